"""Command of the analytical model, which represents a robot by masses connected by springs."""

from pathlib import Path
from typing import Annotated

import typer

from softsim.options import Overrides, explained
from softsim.report.table import Table


def chain(
    robot: Annotated[
        str,
        typer.Argument(
            help="Built-in robot (leafbot3, leafbot5, leafbot9, leafbot_x5) or chain file (YAML).",
            show_default=False,
        ),
    ],
    frequency: Annotated[
        str | None, typer.Option(help="Motor frequency, such as '142 Hz'; default: as in the file.")
    ] = None,
    slope: Annotated[
        str | None,
        typer.Option(help="Slope of the ground, such as '10 deg'; default: as in the file."),
    ] = None,
    overrides: Overrides = None,
    out: Annotated[
        Path | None, typer.Option(help="Output folder; default: runs/ROBOT_chain.")
    ] = None,
) -> None:
    """Simulate a robot with the analytical model: a chain of masses and springs driven by a motor.

    A run takes seconds; a finite-element run of the same robot takes minutes.
    """
    with explained() as console:
        from softsim.apps.chain.report import chain_rows, draw_chain
        from softsim.apps.chain.running import run_chain
        from softsim.apps.chain.scene import load_chain

        given = {
            "--frequency": (("motor", "frequency"), frequency),
            "--slope": (("slope",), slope),
        }
        options = {flag: (keys, text) for flag, (keys, text) in given.items() if text is not None}
        loaded = load_chain(robot, overrides or [], options)
        folder = out or Path("runs") / f"{loaded.path.stem}_chain"
        results = run_chain(loaded, folder)
        console.print(Table(chain_rows(results.summary)), highlight=False)
        console.print(f"figure  {draw_chain(folder)}", highlight=False)
        console.print(f"results in {folder}", highlight=False)
