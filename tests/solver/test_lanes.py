"""What a kernel computes does not depend on how many elements share a lane vector, nor on how it is
optimised.
"""

import numpy as np
import pytest

from softsim.compute import backend, fields

REST = """
materials:
  m: {law: yeoh, C10: 60 kPa, density: 1070 kg/m^3, prony: [{g: 0.4, relaxation_time: 5 ms}]}
environment:
  gravity: 900 m/s^2
  walls: {floor: {kind: plane, point: [0 mm, -0.1 mm], normal: [0, 1]}}
time: {end: 1 s}
"""
PLANE = """
bodies:
  a: {mesh: {generator: block, length: 7 mm, height: 5 mm, element_size: 1 mm, cells: quad},
      formulation: plane_strain, thickness: 10 mm, material: m, fixed: [left]}
  b: {mesh: {generator: block, length: 7 mm, height: 5 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 10 mm, material: m, fixed: [left]}
"""
REVOLVED = PLANE.replace("plane_strain, thickness: 10 mm", "axisymmetric, position: [4 mm, 0 mm]")
SPACE = """
bodies:
  a: {mesh: {generator: box, length: 3 mm, height: 3 mm, width: 1 mm, element_size: 1 mm,
      cells: quad}, formulation: solid, material: m, fixed: [left]}
  b: {mesh: {generator: box, length: 3 mm, height: 1 mm, width: 1 mm, element_size: 1 mm},
      formulation: solid, material: m, fixed: [left]}
"""


@pytest.mark.slow
@pytest.mark.parametrize(("bodies", "lanes"), [(PLANE, 4), (PLANE, 8), (REVOLVED, 8), (SPACE, 2)])
def test_lanes_of_a_vector_change_nothing(build, start, monkeypatch, bodies, lanes):
    """The last vector of lanes is not full."""
    model = build(bodies + REST)
    assert any(len(region.cells) % lanes for region in model.regions)

    def positions():
        solver = start(model)
        solver.advance(400)
        return fields.read(solver.terms.nodes.position)[0]

    monkeypatch.setattr(backend, "CPU_LANES", 1)
    monkeypatch.setenv("TI_ADVANCED_OPTIMIZATION", "0")
    expected = positions()
    monkeypatch.setattr(backend, "CPU_LANES", lanes)
    monkeypatch.setenv("TI_ADVANCED_OPTIMIZATION", "1")
    moved = np.abs(expected - model.points).max()
    assert moved > 3e-5
    np.testing.assert_allclose(positions(), expected, atol=1e-9 * moved)
