"""Signed distances from closed surfaces of triangles."""

import numpy as np
import pytest
from surfaces import box, sphere

from softsim.contact.grid import TriangleSurface, gridded
from softsim.mesh.surface import signed_volume

SIZE = np.array([4e-3, 2e-3, 3e-3])


def signed(surface, x):
    """Distance of the nearest triangle of all, as a grid would take it: of several as near, any."""
    rng = np.random.default_rng(9)
    numbers = rng.permutation(len(surface.triangles))
    found = np.stack([surface.signed_distances(x, np.full(len(x), k)) for k in numbers])
    return found[np.abs(found).argmin(axis=0), np.arange(len(x))]


def box_distance(x):
    """Signed distance of a box, negative inside (Quilez's closed form)."""
    q = np.abs(x - 0.5 * SIZE) - 0.5 * SIZE
    return np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0)


@pytest.mark.parametrize("made", [box(SIZE), sphere(2e-3, 3)])
def test_the_surfaces_of_these_tests_are_outwards(made):
    points, triangles = made
    directed = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    assert len(np.unique(directed, axis=0)) == len(directed)
    assert np.array_equal(np.unique(directed, axis=0), np.unique(directed[:, ::-1], axis=0))
    assert signed_volume(points, triangles) > 0.0


def test_box_against_its_closed_form():
    """Beside faces, edges and corners, inside and outside; turned over, the other sign."""
    points, triangles = box(SIZE)
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
    points, triangles = box(SIZE)
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
    points, triangles = box(SIZE)
    faces = gridded("block", TriangleSurface(points, triangles), 0.5e-3).drawn()["wall_faces"]
    assert faces.shape == (12, 4, 3)
    np.testing.assert_array_equal(faces[:, :3], points[triangles])
