"""Bellows and bending actuators: bodies of revolution."""

import math

import numpy as np
import pytest

from softsim.elements.hoop import Axisymmetric
from softsim.elements.solid import Solid
from softsim.errors import MeshError
from softsim.mesh.mesh import open_rim, signed_volumes
from softsim.mesh.quality import quality
from softsim.robots.revolved import bellows_section, bellows_solid, bending_actuator

ROOT, CROWN, SPACING, WALL, LID = 10e-3, 16e-3, 4e-3, 1.5e-3, 3.5e-3


def polygon(corners):
    """Area of a regular polygon over that of the circle through its corners."""
    return corners / (2.0 * math.pi) * math.sin(2.0 * math.pi / corners)


def bellows_volume(convolutions):
    """Volume of the silicone [m^3], by the theorem of Pappus."""
    rings = 2 * convolutions * WALL * math.pi * (CROWN**2 - ROOT**2)
    area = 0.5 * math.pi * SPACING * WALL  # of a half circle of the wall
    outer, inner = (0.5 * (SPACING + sign * WALL) for sign in (1.0, -1.0))
    shift = 2.0 / 3.0 * (outer**3 - inner**3) / area  # of its centroid from its centre
    crowns = convolutions * 2.0 * math.pi * (CROWN + shift) * area
    roots = (convolutions - 1) * 2.0 * math.pi * (ROOT - shift) * area
    return rings + crowns + roots + LID * math.pi * ROOT**2


@pytest.mark.parametrize("convolutions", [1, 3])
def test_the_section_of_a_bellows_has_its_volume(convolutions):
    mesh = bellows_section(convolutions=convolutions, element_size=0.2e-3)
    areas = signed_volumes(mesh.points, mesh.cells)
    radii = mesh.points[mesh.cells, 0].mean(axis=1)
    volume = 2.0 * math.pi * (areas * radii).sum()
    assert volume == pytest.approx(bellows_volume(convolutions), rel=2e-3)
    base = mesh.points[mesh.node_sets["base"]]
    assert base[:, 0] == pytest.approx(ROOT)
    assert np.ptp(base[:, 1]) == pytest.approx(WALL)


@pytest.mark.parametrize("convolutions", [1, 3])
def test_a_bellows_in_space_is_its_section_revolved(convolutions):
    section = bellows_section(convolutions=convolutions, element_size=1.5e-3)
    body = bellows_solid(convolutions=convolutions)
    corners = 4 * math.ceil(0.5 * math.pi * 13.0 / (1.5 * 1.5))
    inside, within = (
        element.enclosed_volume(mesh.points - open_end, mesh.facet_sets["chamber"])
        for element, mesh, open_end in (
            (Axisymmetric(), section, [0.0, WALL / 2]),
            (Solid(), body, [0.0, WALL / 2, 0.0]),
        )
    )
    assert within == pytest.approx(polygon(corners) * inside, rel=1e-9)
    rim = body.points[np.unique(open_rim(body.facet_sets["chamber"]))]
    assert rim[:, 1] == pytest.approx(WALL / 2)  # the open end
    low, high = body.points.min(axis=0), body.points.max(axis=0)
    top = section.points[:, 1].max()
    assert [low[1], high[1]] == pytest.approx([-WALL / 2, top])
    assert body.points[body.node_sets["top"], 1] == pytest.approx(top)
    assert quality(body).smallest_angle > math.radians(45.0)


def test_a_bending_actuator_is_a_tube_with_a_plug():
    mesh = bending_actuator(element_size=2e-3)
    section = polygon(24)
    volume = section * math.pi * ((10**2 - 8**2) * 60 + 10**2 * 4) * 1e-9
    assert signed_volumes(mesh.points, mesh.cells).sum() == pytest.approx(volume, rel=1e-9)
    chamber = mesh.facet_sets["chamber"]
    air = section * math.pi * 8e-3**2 * 60e-3
    assert Solid().enclosed_volume(mesh.points, chamber) == pytest.approx(air, rel=1e-9)
    assert mesh.points[np.unique(open_rim(chamber)), 0] == pytest.approx(0.0)
    assert mesh.points[mesh.node_sets["tip"], 0] == pytest.approx(64e-3)
    bottom = mesh.points[mesh.node_sets["bottom"]]
    assert np.hypot(bottom[:, 1], bottom[:, 2]) == pytest.approx(10e-3)
    assert len(mesh.facet_sets["bottom"]) * 4 == len(mesh.facet_sets["outside"])
    assert (bottom[:, 1] < -0.99 * np.abs(bottom[:, 2])).all()


@pytest.mark.parametrize(
    ("generator", "change", "message"),
    [
        (bellows_section, {"crown_radius": 10e-3}, "crown_radius is 10 mm; more than root_radius"),
        (bellows_section, {"root_radius": 2e-3}, "more than half of ring_spacing and wall"),
        (bellows_section, {"ring_spacing": 1.5e-3}, "more than wall_thickness, 1.5 mm, is needed"),
        (bellows_solid, {"lid_thickness": 1e-3}, "lid_thickness is 1 mm"),
        (bellows_solid, {"convolutions": 0}, "convolutions is 0"),
        (bellows_solid, {"element_size": 1e-8}, r"at most 5e\+06 fit"),
        (bending_actuator, {"inner_radius": 0.0}, "inner_radius is 0 mm; it must be positive"),
        (bending_actuator, {"element_size": 1e-7}, r"at most 5e\+06 fit"),
    ],
)
def test_impossible_dimensions_of_revolved_bodies_are_named(generator, change, message):
    with pytest.raises(MeshError, match=message):
        generator(**change)
