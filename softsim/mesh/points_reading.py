"""Reading of points of a line in the plane from a text table."""

import re
from pathlib import Path

import numpy as np

from softsim.errors import MeshError


def read_points(path: Path, length_unit: float) -> np.ndarray:
    """Return points (n, 2) [m] from a file with x and y in each line.

    They are separated by a comma, a semicolon, a tab or blanks. length_unit: metres in one unit of
    the file. Empty lines and text after a # are skipped, as is a first line without any number,
    which names the columns.

    Raises MeshError, naming file and line, if it cannot be read or a line has not two numbers.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise MeshError(
            f"{path}: cannot be read as a table of points ({error})",
            hint="use a text file with x and y of one point per line",
        ) from error
    points: list[list[float]] = []
    seen = 0
    for number, line in enumerate(lines, start=1):
        words = [word for word in re.split(r"[;,\s]+", line.partition("#")[0]) if word]
        if not words:
            continue
        seen += 1
        values = [_value(word) for word in words]
        if seen == 1 and not any(np.isfinite(values)):
            continue
        if len(values) != 2 or not np.isfinite(values).all():
            raise MeshError(
                f"{path}:{number}: '{line.strip()}' is not a point",
                hint="write two numbers, x and y, separated by a comma, a semicolon, a tab or "
                "spaces",
            )
        points.append(values)
    return length_unit * np.array(points).reshape(-1, 2)


def _value(word: str) -> float:
    """Return the number that a word represents, NaN if it is none."""
    try:
        return float(word)
    except ValueError:
        return float("nan")
