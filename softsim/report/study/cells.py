"""The cells of a heat map: design points by the levels of two factors."""

from dataclasses import dataclass

import numpy as np
import polars

from softsim.report.study.findings import FAILED_COUNT, Findings, usual
from softsim.report.study.scale import Scale


@dataclass(frozen=True)
class Cells:
    """Cells in rows and columns: places of their levels, columns (c,) and rows (r,); edges between
    them, at_x (c + 1,) and at_y (r + 1,). In each cell (r, c): the value, NaN where no case is
    done; its first case, 0 where there is none; whether cases failed and none is done.
    """

    columns: np.ndarray
    rows: np.ndarray
    at_x: np.ndarray
    at_y: np.ndarray
    values: np.ndarray
    cases: np.ndarray
    failed: np.ndarray

    @classmethod
    def of(cls, findings: Findings, x: Scale, y: Scale, z: Scale) -> "Cells":
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
        return cls(
            columns, rows, edges(columns, x.logarithmic), edges(rows, y.logarithmic),
            values, cases, (failed > 0) & np.isnan(values),
        )  # fmt: skip

    def box(self, i: int, j: int) -> tuple[float, float, float, float]:
        """Left, bottom, width and height of a cell."""
        x, y = self.at_x[i : i + 2], self.at_y[j : j + 2]
        return float(x[0]), float(y[0]), float(np.ptp(x)), float(np.ptp(y))

    def at(self, x: float, y: float) -> tuple[int, int]:
        """The column and row of a place."""
        i, j = (
            int(np.argmin(np.abs(levels - place)))
            for levels, place in ((self.columns, x), (self.rows, y))
        )
        return i, j


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


def remark_on_cells(findings: Findings, x: Scale, y: Scale) -> str:
    """What a reader must know of the cells: over what they are means, and what is left out."""
    others = [factor.name for factor in findings.varied if factor not in (x.axis, y.axis)]
    others += ["repeats"] * (findings.record.repeats > 1)
    said = [f"mean over {', '.join(others)}"] if others else []
    failed = findings.design_points[FAILED_COUNT].sum()
    if others and failed:
        said.append(f"without {failed} that failed")
    return ", ".join(said)
