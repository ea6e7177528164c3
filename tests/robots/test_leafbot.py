"""Leafbot: its section, and in space."""

import numpy as np
import pytest

from softsim.errors import MeshError
from softsim.mesh.mesh import SURFACE, signed_volumes
from softsim.mesh.quality import quality
from softsim.robots.leafbot import leafbot_section, leafbot_solid
from softsim.scene.meshes import LeafbotSolidMesh


@pytest.mark.parametrize("cells", ["quad", "simplex"])
@pytest.mark.parametrize("rows, pitch, under_head", [(3, 28e-3, 1), (5, 14e-3, 2), (9, 7e-3, 3)])
def test_rows_of_limbs_stand_on_the_ground(cells, rows, pitch, under_head):
    mesh = leafbot_section(
        rows=rows,
        limb_pitch=pitch,
        rows_under_head=under_head,
        cells=cells,
        element_size=0.5e-3,
    )
    x, y = mesh.points.T
    assert (x.min(), x.max()) == pytest.approx((-32e-3, 32e-3))
    assert (y.min(), y.max()) == pytest.approx((0.0, 7e-3), abs=1e-12)
    assert y[mesh.node_sets["tips"]] == pytest.approx(0.0, abs=1e-12)
    # They lean backward, and count from the front.
    middles = (np.arange(rows)[::-1] - (rows - 1) / 2) * pitch
    for number, middle in enumerate(middles, start=1):
        limb = mesh.node_sets[f"limb{number}"]
        assert y[limb].max() < 5e-3
        on_ground = limb[y[limb] < 1e-9]
        assert x[on_ground].mean() == pytest.approx(middle - 2.5e-3)
    assert f"limb{rows + 1}" not in mesh.node_sets
    top, head = mesh.node_sets["top"], mesh.node_sets["head"]
    assert y[top] == pytest.approx(7e-3)
    assert set(head) <= set(top)
    reach = middles[0] + 2e-3, middles[under_head - 1] - 2e-3
    assert (x[head].max(), x[head].min()) == pytest.approx(reach, abs=0.5e-3)  # a cell


def test_cells_are_those_of_backbone_and_limbs():
    mesh = leafbot_section()
    volumes = signed_volumes(mesh.points, mesh.cells)
    assert (volumes > 0.0).all()
    assert volumes[mesh.cell_sets["backbone"]].sum() == pytest.approx(64e-3 * 2e-3)
    both = np.concatenate([mesh.cell_sets["backbone"], mesh.cell_sets["limbs"]])
    np.testing.assert_array_equal(np.sort(both), np.arange(len(mesh.cells)))


def test_the_top_faces_upward():
    mesh = leafbot_section()
    edges = mesh.facet_sets["top"]
    along = mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]]
    assert (along[:, 0] < 0.0).all()  # (dy, -dx) points out of the body
    surface = {frozenset(edge) for edge in mesh.facet_sets[SURFACE].tolist()}
    assert {frozenset(edge) for edge in edges.tolist()} <= surface


def test_a_straight_limb():
    """Arcs of large radii between a root and a tip as thick: a bar inclined by 57 degrees."""
    lean = 5e-3 / np.tan(np.radians(57.0))
    mesh = leafbot_section(
        root_thickness=2e-3, tip_thickness=2e-3, lean=lean, front_radius=1.0, rear_radius=1.0
    )
    limb = signed_volumes(mesh.points, mesh.cells)[mesh.cell_sets["limbs"]].sum()
    assert limb == pytest.approx(5 * 5e-3 * 2e-3, rel=1e-3)


@pytest.mark.parametrize(
    "change, said",
    [
        ({"rows": 6}, "length is 64 mm; 6 rows of limbs"),
        ({"root_thickness": 15e-3}, "limb_pitch is 14 mm and the limbs overlap"),
        ({"rows_under_head": 6}, "rows_under_head is 6; it may be 1 to 5, all rows"),
        ({"thickness": 0.0}, "thickness is 0 mm; it must be positive"),
        ({"cells": "simplex", "limb_columns": 2}, "limb_columns is 2; for triangles"),
        ({"cells": "simplex", "tip_thickness": 0.5e-3}, "the limb is .* thick"),
    ],
)
def test_parameters_out_of_range_are_named_with_their_limit(change, said):
    with pytest.raises(MeshError, match=said):
        leafbot_section(**change)


# -------------------------------------------------------------------------------------------------
# Leafbot in space.


def robot(**change):
    """A robot as a scene asks for it that says nothing but `change`."""
    asked = LeafbotSolidMesh(generator="leafbot_solid").model_dump(exclude={"generator"})
    return leafbot_solid(**{**asked, **change})


DEFAULT = robot()


@pytest.mark.parametrize("cells", ["quad", "simplex"])
@pytest.mark.parametrize("rows", [3, 5])
def test_rows_of_limbs_stand_on_the_ground_on_both_sides(cells, rows):
    mesh = robot(rows=rows, cells=cells)
    x, y, z = mesh.points.T
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    assert low == pytest.approx([-32e-3, 0.0, -22.5e-3], abs=1e-12)
    assert high == pytest.approx([32e-3, 7e-3, 22.5e-3])
    assert y[mesh.node_sets["tips"]] == pytest.approx(0.0, abs=1e-12)
    # They lean backward, and count from the front.
    middles = (np.arange(rows)[::-1] - (rows - 1) / 2) * 14e-3
    for number, middle in enumerate(middles, start=1):
        for side, sign in (("left", -1.0), ("right", 1.0)):
            limb = mesh.node_sets[f"limb{number}_{side}"]
            assert y[limb].max() < 5e-3
            assert x[limb[y[limb] < 1e-9]].mean() == pytest.approx(middle - 2.5e-3)
            across = sign * z[limb]
            assert across.min() == pytest.approx(7.5e-3) and across.max() == pytest.approx(22.5e-3)
            assert not ((across > 9.5e-3 + 1e-9) & (across < 20.5e-3 - 1e-9)).any()
    assert f"limb{rows + 1}_left" not in mesh.node_sets


@pytest.mark.parametrize("width", [45e-3, 50e-3])
def test_backbone_and_limbs_fill_their_volumes(width):
    """Limbs are as wide as they are said to be, the backbone fills the whole width."""
    mesh = robot(width=width)
    backbone, limbs = (
        signed_volumes(mesh.points, mesh.cells[mesh.cell_sets[name]]).sum()
        for name in ("backbone", "limbs")
    )
    assert backbone == pytest.approx(64e-3 * width * 2e-3, rel=1e-9)
    fine = leafbot_section(element_size=0.1e-3)
    area = signed_volumes(fine.points, fine.cells[fine.cell_sets["limbs"]]).sum()
    assert limbs == pytest.approx(4 * 2e-3 * area, rel=0.03)
    both = np.concatenate([mesh.cell_sets["backbone"], mesh.cell_sets["limbs"]])
    np.testing.assert_array_equal(np.sort(both), np.arange(len(mesh.cells)))


def test_both_sides_are_mirror_images():
    def places(points):
        rounded = np.round(points, 9) + 0.0
        return rounded[np.lexsort(rounded.T)]

    mirror = DEFAULT.points * [1.0, 1.0, -1.0]
    np.testing.assert_array_equal(places(mirror), places(DEFAULT.points))
    sets = DEFAULT.node_sets
    for name in ("head", "limb1", "limb5"):
        left, right = mirror[sets[f"{name}_left"]], DEFAULT.points[sets[f"{name}_right"]]
        np.testing.assert_array_equal(places(left), places(right))


@pytest.mark.parametrize(("row", "rows"), [(1, 1), (3, 1), (5, 1), (1, 2)])
def test_a_head_stands_on_its_rows(row, rows):
    mesh = robot(head_row=row, rows_under_head=rows)
    sets = mesh.node_sets
    np.testing.assert_array_equal(sets["heads"], [*sets["head_left"], *sets["head_right"]])
    assert set(sets["heads"]) <= set(sets["top"])
    x, y, z = mesh.points[sets["head_right"]].T
    assert y == pytest.approx(7e-3)
    front, rear = (3 - row) * 14e-3 + 2e-3, (3 - row - rows + 1) * 14e-3 - 2e-3
    assert (x.max(), x.min()) == pytest.approx((front, rear))
    assert (z.min(), z.max()) == pytest.approx((7.5e-3, 22.5e-3))


@pytest.mark.parametrize("cells", ["quad", "simplex"])
def test_the_top_in_space_faces_upward(cells):
    mesh = robot(cells=cells)
    corners = mesh.points[mesh.facet_sets["top"]]
    area = (np.cross(corners[:, -2] - corners[:, 0], corners[:, -1] - corners[:, 1]) / 2).sum(0)
    np.testing.assert_allclose(area, [0.0, 64e-3 * 45e-3, 0.0], atol=1e-15)
    assert (signed_volumes(mesh.points, mesh.cells) > 0.0).all()
    assert quality(mesh).worst_aspect_ratio < 8


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"rows": 6}, "length is 64 mm; 6 rows of limbs"),
        ({"head_row": 6}, "the heads stand on rows 6 to 6; there are 5"),
        ({"head_row": 5, "rows_under_head": 2}, "the heads stand on rows 5 to 6; there are 5"),
        ({"head_row": 0}, "head_row is 0; it must be 1 or more"),
        ({"width": 44e-3}, "width is 44 mm; .* need at least 45 mm"),
        ({"limb_distance": 2e-3}, "limb_distance is 2 mm and the limbs of a side overlap"),
        ({"side_distance": 15e-3}, "side_distance is 15 mm .* more than 15 mm is needed"),
        ({"limb_width": 0.0}, "limb_width is 0 mm; it must be positive"),
        ({"lean": -1e-3}, "lean is -1 mm"),
        ({"cells": "simplex", "limb_layers": 2}, "limb_layers is 2; for triangles and tetrahedra"),
    ],
)
def test_parameters_in_space_out_of_range_are_named_with_their_limit(change, said):
    with pytest.raises(MeshError, match=said):
        robot(**change)
