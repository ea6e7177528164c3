from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.errors import MeshError
from softsim.mesh.mesh import (
    Mesh,
    boundary_facets,
    facet_keys,
    facet_owners,
    find_rows,
    mirrored,
    of_corners,
    of_one_kind,
    open_rim,
    renumbered,
    signed_volumes,
    simplex_facets,
    simplexes,
    transformed,
    turned,
    with_corners,
)
from softsim.mesh.quality import check, quality
from softsim.robots.block import block, box

TETRAHEDRON = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]), [[0, 1, 2, 3]])


CUBE = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]]
)
PRISM = CUBE[[0, 1, 3, 4, 5, 7]]
PYRAMID = np.vstack([CUBE[:4], [[0.5, 0.5, 1.0]]])

# Points, cells and size of bodies of one cell.
SINGLE = {
    "triangle": (CUBE[[0, 1, 3], :2], [[0, 1, 2]], 1 / 2),
    "quadrilateral": (CUBE[:4, :2], [[0, 1, 2, 3]], 1.0),
    "tetrahedron": (TETRAHEDRON.points, [[0, 1, 2, 3]], 1 / 6),
    "pyramid": (PYRAMID, [[0, 1, 2, 3, 4]], 1 / 3),
    "wedge": (PRISM, [[0, 1, 2, 3, 4, 5]], 1 / 2),
    "hexahedron": (CUBE, [[0, 1, 2, 3, 4, 5, 6, 7]], 1.0),
}
FACET_COUNTS = {
    "triangle": 3,
    "quadrilateral": 4,
    "tetrahedron": 4,
    "pyramid": 5,
    "wedge": 5,
    "hexahedron": 6,
}
LARGEST = {2: 4, 3: 8}


def one_cell(kind: str) -> Mesh:
    """A body of one cell, written with the most corners that a cell can have."""
    points, cells, _ = SINGLE[kind]
    d = points.shape[1]
    return Mesh(points, with_corners(np.array(cells), d, LARGEST[d]))


def outward_area_vectors(mesh: Mesh) -> np.ndarray:
    corners = mesh.points[mesh.facet_sets["surface"]]
    if mesh.dimension == 2:
        d = corners[:, 1] - corners[:, 0]
        return np.column_stack([d[:, 1], -d[:, 0]])
    return np.cross(corners[:, -2] - corners[:, 0], corners[:, -1] - corners[:, 1]) / 2


@pytest.mark.parametrize("mesh", [block(3.0, 2.0, 0.5), TETRAHEDRON], ids=["2D", "3D"])
def test_surface_normals_point_outward_by_the_divergence_theorem(mesh):
    centres = mesh.points[mesh.facet_sets["surface"]].mean(axis=1)
    flux = np.sum(centres * outward_area_vectors(mesh)) / mesh.dimension
    assert flux == pytest.approx(signed_volumes(mesh.points, mesh.cells).sum())
    np.testing.assert_allclose(outward_area_vectors(mesh).sum(axis=0), 0, atol=1e-14)


@pytest.mark.parametrize(("kind", "facets"), FACET_COUNTS.items())
def test_facets_of_a_cell_close_around_it(kind, facets):
    mesh = one_cell(kind)
    surface, areas = mesh.facet_sets["surface"], outward_area_vectors(mesh)
    assert len(surface) == facets
    np.testing.assert_allclose(areas.sum(axis=0), 0, atol=1e-14)
    outward = mesh.points[surface].mean(axis=1) - mesh.points.mean(axis=0)
    assert (np.sum(outward * areas, axis=1) > 0).all()
    assert facet_owners(np.roll(surface, 1, axis=1), mesh.cells).tolist() == [0] * facets


@pytest.mark.parametrize("kind", SINGLE)
def test_volume_of_a_cell(kind):
    mesh, volume = one_cell(kind), SINGLE[kind][2]
    assert signed_volumes(mesh.points, mesh.cells) == pytest.approx([volume])
    assert signed_volumes(mesh.points, turned(mesh.cells, mesh.dimension)) == pytest.approx(
        [-volume]
    )
    check(mesh)
    assert quality(mesh).volume == pytest.approx(volume)


@given(seed=st.integers(0, 2**32 - 1))
def test_volume_of_a_hexahedron_is_that_of_the_trilinear_map(seed):
    points = CUBE + np.random.default_rng(seed).uniform(-0.5, 0.5, CUBE.shape)
    gauss = (1 + np.array([-1, 1]) / np.sqrt(3)) / 2
    volume = 0.0
    for place in product(gauss, repeat=3):
        # The shape function of a corner is the product of these over the coordinates.
        factors = np.where(CUBE == 1.0, place, 1 - np.array(place))
        slopes = 2 * CUBE - 1
        gradients = np.stack(
            [slopes[:, i] * np.delete(factors, i, axis=1).prod(axis=1) for i in range(3)], axis=1
        )
        volume += np.linalg.det(points.T @ gradients) / 8
    assert signed_volumes(points, np.arange(8)[None]) == pytest.approx([volume], abs=1e-12)


def test_cells_of_other_kinds_meet_in_common_facets():
    points = np.vstack([CUBE, [[2, 0, 0], [2, 0, 1], [0.5, 0.5, 2]]])
    hexahedron, wedge, pyramid = np.arange(8), [8, 2, 1, 9, 6, 5], [4, 5, 6, 7, 10]
    cells = of_one_kind([hexahedron[None], np.array([wedge]), np.array([pyramid])], 3)
    mesh = Mesh(points, cells)
    check(mesh)
    surface = {frozenset(f) for f in mesh.facet_sets["surface"].tolist()}
    assert len(surface) == 4 + 4 + 4
    assert not surface & {frozenset([1, 2, 6, 5]), frozenset([4, 5, 6, 7])}
    assert open_rim(mesh.facet_sets["surface"]).shape == (0, 2)
    assert quality(mesh).volume == pytest.approx(1 + 1 / 2 + 1 / 3)
    assert facet_owners(np.array([[10, 5, 4, 4], [6, 9, 8, 2]]), cells).tolist() == [2, 1]
    after = renumbered(mesh)
    check(after)
    assert quality(after).volume == pytest.approx(quality(mesh).volume)


def test_cells_of_all_kinds_are_cut_into_simplexes_that_conform():
    points = np.vstack([CUBE, [[2, 0, 0], [2, 0, 1], [0.5, 0.5, 2]]])
    hexahedron, wedge, pyramid = np.arange(8), [8, 2, 1, 9, 6, 5], [4, 5, 6, 7, 10]
    cells = of_one_kind([hexahedron[None], np.array([wedge]), np.array([pyramid])], 3)
    for order in np.random.default_rng(1).permuted(np.tile(np.arange(11), (20, 1)), axis=1):
        moved = np.empty_like(points)
        moved[order] = points
        cut = simplexes(order[cells], 3)
        check(Mesh(moved, cut))
        volumes = signed_volumes(moved, cut)
        assert volumes.sum() == pytest.approx(1 + 1 / 2 + 1 / 3)
        sides, numbers = simplex_facets(boundary_facets(order[cells], 3))
        assert {frozenset(f) for f in sides.tolist()} == {
            frozenset(f) for f in boundary_facets(cut, 3).tolist()
        }
        assert np.bincount(numbers).max() == 2


def test_quadrilaterals_are_cut_into_triangles():
    cut = simplexes(np.array([[3, 0, 1, 2], [2, 1, 4, 4]]), 2)
    assert cut.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]
    edges = np.array([[0, 1], [1, 2]])
    assert simplex_facets(edges)[0].tolist() == edges.tolist()


@pytest.mark.parametrize(
    "mesh", [block(3.0, 2.0, 1.0), box(2.0, 1.0, 1.0, 1.0)], ids=["triangles", "tetrahedra"]
)
def test_a_mesh_written_with_more_corners_is_the_same_body(mesh):
    corners = LARGEST[mesh.dimension]
    after = of_corners(mesh, corners)
    check(after)
    assert after.cells.shape == (len(mesh.cells), corners)
    q = quality(mesh), quality(after)
    assert q[0].volume == pytest.approx(q[1].volume)
    assert q[0].cell_kinds == q[1].cell_kinds
    for name, facets in mesh.facet_sets.items():
        assert {frozenset(f) for f in facets.tolist()} == {
            frozenset(f) for f in after.facet_sets[name].tolist()
        }
        assert len(facets) == len(after.facet_sets[name])
    assert of_corners(mesh, mesh.cells.shape[1]).cells.tolist() == mesh.cells.tolist()


def test_triangles_beside_quadrilaterals():
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [2, 0.5]])
    cells = of_one_kind([np.array([[0, 1, 2, 3]]), np.array([[1, 4, 2]])], 2)
    mesh = Mesh(points, cells)
    check(mesh)
    assert mesh.facet_sets["surface"].tolist() == [[0, 1], [2, 3], [3, 0], [1, 4], [4, 2]]
    assert signed_volumes(points, cells).tolist() == [1.0, 0.5]


def test_boundary_of_two_triangles_leaves_out_their_common_edge():
    facets = boundary_facets(np.array([[0, 1, 2], [0, 2, 3]]), 2)
    assert facets.tolist() == [[0, 1], [1, 2], [2, 3], [3, 0]]


def test_signed_volume_changes_sign_with_orientation():
    points = np.array([[0, 0], [2, 0], [0, 3.0]])
    assert signed_volumes(points, np.array([[0, 1, 2], [0, 2, 1]])).tolist() == [3.0, -3.0]
    assert signed_volumes(TETRAHEDRON.points, TETRAHEDRON.cells)[0] == pytest.approx(1 / 6)


def test_surface_names_the_whole_boundary():
    mesh = block(3.0, 2.0, 1.0)
    assert len(mesh.facet_sets["surface"]) == 10
    assert len(mesh.node_sets["surface"]) == 10


@pytest.mark.parametrize(
    ("points", "cells", "said"),
    [
        (np.zeros((4, 1)), [[0, 1, 2]], r"points have the shape \(4, 1\)"),
        (np.zeros((4, 3)), [[0, 1, 2]], r"cells: the shape is \(1, 3\); \(k, 4\) or \(k, 8\)"),
        (np.zeros((4, 2)), [[0, 1]], r"cells: the shape is \(1, 2\); \(k, 3\) or \(k, 4\)"),
    ],
)
def test_arrays_of_another_shape_are_refused(points, cells, said):
    with pytest.raises(MeshError, match=said):
        Mesh(points, cells)


@given(angle=st.floats(-7, 7), x=st.floats(-1, 1), y=st.floats(-1, 1))
def test_transformed_keeps_shape_and_sets(angle, x, y):
    mesh = block(3.0, 2.0, 1.0)
    moved = transformed(mesh, angle, np.array([x, y]))
    check(moved)
    assert quality(moved).volume == pytest.approx(6.0)
    assert moved.node_sets.keys() == mesh.node_sets.keys()


def test_transformed_turns_first_and_counter_clockwise():
    corner = transformed(block(2.0, 1.0, 1.0), np.pi / 2, np.array([5.0, 0.0]))
    np.testing.assert_allclose(corner.points.min(axis=0), [4, -1], atol=1e-12)
    np.testing.assert_allclose(corner.points.max(axis=0), [5, 1], atol=1e-12)


@pytest.mark.parametrize(("kind", "axis"), [(k, a) for k in SINGLE for a in (0, 1)])
def test_a_mirror_image_is_as_sound_as_the_mesh(kind, axis):
    mesh = one_cell(kind)
    image = mirrored(replace(mesh, facet_sets={"all": mesh.facet_sets["surface"]}), axis)
    check(image)
    assert quality(image).volume == pytest.approx(quality(mesh).volume)
    np.testing.assert_array_equal(image.points[:, axis], -mesh.points[:, axis])
    # As cells list them, but for the corner that comes first: material is on the same side.
    along = find_rows(facet_keys(image.facet_sets["all"]), facet_keys(image.facet_sets["surface"]))
    assert sorted(along) == list(range(len(along)))
    np.testing.assert_allclose(
        outward_areas(image, "all"), outward_areas(image, "surface")[along], atol=1e-15
    )


def outward_areas(mesh: Mesh, name: str) -> np.ndarray:
    """Of each facet its size, out of the body."""
    corners = mesh.points[mesh.facet_sets[name]]
    if mesh.dimension == 2:
        along = corners[:, 1] - corners[:, 0]
        return np.column_stack([along[:, 1], -along[:, 0]])
    ends = np.roll(corners, -1, axis=1)
    return 0.5 * np.cross(corners, ends).sum(axis=1)


def shuffled(mesh: Mesh, seed: int) -> Mesh:
    rng = np.random.default_rng(seed)
    old = rng.permutation(len(mesh.points))
    new = np.argsort(old)
    return Mesh(
        mesh.points[old],
        new[mesh.cells],
        {name: new[s] for name, s in mesh.node_sets.items()},
        {name: new[s] for name, s in mesh.facet_sets.items()},
        {"left half": np.flatnonzero(mesh.points[mesh.cells].mean(axis=1)[:, 0] < 0)},
    )


@given(seed=st.integers(0, 2**32 - 1))
def test_renumbered_is_the_same_body_with_the_same_sets(seed):
    before = shuffled(block(4.0, 1.0, 0.25), seed)
    after = renumbered(before)
    check(after)
    for name in ("top", "left"):
        for kind in ("node_sets", "facet_sets"):
            np.testing.assert_array_equal(
                after.points[getattr(after, kind)[name]], before.points[getattr(before, kind)[name]]
            )
    half = after.cell_sets["left half"]
    assert (after.points[after.cells[half]].mean(axis=1)[:, 0] < 0).all()
    assert len(half) == len(before.cell_sets["left half"])


def test_renumbered_brings_neighbours_close():
    def bandwidth(mesh: Mesh) -> int:
        return int(np.ptp(mesh.cells, axis=1).max())

    before = shuffled(block(10.0, 1.0, 0.25), seed=1)
    after = renumbered(before)
    assert bandwidth(after) <= 10 < bandwidth(before)
    assert (np.diff(after.cells.min(axis=1)) >= 0).all()


def test_the_rim_of_edges_is_their_loose_ends():
    assert open_rim(np.array([[3, 1], [1, 4], [4, 2], [7, 8]])).tolist() == [[2], [3], [7], [8]]
    closed = open_rim(block(3.0, 2.0, 1.0).facet_sets["surface"])
    assert closed.shape == (0, 1)


def test_the_rim_of_triangles_runs_against_them_and_closes():
    assert open_rim(np.array([[0, 1, 2]])).tolist() == [[1, 0], [2, 1], [0, 2]]
    surface = TETRAHEDRON.facet_sets["surface"]
    assert open_rim(surface).shape == (0, 2)
    cup = surface[1:]
    lid = open_rim(cup)
    centre = np.full((len(lid), 1), 4)
    assert len(lid) == 3
    assert open_rim(np.vstack([cup, np.hstack([lid, centre])])).shape == (0, 2)
    points = np.vstack([TETRAHEDRON.points, TETRAHEDRON.points[surface[0]].mean(axis=0)])
    corners = points[np.vstack([cup, np.hstack([lid, centre])])]
    volume = np.linalg.det(corners).sum() / 6
    assert volume == pytest.approx(1 / 6)


@pytest.mark.parametrize("width", [2, 3])
def test_the_rim_of_nothing_is_nothing(width):
    assert open_rim(np.zeros((0, width), dtype=np.int64)).shape == (0, width - 1)


@given(seed=st.integers(0, 2**32 - 1), width=st.integers(1, 3), count=st.integers(0, 20))
def test_find_rows_says_where_a_row_is(seed, width, count):
    rng = np.random.default_rng(seed)
    among = np.unique(rng.integers(-2, 3, (count, width)), axis=0)
    rows = rng.integers(-2, 3, (10, width))
    listed = among.tolist()
    expected = [listed.index(row) if row in listed else -1 for row in rows.tolist()]
    assert find_rows(rows, among).tolist() == expected


def test_boundary_of_many_tetrahedra_does_not_depend_on_the_order_of_corners():
    cells = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    facets = {frozenset(facet) for facet in boundary_facets(cells, 3).tolist()}
    assert len(facets) == 6
    assert frozenset([1, 2, 3]) not in facets
