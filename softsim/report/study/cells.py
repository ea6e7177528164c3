"""The cells of a heat map: design points by the levels of two factors."""

import numpy as np
import polars

from softsim.report.diagram import Cells
from softsim.report.study.findings import FAILED_COUNT, Findings, usual
from softsim.report.study.scale import AxisScale


def cells_of(findings: Findings, x: AxisScale, y: AxisScale, z: AxisScale) -> Cells:
    """The mean of z, or its most frequent label, over all cases at two levels."""
    found = findings.design_points.group_by(x.axis.column, y.axis.column).agg(
        usual(z.axis, polars.col(z.axis.column)).alias("value"),
        polars.col("case").min(),
        polars.col(FAILED_COUNT).sum(),
    )
    columns, i = np.unique(x.places(found[x.axis.column]), return_inverse=True)
    rows, j = np.unique(y.places(found[y.axis.column]), return_inverse=True)
    values = np.full((len(rows), len(columns)), np.nan)
    values[j, i] = z.places(found["value"])
    cases, failed = np.zeros(values.shape, dtype=int), np.zeros(values.shape, dtype=int)
    cases[j, i], failed[j, i] = found["case"], found[FAILED_COUNT]
    return Cells(
        columns, rows, edges(columns, x.logarithmic), edges(rows, y.logarithmic),
        values, cases, (failed > 0) & np.isnan(values), bool(averaged(findings, x, y)),
    )  # fmt: skip


def edges(levels: np.ndarray, logarithmic: bool) -> np.ndarray:
    """Edges (n + 1,) of cells around rising levels (n,): half-way between them, by their ratio
    where they are spaced logarithmically; the outer cells reach as far beyond their level.
    """
    at = np.log(levels) if logarithmic else levels
    if len(at) == 1:
        found = at[0] + np.array([-0.5, 0.5]) * (1.0 if logarithmic else abs(at[0]) or 1.0)
    else:
        middle = 0.5 * (at[:-1] + at[1:])
        found = np.array([2.0 * at[0] - middle[0], *middle, 2.0 * at[-1] - middle[-1]])
    return np.exp(found) if logarithmic else found


def averaged(findings: Findings, x: AxisScale, y: AxisScale) -> list[str]:
    """Over what the cells of two factors are means."""
    others = [factor.name for factor in findings.varied if factor not in (x.axis, y.axis)]
    return others + ["repeats"] * (findings.record.repeats > 1)


def remark_on_cells(findings: Findings, x: AxisScale, y: AxisScale) -> str:
    """What a reader must know of the cells: over what they are means, and what is left out."""
    others = averaged(findings, x, y)
    said = [f"mean over {', '.join(others)}"] if others else []
    failed = findings.design_points[FAILED_COUNT].sum()
    if others and failed:
        said.append(f"without {failed} that failed")
    return ", ".join(said)
