"""What a kernel computes does not depend on how many elements share a lane vector, nor on how it is
optimised.
"""

import numpy as np
import pytest

from softsim import backend, fields

SCENE = """
bodies:
  a: {mesh: {generator: block, length: 7 mm, height: 5 mm, element_size: 1 mm, cells: quad},
      formulation: plane_strain, thickness: 10 mm, material: m, fixed: [left]}
  b: {mesh: {generator: block, length: 7 mm, height: 5 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 10 mm, material: m, fixed: [left]}
materials:
  m: {law: yeoh, C10: 60 kPa, density: 1070 kg/m^3, prony: [{g: 0.4, relaxation_time: 5 ms}]}
environment:
  gravity: 900 m/s^2
  walls: {floor: {kind: plane, point: [0 mm, -0.1 mm], normal: [0, 1]}}
time: {end: 1 s}
"""


@pytest.mark.parametrize("lanes", [1, 4, 8])
def test_lanes_of_a_vector_change_nothing(build, start, monkeypatch, lanes):
    model = build(SCENE)

    def positions():
        solver = start(model)
        solver.advance(400)
        return fields.read(solver.terms.nodes.position)[0]

    expected = positions()
    monkeypatch.setattr(backend, "CPU_LANES", lanes)
    monkeypatch.setenv("TI_ADVANCED_OPTIMIZATION", "1")
    moved = np.abs(expected - model.points).max()
    assert moved > 1e-4
    np.testing.assert_allclose(positions(), expected, atol=1e-9 * moved)
