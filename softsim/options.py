"""Options, console and error handling shared by the commands."""

import sys
from collections.abc import Iterator, Mapping, Sized
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from softsim.errors import Option, SceneError, SoftsimError
from softsim.interruption import INTERRUPTED, STOPPED
from softsim.units import parse

ScenePath = Annotated[Path, typer.Argument(help="Scene file (YAML).", show_default=False)]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Override a value, such as time.end='2 s'."),
]

Threads = Annotated[
    str,
    typer.Option(
        metavar="N|auto", help="Number of CPU threads; auto: 1 for a small model, else all cores."
    ),
]

StudyPath = Annotated[Path, typer.Argument(help="Study file (YAML).", show_default=False)]
StudyOverrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Override a value in all cases."),
]
Workers = Annotated[
    int | None,
    typer.Option(min=1, help="Number of worker processes; default: one per core, or one per GPU."),
]
Scheduler = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Use the workers of the dask scheduler at this address."),
]


class DeviceName(str, Enum):
    """Device of a computation."""

    auto = "auto"
    cpu = "cpu"
    cuda = "cuda"


class Precision(str, Enum):
    """Precision of state and forces."""

    f64 = "f64"


Device = Annotated[DeviceName, typer.Option(help="Device to run on.")]


@contextmanager
def explained() -> Iterator[Console]:
    """Yield the console of a command; a user error ends the command with its exit code."""
    console = Console()
    try:
        yield console
    except SoftsimError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(error.exit_code) from error
    except KeyboardInterrupt:
        print(STOPPED, file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None


def quantity(option: str, text: str, unit: str) -> float:
    """Return the value of an option in the SI unit `unit`. Raises SceneError if it is invalid."""
    try:
        return parse(text, unit)
    except ValueError as error:
        raise SceneError(str(error), "", Option(f"{option} {text}")) from None


def positive(option: str, text: str, unit: str) -> float:
    """Return the value of an option as `quantity`; it must be greater than zero."""
    value = quantity(option, text, unit)
    if not value > 0.0:
        raise SceneError(f"{text!r} must be greater than zero", "", Option(f"{option} {text}"))
    return value


def rows_of_sets(
    nodes: Mapping[str, Sized], facets: Mapping[str, Sized], cells: Mapping[str, Sized]
) -> list[tuple[str, str]]:
    """Return rows of a table with the names and sizes of sets, by kind."""
    kinds = {"node sets": nodes, "facet sets": facets, "cell sets": cells}
    return [
        (kind, ", ".join(f"{name} ({len(members)})" for name, members in sorted(sets.items())))
        for kind, sets in kinds.items()
        if sets
    ]
