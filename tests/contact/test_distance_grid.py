"""Grids of distances: how exact they are, beyond their box too, and what they refuse.

The second derivatives of a distance add up to the wall's curvatures, so that linear interpolation
is off by spacing^2 / (8 R) at most beside a circle, and twice that beside a sphere; a polygon whose
edges are 1 part in 1000 of R long stays within R / 8e6 of its circle.
"""

import numpy as np
import pytest
from surfaces import box, sphere

from softsim.contact import distance_grid, polyline, triangle_surface
from softsim.contact.distance_grid import SpacingError, least_spacing, shape_of_grid
from softsim.contact.triangle_surface import TriangleSurface
from softsim.errors import MeshError

RADIUS = 20e-3
STEP = np.array([[0, 0], [10, 0], [10, 4], [20, 4]]) * 1e-3


def circle(count):
    angle = 2.0 * np.pi * np.arange(count) / count
    return RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def beside(dimension, count=2000):
    """Places within 0.2 mm of a sphere or circle, and how far inside they are."""
    rng = np.random.default_rng(4)
    way = rng.normal(size=(count, dimension))
    inside = rng.uniform(-2e-4, 2e-4, count)
    return (RADIUS - inside)[:, None] * way / np.linalg.norm(way, axis=1)[:, None], inside


def test_a_circle_is_met_to_second_order(record_verification):
    x, exact = beside(2)
    line = polyline.checked_polyline(circle(6283), True)
    errors = []
    for spacing in (2e-3, 1e-3, 0.5e-3):
        grid = polyline.gridded("pipe", line, spacing)
        errors.append(np.abs(grid.gaps(x)["pipe"] - exact).max())
        # The radius that counts is that at the places, and at the corners of their cells.
        least = RADIUS - 2e-4 - np.sqrt(2.0) * spacing
        assert errors[-1] < spacing**2 / (8.0 * least) + RADIUS / 8e6
    order = np.log2(errors[0] / errors[2]) / 2.0
    assert 1.9 < order < 2.1
    record_verification("gap on a grid beside a circle, 1 mm [m]", 0.0, errors[1], order)


def test_a_sphere_is_met_to_second_order(record_verification):
    """Beside what its triangles lack themselves: their edges' square over 8 R."""
    x, exact = beside(3)
    points, triangles = sphere(RADIUS, 32)
    surface = TriangleSurface(points, triangles[:, ::-1])
    edges = np.linalg.norm(surface.ways, axis=2).max()
    errors = []
    for spacing in (5e-3, 2.5e-3):
        grid = triangle_surface.gridded("hollow", surface, spacing)
        errors.append(np.abs(grid.gaps(x)["hollow"] - exact).max())
        least = RADIUS - 2e-4 - np.sqrt(3.0) * spacing
        assert errors[-1] < spacing**2 / (4.0 * least) + edges**2 / (8.0 * RADIUS)
    order = np.log2(errors[0] / errors[1])
    assert 1.75 < order < 2.25
    record_verification("gap on a grid beside a sphere, 2.5 mm [m]", 0.0, errors[1], order)


def test_a_slope_is_exact_within_the_grid_and_beyond():
    """To round-off where distances are exact; farther the sign, and the size to a cell's diagonal.
    Beyond the ends the nearer of the rim's gap and the line, which is no more than a diagonal off.
    """
    line = polyline.checked_polyline(np.array([[0.0, 0.0], [0.1, 0.03]]), False)
    grid = polyline.gridded("slope", line, 0.7e-3)
    along, normal = line.directions[0], line.normals[0]
    rng = np.random.default_rng(3)
    height = np.append(rng.uniform(-1e-3, 1e-3, 3000), rng.uniform(-0.3, 0.3, 3000))
    x = np.outer(rng.uniform(-0.2, 0.3, 6000), along) + np.outer(height, normal)
    gap = grid.gaps(x)["slope"]
    last = grid.origin + grid.spacing * (np.array(grid.values.shape) - 1)
    inside = ((x >= grid.origin) & (x <= last)).all(axis=1)
    assert inside[:3000].sum() > 300 and (~inside[:3000]).sum() > 300
    np.testing.assert_allclose(gap[:3000], height[:3000], atol=1e-15)
    assert np.array_equal(gap < 0.0, height < 0.0)
    assert np.abs(gap - height)[inside].max() < np.sqrt(2.0) * grid.spacing
    assert grid.steepest() == pytest.approx(1.0, abs=1e-12)


def test_a_corner_is_rounded_off_by_less_than_half_a_diagonal():
    """Where the wall is touched, and there by a third of a spacing. The gap changes by up to the
    root of two for each metre that a node moves.
    """
    line = polyline.checked_polyline(STEP, False)
    rng = np.random.default_rng(8)
    x = np.array([10e-3, 4e-3]) + rng.uniform(-1e-3, 1e-3, (4000, 2))
    edges = np.stack(
        [line.signed_distances(x, np.full(len(x), edge)) for edge in range(len(line.starts))]
    )
    exact = edges[np.abs(edges).argmin(axis=0), np.arange(len(x))]
    for spacing in (1.03e-3, 0.515e-3, 0.2575e-3):
        grid = polyline.gridded("step", line, spacing)
        near = np.abs(exact) < spacing
        error = (grid.gaps(x)["step"] - exact)[near]
        assert 0.2 * spacing < np.abs(error).max() < 0.5 * np.sqrt(2.0) * spacing
        touching = np.abs(exact[near]) < 0.05 * spacing
        assert np.abs(error[touching]).max() < 0.35 * spacing
        assert 1.0 < grid.steepest() < np.sqrt(2.0) + 1e-9


def test_outside_the_box_free_remains_free_and_solid_solid():
    """Of a hollow, of a solid, and of a ground whose end comes up beside a peak near the rim."""
    points, triangles = box(np.array([4e-3, 5e-3, 6e-3]))
    rng = np.random.default_rng(11)
    far = rng.normal(size=(500, 3))
    far *= 0.1 / np.linalg.norm(far, axis=1)[:, None]
    for name, turned, sign in (("solid", triangles, 1.0), ("hollow", triangles[:, ::-1], -1.0)):
        grid = triangle_surface.gridded(name, TriangleSurface(points, turned), 0.5e-3)
        exact = np.linalg.norm(far - np.clip(far, 0.0, points.max(axis=0)), axis=1)
        found = sign * grid.gaps(far)[name]
        assert (found > 0.9 * exact).all()
        assert found.max() < 0.11

    ground = np.array([[0, 0], [18, 0], [19, 9], [20, 0.0], [22, 0.2]]) * 1e-3
    line = polyline.checked_polyline(ground, False)
    grid = polyline.gridded("ground", line, 0.5e-3)
    x = rng.uniform([30e-3, -0.1], [3.0, 0.4], (20000, 2))
    height = (x - ground[-1]) @ line.normals[-1]
    assert (height < 0.0).any() and (height > 0.0).any()
    gap = grid.gaps(x)["ground"]
    assert np.array_equal(gap < 0.0, height < 0.0)
    near = np.abs(height) < 0.02  # farther up the peak is nearer
    np.testing.assert_allclose(gap[near], height[near], atol=1e-15)


def test_far_from_the_wall_the_distance_is_right_to_a_diagonal():
    """At the nodes of a large hollow, up to 40 spacings from its wall, and never too small."""
    line = polyline.checked_polyline(circle(400), True)
    grid = polyline.gridded("pipe", line, 0.5e-3)
    i, j = np.indices(grid.values.shape)
    r = np.hypot(*(grid.origin[:, None, None] + grid.spacing * np.stack([i, j])))
    error = np.abs(grid.values) - np.abs(RADIUS - r)
    sagitta = RADIUS * (np.pi / 400) ** 2 / 2.0
    assert -1.01 * sagitta < error.min()
    assert 0.1 * grid.spacing < error.max() < np.sqrt(2.0) * grid.spacing + sagitta


def test_a_grid_that_is_too_large_names_a_spacing_that_would_do(monkeypatch):
    monkeypatch.setattr(distance_grid, "MOST_NODES", 20_000)
    line = polyline.checked_polyline(STEP, False)
    with pytest.raises(SpacingError, match=r"2\d{3} x \d+ nodes, 0.01 mm apart, is too") as refused:
        polyline.gridded("step", line, 0.01e-3)
    low, high = STEP.min(axis=0), STEP.max(axis=0)
    enough = least_spacing(low, high)
    assert f"a spacing of {enough * 1e3:.3g} mm" in refused.value.hint
    assert 10_000 < np.prod(shape_of_grid(low, high, enough)) <= 20_000
    assert polyline.gridded("step", line, enough).values.size <= 20_000


@pytest.mark.parametrize("thickness, fits", [(0.4e-3, False), (0.9e-3, False), (3e-3, True)])
@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_a_plate_thinner_than_a_cell_is_refused(thickness, turn, fits):
    """Its sides would be free on all nodes: a hole that nobody sees."""
    corners = np.array([[-20e-3, 0.0], [20e-3, 0.0], [20e-3, thickness], [-20e-3, thickness]])
    c, s = np.cos(turn), np.sin(turn)
    line = polyline.checked_polyline((corners @ [[c, s], [-s, c]])[::-1], True)
    if fits:
        assert polyline.gridded("plate", line, 1e-3).values.min() < 0.0
        return
    with pytest.raises(SpacingError, match="thinner than its grid can hold"):
        polyline.gridded("plate", line, 1e-3)


@pytest.mark.parametrize("case", ["two that overlap", "one inside out"])
def test_a_surface_without_a_clear_inside_is_refused(case):
    points, triangles = box(np.array([8e-3, 8e-3, 8e-3]))
    overlapping = case == "two that overlap"
    shift = np.array([3e-3, 2e-3, 1e-3]) if overlapping else np.array([12e-3, 0.0, 0.0])
    second = triangles if overlapping else triangles[:, ::-1]
    surface = TriangleSurface(
        np.vstack([points, points + shift]), np.vstack([triangles, second + len(points)])
    )
    with pytest.raises(MeshError, match="no clear inside near"):
        triangle_surface.gridded("boxes", surface, 0.6e-3)
