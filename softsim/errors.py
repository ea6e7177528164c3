"""Errors that softsim raises, each with the exit code of the command line.

All of them derive from `SoftsimError`. An error has a `message`, a `hint` with a remedy (or an
empty string) and an `exit_code`; its text is the message with the hint.

Examples
--------
>>> from softsim import load_scene
>>> from softsim.errors import SceneError
>>> try:
...     load_scene("block.yaml", ["time.end=-1 s"])
... except SceneError as error:
...     print(error.exit_code, error.location)
2 --set time.end=-1 s
"""

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
    """Base class of all errors of softsim.

    Parameters
    ----------
    message : str
        What is wrong.
    hint : str
        A remedy, or an empty string.

    Attributes
    ----------
    exit_code : int
        Exit code of the command line.
    element : int or None
        Number of the element at fault in a run, if there is one.
    """

    exit_code: int = 1
    element: int | None = None

    def __init__(self, message: str, hint: str = "") -> None:
        self.message, self.hint = shortened(message), shortened(hint)
        super().__init__(self.message)

    def __str__(self) -> str:
        """Return the message, with the hint below it."""
        return f"{self.message}\n  {self.hint}" if self.hint else self.message


@dataclass(frozen=True)
class Location:
    """Place in a file.

    Parameters
    ----------
    file : Path or str
        Path of the file.
    line, column : int
        Line and column, from 1.
    text : str
        The line itself.
    """

    file: Path | str
    line: int
    column: int
    text: str

    def __str__(self) -> str:
        """Return the place as file:line:column."""
        return f"{self.file}:{self.line}:{self.column}"

    def excerpt(self) -> list[str]:
        """Return the line with its number, and a caret below the column."""
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
    """Place on the command line, such as `--set time.end=3 s`.

    Parameters
    ----------
    text : str
        The option with its value.
    """

    text: str

    def __str__(self) -> str:
        """Return the option."""
        return shortened(self.text)

    def excerpt(self) -> list[str]:
        """Return no lines: the option itself is the place."""
        return []


class SceneError(SoftsimError):
    """A scene, study or chain file that is not valid. Exit code 2.

    Parameters
    ----------
    message, hint : str
        As of `SoftsimError`.
    location : Location or Option or None
        Place of the error in the file or on the command line, if it has one.
    further : sequence of SceneError
        Other errors found in the same file.
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
        """Return place, message, line of the file and hint of this and all further errors."""
        lines = [self.message]
        if self.location is not None:
            lines = [f"{self.location}: {self.message}", *self.location.excerpt()]
        if self.hint:
            lines.append(f"  {self.hint}")
        return "\n".join([*lines, *map(str, self.further)])


class MeshError(SoftsimError):
    """A mesh that cannot be used. Exit code 2."""

    exit_code = 2


class MaterialError(SoftsimError):
    """A material test that cannot be read or fitted. Exit code 2."""

    exit_code = 2


class CalibrationError(SoftsimError):
    """A pair of models of which one cannot be calibrated against the other. Exit code 2."""

    exit_code = 2


class ModesError(SoftsimError):
    """A body whose natural frequencies cannot be computed. Exit code 2."""

    exit_code = 2


class DeviceError(SoftsimError):
    """A device that is not available or has too little memory. Exit code 2."""

    exit_code = 2


class ClusterError(SoftsimError):
    """Workers of a study that do not respond or cannot run it. Exit code 2."""

    exit_code = 2


class OutputError(SoftsimError):
    """A folder or file that cannot be written or read. Exit code 2."""

    exit_code = 2


class SimulationError(SoftsimError):
    """A request that a `Simulation` cannot fulfil. Exit code 2."""

    exit_code = 2


class RunError(SoftsimError):
    """Base class of errors that end a run or study after its start."""


class StabilityError(RunError):
    """A run stopped by a check of its stability or plausibility. Exit code 3.

    Parameters
    ----------
    message, hint : str
        As of `SoftsimError`.
    element : int or None
        Number of the element at fault, counted over all bodies, if there is one.
    """

    exit_code = 3

    def __init__(self, message: str, hint: str = "", element: int | None = None) -> None:
        super().__init__(message, hint)
        self.element = element


class Interrupted(RunError):  # noqa: N818 - no fault of anybody
    """A run stopped by SIGINT or SIGTERM after writing its checkpoint. Exit code 4."""

    exit_code = 4


class ExpectationError(RunError):
    """A finished run with a result outside the scene's `expect` block. Exit code 5."""

    exit_code = 5
