"""Grids of distances: how exact they are, beyond their box too, what they refuse; exact surfaces.

The second derivatives of a distance add up to the wall's curvatures, so that linear interpolation
is off by spacing^2 / (4 R) at most beside a sphere.
"""

import numpy as np
import pytest
from surfaces import box, sphere

from softsim.contact import grid as distance_grid
from softsim.contact.grid import (
    SpacingError,
    TriangleSurface,
    gridded,
    least_spacing,
    shape_of_grid,
)
from softsim.errors import MeshError
from softsim.mesh.surface import signed_volume

RADIUS = 20e-3
SIZE = np.array([20e-3, 4e-3, 10e-3])


def solid(size, spacing):
    """The grid of a solid box from the origin."""
    return gridded("solid", TriangleSurface(*box(size)), spacing)


def distance_to_box(x, size):
    """Signed distance (n,) [m] of places x (n, 3) to a solid box from the origin."""
    beyond = np.abs(x - 0.5 * size) - 0.5 * size
    return np.linalg.norm(beyond.clip(0.0), axis=1) + beyond.max(axis=1).clip(max=0.0)


def beside(count=2000):
    """Places within 0.2 mm of a sphere, and how far inside they are."""
    rng = np.random.default_rng(4)
    way = rng.normal(size=(count, 3))
    inside = rng.uniform(-2e-4, 2e-4, count)
    return (RADIUS - inside)[:, None] * way / np.linalg.norm(way, axis=1)[:, None], inside


@pytest.mark.physics
def test_a_sphere_is_met_to_second_order(record_verification):
    """Beside what its triangles lack themselves: their edges' square over 8 R."""
    x, exact = beside()
    points, triangles = sphere(RADIUS, 32)
    surface = TriangleSurface(points, triangles[:, ::-1])
    edges = np.linalg.norm(surface.ways, axis=2).max()
    errors = []
    for spacing in (5e-3, 2.5e-3):
        grid = gridded("hollow", surface, spacing)
        errors.append(np.abs(grid.gaps(x)["hollow"] - exact).max())
        least = RADIUS - 2e-4 - np.sqrt(3.0) * spacing
        assert errors[-1] < spacing**2 / (4.0 * least) + edges**2 / (8.0 * RADIUS)
    order = np.log2(errors[0] / errors[1])
    assert 1.75 < order < 2.25
    record_verification("gap on a grid beside a sphere, 2.5 mm [m]", 0.0, errors[1], order)


def test_corners_are_rounded_off_by_less_than_half_a_diagonal():
    """Where the wall is touched, and there by half a spacing. The gap changes by up to the root of
    three for each metre that a node moves; on a face it is exact.
    """
    rng = np.random.default_rng(8)
    x = SIZE + rng.uniform(-1e-3, 1e-3, (4000, 3))
    exact = distance_to_box(x, SIZE)
    for spacing in (1.03e-3, 0.515e-3):
        grid = solid(SIZE, spacing)
        near = np.abs(exact) < spacing
        error = (grid.gaps(x)["solid"] - exact)[near]
        assert 0.2 * spacing < np.abs(error).max() < 0.5 * np.sqrt(3.0) * spacing
        touching = np.abs(exact[near]) < 0.05 * spacing
        assert np.abs(error[touching]).max() < 0.5 * spacing
        assert 1.0 < grid.steepest() < np.sqrt(3.0) + 1e-9
        above = np.array([[10e-3, y, 5e-3] for y in (3.9e-3, 4e-3, 4.1e-3)])
        np.testing.assert_allclose(grid.gaps(above)["solid"], above[:, 1] - 4e-3, atol=1e-15)


def test_outside_the_box_free_remains_free_and_solid_solid():
    """Of a hollow, and of a solid."""
    points, triangles = box(np.array([4e-3, 5e-3, 6e-3]))
    rng = np.random.default_rng(11)
    far = rng.normal(size=(500, 3))
    far *= 0.1 / np.linalg.norm(far, axis=1)[:, None]
    for name, turned, sign in (("solid", triangles, 1.0), ("hollow", triangles[:, ::-1], -1.0)):
        grid = gridded(name, TriangleSurface(points, turned), 0.5e-3)
        exact = np.linalg.norm(far - np.clip(far, 0.0, points.max(axis=0)), axis=1)
        found = sign * grid.gaps(far)[name]
        assert (found > 0.9 * exact).all()
        assert found.max() < 0.11


def test_far_from_the_wall_the_distance_is_right_to_a_diagonal():
    """At the nodes of a large hollow, up to 20 spacings from its wall, and never too small."""
    points, triangles = sphere(RADIUS, 16)
    surface = TriangleSurface(points, triangles[:, ::-1])
    grid = gridded("hollow", surface, 1e-3)
    index = np.indices(grid.values.shape).reshape(3, -1)
    r = np.linalg.norm(grid.origin[:, None] + grid.spacing * index, axis=0)
    error = np.abs(grid.values.ravel()) - np.abs(RADIUS - r)
    sagitta = np.linalg.norm(surface.ways, axis=2).max() ** 2 / (8.0 * RADIUS)
    assert -1.01 * sagitta < error.min()
    assert 0.1 * grid.spacing < error.max() < np.sqrt(3.0) * grid.spacing + sagitta


def test_a_grid_that_is_too_large_names_a_spacing_that_would_do(monkeypatch):
    monkeypatch.setattr(distance_grid, "MOST_NODES", 20_000)
    with pytest.raises(SpacingError, match=r"nodes, 0.05 mm apart, is too") as refused:
        solid(SIZE, 0.05e-3)
    enough = least_spacing(0.0 * SIZE, SIZE)
    assert f"spacing of the wall to {enough * 1e3:.3g} mm" in refused.value.hint
    assert 10_000 < np.prod(shape_of_grid(0.0 * SIZE, SIZE, enough)) <= 20_000
    assert solid(SIZE, enough).values.size <= 20_000


@pytest.mark.parametrize("thickness, fits", [(0.4e-3, False), (0.9e-3, False), (3e-3, True)])
@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_a_plate_thinner_than_a_cell_is_refused(thickness, turn, fits):
    """Its sides would be free on all nodes: a hole that nobody sees."""
    corners, triangles = box(np.array([20e-3, thickness, 10e-3]))
    c, s = np.cos(turn), np.sin(turn)
    plate = TriangleSurface(corners @ [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]], triangles)
    if fits:
        assert gridded("plate", plate, 1e-3).values.min() < 0.0
        return
    with pytest.raises(SpacingError, match="too thin for its grid"):
        gridded("plate", plate, 1e-3)


@pytest.mark.parametrize("case", ["two that overlap", "one inside out"])
def test_a_surface_without_a_clear_inside_is_refused(case):
    points, triangles = box(np.array([8e-3, 8e-3, 8e-3]))
    overlapping = case == "two that overlap"
    shift = np.array([3e-3, 2e-3, 1e-3]) if overlapping else np.array([12e-3, 0.0, 0.0])
    second = triangles if overlapping else triangles[:, ::-1]
    surface = TriangleSurface(
        np.vstack([points, points + shift]), np.vstack([triangles, second + len(points)])
    )
    with pytest.raises(MeshError, match="no unique inside near"):
        gridded("boxes", surface, 0.6e-3)


# -------------------------------------------------------------------------------------------------
# Exact distances from a closed surface of triangles.

BOX = np.array([4e-3, 2e-3, 3e-3])


def signed(surface, x):
    """Distance of the nearest triangle of all, as a grid would take it: of several as near, any."""
    rng = np.random.default_rng(9)
    numbers = rng.permutation(len(surface.triangles))
    found = np.stack([surface.signed_distances(x, np.full(len(x), k)) for k in numbers])
    return found[np.abs(found).argmin(axis=0), np.arange(len(x))]


def box_distance(x):
    """Signed distance of a box, negative inside (Quilez's closed form)."""
    q = np.abs(x - 0.5 * BOX) - 0.5 * BOX
    return np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0)


@pytest.mark.parametrize("made", [box(BOX), sphere(2e-3, 3)])
def test_the_surfaces_of_these_tests_are_outwards(made):
    points, triangles = made
    directed = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    assert len(np.unique(directed, axis=0)) == len(directed)
    assert np.array_equal(np.unique(directed, axis=0), np.unique(directed[:, ::-1], axis=0))
    assert signed_volume(points, triangles) > 0.0


def test_box_against_its_closed_form():
    """Beside faces, edges and corners, inside and outside; turned over, the other sign."""
    points, triangles = box(BOX)
    x = np.random.default_rng(5).uniform(-2e-3, 6e-3, (4000, 3))
    exact = box_distance(x)
    found = signed(TriangleSurface(points, triangles), x)
    np.testing.assert_allclose(found, exact, atol=1e-17)
    turned = signed(TriangleSurface(points, triangles[:, ::-1]), x)
    np.testing.assert_allclose(turned, -exact, atol=1e-17)


def test_sign_at_a_sharp_corner_with_a_fan_of_triangles():
    """A needle whose tip has many triangles on one side and one on the other: the plain sum of the
    normals would have the wrong sign behind the tip; weighted by angle it is right.
    """
    fan = np.linspace(-0.5, 0.5, 21)
    ring = np.stack([np.ones(21), fan, np.full(21, 0.05)], axis=1)
    points = np.vstack([[[0.0, 0.0, 0.0]], ring, [[1.0, 0.5, -1.0], [1.0, -0.5, -1.0]]])
    one = np.arange(1, 21)
    top = np.stack([np.zeros(20, dtype=int), one, one + 1], axis=1)
    others = [[0, 22, 23], [0, 21, 22], [0, 23, 1]]
    back = np.stack([np.full(20, 23), one + 1, one], axis=1)
    triangles = np.concatenate([top, others, back, [[23, 22, 21]]])
    surface = TriangleSurface(points, triangles)
    assert signed_volume(points, triangles) > 0.0
    # Nearest to the tip, and so outside.
    rng = np.random.default_rng(1)
    x = rng.uniform([-0.3, -0.3, -0.3], [0.05, 0.3, 0.3], (4000, 3))
    found = signed(surface, x)
    at_tip = np.abs(np.abs(found) - np.linalg.norm(x, axis=1)) < 1e-12
    assert at_tip.sum() > 300
    assert (found[at_tip] > 0.0).all()
    arms = x[at_tip]
    plain = surface.normals[(triangles == 0).any(axis=1)].sum(axis=0)
    assert (arms @ plain < 0.0).any()


def test_a_triangle_without_height_has_no_say():
    """A face cut in two by a point on its edge, with a triangle as flat as a line between."""
    points, triangles = box(BOX)
    cut = np.vstack([points, 0.5 * (points[0] + points[1])])
    first = [k for k, t in enumerate(triangles) if {0, 1} <= set(t.tolist())]
    split = []
    for k, t in enumerate(triangles):
        if k == first[0]:
            here = [t.tolist().index(n) for n in (0, 1)]
            for n in here:
                new = t.copy()
                new[n] = 8
                split.append(new)
        else:
            split.append(t)
    # The other triangle at the edge keeps it whole: the sliver 0, 8, 1 closes the hole.
    sliver = np.array([0, 8, 1])
    whole = triangles[first[1]]
    way = (whole.tolist().index(1) - whole.tolist().index(0)) % 3
    split.append(sliver[::-1] if way == 1 else sliver)
    surface = TriangleSurface(cut, np.array(split))
    x = np.random.default_rng(6).uniform(-2e-3, 6e-3, (2000, 3))
    np.testing.assert_allclose(signed(surface, x), box_distance(x), atol=1e-17)


def test_the_picture_is_the_surface_itself():
    points, triangles = box(BOX)
    faces = gridded("block", TriangleSurface(points, triangles), 0.5e-3).drawn()["wall_faces"]
    assert faces.shape == (12, 4, 3)
    np.testing.assert_array_equal(faces[:, :3], points[triangles])
