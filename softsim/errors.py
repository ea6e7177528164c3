"""Errors that a user meets: each has an exit code and, where there is one, a way out."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

LONGEST_LINE = 120
"""Characters of a line of a file that an error shows."""
LONGEST_TEXT = 2000
"""Characters of a message or a hint, which may quote a value of any length."""
GAP = "..."


def shortened(text: str) -> str:
    """Return a text of at most LONGEST_TEXT characters: a longer one loses its middle."""
    if len(text) <= LONGEST_TEXT:
        return text
    end = LONGEST_TEXT // 4
    return f"{text[: LONGEST_TEXT - end - len(GAP)]}{GAP}{text[-end:]}"


class SoftsimError(Exception):
    """A failure with a message, a hint what to try, and the exit code of the command; element: that
    of a run which it is about, if there is one.
    """

    exit_code: int = 1
    element: int | None = None

    def __init__(self, message: str, hint: str = "") -> None:
        self.message, self.hint = shortened(message), shortened(hint)
        super().__init__(self.message)

    def __str__(self) -> str:
        return f"{self.message}\n  {self.hint}" if self.hint else self.message


@dataclass(frozen=True)
class Location:
    """A place in a text: file, line and column (from 1), and the line itself."""

    file: Path | str
    line: int
    column: int
    text: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"

    def excerpt(self) -> list[str]:
        """The line with its number, and a caret below the column."""
        number = f"{self.line:>5} | "
        text, column = self._part_around_column()
        before = "".join(c if c == "\t" else " " for c in text[: column - 1])
        line = "".join(c if c.isprintable() or c == "\t" else "?" for c in text)
        return [number + line, " " * (len(number) - 2) + "| " + before + "^"]

    def _part_around_column(self) -> tuple[str, int]:
        """Return the line and the column, of a long line the part around the column."""
        if len(self.text) <= LONGEST_LINE:
            return self.text, self.column
        first = min(max(0, self.column - LONGEST_LINE // 2), len(self.text) - LONGEST_LINE)
        last = first + LONGEST_LINE
        left, right = GAP if first > 0 else "", GAP if last < len(self.text) else ""
        return left + self.text[first:last] + right, self.column - first + len(left)


@dataclass(frozen=True)
class Option:
    """A place on the command line, such as `--set time.end=3 s`."""

    text: str

    def __str__(self) -> str:
        return shortened(self.text)

    def excerpt(self) -> list[str]:
        """Nothing more than the text itself tells."""
        return []


class SceneError(SoftsimError):
    """A scene that cannot be run.

    `location` is where it says so, if it says so anywhere; `further` are the other problems that
    the same scene has.
    """

    exit_code = 2

    def __init__(
        self,
        message: str,
        hint: str = "",
        location: Location | Option | None = None,
        further: Sequence["SceneError"] = (),
    ) -> None:
        super().__init__(message, hint)
        self.location, self.further = location, tuple(further)

    def __str__(self) -> str:
        lines = [self.message]
        if self.location is not None:
            lines = [f"{self.location}: {self.message}", *self.location.excerpt()]
        if self.hint:
            lines.append(f"  {self.hint}")
        return "\n".join([*lines, *map(str, self.further)])


class MeshError(SoftsimError):
    """A mesh that cannot be computed with."""

    exit_code = 2


class MaterialError(SoftsimError):
    """A material test that cannot be read or fitted."""

    exit_code = 2


class CalibrationError(SoftsimError):
    """Two models of which one cannot be calibrated by the other."""

    exit_code = 2


class ModesError(SoftsimError):
    """A body whose natural frequencies cannot be told."""

    exit_code = 2


class DeviceError(SoftsimError):
    """A device that is not there."""

    exit_code = 2


class ClusterError(SoftsimError):
    """Workers that do not answer, or cannot do their work."""

    exit_code = 2


class OutputError(SoftsimError):
    """A folder or file that cannot be written or read."""

    exit_code = 2


class SimulationError(SoftsimError):
    """What a simulation in Python is asked and cannot do."""

    exit_code = 2


class RunError(SoftsimError):
    """The end of a run, or of a study, that had begun: its folder keeps what it found."""


class StabilityError(RunError):
    """A run stopped by a guard; element: its number among those of all bodies."""

    exit_code = 3

    def __init__(self, message: str, hint: str = "", element: int | None = None) -> None:
        super().__init__(message, hint)
        self.element = element


class Interrupted(RunError):  # noqa: N818 - no fault of anybody
    """A run stopped by a signal; its checkpoint is written."""

    exit_code = 4


class ExpectationError(RunError):
    """A finished run outside what its scene expects."""

    exit_code = 5
