"""Material law fitted to a tensile test: curves, numbers, and the lines for a scene."""

import json
import re
from pathlib import Path

import numpy as np

from softsim.materials.fitting import LARGEST_STRETCH, SMALLEST_STRETCH, Fit, instability_stretch
from softsim.materials.law import UNIAXIAL, Law
from softsim.materials.tensile import TensileTest
from softsim.report.diagram import FLAT, POINTS, TALL, Diagram, Panel, PlotAxis, PlotSeries, Scale
from softsim.report.png import draw
from softsim.report.style import BLUE, ORANGE, QUIET, RED

SHOWN_BEYOND = 1.6
"""Ratio of the plotted strain to the largest strain of the fit."""

HEADROOM = 1.15
"""Ratio of the largest plotted stress of the law to the largest measured stress plotted."""

LAW_POINTS = 400

ASSUMED_DENSITY = 1070
"""Density of a silicone [kg/m^3] according to the data sheets of Dragon Skin 10 and Ecoflex."""


def draw_fit(test: TensileTest, fit: Fit, path: Path) -> None:
    """Draw `fit_diagram` as PNG. Raises OutputError if the file cannot be written."""
    draw(path, fit_diagram(test, fit))


def fit_diagram(test: TensileTest, fit: Fit) -> Diagram:
    """Return the diagram of measured and fitted stress over strain, and of the relative error.

    Outside the range of the fit the measured curve is grey, the fitted one dashed, and there is
    no error.
    """
    loading = test.first_loading()
    shown = loading.strain <= SHOWN_BEYOND * fit.max_strain
    strain, stress = loading.strain[shown], loading.stress[shown]
    inside = (strain > fit.min_strain) & (strain <= fit.max_strain)
    factor, unit = (1e-3, "kPa") if stress.max() < 1e6 else (1e-6, "MPa")
    x = np.linspace(0.0, float(strain[-1]), LAW_POINTS)
    law = UNIAXIAL.nominal_stress(fit.law, 1.0 + x)
    law[law > HEADROOM * stress.max()] = np.nan
    fitted = np.where((x >= fit.min_strain) & (x <= fit.max_strain), law, np.nan)
    error = UNIAXIAL.nominal_stress(fit.law, 1.0 + strain[inside]) / stress[inside] - 1.0
    curves = [
        PlotSeries("measured", 100.0 * strain, factor * stress, QUIET),
        PlotSeries(
            "measured, fit range",
            100.0 * strain[inside], factor * stress[inside], ORANGE, POINTS,
        ),
        PlotSeries("fitted", 100.0 * x, factor * fitted, BLUE),
        PlotSeries("fit, extrapolated", 100.0 * x, factor * law, BLUE, "--"),
    ]  # fmt: skip
    errors = [PlotSeries("relative error", 100.0 * strain[inside], 100.0 * error, RED)]
    panels = [
        Panel(PlotAxis(Scale(f"engineering stress [{unit}]"), curves), height=TALL),
        Panel(PlotAxis(Scale("relative error [%]", from_zero=True), errors), height=FLAT),
    ]
    said = f"{test.title}: {_constants(fit)}"
    return Diagram("Fit", Scale("engineering strain [%]"), panels, said)


def _constants(fit: Fit) -> str:
    values = [f"{name} = {', '.join(_numbers(fit.law, name, 3))}" for name in _not_zero(fit.law)]
    return f"{type(fit.law).__name__}, {', '.join(values)}"


def _not_zero(law: Law) -> list[str]:
    """Return the names of the nonzero fields of a law."""
    return [name for name, value in vars(law).items() if np.any(value)]


def _numbers(law: Law, name: str, digits: int) -> list[str]:
    """Return the numbers of a field, one or several, with their unit."""
    factor, unit = (1.0, "") if name in law.pure_numbers else (1e-3, " kPa")
    return [f"{factor * c:#.{digits}g}{unit}" for c in np.ravel(getattr(law, name))]


def fit_rows(fit: Fit) -> list[tuple[str, str]]:
    """Return the numbers of a fit as (name, text): range, constants, error, range of validity."""
    rows = [
        ("range", f"strain {fit.min_strain:.3g} to {fit.max_strain:.3g}, {fit.points} points"),
        *((name, ", ".join(_numbers(fit.law, name, 4))) for name in vars(fit.law)),
        ("mu0", f"{fit.law.initial_shear_modulus / 1e3:#.4g} kPa"),
        (
            "residual",
            f"{fit.residual / 1e3:.3g} kPa rms, {100 * fit.relative_residual:.2g} % of the stress, "
            f"R^2 = {fit.r_squared:.5f}",
        ),
        ("largest error", f"{100 * fit.worst_error:.3g} % at a strain of {fit.worst_strain:.3g}"),
    ]
    for path, stretch in instability_stretch(fit.law).items():
        end = SMALLEST_STRETCH if path == "compression" else LARGEST_STRETCH
        is_stable = f"stable: the stress rises up to a stretch of {end:g}"
        rows.append(
            (path, is_stable if stretch is None else f"UNSTABLE from a stretch of {stretch:.3g}")
        )
    return rows


def scene_snippet(test: TensileTest, fit: Fit, law: str) -> str:
    """Return the fitted material in the YAML of a scene; `law` is its name in scenes."""
    name = re.sub(r"\W+", "_", test.title.lower(), flags=re.ASCII).strip("_")
    name = name if name[:1].isalpha() else f"material_{name}"
    lines = [
        "materials:",
        f"  {name}:",
        f"    law: {law}",
        *(f"    {name}: {_in_yaml(fit.law, name)}" for name in _not_zero(fit.law)),
        f"    density: {ASSUMED_DENSITY} kg/m^3  # assumed; a tensile test does not give it",
        f"    strain_range: {fit.max_strain:.3g}",
        f"    source: {json.dumps(f'fit to {test.source}, uniaxial', ensure_ascii=False)}",
    ]
    return "\n".join(lines)


def _in_yaml(law: Law, name: str) -> str:
    """Return a field in the YAML of a scene: a number with its unit, or a list of such."""
    numbers = _numbers(law, name, 3)
    return f"[{', '.join(numbers)}]" if np.ndim(getattr(law, name)) else numbers[0]
