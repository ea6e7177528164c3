"""Sharp corners of a ground against soft blocks: what gets between two nodes is felt.

A corner is held against the block's facets with the potential k g^2 / 2 of its gap g to them; nodes
are held against the ground's edges as ever.
"""

import numpy as np
import pytest
from present_row import readings, wall_contact

from softsim.compute import fields

G, DENSITY = 9.81, 1000.0
SCENE = f"""
bodies:
  block: {{mesh: {{generator: block, length: 20 mm, height: 6 mm, element_size: 2 mm}},
          formulation: plane_strain, thickness: 10 mm, material: rubber}}
materials:
  rubber: {{law: neo_hooke, C10: 100 kPa, density: {DENSITY} kg/m^3,
           prony: [{{g: 0.5, relaxation_time: 1 ms}}]}}
environment: {{walls: {{ground: {{kind: polyline, points: POINTS}}}}}}
contact: {{friction_coefficient: 0}}
time: {{end: 1 s}}
"""
WEIGHT = DENSITY * 20e-3 * 6e-3 * 10e-3 * G
# Two knife edges of 90 degrees under the block's lower side, between its nodes.
TIPS = [(-6.6, 0.0), (4.7, 0.0)]
KNIVES = [(-40, -8), (-14.6, -8), TIPS[0], (-0.95, -5.65), TIPS[1], (12.7, -8), (50, -8)]


def over(points, scene=SCENE):
    """The scene above a ground through points (x, y) [mm]."""
    listed = ", ".join(f"[{x:.17g} mm, {y:.17g} mm]" for x, y in points)
    return scene.replace("POINTS", f"[{listed}]")


def wall_forces(solver, x):
    """Forces of the walls on all nodes (n, d) [N], with these at x, at rest."""
    nodes, model = solver.terms.nodes, solver.models[0]
    nodes.velocity.fill(0.0)
    fields.write(nodes.position, np.ascontiguousarray(x[None]))
    for contact in solver.terms.listing:
        fields.write(contact.lists.stale, 1)
    solver.find_forces(1e-9)
    found = np.zeros_like(x)
    for walls in solver.terms.wall_contacts:
        found[model.contact.nodes] += fields.read(walls.force)[0]
    return found


@pytest.fixture
def pressed(build, start):
    """A block with all its nodes off their places, 0.1 mm down on two knife edges; and one that a
    node is on.
    """
    knives = [*KNIVES[:4], (2.02, 0.0), *KNIVES[5:]]
    model = build(over(knives), "environment.gravity=0 m/s^2")
    solver = start(model)
    noise = np.random.default_rng(5).normal(size=model.points.shape)
    return solver, model.points + [0.0, -0.1e-3] + 2e-5 * noise


def test_the_force_is_the_gradient_of_the_energy(pressed):
    """Of edges against nodes and of corners against facets, by central differences."""
    from softsim.solver.energy import EnergyReader

    solver, x = pressed
    reader = EnergyReader(solver)
    force = wall_forces(solver, x)
    touched = np.flatnonzero(force.any(axis=1))
    assert 3 <= len(touched) <= 6
    corners = solver.terms.corner_contacts[0]
    assert (fields.read(corners.facet)[0] >= 0).sum() == 2
    assert fields.read(solver.terms.wall_contacts[0].normal_force)[0].any()

    def energy(at):
        wall_forces(solver, at)
        return reader.read().contact

    exact, h = np.zeros((len(touched), 2)), 1e-9
    for k, a in enumerate(touched):
        for axis in range(2):
            step = np.zeros_like(x)
            step[a, axis] = h
            exact[k, axis] = -(energy(x + step) - energy(x - step)) / (2.0 * h)
    np.testing.assert_allclose(force[touched], exact, atol=1e-6 * np.abs(force).max())


def test_a_corner_gives_its_facet_force_and_moment(pressed):
    """The facet's nodes together get N n, along a line through the corner; the number of places
    that touch counts it.
    """
    solver, x = pressed
    x[:, 0] += 0.5e-3  # no node is at an edge now
    wall_forces(solver, x)
    surface, corners = solver.terms.wall_contacts
    assert not fields.read(surface.force)[0].any()
    facet, N = fields.read(corners.facet)[0], fields.read(corners.pressing)[0]
    f, of_facet = facet[0], solver.models[0].corners.facets
    tip, (a, b) = np.array(TIPS[0]) * 1e-3, of_facet[f]
    force = wall_forces(solver, x)
    pair = force[[a, b]]
    along = (x[b] - x[a]) / np.linalg.norm(x[b] - x[a])
    inward = np.array([-along[1], along[0]])  # the material is on the left
    np.testing.assert_allclose(pair.sum(axis=0), N[0] * inward, rtol=1e-12, atol=1e-15)
    arms = x[[a, b]] - tip
    moment = (arms[:, 0] * pair[:, 1] - arms[:, 1] * pair[:, 0]).sum()
    assert abs(moment) < 1e-12 * N[0] * np.linalg.norm(x[b] - x[a])
    assert wall_contact(solver.scenario(0)).contact_count == 2


def test_an_edge_below_short_facets_is_outside_though_a_long_one_is_near(build, start):
    """0.9 mm below facets of 1.1 mm, farther than anything gets deep in them, and 1.35 mm from the
    end of a side of 2 mm, less than there. Of that end the side's foot tells nothing: the lower
    facet is closer.
    """
    small = SCENE.replace("length: 20 mm, height: 6 mm", "length: 2.2 mm, height: 2 mm")
    ground = [(-40, -8), (-9.9, -8), (0.1, 0.0), (8.1, -8), (50, -8)]
    model = build(over(ground, small), "environment.gravity=0 m/s^2")
    sizes = model.corners.facet_size
    np.testing.assert_allclose([sizes.min(), sizes.max()], [1.1e-3, 2e-3])
    solver = start(model)
    [corners] = solver.terms.corner_contacts  # as many as the wall has, not as the block has nodes
    assert fields.shape_of(corners.limit)[1] == len(model.walls[0].corners())
    for above in (0.9, 0.84, 0.5):
        assert not wall_forces(solver, model.points + np.array([0.0, above * 1e-3])).any()
    assert wall_forces(solver, model.points - np.array([0.0, 1e-5])).any()


def test_a_block_rests_on_two_knife_edges(build, start, record_verification):
    """Which both lie between its nodes: the forces add up to its weight and share it by the rule of
    the lever. Without corners it would fall 1 mm, until nodes meet the edges' sides.
    """
    solver = start(build(over(KNIVES)))
    model = solver.models[0]
    corners = solver.terms.corner_contacts[0]
    while solver.time < 0.15:
        solver.advance(500)
    solver.clear_impulses(0)
    began = solver.time
    while solver.time < 0.25:
        solver.advance(500)
    impulse = fields.read(corners.impulse)[0] / (solver.time - began)
    nodes_too = fields.read(solver.terms.wall_contacts[0].impulse)[0]
    left = model.points[model.contact.nodes, 0] < -1e-3
    forces = [impulse[left, 1].sum(), impulse[~left, 1].sum()]
    exact = WEIGHT * TIPS[1][0] / (TIPS[1][0] - TIPS[0][0])
    assert not nodes_too.any()
    assert sum(forces) == pytest.approx(WEIGHT, rel=1e-3)
    assert forces[0] == pytest.approx(exact, rel=0.01)
    lowest = solver.positions()[0][:, 1].min()
    assert lowest > -0.2e-3
    record_verification("block on two knife edges: left force [N]", exact, forces[0])


def test_a_block_slides_over_an_edge_and_its_energy_is_kept(build, start, record_verification):
    """Without friction, from a plateau over its sharp edge, until it tips and lets go."""
    from softsim.solver.energy import EnergyBalance, EnergyReader

    points = [(-60, 0), (15.3, 0), (15.3, -30), (90, -30)]
    scene = SCENE.replace(
        "material: rubber}", "material: rubber, initial_velocity: [0.4 m/s, 0 m/s]}"
    )
    solver = start(build(over(points, scene)))
    reader = EnergyReader(solver)
    first = reader.read()
    balance = EnergyBalance.starting(first, solver.models[0])
    largest, by_corner = 0.0, 0.0
    while solver.time < 0.07:
        solver.advance(200)
        largest = max(largest, balance.error(reader.read()))
        by_corner = max(by_corner, fields.read(solver.terms.corner_contacts[0].pressing)[0].max())
    assert by_corner > 0.5 * WEIGHT  # it has turned about the edge
    assert largest < 2e-3
    record_verification("energy over a sharp edge, of its own [-]", 0.0, largest)


def test_knife_edges_that_rise_lift_the_block(build, start):
    """By their way; the work of their motion, and the force that it needs, count the corners."""
    from softsim.solver.energy import EnergyBalance, EnergyReader

    lift = (
        "conditions={lift: {kind: wall_motion, wall: ground, direction: y, "
        "displacement: {kind: ramp, value: 0.5 mm, duration: 40 ms}}}"
    )
    model = build(over(KNIVES), lift)
    solver = start(model)
    reader, walls = EnergyReader(solver), solver.terms.wall_contacts[0]
    began_at = solver.scenario(0).centre_of_mass()
    balance = EnergyBalance.starting(reader.read(), model)
    largest = 0.0
    while solver.time < 0.1:
        solver.clear_impulses(0)
        began = solver.time
        solver.advance(500)
        largest = max(largest, balance.error(reader.read()))
    rise = solver.scenario(0).centre_of_mass()[1] - began_at[1]
    force = readings(walls, solver.time - began)["ground_drive_force"]
    assert largest < 2e-3
    assert rise == pytest.approx(0.5e-3, abs=5e-6)
    assert force == pytest.approx(WEIGHT, rel=0.05)


def test_scenarios_have_corners_of_their_own(build, start):
    """One more in the second: each has the forces that it has alone."""
    grounds = KNIVES, [*KNIVES[:4], (2.02, 0.0), (9.0, -7.0), (9.5, -6.5), *KNIVES[5:]]
    models = [build(over(points), "environment.gravity=0 m/s^2") for points in grounds]
    x = models[0].points - [0.0, 0.1e-3]

    def forces(solver):
        """Of the corners, in each scenario."""
        at = np.broadcast_to(x, (len(solver.models), *x.shape))
        fields.write(solver.terms.nodes.position, np.ascontiguousarray(at))
        solver.terms.nodes.velocity.fill(0.0)
        solver.find_forces(1e-9)
        return fields.read(solver.terms.corner_contacts[0].force)

    alone = [forces(start(model))[0] for model in models]
    together = forces(start(*models))
    assert np.array_equal(together, np.stack(alone))
    assert (alone[0] != alone[1]).any()
