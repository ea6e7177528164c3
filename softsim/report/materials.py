"""Sources of a silicone: table of the library, curves in one figure, comparison with a test."""

from itertools import cycle
from pathlib import Path

import numpy as np
from rich.table import Table

from softsim.materials.laws import UNIAXIAL
from softsim.materials.library import Silicone, SiliconeSource
from softsim.materials.tensile import TensileTest
from softsim.report.diagram import POINTS, Diagram, Panel, PlotAxis, PlotSeries, Scale
from softsim.report.png import draw
from softsim.report.style import COLOURS, INK

DRAWN_RANGE = 0.3
"""Strain up to which a source that gives only a modulus is drawn, as a neo-Hookean solid."""

COMPARED_FROM = 0.1
"""Strain below which a test from crosshead travel shows its slack; see `fitting.MIN_STRAIN`."""

LAW_POINTS = 200
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
    table = Table(
        title=f"{silicone.title}: {silicone.name}", caption=caption,
        title_justify="left", caption_justify="left",
    )  # fmt: skip
    has_batches = any(source.spec.batch for source in silicone.sources)
    table.add_column("entry")
    table.add_column("mu0, kPa", justify="right")
    table.add_column("E0, kPa", justify="right")
    for heading in ("strain", "test", *(["batch"] if has_batches else []), "source"):
        table.add_column(heading, overflow="fold")
    for source in silicone.sources:
        mu0, spec = source.initial_shear_modulus, source.spec
        table.add_row(
            source.name if source.is_material else f"({source.name})",
            _kilo(mu0), _kilo(3.0 * mu0), _strains(source), spec.test,
            *([spec.batch or "not stated"] if has_batches else []),
            f"{spec.citation} {spec.url}".rstrip(),
        )  # fmt: skip
    return table


def _kilo(modulus: float) -> str:
    return f"{modulus / 1e3:.3g}"


def _strains(source: SiliconeSource) -> str:
    """Return the strain range of a source in per cent, as far as it is stated."""
    if source.spec.strains is not None:
        low, high = (100.0 * strain for strain in source.spec.strains)
        return f"{low:.3g} to {high:.3g} %"
    return "not stated" if source.strain_range is None else f"to {100 * source.strain_range:.3g} %"


def draw_sources(silicone: Silicone, test: TensileTest | None, path: Path) -> None:
    """Draw `sources_diagram` as PNG. Raises OutputError if the file cannot be written."""
    draw(path, sources_diagram(silicone, test))


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
        stretch = 1.0 + np.linspace(0.0, end, LAW_POINTS)
        curves = [(_label(source), stretch, UNIAXIAL.nominal_stress(source.law, stretch), kind)]
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


def _label(source: SiliconeSource) -> str:
    """Return the name and the authors of a source for the legend."""
    authors = source.spec.citation.split(",")[0].split(" (")[0]
    return f"{source.name}: {authors}"


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
