"""Half of a pneu-net, and a quadruped of four."""

import numpy as np
import pytest

from softsim.elements.solid import Solid
from softsim.errors import MeshError
from softsim.mesh.mesh import open_rim, signed_volumes
from softsim.robots.pneunet import pneunet, quadruped


@pytest.mark.parametrize("cells", ["quad", "simplex"])
@pytest.mark.parametrize("chambers", [1, 3])
def test_chambers_stand_on_a_common_channel(cells, chambers):
    mesh = pneunet(chambers=chambers, cells=cells, element_size=2e-3)
    length = chambers * 8e-3 + (chambers - 1) * 1e-3
    assert mesh.points.min(axis=0) == pytest.approx([0.0, 0.0, 0.0])
    assert mesh.points.max(axis=0) == pytest.approx([length, 14e-3, 7.5e-3])
    section = chambers * 5e-3 * 10e-3 + (chambers - 1) * 4e-3 * 2e-3  # chambers, channel between
    inside = 6e-3 * section
    gaps = (chambers - 1) * 1e-3 * (14e-3 - 6e-3) * 7.5e-3
    volume = signed_volumes(mesh.points, mesh.cells).sum()
    assert volume == pytest.approx(length * 14e-3 * 7.5e-3 - inside - gaps, rel=1e-12)

    # The plane of symmetry closes the inside and adds no volume to it.
    chamber = mesh.facet_sets["chamber"]
    rim = np.unique(open_rim(chamber))
    np.testing.assert_array_equal(mesh.points[rim, 2], 0.0)
    assert Solid().enclosed_volume(mesh.points, chamber) == pytest.approx(inside, rel=1e-12)
    np.testing.assert_allclose(mesh.points[mesh.node_sets["tip"]], [[length, 0.0, 0.0]])
    assert mesh.points[mesh.node_sets["bottom"], 1] == pytest.approx(0.0)


@pytest.mark.parametrize("cells", ["quad", "simplex"])
def test_a_quadruped_has_four_legs_with_a_chamber_each(cells):
    mesh = quadruped(cells=cells)
    leg = 4 * 10e-3 + 3 * 2e-3
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    np.testing.assert_allclose(
        [low, high], [[-10e-3 - leg, 0, -22e-3], [10e-3 + leg, 14e-3, 22e-3]]
    )
    inside = 12e-3 * (4 * 6e-3 * 10e-3 + 3 * 6e-3 * 2e-3)
    gaps = 3 * 2e-3 * (14e-3 - 6e-3) * 16e-3
    legs = 4 * (leg * 14e-3 * 16e-3 - inside - gaps)
    volume = signed_volumes(mesh.points, mesh.cells).sum()
    assert volume == pytest.approx(legs + 20e-3 * 6e-3 * 44e-3, rel=1e-9)
    for name, x, z in (
        ("front_left", 1, -1), ("front_right", 1, 1), ("rear_left", -1, -1), ("rear_right", -1, 1)
    ):  # fmt: skip
        chamber = mesh.facet_sets[name]
        assert not len(open_rim(chamber))
        assert Solid().enclosed_volume(mesh.points, chamber) == pytest.approx(inside, rel=1e-9)
        assert (mesh.points[mesh.node_sets[name]][:, [0, 2]] * [x, z] > 0.0).all()
        tip = mesh.points[mesh.node_sets[f"tip_{name}"]]
        assert x * tip[:, 0] == pytest.approx(high[0]) and tip[:, 1] == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"gap": 0.0}, "gap is 0 mm; it must be positive"),
        ({"height": 8e-3}, "height is 8 mm; more than 8 mm is needed"),
        ({"width": 3e-3}, "width is 3 mm; more than 3 mm is needed"),
        ({"chambers": 0}, "chambers is 0"),
        ({"element_size": 1e-8}, r"at most 5e\+06 fit"),
    ],
)
def test_impossible_dimensions_are_named(change, told):
    with pytest.raises(MeshError, match=told):
        pneunet(**change)


@pytest.mark.parametrize("name", ["leg_width", "torso_length", "leg_distance"])
def test_impossible_dimensions_of_a_quadruped_are_named(name):
    with pytest.raises(MeshError, match=f"{name} is 0 mm; it must be positive"):
        quadruped(**{name: 0.0})
