"""A soft strip thrown into a pipe along a path: against a straight pipe, workers, a restart."""

import numpy as np
import pytest

from softsim.compute import fields
from softsim.solver.increments import Span
from softsim.solver.stable_step import stable_step

STRIP = """
bodies:
  strip: {mesh: {generator: block, length: 10 mm, height: 1 mm, element_size: 0.5 mm},
          formulation: plane_strain, thickness: 1 mm, material: rubber, position: [0 mm, -1.9 mm],
          initial_velocity: [2 m/s, -1 m/s]}
materials:
  rubber: {law: yeoh, C10: 36 kPa, density: 1000 kg/m^3}
environment: {walls: {pipe: WALL}}
contact: {friction_coefficient: 0.4}
time: {end: 1 s}
"""
PIPE = "{kind: pipe, diameter: 4 mm}"
PATH = (
    "{kind: pipe_path, diameter: 4 mm, start: [-10 mm, 0 mm], pipe: "
    "[{straight: 12 mm}, {straight: 8 mm}, {bend: 60 deg, radius: 8 mm}, {straight: 30 mm}]}"
)


def test_before_the_bend_it_is_a_straight_pipe(build, start):
    """Two segments that are one: to round-off the same places, while the strip strikes the wall
    across their joint and rubs along it, and none of it has reached the bend.
    """
    found = []
    for wall in (PIPE, PATH):
        solver = start(build(STRIP.replace("WALL", wall)), share=0.5)
        while solver.time < 0.4e-3:
            solver.advance(10)
        contact = solver.terms.wall_contacts[0]
        found.append(
            (solver.time, solver.positions()[0], fields.read(contact.friction_dissipation))
        )
    straight, path = found
    assert straight[0] == path[0]
    assert straight[2].sum() > 0.0
    size = np.ptp(straight[1][:, 0])
    np.testing.assert_allclose(path[1], straight[1], rtol=0.0, atol=1e-11 * size)
    np.testing.assert_allclose(path[2].sum(), straight[2].sum(), rtol=1e-9)


def test_workers_give_the_bits_of_one(build, restart):
    """What a node remembers of the path is its own: two threads do as one."""
    from softsim.compute.machine import processor_count
    from softsim.solver.explicit import ExplicitSolver

    if processor_count() == 1:
        pytest.skip("one processor")
    restart(threads=2, device="cpu")
    model = build(STRIP.replace("WALL", PATH))
    dt = 0.9 * stable_step(model, model.points).value
    solver = ExplicitSolver([model])
    solver.begin(dt)
    begun, found = solver.state(), []
    for workers in (1, 2):
        solver.restore(begun, 0.0, 0, dt)
        solver.kernels.together(0, Span(200, solver.time, dt, drift=dt, kick=dt), workers)
        found.append(solver.state())
    for name, array in found[0].items():
        np.testing.assert_array_equal(found[1][name], array, err_msg=name)
    assert found[0]["contacts/0/friction_dissipation"].sum() > 0.0


def test_goes_on_to_the_same_bits_from_what_it_remembers(build, start):
    """In the bend: the memory holds where each node is."""
    solver = start(build(STRIP.replace("WALL", PATH)))
    while solver.time < 3e-3:
        solver.advance(100)
    kept = solver.state()
    assert len(np.unique(kept["contacts/0/near"])) > 1
    solver.advance(300)
    expected = solver.positions()
    again = start(solver.models[0])
    again.restore(kept, solver.time - 300 * solver.time_increment, 0, solver.time_increment)
    again.advance(300)
    np.testing.assert_array_equal(again.positions(), expected)
