"""Round pipes and planes in space: gap and normal, a box that wedges in a pipe, a rigid cylinder.

A box of width w lies in a pipe of radius R on its two lower edges, where the normals are tilted by
beta, sin beta = (w/2)/R. Weight W cos(a) across the pipe then takes normal forces of
W cos(a) / cos(beta) in all, so along the pipe friction holds as if it were mu / cos(beta). Here
R = 5 mm, w = 6 mm: cos beta = 0.8, mu = 0.4 holds like 0.5.

Contacts are damped here. Under the default dashpots a load of 0.97 of the limit that comes within
60 ms lets the box flutter on its contact springs, at 1 kHz and by parts of a micrometre (friction
couples its bounce with pitch and roll, whatever the time step), and so creep down on average.
"""

import numpy as np
import pytest
from present_row import wall_contact

from softsim.compute import fields

WEDGE, FRICTION = 0.8, 0.4

BOX = """
bodies:
  box: {mesh: {generator: box, length: 12 mm, height: 3 mm, width: 6 mm, element_size: 3 mm},
        formulation: solid, material: rubber, position: [0 mm, -3.999999 mm, -3 mm]}
materials:
  rubber: {law: neo_hooke, C10: 100 kPa, density: 1000 kg/m^3,
           prony: [{g: 0.5, relaxation_time: 1 ms}]}
environment: {walls: {pipe: {kind: pipe, diameter: 10 mm}}}
contact: {friction_coefficient: 0.4, damping_ratio: 0.3}
time: {end: 1 s}
"""
WEIGHT = 1000.0 * 12e-3 * 3e-3 * 6e-3 * 9.81


def centre(solver):
    """Centre of mass of all nodes (scenarios, 3) [m]."""
    mass = solver.models[0].mass
    return mass @ solver.positions() / mass.sum()


def settle(solver, until, count=500):
    while solver.time < until:
        solver.advance(count)


# Gap and normal -----------------------------------------------------------------------------------


def kernel_gaps(obstacle, places):
    """Gaps (walls, n) and normals (walls, n, 3) that contact computes."""
    import taichi as ti

    from softsim.compute.fields import real_field, vector_field

    x = vector_field(places)
    gaps = real_field(np.zeros((obstacle.count, len(places))))
    normals = vector_field(np.zeros((obstacle.count, len(places), 3)))

    @ti.kernel
    def look():
        for w, i in gaps:
            gap, n = obstacle.gap_and_normal(0, i, w, x[i])
            gaps[w, i] = gap
            normals[w, i] = n

    look()
    return fields.read(gaps), fields.read(normals)


def test_gap_and_normal(build, fresh_taichi):
    """Of two pipes and a plane at scattered places, on both sides of the walls: as geometry has it,
    in numpy and in kernels, to round-off: 2e-16 of 50 mm, and for the normals of 50 mm over the
    distance from an axis.
    """
    from softsim.solver.terms import Terms

    walls = (
        "environment: {walls: {narrow: {kind: pipe, diameter: 12 mm, axis_height: 1 mm}, "
        "wide: {kind: pipe, diameter: 50 mm, axis_height: -4 mm}, "
        "slope: {kind: plane, point: [0 mm, -9 mm, 2 mm], normal: [1, 2, -2]}}}"
    )
    text = BOX.replace("environment: {walls: {pipe: {kind: pipe, diameter: 10 mm}}}", walls)
    model = build(text.replace("-3.999999 mm", "-1 mm"))
    places = np.random.default_rng(7).uniform(-30e-3, 30e-3, (200, 3))
    x, y, z = places.T
    radii = {"narrow": np.hypot(y - 1e-3, z), "wide": np.hypot(y + 4e-3, z)}
    exact = {
        "slope": (x + 2.0 * (y + 9e-3) - 2.0 * (z - 2e-3)) / 3.0,
        "narrow": 6e-3 - radii["narrow"],
        "wide": 25e-3 - radii["wide"],
    }
    inwards = {
        "slope": np.broadcast_to([1 / 3, 2 / 3, -2 / 3], (200, 3)),
        "narrow": np.column_stack([0 * x, 1e-3 - y, -z]) / radii["narrow"][:, None],
        "wide": np.column_stack([0 * x, -4e-3 - y, -z]) / radii["wide"][:, None],
    }
    gaps_by_name = {n: gap for wall in model.walls for n, gap in wall.gaps(places).items()}
    assert gaps_by_name.keys() == exact.keys()
    for name, gaps in gaps_by_name.items():
        assert (gaps < 0.0).any() and (gaps > 0.0).any()
        np.testing.assert_allclose(gaps, exact[name], rtol=0.0, atol=1e-16)
    planes, pipes = (c.obstacle for c in Terms([model]).wall_contacts)
    for obstacle, names in ((planes, ["slope"]), (pipes, ["narrow", "wide"])):
        gaps, normals = kernel_gaps(obstacle, places)
        np.testing.assert_allclose(gaps, [exact[name] for name in names], rtol=0.0, atol=1e-16)
        expected = [inwards[name] for name in names]
        np.testing.assert_allclose(normals, expected, rtol=0.0, atol=1e-14)


# A box in a pipe ----------------------------------------------------------------------------------


def test_dropped_box_rests_on_two_edges(build, start, record_verification):
    """From 1 mm above, without friction: it comes to rest on its lower edges, and these carry
    W / cos beta together, W upwards.

    Penetration and sag are below 1 um, which changes beta by 1 um / 3 mm.
    """

    model = build(BOX, "contact.friction_coefficient=0", "bodies.box.position=[0 mm, -3 mm, -3 mm]")
    solver = start(model)
    settle(solver, 0.3)
    before, began = centre(solver)[0], solver.time
    solver.clear_impulses(0)
    settle(solver, 0.4)
    scenario = solver.scenario(0)
    grip, after = wall_contact(scenario), scenario.centre_of_mass()
    normal = grip.normal_impulse / (solver.time - began)
    force = grip.impulse / (solver.time - began)
    assert np.abs(after - before).max() < 1e-7
    assert -1e-6 < after[1] - (-4e-3 + 1.5e-3) < 0.0
    contact = solver.terms.wall_contacts[0]
    touching = model.points[model.contact.nodes[fields.read(contact.touching)[0, :, 0] == 1]]
    assert len(touching) == 10  # five nodes an edge
    np.testing.assert_allclose(touching[:, 1], -3e-3)
    np.testing.assert_allclose(np.abs(touching[:, 2]), 3e-3)
    assert normal == pytest.approx(WEIGHT / WEDGE, rel=1e-3)
    np.testing.assert_allclose(force, [0.0, WEIGHT, 0.0], atol=1e-3 * WEIGHT)
    record_verification("box in a pipe: normal force over weight", 1.0 / WEDGE, normal / WEIGHT)


def test_box_wedges_in_a_pipe(build, start, record_verification):
    """Side by side: at 26 deg it holds, though tan = 0.488 is above mu = 0.4; at 35 deg it slides
    down with g (sin - mu cos / cos beta); in a level pipe, pulled gently along it, it holds 0.97
    of W mu / cos beta and goes at 1.03.

    What the edges still hold against each other across the pipe, from the time they stuck, dies out
    as they slip: what it leaves of the limit must be below a third of the bracket.
    """
    limit = FRICTION / WEDGE
    pulls = {"hold": 0.97 * limit, "go": 1.03 * limit}
    slopes = {"stick": 26.0, "slide": 35.0}

    def inclined(angle, pull):
        force = f"[{pull * WEIGHT:.12g} N, 0 N]"
        load = f"{{kind: nodal_force, nodes: box.surface, force: {force}, ramp: 60 ms}}"
        return build(BOX, f"environment.inclination={angle} deg", f"loads.pull={load}")

    models = [inclined(angle, 0.0) for angle in slopes.values()]
    models += [inclined(0.0, pull) for pull in pulls.values()]
    solver = start(*models)
    settle(solver, 0.15)
    times, places = [], []
    while solver.time < 0.25:
        times.append(solver.time)
        places.append(centre(solver)[:, 0])
        solver.advance(200)
    way = places[-1] - places[0]
    acceleration = 2.0 * np.polyfit(np.array(times) - times[0], places, 2)[0]

    assert abs(way[0]) < 1e-7
    angle = np.deg2rad(slopes["slide"])
    exact = -9.81 * (np.sin(angle) - limit * np.cos(angle))
    assert acceleration[1] == pytest.approx(exact, abs=0.01 * limit * 9.81)
    assert abs(way[2]) < 1e-7
    assert way[3] > 1e-4
    found = pulls["go"] - acceleration[3] / 9.81
    assert found == pytest.approx(limit, rel=0.01)
    record_verification("box slides in a pipe at 35 deg [m/s^2]", exact, acceleration[1])
    record_verification("box in a pipe, mu = 0.4: pull over weight", limit, found)


# A rigid body on a plane --------------------------------------------------------------------------

CYLINDER = """
bodies:
  far: {mesh: {generator: box, length: 10 mm, height: 10 mm, width: 10 mm, element_size: 10 mm},
        formulation: solid, material: dragon_skin_30, position: [1 m, 1 m], fixed: [surface]}
rigid_bodies:
  roller: {mass: 10 g, inertia: [0.13 kg*mm^2, 0.4 kg*mm^2, 0.4 kg*mm^2],
           center: [0 mm, 7 mm, 3 mm], outline: {length: 20 mm, height: 10 mm},
           initial_angular_velocity: 2 rad/s, free: [x, y, z, rotation_y, rotation_z]}
environment: {walls: {floor: {kind: plane}}}
contact: {damping_ratio: 0.3}
time: {end: 1 s}
"""


def test_cylinder_falls_flat(build, start, record_verification):
    """It turns as it falls, lands on an end, rocks, and lies flat with all its weight on the floor.

    It cannot roll: its outline meets walls with 24 points around, and would fall over from one.
    """

    model = build(CYLINDER)
    solver = start(model)
    weight = 10e-3 * 9.81
    bodies, steepest = solver.terms.rigid_bodies, 0.0
    while solver.time < 1.0:
        solver.advance(20)
        steepest = max(steepest, abs(fields.read(bodies.rotation)[0, 0, 1, 0]))
    assert steepest > 0.02
    solver.clear_impulses(0)
    began = solver.time
    solver.advance(200)
    grip = wall_contact(solver.scenario(0))
    normal = grip.normal_impulse / (solver.time - began)
    # The dashpots have stopped it: what still moves is below a millionth.
    assert grip.contact_count == 2
    assert normal == pytest.approx(weight, rel=1e-6)
    np.testing.assert_allclose(grip.impulse / grip.normal_impulse, [0.0, 1.0, 0.0], atol=1e-6)
    # On the contact springs of two corners.
    stiffness = model.contact.penalty.k_n.max()
    sunk = 5e-3 - fields.read(bodies.centre)[0, 0, 1]
    assert sunk == pytest.approx(weight / (2.0 * stiffness), rel=1e-6)
    np.testing.assert_allclose(fields.read(bodies.rotation)[0, 0], np.eye(3), atol=1e-6)
    record_verification("cylinder on a plane: normal force [N]", weight, normal)
