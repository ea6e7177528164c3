"""The pipe robot's skin under pressure against FElupe, an independent finite-element program.

Dragon Skin 10 by Yeoh's law, ends clamped, follower pressure, axisymmetric; see felupe_skin.py.
FElupe's own radii change by 3e-6, 2e-5 and 3e-4 (at 3, 6 and 8 kPa) from 6 to 12 cells through the
thickness. Ours converge to them: see the last test.
"""

import io

import numpy as np
import pytest
from rich.console import Console

pytest.importorskip("felupe", reason="FElupe, the oracle, is not installed")
pytest.importorskip("tensortrax", reason="FElupe's law needs tensortrax")

import felupe_skin

PRESSURES = (3000.0, 6000.0, 8000.0)
RISE, REST = 10e-3, 15e-3
"""Time [s] from one pressure to the next and of rest at each: 3 and 4 periods of the skin's
breathing (280 Hz at rest)."""


TRIANGLES = "element_size: 0.25 mm"
COARSE = "element_size: 1 mm, cells: quad, skin_rows: 1"
FINE = "element_size: 0.5 mm, cells: quad, skin_rows: 2"


def skin(cells: str) -> str:
    """The scene: each of PRESSURES in turn, with such cells."""
    points = ["[0 s, 0 Pa]"]
    for k, pressure in enumerate(PRESSURES):
        start = k * (RISE + REST)
        points += [f"[{start + t:.6f} s, {pressure} Pa]" for t in (RISE, RISE + REST)]
    return f"""
bodies:
  skin: {{mesh: {{generator: pfr_meridian, {cells}}},
         formulation: axisymmetric, material: dragon_skin_10, fixed: [ends]}}
environment: {{gravity: 0 m/s^2}}
loads:
  air: {{kind: follower_pressure, facets: [skin.chamber],
        profile: {{kind: table, points: [{", ".join(points)}]}}}}
time: {{end: {len(PRESSURES) * (RISE + REST)} s, procedure: static}}
output:
  history_interval: 0.5 ms
  probes: {{equator: {{kind: displacement, nodes: skin.equator_outer}}}}
"""


@pytest.fixture
def outer_radii(kernel_cache, monkeypatch, write_scene, tmp_path):
    """Outer radius [m] at mid length at rest at each of PRESSURES, by the cells of the mesh."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    def computed(cells):
        quiet = Console(file=io.StringIO())
        scene = write_scene(skin(cells))
        h = run(scene, out=tmp_path / "out", device="cpu", console=quiet).history
        ends = (RISE + REST) * np.arange(1, len(PRESSURES))
        at = [np.searchsorted(h["time"], end, side="right") - 1 for end in ends] + [-1]
        # At rest: what is unbalanced moves the radius by as small a share.
        assert np.all(h["unbalanced_share"][at] < 1e-4)
        return felupe_skin.OUTER_RADIUS + h["equator_x"][at]

    return computed


@pytest.mark.parametrize("cells", [TRIANGLES, COARSE, pytest.param(FINE, marks=pytest.mark.slow)])
def test_the_skin_inflates_as_felupe_says(outer_radii, record_verification, cells):
    """Within 1 % of the radius: what triangles of 0.25 mm, four through the wall, leave.

    The radius grows by 0.86, 2.4 and 4.96 mm; at 8 kPa the limit point (8.35 kPa) is near, where a
    small error of stiffness makes a large one of radius. Found: +0.01 %, -0.01 % and -0.36 %.
    """
    exact = felupe_skin.outer_radius(PRESSURES)
    found = outer_radii(cells)
    for pressure, expected, radius in zip(PRESSURES, exact, found, strict=True):
        case = f"FElupe's skin, {pressure / 1e3:g} kPa, {cells}"
        record_verification(case, expected, radius)
    np.testing.assert_allclose(found, exact, rtol=0.01)


@pytest.mark.slow
def test_the_difference_to_felupe_falls_with_the_mesh(outer_radii, record_verification):
    """At 8 kPa, 0.25 and 0.125 mm (4 and 8 through the wall) against FElupe's finest mesh.

    The clamp's corners are singular: less than second order, at least first, so that half of the
    1 % allowed at 0.25 mm is left. Found: -0.14 %, order 1.5.
    """
    exact = felupe_skin.outer_radius([8000.0], cells_through_thickness=12)[0]
    found = [outer_radii(cells)[-1] for cells in (TRIANGLES, "element_size: 0.125 mm")]
    errors = [radius / exact - 1.0 for radius in found]
    order = np.log2(errors[0] / errors[1])
    record_verification("FElupe's skin, 8 kPa, fine", exact, exact * (1 + errors[1]), order)
    assert abs(errors[1]) < 0.005
    assert order > 1.0
