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


@pytest.mark.parametrize("cells", ["simplex", "quad"])
def test_a_tube_with_held_rims_is_closed_by_two_lids(build, cells):
    """Volume: of the polygonal prism that the inner nodes span, exactly."""
    model = build(tube(rows=f"cells: {cells}, rows"))
    load = model.pressures[0]
    inner = model.points[np.unique(load.facets)]
    angles = np.unique(np.round(np.arctan2(inner[:, 2], inner[:, 1]), 9))
    around = len(angles)
    steps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
    polygon = 0.5 * 7.5e-3**2 * np.sin(steps).sum()
    assert load.volume(model.points) == pytest.approx(polygon * 30e-3, rel=1e-9)
    assert load.source.initial_volume == pytest.approx(load.volume(model.points))
    # Two fans over polygons of `around` corners.
    assert len(load.lids) == 2 * (around - 2)


@pytest.mark.parametrize("mesh", ["pfr_section", "pfr_section, cells: quad, skin_rows: 1"])
def test_two_plane_chambers_enclose_what_is_between_them(build, mesh):
    """The strips of the PFR's section: each chain's end is joined to the start of the other."""
    text = CUP % (mesh, "plane_strain", "thickness: 7 mm", "knots",
                  "cup.chamber_top, cup.chamber_bottom")  # fmt: skip
    model = build(text)
    load = model.pressures[0]
    assert len(load.lids) == 2
    lengths = np.linalg.norm(np.diff(model.points[load.lids], axis=1), axis=2)
    np.testing.assert_allclose(lengths, 15e-3)  # straight across, from strip to strip
    assert load.volume(model.points) == pytest.approx(15e-3 * 30e-3 * 7e-3, rel=1e-12)


@pytest.mark.parametrize("mesh", ["pfr_section", "pfr_section, cells: quad, skin_rows: 1"])
def test_rings_enclose_what_is_between_them_and_the_axis(build, mesh):
    """Two strips of 90 deg are half a cylinder; its flat ends need no lids, and may slide."""
    text = CUP % (mesh, "ring_section", "{thickness: 7 mm, sector: 90 deg, rings: skin}",
                  "knots", "cup.chamber_top, cup.chamber_bottom")  # fmt: skip
    text = text.replace("{thickness", "thickness").replace("}\n    material", "\n    material")
    text = text.replace("7 mm, sector", "7 mm\n    sector").replace("deg, r", "deg\n    r")
    slides = "conditions: {ends: {kind: fixed, nodes: cup.knots, directions: [x]}}\n"
    for closed in (text, text.replace("    fixed: [knots]\n", "") + slides):
        model = build(closed)
        load = model.pressures[0]
        assert len(load.lids) == 0
        half = 0.5 * np.pi * 7.5e-3**2 * 30e-3
        assert load.volume(model.points) == pytest.approx(half, rel=1e-12)


QUARTER = """\
bodies:
  ring: {mesh: {file: ring.inp, length_unit: 1 m}, formulation: plane_strain, thickness: 5 mm,
         material: dragon_skin_10}
conditions:
  right: {kind: symmetry, nodes: ring.right, normal: y}
  upper: {kind: symmetry, nodes: ring.upper, normal: x}
loads:
  water: {kind: added_volume, facets: [ring.bore],
          profile: {kind: ramp, value: 1 ml, duration: 1 s}}
time: {end: 1 s}
"""


def test_planes_of_symmetry_close_a_chamber(build, tmp_path):
    """A quarter of a ring: its rims slide on x = 0 and y = 0 and need no lid."""
    corner = np.sqrt(0.5)
    rim = [(r * c, r * s) for r in (2e-3, 3e-3) for c, s in ((1, 0), (corner, corner), (0, 1))]
    nodes = "".join(f"{k}, {x:.17g}, {y:.17g}\n" for k, (x, y) in enumerate(rim, start=1))
    (tmp_path / "ring.inp").write_text(
        f"*NODE\n{nodes}*ELEMENT, TYPE=CPE3\n1, 1, 4, 5\n2, 1, 5, 2\n3, 2, 5, 6\n4, 2, 6, 3\n"
        "*NSET, NSET=right\n1, 4\n*NSET, NSET=upper\n3, 6\n*SURFACE, NAME=bore\n2, S3\n4, S3\n"
    )
    model = build(QUARTER)
    load = model.pressures[0]
    assert len(load.lids) == 0
    # Two triangles from the origin: r^2 sin(45 deg) in all, 5 mm deep.
    assert load.volume(model.points) == pytest.approx(2e-3**2 * corner * 5e-3, rel=1e-12)
    partly = QUARTER.replace("kind: symmetry, nodes: ring.right, normal: y",
                             "kind: fixed, nodes: ring.right")  # fmt: skip
    assert "partly on a plane of symmetry" in refused(build, partly).message
    shifted = QUARTER.replace("material:", "position: [1 mm, 0 mm], material:")
    assert "on a node that can move independently" in refused(build, shifted).message


@pytest.mark.parametrize("mesh", ["pfr_meridian", "pfr_meridian, cells: quad, skin_rows: 1"])
def test_a_half_section_needs_no_lids(build, mesh):
    model = build(CUP % (mesh, "axisymmetric", "", "ends", "cup.chamber"))
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
    assert "no volume is left for the gas" in error.message and "dead volume" in error.hint


def test_a_chamber_that_cannot_yield_takes_no_liquid(build, tmp_path):
    text = tube(**{"fixed: [knots]": "fixed: [surface]"})
    assert "no node of the chamber can move" in refused(build, text).message
