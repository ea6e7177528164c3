"""Points read off a figure of the thesis: a CSV file a script, DIR/<script>.csv.

The numbers behind the thesis's figures are not available. A script names the columns it needs; a
further column `spread` (in the unit of the last one) holds the half width of the figure's shaded
band, where it has one.
"""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from softsim.errors import SoftsimError
from validation.verdicts import UNKNOWN, Finding, judged

Points = Mapping[str, np.ndarray]
"""Column -> numbers (points,); `spread` is zero where the file has none."""

SPREAD = "spread"
TOLERANCE = 0.2  # of the points' root mean square, where that is more than their spread


class DigitisedError(SoftsimError):
    """A file of digitised points that cannot be read."""

    exit_code = 2


def points_of(folder: Path | None, script: str, columns: Sequence[str]) -> Points | None:
    """The points for a script, None where there is no file for it. Raises DigitisedError."""
    path = None if folder is None else folder / f"{script}.csv"
    return read_points(path, columns) if path is not None and path.is_file() else None


def read_points(path: Path, columns: Sequence[str]) -> Points:
    """The numbers of a CSV file whose first line names its columns.

    Raises DigitisedError: a column is missing or unknown, a line holds no numbers, no points.
    """
    with path.open(encoding="utf-8", newline="") as stream:
        lines = list(csv.reader(stream))
    names = [name.strip() for name in lines[0]] if lines else []
    expected = f"columns: {', '.join(columns)}, and {SPREAD} if known"
    if set(names) - {SPREAD} != set(columns) or len(set(names)) != len(names):
        raise DigitisedError(f"{path}:1: the columns are {', '.join(names) or 'none'}", expected)
    rows = [(number, line) for number, line in enumerate(lines[1:], 2) if line]
    if not rows:
        raise DigitisedError(f"{path}: no points below the header", expected)
    values = np.array([_numbers(path, number, line, len(names)) for number, line in rows])
    points = dict(zip(names, values.T, strict=True))
    return {SPREAD: np.zeros(len(values))} | points


def _numbers(path: Path, number: int, line: list[str], count: int) -> list[float]:
    try:
        values = [float(text) for text in line]
    except ValueError as error:
        raise DigitisedError(f"{path}:{number}: {error}") from None
    if len(values) != count or not np.isfinite(values).all():
        raise DigitisedError(f"{path}:{number}: {count} finite numbers are due")
    return values


def deviation(
    computed: np.ndarray, points: np.ndarray, spread: np.ndarray, unit: str = ""
) -> Finding:
    """Root mean square of computed minus digitised (points,): less than the spread's, or than 20 %
    of the points' own. Points that nothing was computed for (NaN) are left out, and counted.
    """
    there = np.isfinite(computed)
    if not there.any():
        return Finding("nothing computed at these points", UNKNOWN)
    off = _rms(computed[there] - points[there])
    allowed = max(_rms(spread[there]), TOLERANCE * _rms(points[there]))
    text = f"{off:.3g} {unit} rms at {there.sum()} of {len(points)} points, {allowed:.3g} allowed"
    return judged(off <= allowed, text)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
