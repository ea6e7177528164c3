"""What is drawn of a scene's probes, and which columns are theirs."""

import numpy as np
import pytest

from softsim.report.curves import curves_of, inflation_curves, signals
from softsim.scene.quantities import COLUMNS

RISING = np.linspace(0.0, 1.0, 11)
UNITS = {
    "time": "s", "pressure": "Pa", "body_x": "m", "wall_force_x": "N",
    "tip_x": "m", "tip_y": "m", "foot_y": "m", "clamp_x": "N", "air_x": "m^3",
}  # fmt: skip


@pytest.fixture
def history() -> dict[str, np.ndarray]:
    sizes = {
        "pressure": 6e3, "body_x": 1.0, "wall_force_x": 1.0,
        "tip_x": 1e-3, "tip_y": 2e-3, "foot_y": -5e-4, "clamp_x": 3.0, "air_x": 4e-6,
    }  # fmt: skip
    return {"time": RISING, **{name: size * RISING for name, size in sizes.items()}}


def test_probes_are_what_the_solver_does_not_always_write(history) -> None:
    labels = {unit: [c.name for c in curves] for unit, curves in curves_of(history, UNITS).items()}
    assert labels == {"m": ["tip x", "tip y", "foot y"], "N": ["clamp x"], "m^3": ["air_x"]}


def test_lengths_are_in_mm_and_volumes_in_ml(history) -> None:
    curves = curves_of(history, UNITS)
    ends = [curve.y[-1] for unit in ("m", "N", "m^3") for curve in curves[unit]]
    np.testing.assert_allclose(ends, [1.0, 2.0, -0.5, 3.0, 4.0])


def test_a_colour_is_a_probe_and_a_line_an_axis(history) -> None:
    tip_x, tip_y, foot_y = curves_of(history, UNITS)["m"]
    assert tip_x.colour == tip_y.colour != foot_y.colour
    assert tip_x.kind != tip_y.kind == foot_y.kind


def test_components_that_stay_zero_and_probes_without_a_number_are_left_out(history) -> None:
    history["tip_x"] = 1e-12 * RISING
    history["clamp_x"] = np.full(11, np.nan)
    curves = curves_of(history, UNITS)
    assert [curve.name for curve in curves["m"]] == ["tip y", "foot y"]
    assert "N" not in curves


def test_a_probe_that_only_reads_zero_is_shown(history) -> None:
    history["clamp_x"] = np.zeros(11)
    assert [curve.name for curve in curves_of(history, UNITS)["N"]] == ["clamp x"]


def test_an_inflation_curve_is_the_component_that_moves_the_most(history) -> None:
    assert [c.name for c in inflation_curves(history, UNITS)] == ["tip y", "foot y"]


def test_components_that_move_about_as_much_are_inflation_curves_too(history) -> None:
    history["tip_x"] = -1.5e-3 * RISING
    assert [c.name for c in inflation_curves(history, UNITS)] == ["tip x", "tip y", "foot y"]


@pytest.mark.parametrize("pressure", [np.full(11, np.nan), np.zeros(11), np.full(11, 5e3)])
def test_without_a_changing_pressure_there_is_no_inflation_curve(history, pressure) -> None:
    assert inflation_curves(history | {"pressure": pressure}, UNITS) == []


def test_over_several_pressures_there_is_no_inflation_curve(history) -> None:
    several = {"pressure_rear": history["pressure"], "pressure_front": history["pressure"]}
    assert inflation_curves(history | several, UNITS) == []


def test_without_probes_there_is_no_figure_of_them(history) -> None:
    assert {"probes", "pressure_probe"} <= signals(history, UNITS).keys()
    units = {name: unit for name, unit in UNITS.items() if name in COLUMNS}
    assert not {"probes", "pressure_probe"} & signals(history, units).keys()


MODELS = {
    "static, driven by volume, of a material that softens": """
bodies:
  b: {mesh: {generator: pfr_meridian, element_size: 1 mm}, formulation: axisymmetric,
      material: soft, fixed: [ends]}
materials:
  soft: {law: neo_hooke, C10: 10 kPa, density: 1 g/cm^3, mullins: {r: 2, beta: 0.1}}
loads:
  a: {kind: added_volume, facets: [b.chamber], profile: {kind: ramp, value: 1 ml, duration: 1 s}}
time: {end: 1 s, procedure: static}
""",
    "along a pipe": """
bodies:
  b: {mesh: {generator: block, length: 3 mm, height: 3 mm, element_size: 3 mm},
      formulation: plane_strain, thickness: 1 mm, material: ecoflex_00_30, fixed: [bottom]}
rigid_bodies: {r: {mass: 1 g, inertia: 1 g*mm^2, center: [20 mm, 0 mm], outline: {radius: 5 mm}}}
environment:
  walls: {pipe: {kind: pipe_path, diameter: 20 mm, start: [-5 mm, 0 mm], pipe: [{straight: 60 mm}]}}
layout: {}
time: {end: 1 s}
""",
    "of a closed loop, of quadrilaterals": """
bodies:
  b: {mesh: {generator: block, length: 3 mm, height: 3 mm, element_size: 3 mm, cells: quad},
      formulation: plane_strain, thickness: 1 mm, material: ecoflex_00_30, fixed: [bottom]}
rigid_bodies: {r: {mass: 1 g, inertia: 1 g*mm^2}}
loads:
  a: {kind: follower_pressure, facets: [b.top],
      profile: {kind: event_cycles, highest: 2 kPa, lowest: 1 kPa, inflation_rate: 1 kPa/s,
                deflation_rate: 1 kPa/s, contact_force: 1 N, contact_rows: 0, least_rows: 0}}
crossing: {goal: 90 mm}
time: {end: 1 s}
""",
    "along a path of equilibria": """
bodies:
  b: {mesh: {generator: block, length: 3 mm, height: 3 mm, element_size: 3 mm},
      formulation: plane_strain, thickness: 1 mm, material: ecoflex_00_30, fixed: [bottom]}
loads: {a: {kind: follower_pressure, facets: [b.top], profile: {kind: constant, value: 1 kPa}}}
time: {end: 1 s, procedure: static, control: arc_length}
""",
    "in space": """
bodies:
  b: {mesh: {generator: box, length: 3 mm, height: 3 mm, width: 3 mm, element_size: 3 mm},
      formulation: solid, material: ecoflex_00_30}
rigid_bodies: {r: {mass: 1 g, inertia: 1 g*mm^2}}
loads: {gauge: {kind: tendon, acts_on: r}, tail: {kind: tether, acts_on: r, drag: 1 mN}}
time: {end: 1 s}
""",
}


def test_columns_are_those_of_models_without_probes(build) -> None:
    from softsim.output.observation import columns

    units = {
        name: unit for scene in MODELS.values() for name, unit in columns(build(scene)).items()
    }
    assert units == {name: column.unit for name, column in COLUMNS.items()}
