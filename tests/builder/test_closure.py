"""Chambers: lids over open rims enclose the volume that the eye sees; what is open is refused."""

import numpy as np
import pytest

from softsim.errors import SceneError

CUP = """\
bodies:
  cup:
    mesh: {generator: %s}
    formulation: %s
    %s
    material: dragon_skin_10
    fixed: [%s]
environment: {gravity: 0 m/s^2}
loads:
  water: {kind: added_volume, facets: [%s], profile: {kind: ramp, value: 1 ml, duration: 1 s}}
time: {end: 1 s}
"""
BOX = "box, length: 4 mm, height: 3 mm, width: 2 mm, element_size: 1 mm"


def tube(**changes):
    text = CUP % ("pfr_solid, rows: 0, element_size: 1 mm", "solid", "", "knots", "cup.chamber")
    for old, new in changes.items():
        text = text.replace(old, new)
    return text


def test_a_tube_with_held_rims_is_closed_by_two_lids(build):
    """Volume: of the polygonal prism that the inner nodes span, exactly."""
    load = build(tube()).pressures[0]
    model = build(tube())
    inner = model.points[np.unique(load.facets)]
    angles = np.unique(np.round(np.arctan2(inner[:, 2], inner[:, 1]), 9))
    around = len(angles)
    steps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
    polygon = 0.5 * 7.5e-3**2 * np.sin(steps).sum()
    assert load.volume(model.points) == pytest.approx(polygon * 30e-3, rel=1e-9)
    assert load.drive.initial_volume == pytest.approx(load.volume(model.points))
    # Two fans over polygons of `around` corners.
    assert len(load.lids) == 2 * (around - 2)


def test_two_plane_chambers_are_closed_one_by_one(build):
    """The strips of the PFR's section: each chain is closed by the straight line between its ends,
    and between skin and frame there is nothing yet.
    """
    text = CUP % ("pfr_section", "plane_strain", "thickness: 7 mm", "knots",
                  "cup.chamber_top, cup.chamber_bottom")  # fmt: skip
    text = text.replace("added_volume", "added_gas, dead_volume: 1 ml")
    text = text.replace("value: 1 ml", "value: 1 mg")
    model = build(text)
    load = model.pressures[0]
    assert len(load.lids) == 2
    assert load.volume(model.points) == pytest.approx(0.0, abs=1e-15)
    lifted = model.points.copy()
    moving = np.setdiff1d(np.unique(load.facets), np.unique(load.lids))
    lifted[moving, 1] *= 1.1  # away from the axis on both sides
    chamber = model.points[np.unique(load.facets)]
    # Both trapezoids: 0.75 mm high, as wide as the free skin less half a facet at each end.
    widths = chamber[:, 0].max() - chamber[:, 0].min(), np.ptp(model.points[moving, 0])
    expected = 2 * 7e-3 * 0.75e-3 * 0.5 * sum(widths)
    assert load.volume(lifted) == pytest.approx(expected, rel=1e-9)


def test_a_half_section_needs_no_lids(build):
    model = build(CUP % ("pfr_meridian", "axisymmetric", "", "ends", "cup.chamber"))
    load = model.pressures[0]
    assert len(load.lids) == 0
    assert load.volume(model.points) == pytest.approx(np.pi * 7.5e-3**2 * 30e-3, rel=1e-12)


def refused(build, text):
    with pytest.raises(SceneError) as caught:
        build(text)
    return caught.value


def test_an_open_rim_that_may_move_is_refused(build):
    error = refused(build, tube(**{"fixed: [knots]": "fixed: [knot_front]"}))
    assert "the chamber is open: its facets end at (-15.00," in error.message
    assert "hold both ends" in error.hint and error.location.line == 10


def test_facets_that_face_away_enclose_nothing(build):
    error = refused(build, CUP % (BOX, "solid", "", "left", "cup.surface"))
    assert "the facets enclose -0.024 ml" in error.message


def test_gas_needs_room(build):
    text = tube(added_volume="added_gas, excluded_volume: 6 ml").replace("1 ml", "1 mg")
    error = refused(build, text)
    assert "nothing is left for the gas" in error.message and "dead volume" in error.hint
