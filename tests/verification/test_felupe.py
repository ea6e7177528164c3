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

SKIN = """
bodies:
  skin: {mesh: {generator: pfr_meridian, element_size: 0.25 mm}, formulation: axisymmetric,
         material: dragon_skin_10, fixed: [ends]}
environment: {gravity: 0 m/s^2}
loads:
  air: {kind: follower_pressure, facets: [skin.chamber],
        profile: {kind: constant, value: 3 kPa, ramp: 20 ms}}
time: {end: 30 ms, procedure: static}
output: {probes: {equator: {kind: displacement, nodes: skin.equator_outer}}}
"""


@pytest.fixture
def outer_radius(kernel_cache, monkeypatch, write_scene, tmp_path):
    """Outer radius [m] at mid length at a pressure [Pa], elements of a size [mm]."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    def computed(pressure, element_size):
        settings = [
            f"loads.air.profile.value={pressure} Pa",
            f"bodies.skin.mesh.element_size={element_size} mm",
        ]
        quiet = Console(file=io.StringIO())
        results = run(write_scene(SKIN), settings, tmp_path / "out", "cpu", console=quiet)
        return felupe_skin.OUTER_RADIUS + results.summary["probes"]["equator_x"]

    return computed


@pytest.fixture(scope="module")
def felupe_radius():
    """Outer radius [m] by FElupe at 3, 6 and 8 kPa, by pressure."""
    pressures = [3000, 6000, 8000]
    return dict(zip(pressures, felupe_skin.outer_radius(pressures), strict=True))


@pytest.mark.parametrize("pressure", [3000, 6000, 8000])
def test_the_skin_inflates_as_felupe_says(
    pressure, outer_radius, felupe_radius, record_verification
):
    """Within 1 % of the radius: what triangles of 0.25 mm, four through the wall, leave.

    The growth of the radius itself is 0.86, 2.4 and 4.96 mm; at 8 kPa the limit point (8.35 kPa) is
    near, where a small error of stiffness makes a large one of radius.
    Found: +0.01 %, -0.02 % and -0.37 %.
    """
    found = outer_radius(pressure, 0.25)
    record_verification(f"FElupe's skin, {pressure / 1e3:g} kPa", felupe_radius[pressure], found)
    assert found == pytest.approx(felupe_radius[pressure], rel=0.01)


@pytest.mark.slow
def test_the_difference_to_felupe_falls_with_the_mesh(outer_radius, record_verification):
    """At 8 kPa, 0.25 and 0.125 mm (4 and 8 through the wall) against FElupe's finest mesh.

    The clamp's corners are singular: less than second order, at least first, so that half of the
    1 % allowed at 0.25 mm is left. Found: -0.16 %, order 1.4.
    """
    exact = felupe_skin.outer_radius([8000], cells_through_thickness=12)[0]
    errors = [outer_radius(8000, size) / exact - 1.0 for size in (0.25, 0.125)]
    order = np.log2(errors[0] / errors[1])
    record_verification("FElupe's skin, 8 kPa, fine", exact, exact * (1 + errors[1]), order)
    assert abs(errors[1]) < 0.005
    assert order > 1.0
