"""Every force is minus the gradient of its energy, by central differences.

A central difference of a smooth energy E with step h is off by h^2 E'''/6 + eps E / h; with the
steps below both are under 1e-6 of the largest force.
"""

import numpy as np
import pytest

SOFT = """
bodies:
  b:
    mesh: {generator: block, length: 4 mm, height: 3 mm, element_size: 1 mm}
    formulation: plane_strain
    thickness: 5 mm
    material: soft
materials:
  soft: {law: yeoh, C10: 36 kPa, C20: 5 kPa, C30: 1 kPa, density: 1000 kg/m^3,
         prony: [{g: 0.3, relaxation_time: 1 ms}]}
environment: {gravity: 0 m/s^2}
solver: {bulk_viscosity: 0}
time: {end: 1 s}
"""


def scattered(model, seed, amplitude):
    """Every node off its place at random."""
    noise = np.random.default_rng(seed).standard_normal(model.points.shape)
    return model.points + amplitude * noise


def freeze_metric(solver):
    """A viscous metric that stays: the branch energy is then a function of positions alone."""
    for body in solver.terms.bodies:
        for component in range(3):
            body.metric[0][component].fill((1.1, 0.9, 0.1)[component])
        body.decay.fill(1.0)


def forces_at(solver, x):
    """Nodal forces (n, 2) with the nodes at x."""
    nodes = solver.terms.nodes
    nodes.velocity.fill(0.0)
    nodes.position.from_numpy(np.ascontiguousarray(x[None]))
    solver.force_kernel(solver.time, 1e-9)
    solver.kick_kernel(solver.time, 0.0)
    return nodes.force.to_numpy()[0]


def gradient(energy, x, nodes, step=1e-9):
    """-dE/dx by central differences at `nodes`."""
    result = np.zeros((len(nodes), 2))
    for k, a in enumerate(nodes):
        for i in range(2):
            ends = []
            for sign in (1.0, -1.0):
                moved = x.copy()
                moved[a, i] += sign * step
                ends.append(energy(moved))
            result[k, i] = -(ends[0] - ends[1]) / (2.0 * step)
    return result


def test_elements(build, start):
    """Law, averaged nodal pressure and Maxwell branch together."""
    from softsim.solver.energy import Meter

    solver = start(build(SOFT))
    meter = Meter(solver)
    freeze_metric(solver)
    x = scattered(solver.models[0], 1, 0.1e-3)

    def energy(at):
        forces_at(solver, at)
        return meter.read()[0].internal

    nodes = [0, 3, 7, 10, 15]
    exact = gradient(energy, x, nodes)
    force = forces_at(solver, x)[nodes]
    assert np.abs(force).max() > 1e-3
    np.testing.assert_allclose(force, exact, atol=1e-6 * np.abs(force).max())


def test_contact_normal_and_sticking(build, start):
    """Penalty springs, normal and tangential, of nodes that stick."""
    from softsim.solver.energy import Meter

    text = SOFT + "contact: {friction_coefficient: 1000, damping_ratio: 0}\n"
    text = text.replace(
        "environment: {gravity: 0 m/s^2}",
        "environment: {gravity: 0 m/s^2, walls: {w: {kind: plane, normal: [0.3, 1], "
        "point: [-2 mm, -1 mm]}}}",
    )
    model = build(text)
    solver = start(model)
    meter = Meter(solver)
    freeze_metric(solver)
    inside = model.points - np.array([0.0, 2.0e-3])
    forces_at(solver, inside)  # the anchors are set here
    x = inside + scattered(model, 2, 1e-5) - model.points

    def energy(at):
        forces_at(solver, at)
        read = meter.read()[0]
        return read.contact + read.internal

    touching = np.flatnonzero(solver.terms.walls.normal_force.to_numpy()[0] > 0.0)
    assert len(touching) > 2
    nodes = model.contact.nodes[touching[:3]]
    exact = gradient(energy, x, nodes)
    force = forces_at(solver, x)[nodes]
    np.testing.assert_allclose(force, exact, atol=1e-6 * np.abs(force).max())


def test_follower_pressure_is_the_gradient_of_volume(build, start):
    """Pressure on the whole surface: force = p dV/dx, V the area by the shoelace formula."""
    text = SOFT + (
        "loads: {p: {kind: follower_pressure, facets: [b.surface], "
        "profile: {kind: constant, value: 2 kPa}}}\n"
    )
    model = build(text)
    solver = start(model)
    # Compare with the same deformation without pressure: what is left is the pressure.
    freeze_metric(solver)
    x = scattered(model, 3, 0.1e-3)
    with_pressure = forces_at(solver, x)
    solver.terms.pressures[0].value.fill(0.0)
    force = with_pressure - forces_at(solver, x)
    facets = model.pressures[0].facets
    depth = model.pressures[0].thickness

    def energy(at):
        a, b = at[facets[:, 0]], at[facets[:, 1]]
        area = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()
        return 2000.0 * depth * area  # the body's own area: pressure around it does -p dA

    nodes = model.contact.nodes[:6]
    exact = gradient(energy, x, nodes, step=1e-7)
    np.testing.assert_allclose(force[nodes], exact, atol=1e-9 * np.abs(force).max() + 1e-12)
    # A closed surface under uniform pressure: no resultant, no moment.
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-15)
    moment = x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0]
    assert abs(moment.sum()) < 1e-17


@pytest.mark.parametrize("angle", [0.3, np.pi / 2, 2.5])
def test_rigid_rotation_gives_no_stress(build, start, angle):
    """Turned as a whole, the body feels nothing: forces stay at round-off."""
    model = build(SOFT)
    solver = start(model)
    c, s = np.cos(angle), np.sin(angle)
    turned = model.points @ np.array([[c, s], [-s, c]])
    # Round-off: eps times the stress scale (bulk modulus) times a facet's area.
    scale = model.bodies[0].material.bulk_modulus * 1e-3 * 5e-3
    assert np.abs(forces_at(solver, turned)).max() < 1e-13 * scale


def test_patch(build, start):
    """A linear displacement field on a distorted mesh: uniform stress, no force inside."""
    model = build(SOFT)
    solver = start(model)
    gradient_u = np.array([[0.2, 0.3], [-0.1, 0.1]])
    force = forces_at(solver, model.points @ (np.eye(2) + gradient_u).T)
    inside = np.setdiff1d(np.arange(len(model.points)), model.bodies[0].node_sets["surface"])
    assert len(inside) >= 6
    assert np.abs(force[inside]).max() < 1e-12 * np.abs(force).max()
