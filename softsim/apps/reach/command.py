"""Command that computes how far a robot that trails a tether gets through a layout."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from softsim.options import (
    Device,
    DeviceName,
    Overrides,
    Scheduler,
    Workers,
    explained,
)
from softsim.report.table import Row, Table, cell

if TYPE_CHECKING:  # Taichi is for those who compute forces
    from softsim.apps.reach.running import Plan, Search


def reach(
    layout: Annotated[
        Path,
        typer.Argument(help="Scene file with a pipe_path and no robot.", show_default=False),
    ],
    robot: Annotated[str, typer.Option(help="Standard robot to place in the layout.")] = "pfr",
    overrides: Overrides = None,
    out: Annotated[
        Path | None, typer.Option(help="Output folder; default: runs/LAYOUT_ROBOT_reach.")
    ] = None,
    device: Device = DeviceName.auto,
    workers: Workers = None,
    scheduler: Scheduler = None,
    ratio: Annotated[
        float,
        typer.Option(
            min=1.01,
            help="Stop when the bounds of the pulling force differ by no more than this factor.",
        ),
    ] = 1.2,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Only print the number of trials and their run time."),
    ] = False,
) -> None:
    """Compute how far, in metres, a robot gets through a layout of pipes while it pulls its tether.

    Trial runs find the pulling force of the robot, in level pipes against friction and in vertical
    pipes against gravity. The reach follows from this force and the tension of the tether along
    the layout. The key `trailed` of the layout describes the tether. Repeat the command to continue
    after an interruption.
    """
    with explained() as console:
        from softsim.scene.loading import REACH, load_layout

        loaded = load_layout(layout, robot, overrides or [], REACH)
        # Taichi is imported from here on: an error before is told at once.
        from softsim.apps.reach.report import draw_reach
        from softsim.apps.reach.running import plan_for, searches, seek, write_answer
        from softsim.compute.machine import device_of_trials
        from softsim.sweep.engine import pool_for

        plan = plan_for(loaded, robot, overrides or [])
        folder = out or Path("runs") / f"{layout.stem}_{robot}_reach"
        taken = device_of_trials(device.value)
        if dry_run:
            with TemporaryDirectory() as written:
                asked = searches(plan.scenes, plan.puller, Path(written), folder, ratio, taken)
                _tell_plan(asked, console)
                _tell_cost(plan, asked, taken, console)
            return
        asked = searches(plan.scenes, plan.puller, folder, folder, ratio, taken)
        _tell_plan(asked, console)
        pool = pool_for(folder, taken, workers, scheduler)
        seek(asked, folder, pool, taken, console)
        write_answer(plan, robot, asked, folder)
        _tell_answer(folder, console)
        console.print(f"figure  {draw_reach(folder)}", highlight=False)
        console.print(f"results in {folder}", highlight=False)


def _tell_plan(asked: "list[Search]", console: Console) -> None:
    """Print the pipes in which the pull of the robot is measured and the number of trials."""
    rows: list[Row] = [
        [search.pipe.name, cell(len(search.trials)), cell(search.left)] for search in asked
    ]
    console.print(Table(rows, ["pipe", "stored trials", "remaining, at most"]))


def _tell_cost(plan: "Plan", asked: "list[Search]", device: str, console: Console) -> None:
    """Print the longest remaining time, estimated with a short trial run in each pipe.

    The time is an upper bound: a trial ends with its last pressure cycle, usually before its
    time.
    """
    from softsim.compute.machine import choose
    from softsim.report.figures import duration
    from softsim.run.pilot import predicted_duration
    from softsim.run.scenes import ready_model

    choice, total = choose(device, "1"), 0.0
    for search in asked:
        loaded = plan.scenes[search.pipe]
        if search.left:
            each = predicted_duration(loaded, ready_model(loaded, choice), choice).total
            total += search.left * each
            console.print(f"one trial in {search.pipe.name}: at most {duration(each)} on one core")
    console.print(f"total: at most {duration(total)} on one core", style="bold", highlight=False)


def _tell_answer(folder: Path, console: Console) -> None:
    """Print the pulling forces, the lengths of straight pipe and the reach."""
    from softsim.apps.reach.report import pull_rows, read_reach

    found = read_reach(folder)
    console.print(Table(pull_rows(found), ["pipe", "pulling force", "reach in this pipe alone"]))
    for way in found["exits"]:
        console.print(way["sentence"], style="bold", highlight=False, soft_wrap=True)
    console.print(Table([("assumption", text) for text in found["assumptions"]]), highlight=False)
