"""history.csv: one row of numbers a sample; the first line has the names, the second the units."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import ArrayLike

from softsim.errors import OutputError
from softsim.output.folder import explained, replacing

TIME = "time"

REPLACED = "\N{REPLACEMENT CHARACTER}"
"""Character that Python reads in place of a byte that is no UTF-8."""


class History:
    """Writer of history.csv, one line per row, flushed to the operating system by each `append`.

    units: column name -> unit, in the order of the columns; "time" must be one of them. Numbers are
    written so that reading gives the same bits. resumed_at: time [s] at which a stopped run goes
    on, None: a file that is there is replaced. Later rows and a half-written last line go, so that
    the resumed run leaves the file that an uninterrupted one would.

    Raises OutputError if the disk refuses, or if there is no history to go on with, or one with
    other columns or units.
    """

    def __init__(
        self, path: Path | str, units: Mapping[str, str], resumed_at: float | None = None
    ) -> None:
        self.path, self.columns = Path(path), tuple(units)
        kept = [] if resumed_at is None else _rows_until(self.path, units, resumed_at)
        self.row_count = len(kept)
        with replacing(self.path) as partial:
            text = "".join([_header(units), *kept])
            partial.write_text(text, encoding="utf-8", newline="\n")
        with explained(self.path):
            self._stream: TextIO = self.path.open("a", encoding="utf-8", newline="\n", buffering=1)

    def append(self, rows: Mapping[str, ArrayLike]) -> None:
        """Write rows: numbers (rows,) of each column, or one, NaN where there is no value.

        Raises OutputError for a missing or unknown column, or if the disk refuses.
        """
        if rows.keys() != set(self.columns):
            missing = sorted(set(self.columns) - rows.keys())
            unknown = sorted(rows.keys() - set(self.columns))
            raise OutputError(
                f"a row of {self.path} does not match its columns: missing {missing or 'none'}, "
                f"unknown {unknown or 'none'}"
            )
        lines = [",".join(map(repr, row)) + "\n" for row in table(rows, self.columns).tolist()]
        with explained(self.path):
            self._stream.write("".join(lines))
            self._stream.flush()
        self.row_count += len(lines)

    def save(self) -> None:
        """Put the rows on the disk. Raises OutputError if the disk refuses."""
        with explained(self.path):
            os.fsync(self._stream.fileno())

    def close(self) -> None:
        """Put the rows on the disk and close, unless that is done. Raises OutputError if the disk
        refuses.
        """
        if not self._stream.closed:
            with explained(self.path), self._stream:
                os.fsync(self._stream.fileno())


def table(rows: Mapping[str, ArrayLike], names: Sequence[str]) -> np.ndarray:
    """Return rows (column -> (rows,) numbers, or one) as an array (rows, columns)."""
    columns = np.broadcast_arrays(*(np.asarray(rows[name], dtype=float) for name in names))
    return np.stack([np.atleast_1d(column) for column in columns], axis=1)


def read_history(path: Path | str) -> dict[str, np.ndarray]:
    """Return the columns of a history, (rows,) each, SI; a half-written last line is left out.

    Raises OutputError if there is no such file, it has no header, or a line is no row of numbers.
    """
    path = Path(path)
    lines = _whole_lines(path)
    names = lines[0].strip().split(",")
    return dict(zip(names, _numbers(path, lines[2:], len(names)).T, strict=True))


def thin_history(path: Path, rows: int) -> None:
    """Reduce a history to about `rows` rows, evenly picked, with the first and the last.

    One of up to twice as many rows stays as it is. Raises OutputError as read_history does, or if
    the disk refuses.
    """
    lines = _whole_lines(path)
    count = len(lines) - 2
    if count <= 2 * rows:
        return
    picked = np.linspace(2, count + 1, rows).round().astype(int)
    with replacing(path) as partial:
        text = "".join([*lines[:2], *(lines[i] for i in picked)])
        partial.write_text(text, encoding="utf-8", newline="\n")


def read_units(path: Path | str) -> dict[str, str]:
    """Return the units of the columns, name -> unit. Raises OutputError as read_history does."""
    names, units = (line.strip().split(",") for line in _whole_lines(Path(path))[:2])
    return dict(zip(names, units, strict=True))


def _rows_until(path: Path, units: Mapping[str, str], time: float) -> list[str]:
    """Return the lines of the rows up to `time` [s]. Raises OutputError if the columns differ."""
    lines, header = _whole_lines(path), _header(units)
    if "".join(lines[:2]) != header:
        raise OutputError(
            f"{path} has columns other than those of this run: it starts with "
            f"{lines[0].strip()!r}, expected {header.splitlines()[0]!r}, or the units in its "
            "second line differ",
            hint="resume with the scene with which the run was started",
        )
    times = _numbers(path, lines[2:], len(units))[:, list(units).index(TIME)]
    return [line for line, t in zip(lines[2:], times, strict=True) if t <= time]


def _header(units: Mapping[str, str]) -> str:
    return ",".join(units) + "\n" + ",".join(units.values()) + "\n"


def _numbers(path: Path, lines: list[str], count: int) -> np.ndarray:
    """Return the numbers of the rows, (rows, count)."""
    rows = np.empty((len(lines), count))
    for i, line in enumerate(lines):
        numbers = line.split(",")
        try:
            if len(numbers) != count:
                raise ValueError(f"{len(numbers)} values")
            rows[i] = [float(number) for number in numbers]
        except ValueError as error:
            raise OutputError(
                f"{path}:{i + 3}: expected {count} numbers: {line.strip()[:80]!r}",
                hint="the file was changed after the run: correct or remove this line",
            ) from error
    return rows


def _whole_lines(path: Path) -> list[str]:
    """Return the complete lines, at least the two of the header.

    A killed run may leave an incomplete last line.
    """
    try:
        # A byte that is no UTF-8 becomes a character that no number and no name has.
        with path.open(encoding="utf-8", errors="replace", newline="") as stream:
            lines = stream.readlines()
    except OSError as error:
        raise OutputError(
            f"cannot read the history {path}: {error.strerror}",
            hint="name a folder that a run has written",
        ) from error
    if lines and not lines[-1].endswith("\n"):
        lines.pop()
    header = lines[:2]
    if (
        len(header) < 2
        or header[0].count(",") != header[1].count(",")
        or TIME not in header[0].strip().split(",")
        or REPLACED in "".join(header)
    ):
        raise OutputError(
            f"{path} is not a history: its first line must contain the columns, its second line "
            "their units",
            hint="the run was stopped before its first row, or this is another file",
        )
    return lines
