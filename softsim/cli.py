"""The command line: softsim run, check, assess, fit-material, report and more."""

import json
import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from softsim.errors import CalibrationError, ExpectationError, OutputError, SoftsimError

app = typer.Typer(
    no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False,
    help="Explicit finite elements for soft robots.",
)  # fmt: skip

ScenePath = Annotated[Path, typer.Argument(help="Scene file (YAML).", show_default=False)]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Override a value, such as time.end='2 s'."),
]

Threads = Annotated[
    str, typer.Option(metavar="N|auto", help="CPU threads; auto: 1 for a small model, else all.")
]

StudyPath = Annotated[Path, typer.Argument(help="Study file (YAML).", show_default=False)]
StudyOverrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Override a value in all cases."),
]
Workers = Annotated[
    int | None, typer.Option(min=1, help="Processes; default: one a core, one for a GPU.")
]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Use the workers of a dask scheduler.")
]


class DeviceName(str, Enum):
    """Where to run."""

    auto = "auto"
    cpu = "cpu"
    cuda = "cuda"


class LawName(str, Enum):
    """Which law to fit: the names in `softsim.materials.laws.LAWS`."""

    yeoh = "yeoh"
    neo_hooke = "neo_hooke"


class Precision(str, Enum):
    """Precision of state and forces."""

    f64 = "f64"


@app.command()
def run(
    scene: ScenePath,
    overrides: Overrides = None,
    out: Annotated[Path | None, typer.Option(help="Run folder; default: runs/SCENE.")] = None,
    device: Annotated[DeviceName, typer.Option(help="Where to run.")] = DeviceName.auto,
    threads: Threads = "auto",
    precision: Annotated[Precision, typer.Option(help="Number format.")] = Precision.f64,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint.")] = False,
    profile: Annotated[
        bool, typer.Option("--profile", help="End with what each pass of an increment costs.")
    ] = False,
) -> None:
    """Run a scene: numbers, curves and pictures into a run folder."""
    with _explained() as console:
        from softsim.commands.summary import profile_table, summary_table
        from softsim.output.folder import read_summary
        from softsim.run import PROFILE_AFTER  # Taichi is imported here, not for --help
        from softsim.run import run as run_scene

        folder = out or Path("runs") / scene.stem
        try:
            results = run_scene(
                scene, overrides or [], folder, device.value, resume, console, threads,
                profile_after=0.0 if profile else PROFILE_AFTER,
            )  # fmt: skip
        except ExpectationError:  # the run is done all the same, and measured
            if profile:
                console.print(profile_table(read_summary(folder)["profile"]))
            raise
        finally:
            # A stopped run keeps its pictures too; nothing to draw is no second failure.
            _report_what_there_is(folder, console)
        if profile:
            console.print(profile_table(results.summary["profile"]))
        console.print(summary_table(results.summary))
        console.print(f"results in {folder}", highlight=False)


@app.command()
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
    with _explained() as console:
        from softsim.builder import build_model
        from softsim.commands.check import model_table
        from softsim.machine import choose, memory_of
        from softsim.scene.loading import load_scene
        from softsim.solver.footprint import refuse_too_large

        choice = choose(device.value, threads)
        loaded = load_scene(scene, overrides or [])
        model = build_model(loaded)
        refuse_too_large(model, 1, choice.device, memory_of(choice.device))
        console.print(model_table(model))
        if duration:
            from softsim.commands.duration import duration_table  # Taichi is imported here

            console.print(duration_table(loaded, model, choice))
        console.print(f"{scene}: fine")


@app.command()
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
    with _explained() as console:
        from softsim.commands.layout import segments_table
        from softsim.output.folder import read_summary
        from softsim.scene.assessment import load_layout

        loaded = load_layout(layout, robot, overrides or [])
        folder = out or Path("runs") / f"{layout.stem}_{robot}"
        from softsim.run import run as run_scene  # imports Taichi

        try:
            run_scene(
                loaded, [], folder, device.value, resume, console, threads, profile_after=math.inf
            )
        finally:
            # Whatever ended it, what is known of the way is shown.
            _report_what_there_is(folder, console)
            report = read_summary(folder).get("layout")
            if report is not None:
                console.print(segments_table(report))
                console.print(report["sentence"], style="bold", highlight=False, soft_wrap=True)
                console.print(f"results in {folder}", highlight=False)


@app.command()
def sweep(
    study: StudyPath,
    overrides: StudyOverrides = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the study; default: runs/STUDY.")
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    device: Annotated[DeviceName, typer.Option(help="Where to run.")] = DeviceName.auto,
    batch: Annotated[
        str, typer.Option(metavar="N|auto", help="Cases that a worker runs at once.")
    ] = "auto",
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only list the cases.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Many cases are meant.")] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Run again what has failed.")
    ] = False,
) -> None:
    """Run all cases of a study on all cores: a table, with a row a case.

    What is stored is not run again: a study that was stopped goes on, one that was changed runs
    what is new.
    """
    with _explained() as console:
        from softsim.commands import sweep as command
        from softsim.study.loading import load_study

        loaded = load_study(study, overrides or [])
        folder = out or Path("runs") / study.stem
        command.confirm_size(loaded, folder, yes, console)
        again = command.again(retry_failed)
        if dry_run:
            command.print_plan(loaded, folder, again, console)
            return
        from softsim.sweep.crew import crew_for  # imports dask
        from softsim.sweep.sweep import sweep as run_sweep

        crew = crew_for(folder, device.value, workers, scheduler)
        size = command.asked_batch(batch, device.value)
        frame = run_sweep(loaded, folder, crew, device.value, size, again, console)
        command.print_results(loaded, frame, folder, console)


@app.command()
def optimize(
    study: StudyPath,
    overrides: StudyOverrides = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the trials; default: runs/STUDY_optimum.")
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    device: Annotated[DeviceName, typer.Option(help="Where to run.")] = DeviceName.auto,
    trials: Annotated[
        int | None, typer.Option(min=1, help="How many there are in the end; default: as it says.")
    ] = None,
) -> None:
    """Seek the best values of a study's factors: a table, with a row a trial.

    The study says under `optimize` what is best. Each trial is a run whose values follow from those
    before. The same command goes on where it was stopped, and with more --trials beyond its end.
    """
    with _explained() as console:
        from softsim.study.loading import load_study

        loaded = load_study(study, overrides or [])
        folder = out or Path("runs") / f"{study.stem}_optimum"
        from softsim.commands.optimisation import print_best
        from softsim.commands.sweep import print_results
        from softsim.report.study.figures import draw_study
        from softsim.sweep.crew import crew_for  # imports dask
        from softsim.sweep.optimisation import optimize as run_trials  # and optuna

        crew = crew_for(folder, device.value, workers, scheduler)
        table = run_trials(loaded, folder, crew, device.value, trials, console)
        print_results(loaded, table, folder, console)
        for figure in draw_study(folder):
            console.print(f"figure  {figure}", highlight=False)
        print_best(loaded, folder, console)


@app.command()
def fit_material(
    file: Annotated[Path, typer.Argument(help="Table of a uniaxial test.", show_default=False)],
    max_strain: Annotated[float, typer.Option(help="Fit up to this strain; 1 is 100 %.")],
    law: Annotated[LawName, typer.Option(help="Strain-energy law.")] = LawName.yeoh,
    min_strain: Annotated[float, typer.Option(help="Leave out the slack below it.")] = 0.1,
    terms: Annotated[int | None, typer.Option(help="Fit so many constants; default: all.")] = None,
    out: Annotated[Path | None, typer.Option(help="Figure; default: FILE_LAW.png here.")] = None,
    strain_column: Annotated[str, typer.Option(help="Its heading.")] = "Engineering Strain",
    stress_column: Annotated[str, typer.Option(help="Its heading.")] = "Engineering Stress",
    stress_unit: Annotated[
        str | None, typer.Option(help="Such as MPa; default: as the heading says.")
    ] = None,
    delimiter: Annotated[str | None, typer.Option(help="Default: ; or , or tab.")] = None,
) -> None:
    """Fit a material's constants to a tensile test, and say how well and how far they hold."""
    with _explained() as console:
        from softsim.materials.fitting import fit_law
        from softsim.materials.laws import LAWS
        from softsim.materials.tensile import read_tensile_test
        from softsim.report.fit import draw_fit, fit_rows, scene_snippet

        test = read_tensile_test(file, strain_column, stress_column, stress_unit, delimiter)
        fit = fit_law(test, LAWS[law.value], max_strain, min_strain, terms)
        figure = out or Path(f"{file.stem}_{law.value}.png")
        draw_fit(test, fit, figure)
        table = Table(show_header=False, box=None)
        for row in fit_rows(fit):
            table.add_row(*row)
        console.print(table)
        console.print(f"figure  {figure}", highlight=False)
        print(f"\n{scene_snippet(test, fit, law.value)}")


@app.command()
def calibrate_section(
    scene: Annotated[Path, typer.Argument(help="Scene of the section.", show_default=False)],
    reference: Annotated[Path, typer.Option(help="Scene of the body in space, in the same pipe.")],
    highest: Annotated[str, typer.Option(help="Inflate the reference up to it.")] = "23 kPa",
    spikes: Annotated[int, typer.Option(min=3, help="Spikes around a row.")] = 14,
    ramp: Annotated[
        str, typer.Option(help="Time of the reference's inflation; longer is slower.")
    ] = "0.4 s",
    push_at: Annotated[
        str | None, typer.Option(help="Pressure in space at which frames are pushed.")
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="PATH=VALUE", help="Override a value of the section."),
    ] = None,
    reference_overrides: Annotated[
        list[str] | None,
        typer.Option("--set-reference", metavar="PATH=VALUE", help="The same for the reference."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder; default: runs/SCENE_calibration.")
    ] = None,
    device: Annotated[DeviceName, typer.Option(help="Where to run.")] = DeviceName.auto,
    threads: Threads = "auto",
) -> None:
    """Find the pressure factor, offset and thickness with which a plane section stands for a body
    in space: each spike is pressed as hard, and the frame held as stiffly.

    The reference is solid, or axisymmetric: rings, whose force on the wall is that of the whole
    circumference; that tells the pressures as long as the skin carries the air, but neither how
    spikes bend nor a stiffness across the pipe.
    """
    with _explained() as console:
        from softsim.calibration.specimen import (
            reference_specimen,
            refuse_other_pipe,
            section_specimen,
        )
        from softsim.scene.loading import load_scene

        section = section_specimen(load_scene(scene, overrides or []))
        body = reference_specimen(load_scene(reference, reference_overrides or []))
        refuse_other_pipe(section, body)
        pressure, time = _quantity("--highest", highest, "Pa"), _quantity("--ramp", ramp, "s")
        push = None if push_at is None else _quantity("--push-at", push_at, "Pa")
        folder = out or Path("runs") / f"{scene.stem}_calibration"

        from softsim.commands.calibrate_section import Settings, calibrate  # imports Taichi

        settings = Settings(pressure, time, push, spikes, folder, device.value, threads)
        calibrate(section, body, settings, console)


def _quantity(option: str, text: str, unit: str) -> float:
    """The positive quantity of an option, in the SI unit `unit`."""
    from softsim.units import parse

    try:
        value = parse(text, unit)
    except ValueError as error:
        raise CalibrationError(f"{option}: {error}") from None
    if not value > 0.0:
        raise CalibrationError(f"{option}: {text!r} must be greater than zero")
    return value


@app.command()
def report(folder: Annotated[Path, typer.Argument(help="Folder of a run or a study.")]) -> None:
    """Draw the figures of a run's or a study's folder again, and write its page report.html."""
    with _explained() as console:
        from softsim.output.study_folder import is_study

        if is_study(folder):
            _report_study(folder, console)
        else:
            _refuse_without_run(folder)
            _report(folder, console)


@app.command()
def schema() -> None:
    """Print the JSON schema of scene files, with which an editor completes and checks keys."""
    from softsim.scene.schema import scene_json_schema

    print(json.dumps(scene_json_schema(), indent=2))


@app.command()
def devices(
    seconds: Annotated[
        float, typer.Option(min=0.0, help="Time of all measurements; 0 leaves them out.")
    ] = 10.0,
) -> None:
    """Say which devices there are, how fast they are, and which one `auto` takes."""
    with _explained() as console:
        from softsim.commands.devices import print_devices

        print_devices(console, seconds)


def _report_what_there_is(folder: Path, console: Console) -> None:
    """The report of a run, unless it ended before it had a history."""
    if (folder / "history.csv").is_file():
        _report(folder, console)


def _refuse_without_run(folder: Path) -> None:
    """Raise OutputError unless `folder` has a run's history."""
    if not (folder / "history.csv").is_file():
        raise OutputError(
            f"{folder} is the folder of neither a run nor a study",
            hint="name one that softsim run, assess, sweep or optimize has written",
        )


def _report(folder: Path, console: Console) -> None:
    """All figures and the page of a run folder."""
    from softsim.output.folder import read_summary
    from softsim.report.figures import draw_all
    from softsim.report.page.run import write_run_page

    field = read_summary(folder).get("snapshot_field", "stretch")
    for figure in draw_all(folder, field):
        console.print(f"figure  {figure}", highlight=False)
    console.print(f"page    {write_run_page(folder)}", highlight=False)


def _report_study(folder: Path, console: Console) -> None:
    """All figures of a study's folder, and its page."""
    from softsim.report.study.figures import draw_study
    from softsim.report.study.page import write_study_page

    for figure in draw_study(folder):
        console.print(f"figure  {figure}", highlight=False)
    console.print(f"page    {write_study_page(folder)}", highlight=False)


@contextmanager
def _explained() -> Iterator[Console]:
    """A console for the command; an error for the user ends it with its exit code."""
    console = Console()
    try:
        yield console
    except SoftsimError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(error.exit_code) from error


def main() -> None:
    """Entry point of the `softsim` command."""
    app()


if __name__ == "__main__":
    main()
