"""Gap and normal from grids in kernels, against another interpolation and by differences."""

import numpy as np
import taichi as ti
from scipy.interpolate import RegularGridInterpolator
from surfaces import sphere

from softsim.compute import fields
from softsim.contact.grid import GriddedObstacle, TriangleSurface, gridded


def hollow(spacing=0.9e-3):
    points, triangles = sphere(8e-3, 8)
    return gridded("hollow", TriangleSurface(points, triangles[:, ::-1]), spacing)


def look(walls, scenario, places):
    """Gaps (n,) and normals (n, d) that contact computes."""
    from softsim.compute.fields import real_field, vector_field

    obstacle = GriddedObstacle(walls)
    x = vector_field(places)
    gaps, normals = real_field(np.zeros(len(places))), vector_field(np.zeros(places.shape))

    @ti.kernel
    def each():
        for i in gaps:
            gap, n = obstacle.gap_and_normal(scenario, i, 0, x[i])
            gaps[i] = gap
            normals[i] = n

    each()
    return fields.read(gaps), fields.read(normals)


def test_gap_is_interpolated_and_its_gradient_the_normal(fresh_taichi):
    """Inside the box and outside; the gradient by central differences, within a cell."""
    grid = hollow()
    (name,) = grid.names
    d = len(grid.origin)
    rng = np.random.default_rng(7)
    size = grid.spacing * (np.array(grid.values.shape) - 1)
    places = grid.origin + size * rng.uniform(-0.2, 1.2, (3000, d))
    places[:5] += 3.0 * size  # far away
    gaps, normals = look([grid], 0, places)
    axes = [grid.origin[a] + grid.spacing * np.arange(grid.values.shape[a]) for a in range(d)]
    rim = np.clip(places, grid.origin, [axis[-1] for axis in axes])
    exact = RegularGridInterpolator(axes, grid.values)(rim)
    exact += np.sign(exact) * np.linalg.norm(places - rim, axis=1)
    np.testing.assert_allclose(gaps, exact, rtol=1e-13, atol=1e-16)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-12)
    u = (places - grid.origin) / grid.spacing
    step = 1e-5
    share = u - np.floor(u)
    within = ((u > 0.0) & (places < grid.origin + size)).all(axis=1)
    within &= ((share > step) & (share < 1.0 - step)).all(axis=1)
    h = step * grid.spacing
    slopes = [
        (grid.gaps(places + h * e)[name] - grid.gaps(places - h * e)[name]) / (2.0 * h)
        for e in np.eye(d)
    ]
    gradient = np.stack(slopes, axis=1)[within]
    # Round-off 1e-16 * 30 mm over the step of 1e-5 cells, along slopes of 0.3 at least.
    length = np.linalg.norm(gradient, axis=1)[:, None]
    steep = length[:, 0] > 0.3
    assert steep.sum() > 500
    np.testing.assert_allclose(normals[within][steep], (gradient / length)[steep], atol=1e-8)


def test_scenarios_share_a_grid_or_have_their_own(fresh_taichi):
    same, finer = hollow(), hollow(0.6e-3)
    places = np.random.default_rng(3).uniform(-9e-3, 9e-3, (200, 3))
    walls = [same, finer, hollow()]
    assert len(fields.read(GriddedObstacle(walls).value)) == same.values.size + finer.values.size
    for scenario, grid in enumerate(walls):
        gaps, _ = look(walls, scenario, places)
        np.testing.assert_allclose(gaps, grid.gaps(places)["hollow"], rtol=1e-13, atol=1e-17)


def test_a_lost_node_reads_nothing_outside_the_table(fresh_taichi):
    """A run that fails goes on with NaN until a guard reads it: that must not end the process."""
    grid = hollow()
    places = np.full((3, len(grid.origin)), np.nan)
    places[1], places[2, 0] = np.inf, 0.0
    _, normals = look([grid], 0, places)
    assert np.isfinite(normals).all()
