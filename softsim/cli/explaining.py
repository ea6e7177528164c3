"""Where a command prints, and how it ends when its user meets an error."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import typer
from rich.console import Console

from softsim.errors import SoftsimError


@contextmanager
def explained() -> Iterator[Console]:
    """A console for the command; an error for the user ends it with its exit code."""
    console = Console()
    try:
        yield console
    except SoftsimError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(error.exit_code) from error
