"""Errors that a user meets: each has an exit code and, where there is one, a way out."""

from dataclasses import dataclass
from pathlib import Path


class SoftsimError(Exception):
    """A failure with a message, a hint what to try, and the exit code of the command."""

    exit_code = 1

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message, self.hint = message, hint

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


class SceneError(SoftsimError):
    """A scene that cannot be run; `location` is where it says so, if it says so anywhere."""

    exit_code = 2

    def __init__(self, message: str, hint: str = "", location: Location | None = None) -> None:
        super().__init__(message, hint)
        self.location = location

    def __str__(self) -> str:
        if self.location is None:
            return super().__str__()
        number = f"{self.location.line:>5} | "
        caret = " " * (len(number) - 2) + "| " + " " * (self.location.column - 1) + "^"
        lines = [f"{self.location}: {self.message}", number + self.location.text, caret]
        return "\n".join([*lines, f"  {self.hint}"] if self.hint else lines)


class MeshError(SoftsimError):
    """A mesh that cannot be computed with."""

    exit_code = 2


class DeviceError(SoftsimError):
    """A device that is not there."""

    exit_code = 2


class OutputError(SoftsimError):
    """A folder or file that cannot be written or read."""

    exit_code = 2


class StabilityError(SoftsimError):
    """A run stopped by a guard."""

    exit_code = 3


class Interrupted(SoftsimError):
    """A run stopped by a signal; its checkpoint is written."""

    exit_code = 4


class ExpectationError(SoftsimError):
    """A finished run outside what its scene expects."""

    exit_code = 5
