import time
from dataclasses import replace

import numpy as np
import pytest

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, with_corners
from softsim.mesh.quality import Labels, check, piece_count, quality

SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
QUADRILATERAL = np.array([[0, 1, 2, 3]])
CUBE = np.vstack([np.column_stack([SQUARE, np.full(4, z)]) for z in (0.0, 1.0)])
SOUND = Mesh(SQUARE, HALVES)


def moved(node: int, place: list[float]) -> Mesh:
    points = SQUARE.copy()
    points[node] = place
    return Mesh(points, HALVES)


FAULTS = {
    "inverted": (
        Mesh(SQUARE, [[0, 1, 2], [0, 3, 2]]),
        r"cell 1 at \(333.333, 666.667\) mm is inverted",
    ),
    "flat": (moved(1, [0.5, 0.5]), r"cell 0 at .* is flat: area 0"),
    "repeated corner": (Mesh(SQUARE, [*HALVES, [0, 1, 1]]), "cell 2 at .* is flat"),
    "not finite": (moved(2, [np.nan, 1]), r"node 2 has the coordinates \[nan, 1.0\]"),
    "loose node": (
        Mesh(np.vstack([SQUARE, [2, 3]]), HALVES),
        r"node 4 at \(2000, 3000\) mm belongs to no cell",
    ),
    "double node": (
        Mesh(np.vstack([SQUARE, SQUARE[2] + 1e-12]), [[0, 1, 2], [0, 4, 3]]),
        r"nodes 2 and 4 are at the same place, \(1000, 1000\) mm",
    ),
    "cell out of range": (Mesh(SQUARE, [[0, 1, 9]]), "the cells: node number 9 is out of range"),
    "set out of range": (
        replace(SOUND, node_sets={"tip": [-1]}),
        "node set 'tip': node number -1 is out of range; the mesh has nodes 0 to 3",
    ),
    "cell set out of range": (
        replace(SOUND, cell_sets={"skin": [2]}),
        "cell set 'skin': cell number 2 is out of range; the mesh has cells 0 to 1",
    ),
    "empty set": (replace(SOUND, node_sets={"tip": []}), "node set 'tip' is empty"),
    "inner facet": (
        replace(SOUND, facet_sets={"wall": [[0, 2]]}),
        r"facet set 'wall': facet \[0, 2\] at \(500, 500\) mm is not a boundary facet",
    ),
    "turned facet": (
        replace(SOUND, facet_sets={"wall": [[1, 0]]}),
        r"facet set 'wall': facet \[1, 0\] at \(500, 0\) mm is not a boundary facet",
    ),
    "cell twice": (
        Mesh(SQUARE, [*HALVES, [2, 3, 0]]),
        "cell 1 and cell 2, at .*, lie on the same side of a common facet",
    ),
    "inside out at a corner": (
        Mesh(np.vstack([SQUARE[:2], [[0.3, 0.3]], SQUARE[3:]]), QUADRILATERAL),
        r"cell 0 at \(325, 325\) mm is inside out at its node 2",
    ),
    "flat at a corner": (
        Mesh(np.vstack([SQUARE[:2], [[0.5, 0.5]], SQUARE[3:]]), QUADRILATERAL),
        "cell 0 at .* is flat at its node 2",
    ),
    "corners crosswise": (Mesh(SQUARE, [[0, 1, 3, 2]]), "cell 0 at .* is twisted.*: area 0"),
    "hexahedron with a corner pushed through": (
        Mesh(np.vstack([CUBE[:6], [[0.2, 0.2, 0.2]], CUBE[7:]]), [range(8)]),
        "cell 0 at .* is inside out at its node 6",
    ),
    "quadrilateral on triangles": (
        Mesh(
            np.vstack([CUBE, [[0, 0, 2]]]),
            [range(8), [4, 5, 6, 6, 8, 8, 8, 8], [4, 6, 7, 7, 8, 8, 8, 8]],
        ),
        "cell 0 and cell 1, at .*, meet with a quadrilateral and a triangle",
    ),
    "no cells": (Mesh(SQUARE, np.zeros((0, 3))), "the mesh has no cells"),
}


@pytest.mark.parametrize(("mesh", "said"), FAULTS.values(), ids=FAULTS)
def test_check_names_the_fault_and_its_place(mesh, said):
    with pytest.raises(MeshError, match=said):
        check(mesh)


def test_facets_of_tetrahedra_may_start_at_any_corner_but_not_turn():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    check(Mesh(points, [[0, 1, 2, 3]], facet_sets={"base": [[2, 1, 0]]}))
    with pytest.raises(MeshError, match="not a boundary facet"):
        check(Mesh(points, [[0, 1, 2, 3]], facet_sets={"base": [[0, 1, 2]]}))


def test_check_is_the_same_at_any_size():
    for size in (1e-6, 1.0, 1e6):
        check(replace(SOUND, points=size * SQUARE))
        with pytest.raises(MeshError, match="flat"):
            check(replace(moved(1, [0.5, 0.5]), points=size * moved(1, [0.5, 0.5]).points))


def test_quality_of_a_three_four_five_triangle():
    measured = quality(Mesh(np.array([[0, 0], [4, 0], [0, 3.0]]), [[0, 1, 2]]))
    assert (measured.node_count, measured.cell_count) == (3, 1)
    assert measured.volume == pytest.approx(6)
    assert measured.smallest_altitude == pytest.approx(12 / 5)
    assert measured.smallest_angle == pytest.approx(np.arctan(3 / 4))
    assert measured.largest_angle == pytest.approx(np.pi / 2)
    assert measured.worst_aspect_ratio == pytest.approx(np.sqrt(3) / 2 * 5 / 2.4)


def test_quality_finds_the_lowest_cell():
    measured = quality(Mesh(np.vstack([SQUARE, [0.5, -0.1]]), [*HALVES, [0, 4, 1]]))
    assert measured.smallest_altitude == pytest.approx(0.1)
    assert measured.smallest_altitude_cell == 2


def test_equilateral_cells_have_aspect_ratio_one():
    triangle = Mesh(np.array([[0, 0], [1, 0], [0.5, np.sqrt(0.75)]]), [[0, 1, 2]])
    corners = np.array([[1, 1, 1], [-1, -1, 1], [1, -1, -1], [-1, 1, -1.0]])
    tetrahedron = Mesh(corners, [[0, 2, 1, 3]])
    check(tetrahedron)
    for mesh in (triangle, tetrahedron):
        assert quality(mesh).worst_aspect_ratio == pytest.approx(1)
    dihedral = quality(tetrahedron)
    assert dihedral.smallest_angle == pytest.approx(np.arccos(1 / 3))
    assert dihedral.smallest_altitude == pytest.approx(np.sqrt(8) * np.sqrt(2 / 3))
    assert dihedral.volume == pytest.approx(8 / 3)


@pytest.mark.parametrize(
    "mesh", [Mesh(SQUARE, QUADRILATERAL), Mesh(CUBE, [range(8)])], ids=["square", "cube"]
)
def test_a_square_and_a_cube_are_the_best(mesh):
    q = quality(mesh)
    assert q.worst_aspect_ratio == pytest.approx(1.0)
    assert q.smallest_altitude == pytest.approx(1.0)
    assert (q.smallest_angle, q.largest_angle) == pytest.approx((np.pi / 2, np.pi / 2))


def test_cells_are_counted_by_their_kind():
    points = np.vstack([SQUARE, [[2, 0.5]]])
    assert quality(Mesh(points, [[0, 1, 2, 3], [1, 4, 2, 2]])).cell_kinds == {
        "triangles": 1,
        "quadrilaterals": 1,
    }
    assert quality(SOUND).cell_kinds == {"triangles": 2}
    assert quality(Mesh(CUBE, [range(8)])).cell_kinds == {"hexahedra": 1}


def test_quality_of_a_sheared_brick():
    sheared = CUBE * [3.0, 2.0, 1.0]
    sheared[:, 0] += sheared[:, 2]
    q = quality(Mesh(sheared, [range(8)]))
    assert q.smallest_altitude == pytest.approx(1.0)
    assert q.worst_aspect_ratio == pytest.approx(3.0)
    assert (q.smallest_angle, q.largest_angle) == pytest.approx((np.pi / 4, 3 * np.pi / 4))


def test_a_collapsed_cell_is_measured_as_what_it_has_become():
    wedge = Mesh(
        np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0], [0, 0, 5], [3, 0, 5], [0, 4, 5.0]]),
        with_corners(np.arange(6)[None], 3, 8),
    )
    triangle = Mesh(wedge.points[:3, :2], [[0, 1, 2]])
    for name in ("smallest_altitude", "smallest_angle"):
        assert getattr(quality(wedge), name) == pytest.approx(getattr(quality(triangle), name))


def test_faults_are_named_as_the_file_names_nodes_and_cells():
    labels = Labels(nodes=np.array([11, 12, 13, 14, 15]), cells=np.array([101, 102]))
    double = Mesh(np.vstack([SQUARE, SQUARE[2] + 1e-12]), [[0, 1, 2], [0, 4, 3]])
    with pytest.raises(MeshError, match="nodes 13 and 15 are at the same place"):
        check(double, labels)
    with pytest.raises(MeshError, match=r"element 102 at .* is inverted"):
        check(Mesh(SQUARE, [[0, 1, 2], [0, 3, 2]]), labels)


def test_a_folded_mesh_is_refused():
    points = np.vstack([SQUARE, [0.8, 0.1]])
    with pytest.raises(MeshError, match=r"cell 0 and cell 2, .* same side of a common facet"):
        check(Mesh(points, [*HALVES, [0, 4, 2]]))


def test_pieces_share_no_node():
    assert piece_count(SOUND) == 1
    two = Mesh(np.vstack([SQUARE, SQUARE + 2]), [*HALVES, *(HALVES + 4)])
    assert piece_count(two) == 2
    assert quality(two).describe().endswith("45 deg to 90 deg, 2 unconnected pieces")
    at_a_corner = Mesh(np.vstack([SQUARE, SQUARE[1:] + 1]), [*HALVES, [2, 4, 5], [2, 5, 6]])
    assert quality(at_a_corner).piece_count == 1


@pytest.mark.physics
def test_a_mesh_of_half_a_million_tetrahedra_is_checked_at_once():
    n = 44
    grid = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corner = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    x, y, z = (n + 1) ** 2, n + 1, 1
    ways = [(x, x + y), (y, y + z), (z, z + x)]
    turned = [(x + z, x), (x + y, y), (y + z, z)]
    steps = np.array(
        [[0, a, ab, x + y + z] for a, ab in ways] + [[0, ab, b, x + y + z] for ab, b in turned]
    )
    cells = (corner[:-1, :-1, :-1].reshape(-1, 1, 1) + steps).reshape(-1, 4)
    mesh = Mesh(grid, cells)
    assert len(cells) > 500_000
    start = time.perf_counter()
    check(mesh)
    assert time.perf_counter() - start < 20
