"""Ties in the solver: the same bits whoever sums, from a state that was kept, side by side."""

import numpy as np

from softsim.compute import fields
from softsim.solver.increments import Span
from softsim.solver.stable_step import stable_step

BLOCK = "generator: block, length: 8 mm, height: 4 mm, element_size"
TIED = f"""
bodies:
  lower: {{mesh: {{{BLOCK}: 2 mm}}, formulation: plane_strain, thickness: 3 mm,
          material: dragon_skin_10, fixed: [bottom]}}
  upper: {{mesh: {{{BLOCK}: 1.3 mm}}, formulation: plane_strain, thickness: 3 mm,
          material: dragon_skin_10, position: [0 mm, 4 mm], initial_velocity: [0.1 m/s, 0 m/s]}}
ties: {{glue: {{nodes: upper.bottom, facets: lower.top}}}}
time: {{end: 1 s}}
"""


def test_the_same_bits_with_two_workers_and_from_a_kept_state(build, restart):
    """Launches, which are other kernels, give them to round-off."""
    from softsim.solver.explicit import ExplicitSolver

    restart(threads=2, device="cpu")
    model = build(TIED)
    dt = 0.9 * stable_step(model, model.points).value
    solver = ExplicitSolver([model])
    solver.begin(dt)
    begun, found = solver.state(), []
    for workers in (0, 1, 2):
        solver.restore(begun, 0.0, 0, dt)
        span = Span(60, 0.0, dt, drift=dt, kick=dt)
        if workers:
            solver.kernels.together(0, span, workers)
        else:
            solver.kernels.alone(0, span)
        found.append(solver.state())
    solver.restore(begun, 0.0, 0, dt)
    solver.begin_block()
    solver.continue_block(25)
    halfway = solver.state()
    solver.restore(begun, 0.0, 0, dt)
    solver.advance(3)  # something else between
    solver.restore(halfway, 25 * dt, 25, dt)
    solver.kernels.alone(0, Span(35, 0.0, dt, drift=dt, kick=dt, done=25))
    found.append(solver.state())
    for other in found[1:]:
        for name, array in found[0].items():
            np.testing.assert_array_equal(other[name], array, err_msg=name)
    x = found[0]["nodes/position"][0]
    assert np.abs(x - model.points).max() > 1e-5
    np.testing.assert_allclose(model.ties.followed(x), x, rtol=0.0, atol=1e-17)


def test_tied_scenarios_side_by_side_are_those_alone(build, start):
    models = [build(TIED, f"environment.gravity={g} m/s^2") for g in (0, 30)]
    assert models[0].can_share(models[1])
    assert not models[0].can_share(build(TIED.replace("tolerance", ""), "ties={}"))
    together = start(*models)
    together.advance(80)
    x, dt = together.positions(), together.time_increment
    for number, model in enumerate(models):
        alone = start(model)
        assert alone.time_increment == dt
        alone.advance(80)
        np.testing.assert_allclose(x[number], alone.positions()[0], rtol=0.0, atol=1e-15)
    assert np.abs(x[1] - x[0]).max() > 1e-6


def test_a_prescribed_side_does_the_work_of_the_tied_one(build, start):
    """What a motion of the facets does, the other body takes up too."""
    from softsim.solver.energy import EnergyReader

    model = build(
        TIED.replace("initial_velocity: [0.1 m/s, 0 m/s]", "fixed: [top]").replace("[bottom]", "[]")
        + "environment: {gravity: 0 m/s^2}\n"
        "conditions: {push: {kind: prescribed, nodes: lower.top, direction: y,\n"
        "                    displacement: {kind: smooth_step, value: 0.4 mm, duration: 20 ms}}}\n"
    )
    solver = start(model)
    reader = EnergyReader(solver)
    while solver.time < 20e-3:
        solver.advance(100)
    energies = reader.read()
    assert energies.external_work > 0.0
    assert abs(energies.balance) < 1e-3 * energies.external_work
    (upper,) = (b for b in model.bodies if b.name == "upper")
    x = solver.positions()[0][upper.nodes]
    assert np.ptp(x[:, 1]) < 3.61e-3  # it is pressed


FRAME = (
    TIED.replace(", fixed: [bottom]", "")
    + """
rigid_bodies: {frame: {mass: 2 g, inertia: 20 g*mm^2, tied: [lower.top]}}
environment: {gravity: 0 m/s^2}
"""
)


def test_facets_that_a_rigid_body_holds_hand_on_to_it(build, start):
    """The tied nodes follow the frame as it turns, and momentum is kept between body and frame."""
    model = build(FRAME)
    solver = start(model)
    terms = solver.terms
    free = model.is_free.all(axis=1)

    def momentum():
        v = fields.read(terms.nodes.velocity)[0][free]
        frame = fields.read(terms.rigid_bodies.velocity)[0, 0]
        return model.mass[free] @ v + fields.read(terms.rigid_bodies.mass)[0] * frame

    before = momentum()
    solver.advance(400)
    np.testing.assert_allclose(momentum(), before, rtol=0.0, atol=1e-12 * np.abs(before).max())
    x = solver.positions()[0]
    top, tied = model.bodies[0].node_sets["top"], model.ties.nodes
    assert np.abs(x[top] - model.points[top]).max() > 1e-5
    np.testing.assert_allclose(model.ties.followed(x)[tied], x[tied], rtol=0.0, atol=1e-17)
