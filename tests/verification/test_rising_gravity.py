"""Bodies that fall freely while gravity rises over a ramp of 10 ms to its full value G.

A soft block far from everything falls like the rigid body beside it, as no force acts within it.
Central differences of x'' = G t / T from rest give x_n = G (t^3 - t dt^2) / (6 T) to round-off:
the half-step scheme is exact for it but for the second term.
"""

import numpy as np
import pytest

from softsim.compute import fields

G, RAMP = 9.81, 10e-3
SCENE = """
bodies:
  block: {mesh: {generator: block, length: 100 mm, height: 50 mm, element_size: 50 mm},
          formulation: plane_strain, thickness: 100 mm, material: soft, position: [1 m, 1 m]}
materials: {soft: {law: neo_hooke, C10: 100 Pa, density: 10 kg/m^3}}
rigid_bodies: {frame: {mass: 5 g, inertia: 1 kg*mm^2}}
environment: {gravity_profile: {kind: ramp, duration: 10 ms}}
time: {end: 1 s}
"""


def fallen(solver):
    """Way down (nodes + 1,) [m] of all nodes and of the rigid body."""
    terms = solver.terms
    nodes = fields.read(terms.nodes.rest) - fields.read(terms.nodes.position)[0]
    body = fields.read(terms.rigid_bodies.rest) - fields.read(terms.rigid_bodies.centre)[0]
    return np.concatenate([nodes, body])[:, 1]


def test_free_fall_under_a_ramp(build, fresh_taichi, record_verification):
    """Within the ramp and after it; the books miss m (dt g)^2 / 8, as of any force that changes
    within an increment (half a kick at either end), and go on from a checkpoint to the same bits.
    """
    from softsim.solver.energy import EnergyReader
    from softsim.solver.explicit import ExplicitSolver

    model = build(SCENE)
    solver, other = ExplicitSolver([model]), ExplicitSolver([model])
    reader = EnergyReader(solver)
    dt = RAMP / 200
    solver.begin(dt)
    solver.advance(100)
    t = solver.time
    exact = G * (t**3 - t * dt**2) / (6.0 * RAMP)
    np.testing.assert_allclose(fallen(solver), exact, rtol=1e-9)
    mass = model.mass.sum() + 5e-3
    energies = reader.read()
    assert abs(energies.balance) == pytest.approx(mass * (0.5 * G * dt) ** 2 / 8.0, rel=1e-5)
    kept = solver.state()
    other.restore(kept, solver.time, solver.increment_count, dt)
    for one in (solver, other):
        one.advance(300)
    for name, array in solver.state().items():
        np.testing.assert_array_equal(other.state()[name], array, err_msg=name)
    energies, after = reader.read(), solver.time - RAMP
    way = G * (RAMP**2 / 6.0 + 0.5 * RAMP * after + 0.5 * after**2)
    speed = G * (0.5 * RAMP + after)
    # The end of the ramp lies on an increment: half a step of its slope is all that is rounded off.
    np.testing.assert_allclose(fallen(solver), way, rtol=2.0 * (dt / RAMP) ** 2)
    assert energies.kinetic == pytest.approx(0.5 * mass * speed**2, rel=(dt / RAMP) ** 2)
    assert energies.external_work == pytest.approx(energies.kinetic, rel=(dt / RAMP) ** 2)
    assert abs(energies.balance) == pytest.approx(mass * (G * dt) ** 2 / 8.0, rel=1e-5)
    record_verification("free fall, gravity over a ramp [m]", way, fallen(solver)[-1])


def test_the_relief_follows(build, start):
    """Half of the weight along x, gravity along -x: all bodies' mass times half of the present
    gravity acts forward on the frame.
    """
    model = build(
        SCENE,
        "environment.gravity=[-9.81 m/s^2, 0 m/s^2]",
        "loads={relief: {kind: axial_relief, acts_on: frame, share: 0.5}}",
    )
    solver = start(model)
    solver.advance(int(0.5 * RAMP / solver.time_increment))
    share = solver.time / RAMP
    assert 0.2 < share < 0.6
    mass = model.mass.sum() + 5e-3
    force = fields.read(solver.terms.rigid_bodies.force)[0, 0, 0]
    assert force == pytest.approx(share * G * (0.5 * mass - 5e-3), rel=1e-9)
