"""Command-line interface: the commands of `softsim` in the order of `softsim --help`.

Applications add theirs through `COMMANDS` of softsim/applications.py.
"""

from typing import Annotated

import typer

from softsim.applications import COMMANDS, entry
from softsim.cli.about import devices, examples, new, print_version, schema
from softsim.cli.materials import fit_material, materials, spectrum
from softsim.cli.meshing import mesh
from softsim.cli.reporting import render, report
from softsim.cli.runs import assess, check, compile, optimize, run, sweep
from softsim.cli.vibrations import modes, response
from softsim.interruption import become_command

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)


@app.callback()
def softsim(
    version: Annotated[
        bool,
        typer.Option("--version", callback=print_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Simulate soft robots with finite elements: explicit dynamics, large deformation, contact."""


for command in (
    examples, new, mesh, run, compile, check, modes, response, assess, sweep, optimize,
    report, render, materials, fit_material, spectrum, schema, devices, *map(entry, COMMANDS),
):  # fmt: skip
    app.command()(command)


def main() -> None:
    """Entry point of the `softsim` command."""
    become_command()
    app()
