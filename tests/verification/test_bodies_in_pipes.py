"""Bodies in a pipe along a path: nothing is felt at smooth joints, and what fits passes.

A particle (a rigid ball of a tenth of a nanometre, so that all its points touch at one place)
slides along the outer wall of straight, bend, straight. In the bend the wall has the radius
R = 60 mm + 18 mm, so it presses with m v^2 / R. The contact spring, stiffness k, meets this load
as a sudden one: at most twice the force, with omega = sqrt(k / m).
"""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize

from softsim.compute import fields

FAR = {
    2: "{generator: block, length: 10 mm, height: 10 mm, element_size: 10 mm}, "
    "formulation: plane_strain, thickness: 10 mm",
    3: "{generator: box, length: 10 mm, height: 10 mm, width: 10 mm, element_size: 10 mm}, "
    "formulation: solid",
}
SCENE = """
bodies:
  far: {mesh: MESH, material: rubber, position: [-1 m, 0 m], fixed: [surface]}
materials:
  rubber: {law: neo_hooke, C10: 1 kPa, density: 1000 kg/m^3}
environment:
  gravity: 0 m/s^2
  walls:
    pipe:
      kind: pipe_path
      diameter: 36 mm
      pipe:
        - {straight: 60 mm}
        - {bend: 90 deg, radius: 60 mm TURNED}
        - {straight: 60 mm}
contact: {friction_coefficient: 0, damping_ratio: 0, penalty_stiffness: 1 kN/m}
time: {end: 1 s}
"""
TURN = np.radians(50.0)
MASS, SPEED, OUTER, STIFFNESS = 1e-3, 0.5, 78e-3, 1e3


def particle(dimension, place, velocity):
    """A scene text with a particle of a gramme at `place` [m], `velocity` [m/s]."""
    text = SCENE.replace("MESH", FAR[dimension])
    text = text.replace(
        "TURNED", "" if dimension == 2 else f", turned: {np.degrees(TURN):.15g} deg"
    )
    place, velocity = (
        "[" + ", ".join(f"{c:.15g} {unit}" for c in vector) + "]"
        for vector, unit in ((place, "m"), (velocity, "m/s"))
    )
    return text + (
        "rigid_bodies:\n  particle: {mass: 1 g, inertia: 1 g*mm^2, outline: {radius: 1e-7 mm}, "
        f"center: {place}, initial_velocity: {velocity}}}\n"
    )


def outwards(dimension):
    """Away from the centre of the bend, where the path starts."""
    return np.array([0.0, -1.0] if dimension == 2 else [0.0, -np.cos(TURN), -np.sin(TURN)])


def sliding(dimension):
    """The particle on the outer wall, on its way to the bend."""
    forward = np.eye(dimension)[0]
    return particle(
        dimension, 0.055 * forward + (18e-3 - 1e-10) * outwards(dimension), SPEED * forward
    )


def state(solver):
    """Centre (d,) and velocity (d,) of the rigid body."""
    bodies = solver.terms.rigid_bodies
    return fields.read(bodies.centre)[0, 0], fields.read(bodies.velocity)[0, 0]


def points_of_particle(model):
    """How many contact springs hold it side by side."""
    return len(model.rigid_bodies[0].tied)


def path_of(model):
    """The one pipe that is the wall."""
    (pipe,) = model.walls[0].branches
    return pipe.path


def slide_through(solver, sample):
    """Arc lengths [m] and forces [N] at every `sample` [s], and the last velocity (d,), of the
    particle until it has left the bend by 5 mm, or is too slow.
    """
    path, contact = path_of(solver.models[0]), solver.terms.wall_contacts[0]
    forces, lengths = [], [0.0]
    while lengths[-1] < path.segments[2].start + 5e-3 and solver.time < 1.0:
        solver.advance(round(sample / solver.time_increment))
        centre, velocity = state(solver)
        lengths.append(path.arc_length(centre[None])[0])
        forces.append(fields.read(contact.normal_force).sum())
    return np.array(lengths[1:]), np.array(forces), velocity


@pytest.mark.parametrize("dimension", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_nothing_is_felt_at_a_joint(build, start, record_verification, dimension):
    """Without friction the speed is kept to what the contact spring holds of the energy,
    N^2 / 2 k, some 1e-6 of it; the force rises from zero and never jumps: in a time t it changes by
    no more than omega t of m v^2 / R; in the bend its mean over 20 periods is m v^2 / R, to less
    than a 20th of a period.
    """
    from softsim.solver.energy import EnergyBalance, EnergyReader

    model = build(sliding(dimension))
    solver = start(model, share=0.5)
    reader = EnergyReader(solver)
    balance = EnergyBalance.starting(reader.read(), model)
    sample = 2.0 * solver.time_increment
    lengths, forces, velocity = slide_through(solver, sample)
    bend = path_of(model).segments[1]
    first, last = bend.start, bend.end
    exact = MASS * SPEED**2 / OUTER
    omega = np.sqrt(points_of_particle(model) * STIFFNESS / MASS)
    assert forces[lengths < first].max() < 1e-9 * exact
    assert forces.max() < 2.01 * exact
    assert np.abs(np.diff(forces)).max() < 1.1 * sample * omega * exact
    mean = forces[(lengths > first) & (lengths < last)].mean()
    assert mean == pytest.approx(exact, rel=0.05)
    assert np.linalg.norm(velocity) == pytest.approx(SPEED, rel=1e-5)
    assert balance.error(reader.read()) < 1e-6
    record_verification(f"particle in a bend, {dimension}D: m v^2 / R [N]", exact, mean)


def test_friction_in_a_bend(build, start, record_verification):
    """m dv/dt = -mu m v^2 / R makes v = v0 exp(-mu angle), whatever the radius (as of a rope around
    a bollard). Its springs are damped: the first touch is over within a hundredth of the bend.
    """
    friction = 0.3
    model = build(
        sliding(2), f"contact.friction_coefficient={friction}", "contact.damping_ratio=0.3"
    )
    solver = start(model, share=0.5)
    _, _, velocity = slide_through(solver, 1e-3)
    exact = np.exp(-friction * np.pi / 2.0)
    found = np.linalg.norm(velocity) / SPEED
    assert found == pytest.approx(exact, rel=0.005)
    record_verification("particle in a bend with friction: v / v0", exact, found)


def test_a_stick_survives_the_joint(build, start, record_verification):
    """Pressed on the wall half a micrometre before the joint and pushed along it with less than the
    friction: it is held, across the joint, by the same slip anchor, F / k_t from where it stood.
    """
    place = np.array([60e-3 - 0.5e-6, -18e-3 + 1e-10])
    text = particle(2, place, np.zeros(2)) + (
        "loads:\n"
        "  press: {kind: rigid_force, acts_on: particle, force: [0 N, -1 N], ramp: 20 ms}\n"
        "  push: {kind: rigid_force, acts_on: particle, force: [0.4 N, 0 N], ramp: 100 ms}\n"
    )
    model = build(text, "contact.friction_coefficient=0.5", "contact.penalty_stiffness=10 kN/m")
    solver = start(model, share=0.5)
    walls = solver.terms.wall_contacts[0]
    while solver.time < 0.02:
        solver.advance(100)
    # Of each point that has touched by then, friction's first force took its share of the way that
    # the point came in that increment before it touched.
    landed = fields.read(walls.friction_dissipation).sum()
    while solver.time < 0.2:
        solver.advance(100)
    centre, _ = state(solver)
    exact = 0.4 / (points_of_particle(model) * 10e3)
    assert centre[0] > 60e-3
    moved = centre[0] - place[0]
    assert moved == pytest.approx(exact, rel=0.02)
    assert fields.read(walls.friction_dissipation).sum() == landed
    record_verification("particle held across a joint: F / k_t [m]", exact, moved)


# A frame in a bend --------------------------------------------------------------------------------

BEND, BORE, HEIGHT = 40e-3, 30e-3, 15e-3
INNER, WIDEST = BEND - 0.5 * BORE, BEND + 0.5 * BORE
LONGEST = 2.0 * np.sqrt(WIDEST**2 - (INNER + HEIGHT) ** 2)


def bend_path(dimension):
    from softsim.contact.pipe_layout import Bend, path_of_items

    turn = [Bend(np.pi, BEND, 0.0)]
    return path_of_items("pipe", turn, BORE, np.zeros(dimension), (False, False))


def outline_gap(path, points, lateral, tilt):
    """Least gap of points (k, d) of a body in the middle of a bend of half a turn, moved by
    `lateral` [m] away from its centre and tilted by `tilt` [rad] in its plane.
    """
    c, s = np.cos(tilt), np.sin(tilt)
    turned = points.copy()
    turned[:, 0] = c * points[:, 0] - s * points[:, 1]
    turned[:, 1] = s * points[:, 0] + c * points[:, 1]
    # In the middle the path runs along +y, and the centre of the bend lies at -x from it.
    places = points * 0.0
    places[:, 0], places[:, 1] = BEND + lateral - turned[:, 1], BEND + turned[:, 0]
    places[:, 2:] = turned[:, 2:]
    return path.gap(places).min()


def longest_that_fits(dimension, shape):
    """The length [m] at which the best pose touches, by bisection. shape(length): points."""
    path = bend_path(dimension)

    def clearance(length):
        points = shape(length)
        best = minimize(
            lambda pose: -outline_gap(path, points, *pose), [-4e-3, 0.05], method="Nelder-Mead",
            options={"xatol": 1e-11, "fatol": 1e-12, "maxiter": 2000},
        )  # fmt: skip
        return -best.fun

    return brentq(clearance, 0.9 * LONGEST, 1.1 * LONGEST, xtol=1e-10)


def test_longest_rectangle_in_a_bend(record_verification):
    """Over all poses in the middle of the bend: the inner side touches the inner wall, the outer
    corners the outer one, (R - D/2 + W)^2 + (L/2)^2 = (R + D/2)^2.
    """
    side = np.linspace(-0.5, 0.5, 41)  # with its middle, where it touches the inner wall

    def rectangle(length):
        sides = [[length * a, sign * 0.5 * HEIGHT] for a in side for sign in (-1.0, 1.0)]
        return np.array(sides)

    found = longest_that_fits(2, rectangle)
    assert found == pytest.approx(LONGEST, rel=1e-6)
    record_verification("longest rectangle in a bend [m]", LONGEST, found)


def test_longest_cylinder_in_a_torus(record_verification):
    """The same: of a rim, a place turned by phi out of the plane of the bend is at the distance
    sqrt((q - R)^2 + (a sin phi)^2) from the centre line, q^2 = (R - r + a + a cos phi)^2 + (L/2)^2,
    which is largest at phi = 0 (its slope there is (r - a) (R - r) a / (R + r) > 0 in cos phi).
    """
    side, around = np.linspace(-0.5, 0.5, 3), np.linspace(0.0, 2.0 * np.pi, 49)
    circle = 0.5 * HEIGHT * np.stack([np.cos(around), np.sin(around)], axis=1)

    def cylinder(length):
        return np.array([[length * a, *c] for a in side for c in circle])

    found = longest_that_fits(3, cylinder)
    assert found == pytest.approx(LONGEST, rel=1e-6)
    record_verification("longest cylinder in a torus [m]", LONGEST, found)


@pytest.mark.parametrize(("share", "passes"), [(0.97, True), (1.03, False)])
def test_a_frame_is_pushed_through_a_bend(build, start, share, passes):
    """Without friction, by 5 mN: a frame 3 % shorter than the longest that fits passes, one 3 %
    longer is stuck in the bend: its corners lack 0.8 mm there, the work of the force over the way
    presses them in by sqrt(2 E / k), a tenth of a millimetre.
    """
    length = share * LONGEST
    text = SCENE.replace("MESH", FAR[2]).replace("TURNED", "")
    changes = {
        "36 mm": "30 mm",
        "radius: 60 mm": "radius: 40 mm",
        "60 mm}": "100 mm}",
        "penalty_stiffness: 1 kN/m": "penalty_stiffness: 100 kN/m",
        "damping_ratio: 0,": "damping_ratio: 0.1,",
    }
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    inertia = 10.0 * (length**2 + HEIGHT**2) * 1e6 / 12.0
    text += (
        "rigid_bodies:\n"
        f"  frame: {{mass: 10 g, inertia: {inertia:.9g} g*mm^2, center: [50 mm, 0 mm],\n"
        f"          outline: {{length: {length:.9g} m, height: 15 mm}}}}\n"
        "loads: {push: {kind: rigid_force, acts_on: frame, force: [5 mN, 5 mN]}}\n"
    )
    model = build(text)
    solver = start(model)
    path = path_of(model)
    bend = path.segments[1]
    progress = 0.0
    while solver.time < 2.0 and progress < bend.end:
        solver.advance(500)
        progress = path.arc_length(state(solver)[0][None])[0]
    if passes:
        assert progress >= bend.end
        return
    assert bend.start - 0.5 * length < progress < bend.end
    assert np.linalg.norm(state(solver)[1]) < 1e-3
