import numpy as np
import pytest

from softsim.errors import MeshError
from softsim.mesh.mesh import signed_volumes
from softsim.mesh.quality import quality
from softsim.robots.pfr import pfr_section
from softsim.robots.spikes import spike_patch
from softsim.scene.meshes import SpikePatchMesh


def patch(**change):
    """A patch as a scene asks for it that says nothing but `change`."""
    asked = SpikePatchMesh(generator="spike_patch").model_dump(exclude={"generator"})
    return spike_patch(**{**asked, **change})


DEFAULT = patch()


def spike_volume():
    """Of one spike of the fine plane section, 2 mm wide."""
    fine = pfr_section(element_size=0.1e-3)
    return signed_volumes(fine.points, fine.cells[fine.cell_sets["spikes"]]).sum() / 10 * 2e-3


@pytest.mark.parametrize(("rows", "columns"), [(5, 3), (1, 1), (2, 4)])
def test_skin_and_spikes_fill_their_volumes(rows, columns):
    mesh = patch(rows=rows, columns=columns)
    skin, spikes = (
        signed_volumes(mesh.points, mesh.cells[mesh.cell_sets[name]]).sum()
        for name in ("skin", "spikes")
    )
    assert skin == pytest.approx(rows * 6e-3 * columns * 3.59e-3 * 1e-3, rel=1e-9)
    assert spikes == pytest.approx(rows * columns * spike_volume(), rel=0.03)


def test_the_samples_middle_is_the_origin_and_spikes_point_up_and_lean_back():
    low, high = DEFAULT.points.min(axis=0), DEFAULT.points.max(axis=0)
    np.testing.assert_allclose([low, high], [[-15e-3, 0, -5.385e-3], [15e-3, 6e-3, 5.385e-3]])
    tips = DEFAULT.points[DEFAULT.node_sets["tips"]]
    np.testing.assert_allclose(tips[:, 1], 6e-3)
    np.testing.assert_allclose(np.unique(np.round(tips[:, 2], 9)), np.ravel(
        [[z - 1e-3, z, z + 1e-3] for z in (-3.59e-3, 0, 3.59e-3)]
    ), atol=1e-12)  # fmt: skip
    front = DEFAULT.points[DEFAULT.node_sets["j1"], 0]
    assert front.min() == pytest.approx(12e-3 - 3e-3) and front.max() < 12e-3 + 1.5e-3


def test_all_spikes_are_alike():
    volumes = signed_volumes(DEFAULT.points, DEFAULT.cells)
    spikes = DEFAULT.cell_sets["spikes"]
    x, _, z = DEFAULT.points[DEFAULT.cells[spikes]].mean(axis=1).T
    column = np.round(z / 3.59e-3).astype(int) + 1
    row = np.floor((x + 15e-3 + 0.5e-3) / 6e-3).astype(int)
    np.testing.assert_allclose(
        np.bincount(3 * row + column, volumes[spikes]), volumes[spikes].sum() / 15
    )


@pytest.mark.parametrize("cells", ["quad", "simplex"])
def test_sides(cells):
    mesh = patch(cells=cells, columns=2)
    under = np.flatnonzero(mesh.points[:, 1] == 0)
    np.testing.assert_array_equal(np.sort(mesh.node_sets["underside"]), under)
    assert set(mesh.facet_sets) == {"underside", "outer", "spikes", "surface"}

    def area(name):
        corners = mesh.points[mesh.facet_sets[name]]
        return (np.cross(corners[:, -2] - corners[:, 0], corners[:, -1] - corners[:, 1]) / 2).sum(0)

    size = 30e-3 * 2 * 3.59e-3
    np.testing.assert_allclose(area("underside"), [0, -size, 0], atol=1e-15)
    np.testing.assert_allclose(area("outer"), [0, size - 10 * 6e-6, 0], atol=1e-15)
    np.testing.assert_allclose(area("surface"), 0, atol=1e-15)
    assert quality(mesh).worst_aspect_ratio < 6


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"rows": 0}, "rows is 0; it must be 1 or more"),
        ({"columns": 0}, "columns is 0; it must be 1 or more"),
        ({"skin_thickness": 0.0}, "skin_thickness is 0 mm; it must be positive"),
        ({"lean": -1e-3}, "lean is -1 mm"),
        ({"spike_pitch": 3e-3}, "spike_pitch is 3 mm and the spikes overlap; .* 3.7 mm"),
        ({"column_pitch": 2.5e-3}, "column_pitch is 2.5 mm and the columns overlap; .* 2.7 mm"),
        ({"front_radius": 3e-3}, "front_radius is 3 mm; .* at least 3.725 mm"),
        (
            {"cells": "simplex", "spike_layers": 2},
            "spike_layers is 2; for triangles and tetrahedra",
        ),
    ],
)
def test_parameters_out_of_range_are_named_with_their_limit(change, said):
    with pytest.raises(MeshError, match=said):
        patch(**change)
