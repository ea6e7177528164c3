"""Cables against closed forms: a hanging chain, a cantilever that sags and swings, a capstan.

A scene needs a meshed body: a soft block far away, which does not limit the step.
"""

import numpy as np
import pytest
from scipy.optimize import brentq, curve_fit

from softsim.compute import fields

FAR = """
bodies:
  far: {mesh: {generator: block, length: 100 mm, height: 100 mm, element_size: 100 mm},
        formulation: plane_strain, thickness: 1 mm, material: soft, position: [1 m, 1 m],
        fixed: [surface]}
materials: {soft: {law: neo_hooke, C10: 10 Pa, density: 1000 kg/m^3}}
"""
G, LINE = 9.81, 2.4e-3  # m/s^2, kg/m
TUBE = f"diameter: 2 mm, mass_per_length: {LINE} kg/m"


def settled(start, model):
    """A solver whose model has come to rest under local damping, and where its nodes are."""
    from softsim.solver.energy import unbalanced_share

    solver = start(model, share=0.6)
    while solver.time < 20.0:
        solver.advance(5000)
        if unbalanced_share(solver.scenario(0)) < 1e-7:
            return solver, solver.scenario(0).positions()[model.structures[0].nodes]
    raise AssertionError("no equilibrium")


def test_a_chain_between_two_walls_hangs_in_a_catenary(build, start, record_verification):
    """Length L over a span: y = a cosh(x / a), 2 a sinh(span / 2a) = L, tension w a below, w (a +
    sag) at the ends.
    """
    length, span = 0.24, 0.2
    height = 0.5 * np.sqrt(length**2 - span**2)
    model = build(
        FAR
        + f"""
cables:
  chain: {{points: [[{-0.5 * span} m, 0 m], [0 m, {-height} m], [{0.5 * span} m, 0 m]],
          segment_length: 5 mm, {TUBE}, stretching_stiffness: 60 N, bending_stiffness: 0 N*mm^2}}
conditions:
  one: {{kind: fixed, nodes: chain.start}}
  other: {{kind: fixed, nodes: chain.end}}
time: {{end: 1 s, procedure: static}}
"""
    )
    solver, x = settled(start, model)
    a = brentq(lambda a: 2.0 * a * np.sinh(0.5 * span / a) - length, 0.01, 1.0)
    sag = a * (np.cosh(0.5 * span / a) - 1.0)
    record_verification("cable, catenary: sag [m]", sag, -x[:, 1].min())
    assert -x[:, 1].min() == pytest.approx(sag, rel=2e-3)
    shape = a * (np.cosh(x[:, 0] / a) - np.cosh(0.5 * span / a))
    assert np.abs(x[:, 1] - shape).max() < 2e-3 * sag
    cable = model.structures[0]
    tensions = cable.spring_stiffness * (cable.tangents(solver.scenario(0).positions())[1]
                                         - cable.lengths)  # fmt: skip
    assert tensions.min() == pytest.approx(LINE * G * a, rel=0.01)
    assert tensions.max() == pytest.approx(LINE * G * (a + sag), rel=0.02)


CANTILEVER = (
    FAR
    + f"""
cables:
  tube: {{points: [[-2 mm, 0 m], [50 mm, 0 m]], segment_length: 2 mm, {TUBE},
         stretching_stiffness: 60 N, bending_stiffness: 20 N*mm^2}}
conditions: {{clamp: {{kind: fixed, nodes: tube.start_segment}}}}
environment: {{gravity: 1 m/s^2}}
time: {{end: 1 s}}
"""
)
FREE, EI = 50e-3, 20e-6  # m beyond the held segment, N m^2


def test_a_cantilever_sags_under_its_weight_and_swings(build, start, record_verification):
    """Let go straight it swings about the sag w L^4 / 8 EI, nearly all of it in the first mode,
    1.8751^2 sqrt(EI / m' L^4); what it stores and moves with is what its weight did.
    """
    from softsim.solver.energy import EnergyReader

    model = build(CANTILEVER)
    solver = start(model)
    reader, track = EnergyReader(solver), []
    first = reader.read().balance
    while solver.time < 0.2:
        solver.advance(20)
        track.append(
            (solver.time, solver.scenario(0).positions()[model.structures[0].nodes[-1], 1])
        )
    energies = reader.read()
    t, y = np.array(track).T
    omega = 1.875104**2 * np.sqrt(EI / (LINE * FREE**4))
    sag = LINE * 1.0 * FREE**4 / (8.0 * EI)

    def swing(t, mean, omega, cosine, sine):
        return mean + cosine * np.cos(omega * t) + sine * np.sin(omega * t)

    (mean, found, *_), _ = curve_fit(swing, t, y, p0=(-sag, omega, sag, 0.0))
    record_verification("cable, cantilever: first mode [rad/s]", omega, found)
    record_verification("cable, cantilever: sag [m]", sag, -mean)
    assert found == pytest.approx(omega, rel=3e-3)
    assert -mean == pytest.approx(sag, rel=1e-2)
    assert abs(energies.balance - first) < 1e-3 * energies.external_work


FRICTION, HELD = 0.3, 0.1  # -, N
LAID = 10e-6  # m off the wall: nodes lie on chords of the polygon that a rope is laid along
# Around a drum and along the inside of a bend: the wall, its radius, the centre, the angles between
# which the rope lies on it, the straight ends; which way its end is pulled, along y.
DRUM = ("{kind: sphere, center: [0 mm, 0 mm], diameter: 58 mm}", 29e-3, (0.0, 0.0), (0.0, 180.0),
        ((30e-3, -30e-3), (-30e-3, -30e-3)), -1.0)  # fmt: skip
BEND = ("{kind: pipe_path, diameter: 36 mm, pipe: [straight: 40 mm, {bend: 90 deg, radius: 60 mm}, "
        "straight: 70 mm]}", 42e-3, (40e-3, 60e-3), (-90.0, 0.0), ((5e-3, 17e-3), (83e-3, 90e-3)),
        1.0)  # fmt: skip
BOX = FAR.replace("generator: block", "generator: box, width: 100 mm").replace(
    "plane_strain, thickness: 1 mm", "solid"
)


def rope(far, wall, radius, centre, angles, ends, way):
    """A scene of a rope that is held at its start and pulled over a wall by its end."""
    turn, on_wall = np.deg2rad(np.linspace(*angles, 91)), radius + 1e-3 + LAID
    arc = np.array(centre) + on_wall * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    # The straight ends are tangent to the arc.
    first, last = np.array(ends)
    first += (arc[0] - first) @ outwards(turn[0]) * outwards(turn[0])
    last += (arc[-1] - last) @ outwards(turn[-1]) * outwards(turn[-1])
    corners = ", ".join(f"[{x} m, {y} m]" for x, y in [first, *arc, last])
    held = HELD * (first - arc[0]) / np.linalg.norm(first - arc[0])
    return (
        far
        + f"""
cables:
  rope: {{points: [{corners}], segment_length: 1.5 mm, {TUBE}, stretching_stiffness: 60 N,
         bending_stiffness: 0.01 N*mm^2}}
conditions:
  pull: {{kind: prescribed, nodes: rope.end, direction: y,
         displacement: {{kind: table, points: [[0 s, 0 mm], [1 s, {way * 20.0} mm]]}}}}
loads: {{hold: {{kind: nodal_force, nodes: rope.start, force: [{held[0]} N, {held[1]} N],
        ramp: 10 ms}}}}
environment: {{gravity: 0 m/s^2, walls: {{bend: {wall}}}}}
contact: {{friction_coefficient: {FRICTION}, friction_memory: 0 s}}
time: {{end: 1 s}}
"""
    )


def outwards(angle):
    """Unit vector of a direction."""
    return np.array([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize(
    ("name", "far", "bend"), [("drum", FAR, DRUM), ("bend of a pipe", BOX, BEND)]
)
def test_a_rope_that_slides_over_a_wall_is_a_capstan(
    name, far, bend, build, start, record_verification
):
    """Pulled over an angle against a force, the tension is exp(mu angle) times that force."""
    solver = start(build(rope(far, *bend)))
    cable = solver.models[0].structures[0]
    pulls = []
    while solver.time < 0.4:
        solver.advance(50)
        if solver.time > 0.2:
            _, lengths = cable.tangents(solver.scenario(0).positions())
            tensions = cable.spring_stiffness * (lengths - cable.lengths)
            pulls.append([tensions[:10].mean(), tensions[-10:].mean()])
    held, pulled = np.mean(pulls, axis=0)
    first, last = np.deg2rad(bend[3])
    expected = np.exp(FRICTION * (last - first))
    record_verification(f"cable, capstan, {name}: ratio of tensions", expected, pulled / held)
    assert pulled / held == pytest.approx(expected, rel=0.02)
    assert held == pytest.approx(HELD, rel=0.01)


TRAILED = (
    BOX
    + f"""
rigid_bodies:
  frame: {{mass: 10 g, inertia: [0.4 kg*mm^2, 0.8 kg*mm^2, 0.8 kg*mm^2], tied: [tail.start_segment],
          initial_velocity: [0.1 m/s, 0.3 m/s, -0.2 m/s], initial_angular_velocity: 40 rad/s}}
cables:
  tail: {{points: [[-16 mm, 0 mm], [-116 mm, 0 mm]], segment_length: 5 mm, {TUBE},
         stretching_stiffness: 60 N, bending_stiffness: 20 N*mm^2}}
environment: {{gravity: 0 m/s^2}}
time: {{end: 1 s}}
"""
)


def test_a_body_that_trails_a_clamped_tube_keeps_momentum_and_energy(build, start):
    """Thrown and turned in free space: the tube whips, and pulls and turns the body."""
    from softsim.solver.energy import EnergyReader

    solver = start(build(TRAILED))
    model, terms = solver.models[0], solver.terms
    reader, bodies = EnergyReader(solver), terms.rigid_bodies
    alone = np.setdiff1d(model.structures[0].nodes, model.rigid_bodies[0].tied)

    def momenta():
        """At half steps; positions are moved back to them."""
        x, v = (fields.read(f)[0, alone] for f in (terms.nodes.position, terms.nodes.velocity))
        v_body, m = fields.read(bodies.velocity)[0, 0], fields.read(bodies.mass)[0]
        centre = fields.read(bodies.centre)[0, 0]
        p = model.mass[alone, None] * v
        spin = fields.read(bodies.angular_momentum)[0, 0] + m * np.cross(centre, v_body)
        return p.sum(axis=0) + m * v_body, np.cross(x, p).sum(axis=0) + spin

    energies = reader.read()
    began, turning, kinetic = *momenta(), energies.kinetic
    most_stored = 0.0
    while solver.time < 0.1:
        solver.advance(200)
        now = reader.read()
        most_stored = max(most_stored, now.internal)
        np.testing.assert_allclose(momenta()[0], began, rtol=1e-9)
        assert abs(now.balance - kinetic) < 1e-3 * kinetic
    assert np.abs(momenta()[1] - turning).max() < 1e-3 * np.linalg.norm(turning)
    assert most_stored > 0.05 * kinetic


DRAG, SLIP = 10e-3, 0.1e-3  # N, m
DRAGGED = (
    FAR
    + f"""
rigid_bodies: {{frame: {{mass: 10 g, inertia: 1 kg*mm^2, tied: [tail.start]}}}}
cables:
  tail: {{points: [[0 mm, 0 mm], [-100 mm, 0 mm]], segment_length: 5 mm, {TUBE},
         stretching_stiffness: 60 N, bending_stiffness: 20 N*mm^2, end_drag: {DRAG} N}}
loads: {{walk: {{kind: rigid_force, acts_on: frame, force: [{0.45 * DRAG} N, 0 N]}}}}
environment: {{gravity: 0 m/s^2}}
time: {{end: 1 s}}
"""
)


def test_what_a_cable_s_end_drags_holds_up_to_its_friction_and_slides_beyond(
    build, start, record_verification
):
    """A force below the drag F swings body and cable about their rest, at most twice as far off; of
    the work of a force 2 F over the way w, sliding takes F (w - F / k), and the rest moves them but
    for what the spring k holds.
    """
    from softsim.solver.energy import EnergyReader

    solver = start(build(DRAGGED), build(DRAGGED, f"loads.walk.force=[{2.0 * DRAG} N, 0 N]"))
    reader = EnergyReader(solver)
    while solver.time < 0.2:
        solver.advance(100)
    held, pulled = (solver.scenario(s) for s in (0, 1))
    tail = solver.models[0].structures[0].nodes
    ways = [s.positions()[tail[-1], 0] - s.model.points[tail[-1], 0] for s in (held, pulled)]
    assert abs(ways[0]) < 2.0 * 0.45 * SLIP
    reader.update()
    energies = reader.of_scenario(0)
    assert energies.friction_dissipation < 1e-12 * energies.external_work
    energies = reader.of_scenario(1)
    slid, moving = DRAG * (ways[1] - SLIP), DRAG * (ways[1] + 0.5 * SLIP)
    record_verification("cable, dragged end: dissipated [J]", slid, energies.friction_dissipation)
    record_verification("cable, dragged end: moving [J]", moving, energies.kinetic)
    assert energies.friction_dissipation == pytest.approx(slid, rel=1e-3)
    assert energies.kinetic == pytest.approx(moving, rel=1e-2)
    assert abs(energies.balance) < 1e-3 * energies.external_work


@pytest.mark.parametrize("stiffness", ["20 N*mm^2", "2000 N*mm^2"])
def test_the_stable_step_is_that_of_the_stiffest_mode(stiffness, build, restart):
    """Of stretching, dt = l sqrt(m' / EA), or of bending, l^2 sqrt(m' / EI) / 2: each rules the
    one's cable, and adds its square to the other's bound.
    """
    from softsim.solver.stable_step import stable_step

    model = build(CANTILEVER, f"cables.tube.bending_stiffness={stiffness}")
    length, ei = 2e-3, float(stiffness.partition(" ")[0]) * 1e-6
    frequencies = np.array([4.0 * 60.0 / length**2, 16.0 * ei / length**4]) / LINE
    stable = stable_step(model, model.points)
    assert stable.limit == "cable 'tube'"
    largest = (2.0 / stable.stable) ** 2
    assert frequencies.max() < largest < 1.25 * frequencies.sum()
