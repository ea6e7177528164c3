"""One scene: run it, check it, ask whether a robot gets through a layout."""

import math
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from softsim.cli.options import DeviceName, Overrides, Precision, ScenePath, Threads, explained
from softsim.cli.reporting import ended_by, put_off_report, report_what_there_is
from softsim.errors import ExpectationError


def run(
    scene: ScenePath,
    overrides: Overrides = None,
    out: Annotated[Path | None, typer.Option(help="Run folder; default: runs/SCENE.")] = None,
    device: Annotated[DeviceName, typer.Option(help="Where to run.")] = DeviceName.auto,
    threads: Threads = "auto",
    precision: Annotated[Precision, typer.Option(help="Number format.")] = Precision.f64,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint.")] = False,
    profile: Annotated[
        bool,
        typer.Option(
            "--profile", help="End with what the wall time and each pass of an increment went into."
        ),
    ] = False,
    report: Annotated[
        bool, typer.Option("--report/--no-report", help="Draw the figures and the page at the end.")
    ] = True,
) -> None:
    """Run a scene: numbers, curves and pictures into a run folder."""
    with explained() as console:
        from softsim.cli.run_tables import profile_table, summary_table, wall_time_table
        from softsim.output.folder import read_summary
        from softsim.run import PROFILE_AFTER  # Taichi is imported here, not for --help
        from softsim.run import run as run_scene

        folder = out or Path("runs") / scene.stem
        end_with = report_what_there_is if report else put_off_report

        def show_profile() -> None:
            if profile:
                summary = read_summary(folder)
                console.print(profile_table(summary["profile"]))
                console.print(wall_time_table(summary["wall_times"]))

        try:
            with ended_by(lambda: end_with(folder, console)):
                results = run_scene(
                    scene, overrides or [], folder, device.value, resume, console, threads,
                    profile_after=0.0 if profile else PROFILE_AFTER,
                )  # fmt: skip
        except ExpectationError:  # the run is done all the same, and measured
            show_profile()
            raise
        show_profile()
        console.print(summary_table(results.summary))
        console.print(f"results in {folder}", highlight=False)


def check(
    scene: ScenePath,
    overrides: Overrides = None,
    device: Annotated[DeviceName, typer.Option(help="Where it would run.")] = DeviceName.auto,
    threads: Threads = "auto",
    duration: Annotated[
        bool, typer.Option(help="Predict how long the run takes, from a few seconds of it.")
    ] = True,
) -> None:
    """Check a scene and say how large it is, its stable step, and how long it will take."""
    with explained() as console:
        from softsim.machine import choose
        from softsim.scene.loading import load_scene

        choice = choose(device.value, threads)
        loaded = load_scene(scene, overrides or [])
        # Taichi is imported from here on: an error before is told at once.
        from softsim.builder import build_model
        from softsim.cli.run_tables import model_table
        from softsim.solver.memory import refuse_before_start

        model = build_model(loaded)
        refuse_before_start(model, choice.device)
        console.print(model_table(model))
        if duration:
            from softsim.cli.run_tables import duration_table

            console.print(duration_table(loaded, model, choice))
        console.print(f"{scene}: fine")


def assess(
    layout: Annotated[
        Path, typer.Argument(help="Scene file of a pipe_path, without a robot.", show_default=False)
    ],
    robot: Annotated[str, typer.Option(help="Standard robot that is put into it.")] = "pfr",
    overrides: Overrides = None,
    out: Annotated[
        Path | None, typer.Option(help="Run folder; default: runs/LAYOUT_ROBOT.")
    ] = None,
    device: Annotated[DeviceName, typer.Option(help="Where to run.")] = DeviceName.auto,
    threads: Threads = "auto",
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint.")] = False,
) -> None:
    """Ask whether a robot gets through a layout of pipes: exit code 0 if it passes, 5 if not.

    What LAYOUT says wins over what the robot brings. Without `time` it has 60 s; the run ends as
    soon as the verdict is there.
    """
    with explained() as console:
        from softsim.scene.assessment import load_layout

        loaded = load_layout(layout, robot, overrides or [])
        folder = out or Path("runs") / f"{layout.stem}_{robot}"
        from softsim.run import run as run_scene  # imports Taichi

        with ended_by(lambda: _show_passage(folder, console)):
            run_scene(
                loaded, [], folder, device.value, resume, console, threads, profile_after=math.inf
            )


def _show_passage(folder: Path, console: Console) -> None:
    """The report of an assessment, its segments and its verdict, as far as they are known."""
    from softsim.cli.run_tables import segments_table
    from softsim.output.folder import read_summary

    report_what_there_is(folder, console)
    report = read_summary(folder).get("layout")
    if report is not None:
        console.print(segments_table(report))
        console.print(report["sentence"], style="bold", highlight=False, soft_wrap=True)
        console.print(f"results in {folder}", highlight=False)
