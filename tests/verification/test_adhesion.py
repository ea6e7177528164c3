"""Adhesion to walls: pull-off of a ball and of a cylinder, peeling, hanging, lost energy.

Johnson, Kendall and Roberts (1971, Proc. R. Soc. A 324:301): a ball of radius R leaves a soft half
space at the force (3/2) pi w R, whatever its modulus; Bradley, and Derjaguin, Muller and Toporov
(1975): a rigid body at 2 pi w R. Between them Maugis (1992) has a parameter lambda; of his solution
Carpick, Ogletree and Salmeron (1999, J. Colloid Interface Sci. 211:395, eq. 12) give

    P / (pi w R) = -7/4 + (1/4) (4.04 lambda^1.4 - 1) / (4.04 lambda^1.4 + 1),
    lambda = 2 s (R / (pi w K^2))^(1/3),  K = (4/3) E*,  s: pull-off stress.

A cylinder leaves at (3/4) (4 pi E* w^2 R)^(1/3) per length (Barquins 1988, J. Adhesion 26:1).

A cohesive zone, of the length E* w / s^2, has to be resolved: of 230 um at 20 kPa, 100 um at 30 kPa
and 36 um at 50 kPa. The law softens linearly, that of Maugis is constant. Expected errors of a ball
with a contact radius a of 1 mm at pull-off: a fraction of a/R = 10 % for finite strain and because
the ball is no paraboloid; less than a tenth of (a/H)^2 = 2 % for the depth H = 8 mm.
"""

import io

import meshes
import numpy as np
import pytest
from rich.console import Console

from softsim.compute import fields
from softsim.contact.adhesion import Adhesion, CohesiveLaw
from softsim.output.history import read_history

RADIUS, ENERGY = 10e-3, 0.5
SHEAR, NU = 50e3, 0.45
REDUCED = 2.0 * SHEAR / (1.0 - NU)  # E* [Pa]
FINE, EXTENT, GROWTH = 1.5e-3, 8e-3, 1.25

PULLED = """
bodies:
  block: {{mesh: {{file: block.inp, length_unit: 1 m}}, formulation: {formulation}, material: gel,
           fixed: [bottom], sets: {{near: {{box: [[-1 um, -1 um], [1.501 mm, 1 um]]}}}}}}
materials:
  gel: {{law: neo_hooke, C10: 25 kPa, poisson_ratio: 0.45, density: 1000 kg/m^3}}
environment:
  gravity: 0 m/s^2
  walls: {{ball: {{kind: sphere, center: [0 mm, 10 mm], diameter: 20 mm}}}}
contact:
  friction_coefficient: 0
  adhesion:
    gel: {{work_of_adhesion: 0.5 J/m^2, pull_off_stress: {stress} kPa, surfaces: [block.near]}}
conditions:
  pull: {{kind: wall_motion, wall: ball, direction: y,
         displacement: {{kind: ramp, value: {way} mm, duration: {end} ms}}}}
{more}
time: {{end: {end} ms, settle: 0.5 s}}
output: {{history_interval: 0.2 ms, frame_interval: 1 s}}
"""
HALF = "  half: {kind: symmetry, nodes: block.left, normal: x}"


@pytest.fixture
def history(kernel_cache, monkeypatch, write_scene, tmp_path):
    """Run a scene and return its history."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    def ran(text, *overrides):
        out = tmp_path / "out"
        run(write_scene(text), overrides, out, "cpu", console=Console(file=io.StringIO()))
        return read_history(out / "history.csv")

    return ran


def write_half_space(path, size, formulation):
    """Write quadrilaterals of `size` [m] up to FINE from the axis, larger ones beyond."""

    def stations(fine):
        cells = [size] * round(fine / size)
        while sum(cells) < EXTENT:
            cells.append(GROWTH * cells[-1])
        return np.concatenate([[0.0], np.cumsum(cells)])

    across, deep = stations(FINE), stations(3.0 * size)
    columns, rows = len(across) - 1, len(deep) - 1

    def place(s, t):
        x, y = (np.round(u * n).astype(int) for u, n in ((s, columns), (t, rows)))
        return across[x], -deep[rows - y]

    meshes.joined(meshes.grid(columns, rows, place)).write(path, formulation)


def pull_off(history, record_verification, tmp_path, size, stress, formulation, way, more=""):
    """Return the largest force [N] that pulls the ball, until it has left."""
    write_half_space(tmp_path / "block.inp", size, formulation.partition(",")[0])
    scene = PULLED.format(
        formulation=formulation, stress=stress, way=way, end=500.0 * way, more=more
    )
    found = history(scene)
    worst = found["energy_error"].max()
    record_verification(f"energy error of a pull-off, {1e6 * size:g} um", 0.0, worst)
    assert found["contact_count"][0] > 10 and found["contact_count"][-1] == 0
    assert worst < 1e-3
    return found["wall_force_y"].max()


@pytest.mark.parametrize(
    ("size", "stress", "of_maugis"),
    [
        (50e-6, 20.0, 0.05),
        pytest.param(25e-6, 30.0, 0.03, marks=pytest.mark.slow),
        pytest.param(12.5e-6, 50.0, 0.03, marks=pytest.mark.slow),
    ],
)
def test_a_ball_leaves_a_soft_half_space(
    history, tmp_path, record_verification, size, stress, of_maugis
):
    """Within 3 % of the solution of Maugis on two meshes, 5 % on the coarsest."""
    force = pull_off(history, record_verification, tmp_path, size, stress, "axisymmetric", 0.08)
    K = 4.0 / 3.0 * REDUCED
    maugis_parameter = 2.0 * 1e3 * stress * np.cbrt(RADIUS / (np.pi * ENERGY * K**2))
    share = 4.04 * maugis_parameter**1.4
    exact = np.pi * ENERGY * RADIUS * (1.75 - 0.25 * (share - 1.0) / (share + 1.0))
    record_verification(f"pull-off of a ball, {1e6 * size:g} um, Maugis [N]", exact, force)
    assert force == pytest.approx(exact, rel=of_maugis)
    jkr = 1.5 * np.pi * ENERGY * RADIUS
    record_verification(f"pull-off of a ball, {1e6 * size:g} um, JKR [N]", jkr, force)


@pytest.mark.parametrize(
    ("size", "stress"), [(50e-6, 20.0), pytest.param(25e-6, 30.0, marks=pytest.mark.slow)]
)
def test_a_cylinder_leaves_a_soft_half_space(history, tmp_path, record_verification, size, stress):
    """The model is half of it, 1 m long. Within 3 % on each mesh."""
    section = "plane_strain, thickness: 1 m"
    force = pull_off(history, record_verification, tmp_path, size, stress, section, 0.15, HALF)
    exact = 0.75 * np.cbrt(4.0 * np.pi * REDUCED * ENERGY**2 * RADIUS)
    record_verification(f"pull-off of a cylinder, {1e6 * size:g} um, JKR", exact, 2.0 * force)
    assert 2.0 * force == pytest.approx(exact, rel=0.03)


RIGID = """
bodies:
  block: {mesh: {generator: block, length: 2 mm, height: 0.2 mm, element_size: 0.02 mm,
                 cells: quad}, position: [1 mm, 0 mm], formulation: axisymmetric, material: gel,
          fixed: [surface], sets: {upper: {box: [[-1 um, 0.199 mm], [3 mm, 0.201 mm]]}}}
materials: {gel: {law: neo_hooke, C10: 1 GPa, density: 1000 kg/m^3}}
environment:
  gravity: 0 m/s^2
  walls: {ball: {kind: sphere, center: [0 mm, 10.2 mm], diameter: 20 mm}}
contact:
  adhesion: {gel: {work_of_adhesion: 0.5 J/m^2, range: 40 um, surfaces: [block.upper]}}
time: {end: 1 us, procedure: static}
"""


def test_a_rigid_plane_attracts_a_ball(history, record_verification):
    """It touches in one point and is attracted with 2 pi w R; the attraction ends at 0.9 mm.

    Nodes 0.02 mm apart; w R (h / R) = 0.4 % for the shape of the ball.
    """
    force = history(RIGID)["wall_force_y"][-1]
    exact = 2.0 * np.pi * ENERGY * RADIUS
    record_verification("pull-off of a rigid ball, DMT [N]", exact, force)
    assert force == pytest.approx(exact, rel=0.01)


PEELED = """
bodies:
  strip:
    mesh: {generator: block, length: 20 mm, height: 0.25 mm, element_size: 0.125 mm, cells: quad}
    position: [10 mm, 0 mm]
    formulation: plane_strain
    thickness: 10 mm
    material: silicone
    fixed: [left]
    sets: {glued: {box: [[-1 mm, -1 um], [18 mm, 1 um]]},
           end: {box: [[19.99 mm, -1 um], [21 mm, 1 mm]]}}
materials:
  silicone: {law: neo_hooke, C10: 170 kPa, poisson_ratio: 0.45, density: 1000 kg/m^3}
environment: {gravity: 0 m/s^2, walls: {floor: {kind: plane}}}
contact:
  friction_coefficient: 0
  adhesion:
    glue: {work_of_adhesion: 1 J/m^2, pull_off_stress: 10 kPa, surfaces: [strip.glued]}
conditions:
  up: {kind: prescribed, nodes: strip.end, direction: y,
       displacement: {kind: ramp, value: 12 mm, duration: 0.4 s}}
time: {end: 0.4 s}
output: {history_interval: 2 ms, frame_interval: 1 s,
         probes: {pull: {kind: reaction, nodes: strip.end}}}
"""


@pytest.mark.slow
def test_a_strip_is_peeled(history, record_verification):
    """At 90 degrees it takes F = w b, once the lifted part hangs straight.

    The bending length sqrt(E I / (w b)) is 1.1 mm; the strip vibrates a little.
    """
    found = history(PEELED)
    force = found["pull_y"][found["time"] > 0.3].mean()
    exact = 1.0 * 10e-3
    record_verification("force that peels a strip [N]", exact, force)
    assert force == pytest.approx(exact, rel=0.02)
    assert found["energy_error"].max() < 5e-3


BLOCK = """
bodies:
  block:
    mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 1 mm, cells: quad}
    formulation: plane_strain
    thickness: 10 mm
    material: gel
    sets: {upper: {box: [[-5 mm, 3.999 mm], [5 mm, 4.001 mm]]},
           lower: {box: [[-5 mm, -1 um], [5 mm, 1 um]]}}
materials: {gel: {law: neo_hooke, C10: 100 kPa, density: 1080 kg/m^3}}
environment:
  walls: {ceiling: {kind: plane, point: [0 mm, 4 mm], normal: [0, -1]}}
contact:
  adhesion: {glue: {work_of_adhesion: 10 mJ/m^2, pull_off_stress: 100 Pa,
                    surfaces: [block.upper]}}
time: {end: 60 ms}
output: {frame_interval: 1 s}
"""


IN_SPACE = BLOCK
for plane, space in (
    ("generator: block", "generator: box"),
    ("height: 4 mm", "height: 4 mm, width: 10 mm"),
    ("plane_strain\n    thickness: 10 mm", "solid"),
    ("[[-5 mm, 3.999 mm], [5 mm, 4.001 mm]]", "[[-5 mm, 3.999 mm, -1 cm], [9 mm, 4.001 mm, 2 cm]]"),
    ("[[-5 mm, -1 um], [5 mm, 1 um]]", "[[-5 mm, -1 um, -1 cm], [9 mm, 1 um, 2 cm]]"),
):
    IN_SPACE = IN_SPACE.replace(plane, space)


@pytest.mark.parametrize("scene", [BLOCK, pytest.param(IN_SPACE, marks=pytest.mark.slow)])
def test_a_block_hangs_from_a_ceiling(history, record_verification, scene):
    """Its weight over its face is 42 Pa: it hangs at 100 Pa and falls freely at 40 Pa."""
    hanging = history(scene)
    weight = 1080.0 * 9.81 * 8e-3 * 4e-3 * 10e-3
    force = hanging["wall_force_y"][-10:].mean()
    record_verification("force that holds a block on a ceiling [N]", weight, force)
    assert force == pytest.approx(weight, rel=3e-3)
    assert hanging["energy_error"].max() < 5e-3
    falling = history(scene, "contact.adhesion.glue.pull_off_stress=40 Pa")
    assert falling["wall_force_y"][-1] == 0.0 and falling["body_y"][-1] < -5e-3
    assert falling["energy_error"].max() < 5e-3


TOUCHED_AND_LEFT = """
conditions:
  move: {kind: wall_motion, wall: ceiling, direction: y,
         displacement: {kind: table, points: [[0 s, 0 mm], [20 ms, -0.3 mm], [40 ms, 0.3 mm]]}}
"""


KINDS = {
    "plane": "{kind: plane, point: [0 mm, 4.3 mm], normal: [0, -1]}",
    "polyline": "{kind: polyline, points: [[20 mm, 4.3 mm], [-20 mm, 4.3 mm]]}",
    "pipe path": "{kind: pipe_path, diameter: 20 mm, start: [-20 mm, -5.7 mm],"
    " pipe: [{straight: 40 mm}]}",
}


@pytest.mark.parametrize(
    ("kind", "stiffness"),
    [("plane", "auto"), ("plane", "20 N/mm"), ("polyline", "auto"), ("pipe path", "auto")],
)
def test_separation_takes_the_work_of_adhesion(history, record_verification, kind, stiffness):
    """A plate approaches a block from 0.3 mm until it just touches, and leaves it again, slowly.

    The face of the block is attracted and repelled as a whole, without a jump: s / h is a
    hundredth of the stiffness of the block. So the work on the plate is -w A where it touches
    without force, whatever the penalty stiffness and the kind of wall, and zero in the end.
    """
    scene = BLOCK.replace("{kind: plane, point: [0 mm, 4 mm], normal: [0, -1]}", KINDS[kind])
    found = history(
        scene + TOUCHED_AND_LEFT, "environment.gravity=0 m/s^2", "bodies.block.fixed=[bottom]",
        f"contact.penalty_stiffness={stiffness}", "contact.friction_coefficient=0",
        "time.procedure=static", "time.end=40 ms", "output.history_interval=0.25 ms",
    )  # fmt: skip
    exact, work = 10e-3 * 8e-3 * 10e-3, found["external_work"]
    record_verification(f"work of adhesion, {kind}, penalty {stiffness} [J]", exact, -work.min())
    assert -work.min() == pytest.approx(exact, rel=0.03)
    assert work[-1] == pytest.approx(0.0, abs=0.03 * exact)
    assert found["wall_force_y"][-1] == 0.0


ON_A_BELT = """
conditions:
  run: {kind: wall_motion, wall: ceiling, direction: x,
        displacement: {kind: ramp, value: 2 mm, duration: 60 ms}}
  held: {kind: fixed, nodes: block.upper, directions: [x]}
"""


def test_adhesion_raises_friction(history, record_verification):
    """A belt below a block exerts mu (m g + s A)."""
    scene = BLOCK.replace("point: [0 mm, 4 mm], normal: [0, -1]", "point: [0 mm, 0 mm]")
    scene = scene.replace("surfaces: [block.upper]", "surfaces: [block.lower]") + ON_A_BELT
    found = history(scene, "contact.friction_coefficient=0.5")
    force = found["wall_force_x"][found["time"] > 40e-3].mean()
    exact = 0.5 * (1080.0 * 9.81 * 8e-3 * 4e-3 * 10e-3 + 100.0 * 8e-3 * 10e-3)
    record_verification("friction on a belt with adhesion [N]", exact, force)
    assert force == pytest.approx(exact, rel=0.02)


def test_the_shear_strength_of_an_adhering_area(history, record_verification):
    """A belt exerts mu m g + tau A on a block that is held at its lower side, so not tilted."""
    scene = BLOCK.replace("point: [0 mm, 4 mm], normal: [0, -1]", "point: [0 mm, 0 mm]")
    scene = scene.replace("surfaces: [block.upper]", "surfaces: [block.lower]")
    scene += ON_A_BELT.replace("block.upper", "block.lower")
    found = history(
        scene, "contact.friction_coefficient=0.5", "contact.adhesion.glue.shear_strength=80 Pa"
    )
    force = found["wall_force_x"][found["time"] > 40e-3].mean()
    exact = 0.5 * 1080.0 * 9.81 * 8e-3 * 4e-3 * 10e-3 + 80.0 * 8e-3 * 10e-3
    record_verification("friction on a belt with a shear strength [N]", exact, force)
    assert force == pytest.approx(exact, rel=0.02)
    assert found["energy_error"][-1] < 1e-3


def test_a_node_with_and_without_a_shear_strength():
    """Coulomb's friction acts on the load without the attraction of the law with a strength."""
    laws = [CohesiveLaw(0.05, 2e3, None, 500.0), CohesiveLaw(0.05, 4e3, None)]
    areas = np.array([[[3e-6]], [[1e-6]]])
    adhesion = Adhesion.of_areas(laws, areas, np.array([1e3]), 1e5)
    assert adhesion.attraction == pytest.approx(2e3 * 3e-6 + 4e3 * 1e-6)
    assert adhesion.shear == pytest.approx(500.0 * 3e-6)
    assert adhesion.sheared == pytest.approx(2e3 * 3e-6)


def test_a_hanging_block_is_held_by_its_shear_strength(history, record_verification):
    """Pulled sideways without Coulomb's friction, with less than its attraction on the ceiling."""
    found = history(
        BLOCK + ON_A_BELT,
        "contact.friction_coefficient=0",
        "contact.adhesion.glue.shear_strength=60 Pa",
    )
    force = found["wall_force_x"][found["time"] > 40e-3].mean()
    exact = 60.0 * 8e-3 * 10e-3
    record_verification("friction of a hanging block, shear strength [N]", exact, force)
    assert force == pytest.approx(exact, rel=0.02)
    assert found["energy_error"][-1] < 1e-3


def test_scenarios_do_not_depend_on_each_other(build, fresh_taichi):
    """A block that hangs and one that falls move alike alone and in a batch, bit by bit."""
    from softsim.solver.explicit import ExplicitSolver

    stresses = [f"contact.adhesion.glue.pull_off_stress={stress} Pa" for stress in (100, 40)]
    models = [build(BLOCK, stress) for stress in stresses]
    batch, *alone = (ExplicitSolver(chosen) for chosen in (models, models[:1], models[1:]))
    for solver in (batch, *alone):
        solver.begin(5e-6)
        solver.advance(2000)
    together = batch.positions()
    assert not np.array_equal(together[0], together[1])
    for solver, positions in zip(alone, together, strict=True):
        np.testing.assert_array_equal(solver.positions()[0], positions)


def test_a_step_without_adhesion_has_none(build, start):
    """The ceiling, 0.1 mm above a block, attracts it in one step and no longer in the next."""
    scene = BLOCK.replace("[0 mm, 4 mm]", "[0 mm, 4.1 mm]")
    first = start(build(scene))
    first.advance(2)
    assert np.any(contact_forces(first) > 0.0)
    state, time = first.state(), first.time
    dt = first.time_increment
    second = start(build(scene, "contact.adhesion={}"))
    second.take_over(state, time)
    second.go_back_half(dt)
    second.start_motion(dt)
    second.advance(2)
    np.testing.assert_array_equal(contact_forces(second), 0.0)
    whole = fields.read(second.terms.nodes.force)[0].sum(axis=0)
    np.testing.assert_allclose(whole, 0.0, atol=1e-12)


def test_a_step_with_the_same_adhesion_continues(build, start):
    """Positions after two steps are those after one, though nodes adhere across a gap between.

    Bulk viscosity, whose forces follow the velocities, makes 1e-11 m.
    """
    scene = BLOCK.replace("[0 mm, 4 mm]", "[0 mm, 4.1 mm]")
    whole = start(build(scene))
    whole.advance(100)
    state, time, dt = whole.state(), whole.time, whole.time_increment
    whole.advance(100)
    expected = whole.positions()
    second = start(build(scene))
    second.take_over(state, time)
    second.go_back_half(dt)
    second.start_motion(dt)
    second.advance(100)
    np.testing.assert_allclose(second.positions(), expected, rtol=0.0, atol=1e-9)


RATE = {"speed": 10e-3, "exponent": 0.6}  # v0 [m/s], n
RATED = """
bodies:
  block:
    mesh: {{generator: block, length: 8 mm, height: 4 mm, element_size: 1 mm, cells: quad}}
    formulation: plane_strain
    thickness: 10 mm
    material: gel
    fixed: [bottom]
    sets: {{upper: {{box: [[-5 mm, 3.999 mm], [5 mm, 4.001 mm]]}}}}
materials: {{gel: {{law: neo_hooke, C10: {C10}, density: 1080 kg/m^3}}}}
environment:
  gravity: 0 m/s^2
  walls: {{ceiling: {{kind: plane, point: [0 mm, 4 mm], normal: [0, -1]}}}}
contact:
  friction_coefficient: 0
  adhesion: {{glue: {{work_of_adhesion: {work} J/m^2, pull_off_stress: {stress} Pa,
                     surfaces: [block.upper], rate: {{speed: 10 mm/s, exponent: 0.6}}}}}}
conditions:
  away: {{kind: wall_motion, wall: ceiling, direction: y,
          displacement: {{kind: table, points: [{points}]}}}}
time: {{end: {end} s, settle: 0.2 s}}
output: {{frame_interval: 1 s, history_interval: {interval} s}}
"""
FACE = 8e-3 * 10e-3
LIGHT = {"C10": "10 MPa", "work": 0.01, "stress": 100.0}  # range 0.2 mm; a rigid block
STRONG = {"C10": "100 kPa", "work": 2.0, "stress": 10e3}  # range 0.4 mm; it is stretched by 2 %


def rated(law, path):
    """Return a scene in which the wall is at the places `path` [(s, mm), ...] at these times."""
    points = ", ".join(f"[{time} s, {place} mm]" for time, place in path)
    return RATED.format(**law, points=points, end=path[-1][0], interval=path[-1][0] / 400)


def growth(speed):
    """Return (v / v0)^n of a speed [m/s]."""
    return (speed / RATE["speed"]) ** RATE["exponent"]


@pytest.mark.parametrize("speed", [0.01, 0.08])
def test_a_faster_separation_takes_more_work(history, record_verification, speed):
    """The wall leaves at a constant speed: work w0 (1 + (v / v0)^n) A, of which w0 A comes back.

    Before, the block has come to rest at the wall.
    """
    end = 5e-3 / speed
    found = history(rated(LIGHT, [(0.0, 0.0), (end, 5.0)]))
    at_rest = LIGHT["work"] * FACE
    work, lost = found["external_work"][-1], found["viscous_dissipation"][-1]
    exact, worst = at_rest * (1.0 + growth(speed)), found["energy_error"].max()
    record_verification(f"work of separation at {speed:g} m/s [J]", exact, work)
    record_verification(f"energy lost at {speed:g} m/s [J]", exact - at_rest, lost)
    record_verification(f"energy error of a separation at {speed:g} m/s", 0.0, worst)
    assert work == pytest.approx(exact, rel=1e-3)
    assert lost == pytest.approx(exact - at_rest, rel=1e-3)
    assert worst < 1e-3
    assert found["wall_force_y"][-1] == 0.0 and found["contact_energy"][-1] == 0.0


def test_an_interrupted_separation_loses_nothing(history, record_verification):
    """The wall goes to 0.3 mm, beyond the range at rest, and returns.

    There it still attracts: with (1/2) s (1 - 0.2 / (0.1 + 0.4)) = 30 Pa.
    """
    path = [(0.0, 0.0), (30e-3, 0.3), (60e-3, 0.0), (70e-3, 0.0)]
    found = history(rated(LIGHT, path))
    apart = found["wall_force_y"][np.argmin(np.abs(found["time"] - 30e-3))]
    assert apart == pytest.approx(30.0 * FACE, rel=0.02)
    lost, extra = found["viscous_dissipation"], LIGHT["work"] * FACE * growth(0.01)
    record_verification(
        "energy lost by an interrupted separation / (w - w0) A", 0.0, lost[-1] / extra
    )
    assert abs(lost[-1]) < 5e-3 * extra
    assert lost.min() > -1e-6 * extra
    assert found["contact_energy"][-1] == pytest.approx(-LIGHT["work"] * FACE, rel=5e-3)
    assert found["energy_error"].max() < 1e-3


def test_the_speed_does_not_depend_on_the_penalty_stiffness(history, record_verification):
    """A block stretched by 2 % is pulled off, with the default penalty stiffness and five times it.

    It contracts while the attraction decreases, so the gap opens by about 1 / (1 - s H / (E h))
    faster than the wall moves: 11 %, which makes 7 % of the energy lost and 3 % of the work.
    """
    work = []
    for stiffness in ("auto", "200 N/mm"):
        found = history(
            rated(STRONG, [(0.0, 0.0), (0.2, 2.0)]), f"contact.penalty_stiffness={stiffness}"
        )
        work.append(found["external_work"][-1])
        assert found["energy_error"].max() < 1e-3
    exact = STRONG["work"] * FACE * 2.0
    record_verification("work of separation of a stretched block [J]", exact, work[0])
    assert work[0] == pytest.approx(exact, rel=0.05)
    assert work[1] == pytest.approx(work[0], rel=0.01)


@pytest.mark.slow
def test_a_strip_is_peeled_at_a_speed(history, record_verification):
    """The force that peels it does not depend on the penalty stiffness; the excess is lost."""
    forces = []
    for stiffness in ("auto", "500 N/mm"):
        found = history(
            PEELED,
            "contact.adhesion.glue.rate={speed: 10 mm/s, exponent: 0.6}",
            "conditions.up.displacement={kind: ramp, value: 8 mm, duration: 0.27 s}",
            f"contact.penalty_stiffness={stiffness}",
            "time.end=0.27 s",
        )
        steady = found["time"] > 0.15
        lost, work = (found[c][steady] for c in ("viscous_dissipation", "external_work"))
        forces.append(found["pull_y"][steady].mean())
        excess = 1.0 - 1.0 * 10e-3 / forces[-1]
        name = f"energy lost over work of peeling, penalty {stiffness}"
        record_verification(name, excess, (lost[-1] - lost[0]) / (work[-1] - work[0]))
        assert lost[-1] - lost[0] == pytest.approx(excess * (work[-1] - work[0]), rel=0.08)
        assert found["energy_error"].max() < 1e-3
    record_verification("force that peels a strip at 30 mm/s, penalty 15 times", *forces)
    assert forces[1] == pytest.approx(forces[0], rel=0.02)
    assert forces[0] > 1.5 * 1.0 * 10e-3


TOUCHED_AND_PULLED = [(0.0, 0.0), (0.1e-3, -10e-6), (10e-3, 1.0)]  # 10 nm in, then 0.1 m/s


@pytest.mark.parametrize("method", ["newton", "relaxation"])
def test_static_procedures_do_not_depend_on_the_rate(history, method):
    """Bit by bit, though the wall moves fast in the time of the loads."""
    scene = rated(LIGHT | {"C10": "1 MPa"}, [(0.0, 0.0), (0.5e-3, -1e-5), (2e-3, 0.15)])
    overrides = ["time.procedure=static", f"time.method={method}", "output.history_interval=0.1 ms"]
    if method == "newton":
        overrides.append("time.settle=null")
    with_rate = history(scene, *overrides)
    without = history(scene, *overrides, "contact.adhesion.glue.rate=null")
    for column in ("external_work", "wall_force_y", "contact_energy"):
        np.testing.assert_array_equal(with_rate[column], without[column])


def test_a_separation_continues_from_a_checkpoint_and_in_a_batch(build, fresh_taichi):
    """Two scenarios with rates of their own give the same bits alone, and restored halfway."""
    from softsim.solver.explicit import ExplicitSolver

    scene = rated(LIGHT, TOUCHED_AND_PULLED)
    models = [build(scene, f"contact.adhesion.glue.rate.speed={v} mm/s") for v in (10, 200)]
    batch, alone = (ExplicitSolver(chosen) for chosen in (models, models[1:]))
    for solver in (batch, alone):
        solver.begin(0.8e-6)
        solver.advance(1500)
    [rate] = batch.terms.node_contacts[0].rates
    extension = fields.read(rate.extension)
    assert (extension.max(axis=(1, 2)) > 0.0).all() and extension[0].max() > extension[1].max()
    state, time, count = batch.state(), batch.time, batch.increment_count
    for solver in (batch, alone):
        solver.advance(500)
    expected = batch.positions()
    np.testing.assert_array_equal(alone.positions()[0], expected[1])
    batch.restore(state, time, count, 0.8e-6)
    batch.advance(500)
    np.testing.assert_array_equal(batch.positions(), expected)


def test_a_static_step_after_a_dynamic_one_uses_the_work_at_rest(build, start):
    """The range of nodes that are being separated returns to that at rest."""
    scene = rated(LIGHT, TOUCHED_AND_PULLED)
    first = start(build(scene))
    first.advance(1500)
    state, time = first.state(), first.time
    [rate] = first.terms.node_contacts[0].rates
    assert fields.read(rate.extension).max() > 0.0
    static = start(build(scene, "time.procedure=static", "time.settle=null"))
    static.take_over(state, time)
    [rate] = static.terms.node_contacts[0].rates
    assert not fields.read(rate.extension).any()


def contact_forces(solver):
    """Return the forces of the wall on the nodes (k, d) [N]."""
    [contact] = solver.terms.contacts
    return fields.read(contact.force)[0]


# -------------------------------------------------------------------------------------------------
# Bodies that adhere to each other.

BODIES = """
bodies:
  lower:
    mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 1 mm, cells: quad}
    formulation: plane_strain
    thickness: 10 mm
    material: gel
    fixed: [bottom]
  upper:
    mesh: {generator: block, length: 6 mm, height: 3 mm, element_size: 0.75 mm, cells: quad}
    position: [0.2 mm, 4.3 mm]
    formulation: plane_strain
    thickness: 10 mm
    material: rubber
materials:
  gel: {law: neo_hooke, C10: 100 kPa, density: 1080 kg/m^3}
  rubber: {law: neo_hooke, C10: 500 kPa, density: 1080 kg/m^3}
environment: {gravity: 0 m/s^2}
contact:
  friction_coefficient: 0
  pairs: [{between: [lower.top, upper.bottom]}]
  adhesion: {glue: {work_of_adhesion: 10 mJ/m^2, pull_off_stress: 100 Pa,
                    between: [lower.top, upper.bottom]}}
time: {end: 40 ms}
output: {frame_interval: 1 s}
"""
HELD_ABOVE = """
conditions:
  straight: {kind: fixed, nodes: upper.top, directions: [x]}
  move: {kind: prescribed, nodes: upper.top, direction: y,
         displacement: {kind: table, points: [[0 s, 0 mm], [20 ms, -0.3 mm], [40 ms, 0 mm]]}}
"""
JOINT = 6e-3 * 10e-3  # m^2


@pytest.mark.parametrize(
    ("law", "size"),
    [
        ("pull_off_stress: 100 Pa", "1 mm"),
        ("pull_off_stress: 100 Pa", "4 mm"),
        ("range: 200 um", "1 mm"),
        ("range: 200 um, shear_strength: 1 kPa", "1 mm"),
    ],
)
def test_separation_of_bodies_takes_the_work_of_adhesion(history, record_verification, law, size):
    """Compare the work on a stiff body that leaves a soft one with w A; nodes are not opposite.

    Where they touch without force the faces are in the wall's place within 1 um of 0.2 mm. Facets
    of 4 mm are larger than half of the face opposite.
    """
    found = history(
        BODIES.replace("pull_off_stress: 100 Pa", law) + HELD_ABOVE,
        f"bodies.lower.mesh.element_size={size}",
        "time.procedure=static",
        "output.history_interval=0.25 ms",
    )
    exact, work = 10e-3 * JOINT, found["external_work"]
    record_verification(f"work of adhesion of bodies, {law}, {size} [J]", exact, -work.min())
    assert -work.min() == pytest.approx(exact, rel=0.03)
    assert work[-1] == pytest.approx(0.0, abs=0.03 * exact)


def test_a_block_hangs_from_another(history, record_verification):
    """Its weight over its face is 32 Pa: it hangs at 100 Pa and falls freely at 30 Pa."""
    hanging_below = BODIES.replace("fixed: [bottom]", "fixed: [top]")
    for old, new in (
        ("position: [0.2 mm, 4.3 mm]", "position: [0.2 mm, -3 mm]"),
        ("gravity: 0", "gravity: 9.81"),
        ("lower.top", "lower.bottom"),
        ("upper.bottom", "upper.top"),
    ):
        hanging_below = hanging_below.replace(old, new)
    probe = (
        "output.probes={hold: {kind: reaction, nodes: lower.top}, "
        "tip: {kind: displacement, nodes: upper.bottom}}"
    )
    end = "time.end=60 ms"
    risen = "environment.gravity_profile={kind: smooth_step, value: 1, duration: 30 ms}"
    hanging = history(hanging_below, probe, risen, end)
    weight = 1080.0 * 9.81 * 10e-3 * (8e-3 * 4e-3 + 6e-3 * 3e-3)
    force = hanging["hold_y"][hanging["time"] > 40e-3].mean()
    record_verification("force that holds two blocks [N]", weight, force)
    assert force == pytest.approx(weight, rel=3e-3)
    assert hanging["energy_error"].max() < 5e-3
    weaker = "contact.adhesion.glue={work_of_adhesion: 4 mJ/m^2, pull_off_stress: 30 Pa}"
    between = "contact.adhesion.glue.between=[lower.bottom, upper.top]"
    falling = history(hanging_below, probe, risen, end, weaker, between)
    assert falling["tip_y"][-1] < -1e-3
    assert falling["energy_error"].max() < 5e-3


def test_scenarios_of_bodies_do_not_depend_on_each_other(build, fresh_taichi):
    """Bodies that attract each other move alike alone, in a batch, and after a checkpoint."""
    from softsim.solver.explicit import ExplicitSolver

    near = BODIES.replace("4.3 mm]", "4.1 mm]")
    models = [build(near, f"contact.adhesion.glue.pull_off_stress={s} Pa") for s in (100, 80)]
    batch, *alone = (ExplicitSolver(chosen) for chosen in (models, models[:1], models[1:]))
    for solver in (batch, *alone):
        solver.begin(1e-6)
        solver.advance(1000)
    [contact] = alone[0].terms.self_contacts
    assert fields.read(contact.adhesion[0].attraction).max() > 0.0
    state, time, count = batch.state(), batch.time, batch.increment_count
    for solver in (batch, *alone):
        solver.advance(1000)
    together = batch.positions()
    assert not np.array_equal(together[0], together[1])
    for solver, positions in zip(alone, together, strict=True):
        np.testing.assert_array_equal(solver.positions()[0], positions)
    batch.restore(state, time, count, 1e-6)
    batch.advance(1000)
    np.testing.assert_array_equal(batch.positions(), together)
