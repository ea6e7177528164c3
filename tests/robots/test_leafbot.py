"""The section of Leafbot."""

import numpy as np
import pytest

from softsim.errors import MeshError
from softsim.mesh.mesh import SURFACE, signed_volumes
from softsim.robots.leafbot import leafbot_section


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
