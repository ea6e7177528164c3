"""A measure over a factor: a line for each level of another one, in a band where cases repeat."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import polars
from matplotlib.colors import to_hex

from softsim.report.study.findings import DONE_COUNT, SPREAD, Findings, written
from softsim.report.study.scale import Scale, shortened
from softsim.report.style import BLUE, COLOURS
from softsim.study.axes import Axis

BAND = 3.0
"""Half of a band [standard deviations]."""

CONFIDENCE = 0.95
"""Of the interval about a share of the cases."""


@dataclass(frozen=True)
class Line:
    """Design points that differ in x alone, a row each: their places (n,), means (n,), and the band
    from its lowest to its highest values (2, n), NaN where there is none. level: of the factor that
    tells lines apart.
    """

    level: float | str | None
    points: polars.DataFrame
    x: np.ndarray
    mean: np.ndarray
    band: np.ndarray


def lines(findings: Findings, x: Scale, y: Scale, by: Axis | None) -> Iterator[Line]:
    """The lines, in the order of the table; what else varies makes lines of its own."""
    points, spread = findings.design_points, SPREAD + y.axis.column
    apart = [axis.column for axis in findings.factors if axis not in (x.axis, by)]
    first = [by.column] if by else []
    groups = points.group_by([*first, *apart], maintain_order=True) if first + apart else [
        ((None,), points)
    ]  # fmt: skip
    for key, group in groups:
        line = group[np.argsort(x.places(group[x.axis.column]), kind="stable")]
        places, mean = x.places(line[x.axis.column]), y.places(line[y.axis.column])
        if is_share(findings, y.axis):
            band = wilson_band(mean, line[DONE_COUNT].to_numpy())
        elif spread in line.columns:
            half = BAND * line[spread].to_numpy()
            band = np.stack([mean - half, mean + half])
        else:  # labels have none
            band = np.full((2, len(places)), np.nan)
        yield Line(key[0] if by else None, line, places, mean, band)


def is_share(findings: Findings, y: Axis) -> bool:
    """Whether a measure says yes or no, 1 or 0, in cases that repeat: its mean is a share."""
    repeats = findings.design_points[DONE_COUNT].max()
    if y.is_label or not isinstance(repeats, int) or repeats < 2:
        return False
    return bool(findings.done[y.column].drop_nulls().is_in([0.0, 1.0]).all())


def wilson_band(share: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Wilson's interval (2, n) about shares (n,) of `count` (n,) cases each; NaN without cases."""
    from scipy.stats import binomtest  # slow to import

    band = np.full((2, len(share)), np.nan)
    for k in np.flatnonzero((count > 0) & np.isfinite(share)):
        found = binomtest(round(share[k] * count[k]), int(count[k]))
        band[:, k] = found.proportion_ci(CONFIDENCE, "wilson")
    return band


def remark(findings: Findings, x: Axis, y: Axis, by: Axis | None) -> str:
    """What a reader must know of the lines: over how many cases the mean is, what else varies."""
    said = []
    counts = findings.design_points[DONE_COUNT].filter(findings.design_points[DONE_COUNT] > 0)
    if len(counts) and counts.max() > 1:
        low, high = counts.min(), counts.max()
        n = f"{high}" if low == high else f"{low} to {high}"
        about = f"mean and {BAND:g} standard deviations"
        if is_share(findings, y):
            about = f"share and its {100.0 * CONFIDENCE:g} % interval (Wilson)"
        said.append(f"{about} of n = {n} repeats")
    apart = [axis.name for axis in findings.varied if axis not in (x, by)]
    if apart:
        said.append(f"a line each of {', '.join(apart)}")
    return "; ".join(said)


def line_colours(findings: Findings, found: list[Line], by: Axis | None) -> list[str]:
    """A colour for each line: told apart by level, or rising with it where there are many."""
    if by is None:
        return [BLUE] * len(found)
    if has_bar(findings, by):
        scale = findings.scale(by.name)
        places = scale.places(polars.Series([line.level for line in found]))
        return [to_hex(colour) for colour in scale.colours(places).to_rgba(places)]
    levels = list(dict.fromkeys(line.level for line in found))
    return [COLOURS[levels.index(line.level)] for line in found]


def has_bar(findings: Findings, by: Axis | None) -> bool:
    """Whether a bar says what the colours of lines mean: there are too many for a legend."""
    return by is not None and findings.level_count(by) > len(COLOURS)


def line_labels(findings: Findings, found: list[Line], by: Axis | None) -> list[str]:
    """What the legend calls each line; nothing a second time, or where a bar says it."""
    if by is None or has_bar(findings, by):
        return [""] * len(found)
    labels: list[str] = []
    for line in found:
        label = f"{by.name} {shortened(written(by, line.level))}"
        labels.append("" if label in labels else label)
    return labels
