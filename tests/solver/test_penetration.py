"""Penetration of walls: against the elements' size and the thickness of walls."""

import numpy as np
import pytest

from softsim.contact.polyline import Polyline
from softsim.solver.guards import (
    body_penetration,
    body_penetration_warnings,
    crossing_warnings,
    element_sizes,
    penetration,
    penetration_warnings,
    thinnest_wall,
)

FIN = """
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
environment:
  walls:
    floor: {kind: plane, point: [0 mm, -1 mm], normal: [0, 1]}
    fin: {kind: polyline, closed: true,
          points: [[7 mm, -9 mm], [7 mm, 15 mm], [7.2 mm, 15 mm], [7.2 mm, -9 mm]]}
time: {end: 1 ms}
"""


def deep(model, wall, depth):
    """Depths (walls, k) [m] of which one node has one in one wall."""
    depths = np.zeros((len(model.walls), len(model.contact.nodes)))
    depths[wall, 3] = depth
    return penetration(model, depths)


def test_depth_is_counted_in_elements(build):
    model = build(FIN)
    assert element_sizes(model)[model.contact.nodes] == pytest.approx(1e-3)
    names = [wall.names[0] for wall in model.walls]
    floor, fin = names.index("floor"), names.index("fin")
    assert deep(model, floor, 0.0).node is None
    assert deep(model, floor, 0.2e-3).relative == pytest.approx(0.2)
    assert penetration_warnings(model, deep(model, floor, 0.09e-3)) == {}
    [told] = penetration_warnings(model, deep(model, floor, 0.2e-3)).values()
    assert "penetrated a wall by 0.2 mm, 20 % of the size" in told
    assert penetration_warnings(model, deep(model, fin, 0.049e-3)) == {}
    [told] = penetration_warnings(model, deep(model, fin, 0.051e-3)).values()
    assert "wall 'fin' by 0.051 mm, and the wall is 0.2 mm thick" in told


def test_depth_of_bodies_is_counted_in_their_facets(build):
    model = build(FIN, "contact.self_contact=[b]")
    data = model.self_contact
    depths = np.zeros(len(data.nodes) + len(data.facets))
    assert body_penetration_warnings(body_penetration(model, data, depths)) == {}
    depths[-1] = 0.2e-3
    found = body_penetration(model, data, depths)
    assert (found.relative, found.depth) == (pytest.approx(0.2), 0.2e-3)
    np.testing.assert_allclose(found.place, model.points[data.facets[-1]].mean(axis=0))
    [told] = body_penetration_warnings(found).values()
    assert "penetrated another surface by 0.2 mm, 20 % of the size" in told
    assert "contact.allowed_penetration" in told
    assert body_penetration_warnings(None) == {}


def test_a_node_that_can_step_over_a_wall_is_told(build):
    name, thickness = thinnest_wall(build(FIN).walls)
    assert (name, thickness) == ("fin", pytest.approx(0.2e-3))
    assert crossing_warnings(name, thickness, 4.9, 10e-6) == {}
    told = crossing_warnings(name, thickness, 20.0, 10e-6)["thickness of fin"]
    assert "0.2 mm per increment" in told and "at most 2.5 us" in told


def test_thickness_of_polylines():
    """A fin is as thick as its sides are apart; ground and the inside of a channel are thick."""
    fin = np.array([[0.0, 0.0], [0.0, 9.0], [0.5, 9.0], [0.5, 0.0]])
    assert Polyline(fin, closed=True).thickness == pytest.approx(0.5)
    assert Polyline(fin[::-1], closed=True).thickness == np.inf
    ground = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [1.1, 2.0], [1.1, 0.0], [3.0, 0.0]])
    assert Polyline(ground, closed=False).thickness == pytest.approx(0.1)
    assert Polyline(ground[[0, 1, 5]], closed=False).thickness == np.inf


@pytest.mark.physics
def test_the_largest_depth_is_kept(build, start):
    """A block that falls onto a floor as soft as foam, and is thrown back."""

    model = build(
        FIN,
        "environment.walls.floor.point.1=0 mm",
        "environment.gravity=1000 m/s^2",
        "contact.penalty_stiffness=100 N/m",
    )
    solver = start(model)
    deepest = 0.0
    for _ in range(400):
        solver.advance(1)
        deepest = max(deepest, -float(solver.positions()[0, :, 1].min()))
    found = solver.scenario(0).penetration()
    assert found.depths.max() == pytest.approx(deepest, rel=1e-9)
    assert found.relative == pytest.approx(deepest / 1e-3, rel=1e-9)
    assert deepest > 0.0
