"""Figures and tables of materials: sources of a silicone, and laws fitted to tests."""

import json
import re
from collections.abc import Sequence
from itertools import cycle

import numpy as np

from softsim.materials.fitting import (
    LARGEST_STRETCH,
    PREDICTED_WITHIN,
    SMALLEST_STRETCH,
    Fit,
    TensileTest,
    instability_stretch,
)
from softsim.materials.laws import UNIAXIAL, Law
from softsim.materials.library import Silicone, SiliconeSource
from softsim.report.diagram import FLAT, POINTS, TALL, Diagram, Panel, PlotAxis, PlotSeries, Scale
from softsim.report.style import BLUE, COLOURS, INK, ORANGE, QUIET, RED
from softsim.report.table import Row, Table, cell

# -------------------------------------------------------------------------------------------------
# Sources of a silicone: table of the library, curves in one figure, comparison with a test.

DRAWN_RANGE = 0.3
"""Strain up to which a source that gives only a modulus is drawn, as a neo-Hookean solid."""

COMPARED_FROM = 0.1
"""Strain below which a test from crosshead travel shows its slack; see `fitting.MIN_STRAIN`."""

SOURCE_POINTS = 200
FIRST_STRAIN = 0.01


def sources_table(silicone: Silicone) -> Table:
    """Return the table of the sources of a silicone, with their spread as its caption."""
    spread = silicone.spread
    caption = "one source: no spread is known"
    if spread is not None:
        caption = (
            f"initial shear modulus: lowest {_kilo(spread.low)}, typical {_kilo(spread.typical)} "
            f"({silicone.typical}), highest {_kilo(spread.high)} kPa"
        )
        if not spread.agrees:
            caption += "; fit a test of your own batch with softsim fit-material"
    has_batches = any(source.spec.batch for source in silicone.sources)
    rows: list[Row] = []
    for source in silicone.sources:
        mu0, spec = source.initial_shear_modulus, source.spec
        rows.append([
            source.name if source.is_material else f"({source.name})",
            cell(mu0 / 1e3, ".3g"), cell(3.0 * mu0 / 1e3, ".3g"), _strains(source), spec.test,
            *([spec.batch or "not stated"] if has_batches else []),
            f"{spec.citation} {spec.url}".rstrip(),
        ])  # fmt: skip
    batch = ["batch"] if has_batches else []
    headings = ["entry", "mu0 [kPa]", "E0 [kPa]", "strain", "test", *batch, "source"]
    return Table(rows, headings, caption, f"{silicone.title}: {silicone.name}")


def _kilo(modulus: float) -> str:
    return f"{modulus / 1e3:.3g}"


def _strains(source: SiliconeSource) -> str:
    """Return the strain range of a source in per cent, as far as it is stated."""
    if source.spec.strains is not None:
        low, high = (100.0 * strain for strain in source.spec.strains)
        return f"{low:.3g} to {high:.3g} %"
    return "not stated" if source.strain_range is None else f"to {100 * source.strain_range:.3g} %"


def sources_diagram(silicone: Silicone, test: TensileTest | None = None) -> Diagram:
    """Return the diagram of the uniaxial curves of all sources, and of a test if given.

    The upper panel shows the nominal stress P over the stretch l, the lower one the apparent shear
    modulus P / (l - l^-2), which is constant for a neo-Hookean solid. A source that gives only a
    modulus is a dashed line up to a strain of DRAWN_RANGE; published points have the colour of the
    law fitted to them.
    """
    stress, modulus = [], []
    for source, colour in zip(silicone.sources, cycle(COLOURS), strict=False):
        end, kind = source.strain_range or DRAWN_RANGE, "-" if source.strain_range else "--"
        stretch = 1.0 + np.linspace(0.0, end, SOURCE_POINTS)
        authors = source.spec.citation.split(",")[0].split(" (")[0]
        P = UNIAXIAL.nominal_stress(source.law, stretch)
        curves = [(f"{source.name}: {authors}", stretch, P, kind)]
        if source.spec.points:
            points = np.array(source.spec.points)
            curves.append(("", points[:, 0], points[:, 1], POINTS))
        for name, x, P, kind in curves:
            stress.append(PlotSeries(name, x, P / 1e3, colour, kind))
            modulus.append(PlotSeries("", x, _apparent_modulus(x, P), colour, kind))
    if test is not None:
        loading = test.first_loading()
        end = max(float(series.x[-1]) for series in stress)
        shown = (loading.strain > 0.0) & (1.0 + loading.strain <= end)
        x, P = 1.0 + loading.strain[shown], loading.stress[shown]
        stress.append(PlotSeries(f"test: {test.title}", x, P / 1e3, INK, POINTS))
        x, P = x[x >= 1.0 + COMPARED_FROM], P[x >= 1.0 + COMPARED_FROM]
        modulus.append(PlotSeries("", x, _apparent_modulus(x, P), INK, POINTS))
    panels = [
        Panel(PlotAxis(Scale("nominal stress [kPa]", from_zero=True), stress), height=1.5),
        Panel(PlotAxis(Scale("apparent shear modulus [kPa]", from_zero=True), modulus), height=1.2),
    ]
    remark = f"{silicone.title}: uniaxial tension"
    return Diagram("Sources", Scale("stretch [-]"), panels, remark)


def _apparent_modulus(stretch: np.ndarray, stress: np.ndarray) -> np.ndarray:
    """Return P / (l - l^-2) [kPa]; NaN where the stretch is too close to 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        apparent = stress / (stretch - stretch**-2) / 1e3
    return np.where(stretch > 1.0 + FIRST_STRAIN, apparent, np.nan)


def comparison_rows(silicone: Silicone, test: TensileTest) -> list[tuple[str, str]]:
    """Return the ratio of a test's stress to that of each source, as (name, text).

    It is the ratio of the works of both between a strain of COMPARED_FROM and the end of the
    shorter of the two curves.
    """
    loading = test.first_loading()
    rows = []
    for source in silicone.sources:
        end = min(source.strain_range or DRAWN_RANGE, float(loading.strain[-1]))
        inside = (loading.strain >= COMPARED_FROM) & (loading.strain <= end)
        if inside.sum() < 2:
            rows.append((source.name, "no common range of strain"))
            continue
        strain = loading.strain[inside]
        theirs = UNIAXIAL.nominal_stress(source.law, 1.0 + strain)
        ratio = np.trapezoid(loading.stress[inside], strain) / np.trapezoid(theirs, strain)
        span = f"strains {strain[0]:.3g} to {strain[-1]:.3g}"
        rows.append((source.name, f"{ratio:.3g}, {span}"))
    return rows


# -------------------------------------------------------------------------------------------------
# Material law fitted to tests: curves, numbers, warnings, and the lines for a scene.

SHOWN_BEYOND = 1.6
"""Ratio of the plotted strain to the largest strain of the fit."""

HEADROOM = 1.15
"""Ratio of the largest plotted stress of the law to the largest measured stress plotted."""

LAW_POINTS = 400

LARGEST_SHOWN = 10.0
"""Relative error above which its size is not printed."""

ASSUMED_DENSITY = 1070
"""Density of a silicone [kg/m^3] according to the data sheets of Dragon Skin 10 and Ecoflex."""


def fits_diagram(tests: Sequence[TensileTest], fits: Sequence[Fit]) -> Diagram:
    """Return the diagram of a law fitted to several tests, each with a colour of its own.

    Points are measured within the range of the fit, lines fitted; below is the relative error.
    """
    largest = max(float(test.first_loading().stress.max()) for test in tests)
    factor, unit = (1e-3, "kPa") if largest < 1e6 else (1e-6, "MPa")
    curves, errors = [], []
    for name, test, fit, colour in zip(names_of(tests), tests, fits, cycle(COLOURS)):
        loading = test.first_loading()
        inside = (loading.strain > fit.min_strain) & (loading.strain <= fit.max_strain)
        strain, stress = loading.strain[inside], loading.stress[inside]
        x = np.linspace(0.0, float(strain[-1]), LAW_POINTS)
        error = test.stress_of(fit.law, strain) / stress - 1.0
        fitted = factor * test.stress_of(fit.law, x)
        curves += [
            PlotSeries(name, 100.0 * strain, factor * stress, colour, POINTS),
            PlotSeries("", 100.0 * x, fitted, colour),
        ]
        errors.append(PlotSeries("", 100.0 * strain, 100.0 * error, colour))
    return _fit(curves, errors, unit, f"{len(tests)} tests, {_constants(fits[0])}")


def names_of(tests: Sequence[TensileTest]) -> list[str]:
    """Return the modes of the tests, with their titles where several have the same mode."""
    modes = [test.mode for test in tests]
    return [
        test.mode if modes.count(test.mode) == 1 else f"{test.mode}, {test.title}" for test in tests
    ]


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
    law = test.stress_of(fit.law, x)
    law[law > HEADROOM * stress.max()] = np.nan
    fitted = np.where((x >= fit.min_strain) & (x <= fit.max_strain), law, np.nan)
    error = test.stress_of(fit.law, strain[inside]) / stress[inside] - 1.0
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
    return _fit(curves, errors, unit, f"{test.title}: {_constants(fit)}")


def _fit(curves: list[PlotSeries], errors: list[PlotSeries], unit: str, remark: str) -> Diagram:
    panels = [
        Panel(PlotAxis(Scale(f"engineering stress [{unit}]"), curves), height=TALL),
        Panel(PlotAxis(Scale("relative error [%]", from_zero=True), errors), height=FLAT),
    ]
    return Diagram("Fit", Scale("engineering strain [%]"), panels, remark)


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


def fit_rows(fits: Sequence[Fit], names: Sequence[str] = ("",)) -> list[tuple[str, str]]:
    """Return the numbers of fits with one law as (name, text), for tests of these `names`.

    They are the constants, the range and the error in each test, and the range of validity.
    """
    law = fits[0].law
    rows = [
        *((name, ", ".join(_numbers(law, name, 4))) for name in vars(law)),
        ("mu0", f"{law.initial_shear_modulus / 1e3:#.4g} kPa"),
    ]
    for fit, name in zip(fits, names, strict=True):
        rows += [
            *([(name, "")] if name else []),
            ("range", f"strain {fit.min_strain:.3g} to {fit.max_strain:.3g}, {fit.points} points"),
            (
                "residual",
                f"{fit.residual / 1e3:.3g} kPa rms, {100 * fit.relative_residual:.2g} % of the "
                f"stress, R^2 = {fit.r_squared:.5f}",
            ),
            (
                "largest error",
                f"{100 * fit.worst_error:.3g} % at a strain of {fit.worst_strain:.3g}",
            ),
        ]
    rows += [("stability", "")] if len(fits) > 1 else []
    for path, stretch in instability_stretch(law).items():
        end = SMALLEST_STRETCH if path == "compression" else LARGEST_STRETCH
        is_stable = f"stable: the stress rises up to a stretch of {end:g}"
        rows.append(
            (path, is_stable if stretch is None else f"UNSTABLE from a stretch of {stretch:.3g}")
        )
    return rows


def _percent(error: float) -> str:
    """Return a relative error in per cent with two or three digits."""
    if error > LARGEST_SHOWN:
        return f"more than {100.0 * LARGEST_SHOWN:.0f} %"
    return f"{100.0 * error:.0f} %" if error > 0.1 else f"{100.0 * error:.2g} %"


def prediction_rows(names: Sequence[str], errors: np.ndarray) -> list[tuple[str, str]]:
    """Return the errors (n, n) of `prediction_errors` as (name, text), one row per test fitted."""
    rows = []
    for name, row in zip(names, errors, strict=True):
        texts = [f"{other} {_percent(error)}" for other, error in zip(names, row, strict=True)]
        stable = bool(np.isfinite(row).all())
        rows.append((name, ", ".join(texts) if stable else "this test alone gives no stable fit"))
    return rows


def prediction_warnings(names: Sequence[str], fits: Sequence[Fit], errors: np.ndarray) -> list[str]:
    """Return warnings on tests that a fit to another one, or to all, misses by PREDICTED_WITHIN.

    errors (n, n): those of `prediction_errors`.
    """
    found = []
    for name, row in zip(names, errors, strict=True):
        missed = [
            f"{other} by {_percent(error)}"
            for other, error in zip(names, row, strict=True)
            if other != name and error > PREDICTED_WITHIN
        ]
        if missed:
            found.append(
                f"constants fitted to '{name}' alone miss {', '.join(missed)} rms: do not use "
                "this law with that test alone where the part is loaded in the other modes"
            )
    joint = [
        f"{name} by {_percent(fit.relative_residual)}"
        for name, fit in zip(names, fits, strict=True)
        if fit.relative_residual > PREDICTED_WITHIN
    ]
    if joint:
        found.append(
            f"the constants fitted to all tests miss {', '.join(joint)} rms: use another law "
            "(--law) or more terms (--terms), or check that the specimens are of one batch"
        )
    return found


def scene_snippet(tests: Sequence[TensileTest], fits: Sequence[Fit], law: str) -> str:
    """Return the fitted material in the YAML of a scene; `law` is its name in scenes.

    Its strain range is that of the uniaxial tests, or of all tests if none is uniaxial.
    """
    test, fit = tests[0], fits[0]
    ranges = [one.max_strain for one in fits if one.mode == UNIAXIAL.name]
    strain_range = max(ranges or [one.max_strain for one in fits])
    listed = "; ".join(f"{one.source}, {one.mode}" for one in tests)
    name = re.sub(r"\W+", "_", test.title.lower(), flags=re.ASCII).strip("_")
    name = name if name[:1].isalpha() else f"material_{name}"
    lines = [
        "materials:",
        f"  {name}:",
        f"    law: {law}",
        *(f"    {name}: {_in_yaml(fit.law, name)}" for name in _not_zero(fit.law)),
        f"    density: {ASSUMED_DENSITY} kg/m^3  # assumed; a tensile test does not give it",
        f"    strain_range: {strain_range:.3g}",
        f"    source: {json.dumps(f'fit to {listed}', ensure_ascii=False)}",
    ]
    return "\n".join(lines)


def _in_yaml(law: Law, name: str) -> str:
    """Return a field in the YAML of a scene: a number with its unit, or a list of such."""
    numbers = _numbers(law, name, 3)
    return f"[{', '.join(numbers)}]" if np.ndim(getattr(law, name)) else numbers[0]
