"""Curves of a measure over a factor, one per level of another, with a band for repeated cases."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import polars
from matplotlib.colors import to_hex

from softsim.output.passage import Verdict
from softsim.report.colours import colours_of
from softsim.report.diagram import Series, shortened
from softsim.report.study.findings import (
    DONE_COUNT,
    SPREAD,
    VERDICT,
    AxisScale,
    Findings,
    written,
)
from softsim.report.style import BLUE, COLOURS
from softsim.study.axes import Axis

BAND = 3.0
"""Half-width of a band [standard deviations]."""

CONFIDENCE = 0.95
"""Confidence level of the interval of a proportion of cases."""


Level = float | str | None


def lines(
    findings: Findings, x: AxisScale, y: AxisScale, by: Axis | None
) -> Iterator[tuple[Level, Series]]:
    """Yield the lines in the order of the table, each with its level of `by`.

    A line joins design points that differ in x alone; each combination of the other factors has
    its own line.
    """
    points, spread = findings.design_points, SPREAD + y.axis.column
    apart = [axis.column for axis in findings.factors if axis not in (x.axis, by)]
    first = [by.column] if by else []
    groups = points.group_by([*first, *apart], maintain_order=True) if first + apart else [
        ((None,), points)
    ]  # fmt: skip
    for key, group in groups:
        line = group[np.argsort(x.places(group[x.axis.column]), kind="stable")]
        mean = y.places(line[y.axis.column])
        if is_share(findings, y.axis):
            band = wilson_band(mean, line[DONE_COUNT].to_numpy())
        elif spread in line.columns:
            half = BAND * line[spread].to_numpy()
            band = np.stack([mean - half, mean + half])
        else:  # labels have none
            band = np.full((2, len(mean)), np.nan)
        places, cases = x.places(line[x.axis.column]), line["case"].to_numpy()
        several = bool((line[DONE_COUNT] > 1).any())
        series = Series("", places, mean, band=band, cases=cases, mean=several)
        yield key[0] if by else None, series


def is_share(findings: Findings, y: Axis) -> bool:
    """Return True if a measure is 0 or 1 in repeated cases, so that its mean is a proportion."""
    repeats = findings.design_points[DONE_COUNT].max()
    if y.is_label or not isinstance(repeats, int) or repeats < 2:
        return False
    return bool(findings.done[y.column].drop_nulls().is_in([0.0, 1.0]).all())


def wilson_band(share: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Return Wilson's interval (2, n) of proportions (n,) of `count` (n,) cases, NaN if none."""
    from scipy.stats import binomtest  # slow to import

    band = np.full((2, len(share)), np.nan)
    for k in np.flatnonzero((count > 0) & np.isfinite(share)):
        found = binomtest(round(share[k] * count[k]), int(count[k]))
        band[:, k] = found.proportion_ci(CONFIDENCE, "wilson")
    return band


def pass_rate_in_words(findings: Findings) -> str:
    """Return how many of the drawn cases of a layout passed, with Wilson's interval.

    The result is empty for a study whose cases are not drawn from ranges, or have no verdict.
    """
    if not findings.record.sampled or VERDICT not in findings.table.columns:
        return ""
    verdicts = findings.done[VERDICT].drop_nulls()
    count, passed = len(verdicts), int((verdicts == Verdict.PASSED.value).sum())
    if count == 0:
        return "no case has a verdict"
    low, high = wilson_band(np.array([passed / count]), np.array([count]))[:, 0]
    others = verdicts.filter(verdicts != Verdict.PASSED.value).value_counts(sort=True)
    rest = "".join(f", {number} {verdict}" for verdict, number in others.iter_rows())
    uncounted = findings.table.height - count
    without = f"; {uncounted} more without a verdict (not counted)" if uncounted else ""
    return (
        f"passed: {passed} of {count} cases, {100.0 * passed / count:.0f} % "
        f"({100.0 * CONFIDENCE:g} % interval, Wilson: {100.0 * low:.0f} to {100.0 * high:.0f} %)"
        f"{rest}{without}"
    )


def remark(findings: Findings, x: Axis, y: Axis, by: Axis | None) -> str:
    """Return a note on the lines: the number of cases behind each mean, and what else varies."""
    said = []
    counts = findings.design_points[DONE_COUNT].filter(findings.design_points[DONE_COUNT] > 0)
    if len(counts) and counts.max() > 1:
        low, high = counts.min(), counts.max()
        n = f"{high}" if low == high else f"{low} to {high}"
        about = f"mean and {BAND:g} standard deviations"
        if is_share(findings, y):
            about = f"fraction with its {100.0 * CONFIDENCE:g} % interval (Wilson)"
        said.append(f"{about} of n = {n} repeats")
    apart = [axis.name for axis in findings.varied if axis not in (x, by)]
    if apart:
        said.append(f"one line for each {', '.join(apart)}")
    return "; ".join(said)


def curves(
    findings: Findings, x: AxisScale, y: AxisScale, by: Axis | None
) -> Iterator[Series]:  # fmt: skip
    """Yield the lines with their colours and names.

    Colours differ by level, or follow the colour bar if there is one; each level is named once.
    """
    found, named = list(lines(findings, x, y, by)), set()
    for (level, series), colour in zip(found, line_colours(findings, found, by), strict=True):
        name = ""
        if by is not None and level not in named and not has_bar(findings, by):
            name = f"{by.name} {shortened(written(by, level))}"
        named.add(level)
        yield replace(series, name=name, colour=colour)


def line_colours(
    findings: Findings, found: list[tuple[Level, Series]], by: Axis | None
) -> list[str]:
    """Return a colour for each line."""
    if by is None:
        return [BLUE] * len(found)
    levels = [level for level, _ in found]
    if has_bar(findings, by):
        scale = findings.scale(by.name)
        places = scale.places(polars.Series(levels))
        return [to_hex(colour) for colour in colours_of(scale, places).to_rgba(places)]
    unique = list(dict.fromkeys(levels))
    return [COLOURS[unique.index(level)] for level in levels]


def has_bar(findings: Findings, by: Axis | None) -> bool:
    """Return True if a colour bar explains the lines, because they are too many for a legend."""
    return by is not None and findings.level_count(by) > len(COLOURS)
