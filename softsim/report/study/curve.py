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


@dataclass(frozen=True)
class Line:
    """Design points that differ in x alone, a row each: their places (n,), means (n,) and half of
    the band (n,), NaN where there is none. level: of the factor that tells lines apart.
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
        has_band = spread in line.columns  # labels have none
        band = BAND * line[spread].to_numpy() if has_band else np.full(len(places), np.nan)
        yield Line(key[0] if by else None, line, places, mean, band)


def remark(findings: Findings, x: Axis, by: Axis | None) -> str:
    """What a reader must know of the lines: over how many cases the mean is, what else varies."""
    said = []
    counts = findings.design_points[DONE_COUNT].filter(findings.design_points[DONE_COUNT] > 0)
    if len(counts) and counts.max() > 1:
        low, high = counts.min(), counts.max()
        n = f"{high}" if low == high else f"{low} to {high}"
        said.append(f"mean and {BAND:g} standard deviations of n = {n} repeats")
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
