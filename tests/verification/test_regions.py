"""Regions of a body against closed forms: halves in series, layers of a tube, a stepped plate.

Elements of a region under a homogeneous strain have one pressure, and at an interface it jumps: a
bar of two homogeneous halves is exact to the tolerance of the equilibrium, 1e-7 of the forces, of
which an error of the lowest mode makes 1e-5 at most.
"""

import io

import closed_forms
import pytest
from rich.console import Console
from scipy.optimize import brentq

SOFT, HARD = (36e3,), (108e3,)  # C10 [Pa]
LAWS = """
materials:
  soft: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}
  hard: {law: neo_hooke, C10: 108 kPa, density: 2000 kg/m^3}
"""
BAR = {
    "plane_strain": "mesh: {generator: block, length: 1 mm, height: 2 mm, element_size: 0.5 mm}, "
    "formulation: plane_strain, thickness: 3 mm",
    "axisymmetric": "mesh: {generator: block, length: 1 mm, height: 2 mm, element_size: 0.5 mm}, "
    "formulation: axisymmetric, position: [0.5 mm, 0 mm]",
    "solid": "mesh: {generator: box, length: 1 mm, width: 1 mm, height: 2 mm, "
    "element_size: 0.5 mm}, formulation: solid",
}
SIDES = {
    "plane_strain": {"left": "x", "right": "x"},
    "axisymmetric": {"right": "x"},
    "solid": {"left": "x", "right": "x", "front": "z", "back": "z"},
}
PULL = 40e3  # [Pa] on the lower half's section


@pytest.fixture
def run(kernel_cache, monkeypatch, write_scene, tmp_path):
    """Run a scene text quietly on the CPU."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run as run_scene

    def quiet(text, *settings):
        console = Console(file=io.StringIO())
        return run_scene(write_scene(text), settings, tmp_path / "out", "cpu", console=console)

    return quiet


def bar(formulation, region, area_ratio=1.0):
    """A bar of 2 mm pulled upwards between smooth walls, its upper half a region; PULL acts on the
    area of the lower half, which is `area_ratio` times that of the upper one.
    """
    d = 3 if formulation == "solid" else 2
    middle = "[0 mm, 1 mm, 0 mm], normal: [0, 1, 0]" if d == 3 else "[0 mm, 1 mm], normal: [0, 1]"
    traction = ", ".join(["0 Pa", f"{area_ratio * PULL:.12g} Pa", "0 Pa"][:d])
    sides = "".join(
        f"  {side}: {{kind: symmetry, nodes: bar.{side}, normal: {axis}}}\n"
        for side, axis in SIDES[formulation].items()
    )
    return f"""
bodies:
  bar: {{{BAR[formulation]}, material: soft, fixed: [bottom],
        sets: {{upper: {{plane: {{point: {middle}}}}}}}, regions: {{upper: {{{region}}}}}}}
{LAWS}
conditions:
{sides}loads:
  pull: {{kind: surface_traction, facets: [bar.top], traction: [{traction}], ramp: 2 ms}}
environment: {{gravity: 0 m/s^2}}
time: {{end: 2 ms, procedure: static}}
solver: {{equilibrium_tolerance: 1e-7}}
output: {{frame_interval: 1 s, probes: {{tip: {{kind: displacement, nodes: bar.top}}}}}}
"""


def held_stretch(stress, c):
    """Stretch of a bar whose sides are held, under a stress [Pa]."""
    kappa = closed_forms.default_bulk_modulus(c)

    def excess(s):
        return closed_forms.cauchy_stress((s, 1.0, 1.0), c, kappa)[0] - stress

    return brentq(excess, 0.8, 1.5, xtol=1e-14)


@pytest.mark.parametrize("formulation", list(BAR))
def test_two_materials_in_series(run, record_verification, formulation):
    """Both halves bear the same stress, and the stiffer one a third of the strain."""
    results = run(bar(formulation, "material: hard"))
    tip = results.summary["probes"]["tip_y"]
    exact = 1e-3 * (held_stretch(PULL, SOFT) + held_stretch(PULL, HARD) - 2.0)
    record_verification(f"two materials in series [m], {formulation}", exact, tip)
    assert tip == pytest.approx(exact, rel=1e-5)


def test_a_plate_with_two_thicknesses(run, record_verification):
    """Both halves bear the same force: the one of twice the thickness half of the stress."""
    results = run(bar("plane_strain", "thickness: 6 mm", 0.5))
    tip = results.summary["probes"]["tip_y"]
    exact = 1e-3 * (held_stretch(PULL, SOFT) + held_stretch(0.5 * PULL, SOFT) - 2.0)
    record_verification("stepped plate [m]", exact, tip)
    assert tip == pytest.approx(exact, rel=1e-5)


RADII = (7.5e-3, 8.0e-3, 8.5e-3)  # [m]
TUBE = f"""
bodies:
  wall: {{mesh: {{generator: block, length: 1 mm, height: 0.125 mm, element_size: 0.125 mm}},
         formulation: axisymmetric, position: [8 mm, 0 mm], material: soft,
         sets: {{outside: {{plane: {{point: [8 mm, 0 mm], normal: [1, 0]}}}}}},
         regions: {{outside: {{material: hard}}}}}}
{LAWS}
conditions:
  bottom: {{kind: symmetry, nodes: wall.bottom, normal: y}}
  top: {{kind: symmetry, nodes: wall.top, normal: y}}
loads:
  air: {{kind: follower_pressure, facets: [wall.left],
        profile: {{kind: table, points: [[0 s, 0 kPa], [5 ms, 8 kPa]]}}}}
environment: {{gravity: 0 m/s^2}}
time: {{end: 5 ms, procedure: static}}
solver: {{equilibrium_tolerance: 1e-7}}
output: {{frame_interval: 1 s, probes: {{inner: {{kind: displacement, nodes: wall.left}}}}}}
"""


def test_a_tube_of_two_layers(run, record_verification):
    """The pressure that opens it to the inner radius that was found. The error is of second order:
    (h/A)^2 of the pressure, h = A/60, times what the jump of pressure at the interface adds, no
    more than four.
    """
    results = run(TUBE)
    inner = RADII[0] + results.summary["probes"]["inner_x"]
    assert inner > 1.1 * RADII[0]
    exact = closed_forms.layered_tube_inflation(inner, RADII, (SOFT, HARD)).pressure
    record_verification("pressure in a tube of two layers [Pa]", exact, 8e3)
    assert pytest.approx(exact, rel=4.0 / 60.0**2) == 8e3


def test_energy_and_stress_free_rest(run):
    """A robot's section with hard spikes that falls and rings down: the books close, and nothing
    moves in it before it is loaded.
    """
    results = run(
        """
bodies:
  skin: {mesh: {generator: pfr_section, element_size: 1 mm}, formulation: ring_section,
         sector: 90 deg, rings: skin, thickness: 7 mm, material: dragon_skin_10, fixed: [knots],
         regions: {spikes: {material: dragon_skin_30, thickness: 3 mm}}}
loads:
  air: {kind: follower_pressure, facets: [skin.chamber_top, skin.chamber_bottom],
        profile: {kind: table, points: [[0 s, 0 kPa], [5 ms, 3 kPa]]}}
time: {end: 10 ms}
output: {frame_interval: 5 ms}
"""
    )
    assert results.summary["status"] == "done"
    assert results.summary["energy_error"] < 0.005
