"""Commands that run a scene, check it, assess a robot in a layout, or run a study."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from softsim.cli.reporting import (
    drawing_can_stop,
    ended_by,
    put_off_reports,
    report_runs,
    report_study,
    report_what_there_is,
    run_folders,
)
from softsim.errors import ExpectationError, Option, SceneError, StabilityError
from softsim.options import (
    Device,
    DeviceName,
    Overrides,
    Precision,
    ScenePath,
    Scheduler,
    StudyOverrides,
    StudyPath,
    Threads,
    Workers,
    explained,
    quantity,
)
from softsim.units import count_text

if TYPE_CHECKING:
    from softsim.live import LiveView
    from softsim.model import Model
    from softsim.scene.loading import LoadedScene
    from softsim.study.loading import LoadedStudy


def run(
    scene: ScenePath,
    overrides: Overrides = None,
    out: Annotated[Path | None, typer.Option(help="Run folder; default: runs/SCENE.")] = None,
    device: Device = DeviceName.auto,
    threads: Threads = "auto",
    precision: Annotated[Precision, typer.Option(help="Floating-point precision.")] = Precision.f64,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue from the checkpoint in the run folder.")
    ] = False,
    source: Annotated[
        Path | None,
        typer.Option("--from", help="Run folder from which identical first steps are reused."),
    ] = None,
    profile: Annotated[
        bool,
        typer.Option(
            "--profile", help="Print the cost of each pass of an increment and of each run phase."
        ),
    ] = False,
    report: Annotated[
        bool,
        typer.Option("--report/--no-report", help="Draw the figures and write the page, or not."),
    ] = True,
    live: Annotated[
        bool,
        typer.Option(
            "--live", help="Show the running simulation in a browser, with pause and sliders."
        ),
    ] = False,
) -> None:
    """Run a scene and write its results, figures and report page to a run folder.

    A scene with steps gets one folder per step.
    """
    with explained() as console:
        from softsim.scene.steps import load_steps

        steps = load_steps(scene, overrides or [])
        if source is not None and not steps:
            raise SceneError(
                f"{scene} has no steps, so no step can be reused from another run",
                "leave out --from, or give the scene `steps`",
                Option(f"--from {source}"),
            )
        # Taichi is imported from here on, not for --help.
        from softsim.cli.run_tables import summary_table
        from softsim.output.folder import HISTORY
        from softsim.output.history import read_units
        from softsim.run import run as run_scene
        from softsim.run import run_steps

        folder = out or Path("runs") / scene.stem
        end_with = report_runs if report else put_off_reports
        try:
            with ended_by(lambda: end_with(folder, console)), _opened_views(live, console) as views:
                if steps:
                    done = list(run_steps(
                        steps, folder, device.value, resume, console, threads, profile, source,
                        views,
                    ).values())  # fmt: skip
                else:
                    done = [run_scene(
                        scene, overrides or [], folder, device.value, resume, console, threads,
                        profile, monitors=views,
                    )]  # fmt: skip
        except ExpectationError:  # the run is done all the same, and measured
            _show_profiles(folder, profile, console)
            raise
        _show_profiles(folder, profile, console)
        for results in done:
            units = read_units(results.folder / HISTORY)
            console.print(summary_table(results.summary, units))
            console.print(f"results in {results.folder}", highlight=False)


@contextmanager
def _opened_views(live: bool, console: Console) -> "Iterator[list[LiveView]]":
    """Yield a live view of the run, if it is wanted, after its address was printed."""
    if not live:
        yield []
        return
    from softsim.live import LiveView

    with LiveView() as view:
        console.print(f"live view: {view.address}", highlight=False)
        yield [view]


def _show_profiles(folder: Path, asked: bool, console: Console) -> None:
    """Print, if asked, the table of wall times of a run or of each of its steps."""
    from softsim.cli.run_tables import profile_table, wall_time_table
    from softsim.output.folder import read_summary

    for summary in map(read_summary, run_folders(folder) if asked else ()):
        if "profile" in summary:
            console.print(profile_table(summary["profile"]))
            console.print(wall_time_table(summary["wall_times"]))


def compile(
    scene: ScenePath,
    overrides: Overrides = None,
    device: Device = DeviceName.auto,
    threads: Threads = "auto",
) -> None:
    """Compile the kernels of a scene and store them, so that its runs start sooner.

    Runs with other numbers use the same kernels, as long as the structure of the scene, the device
    and the number of threads stay. Nothing is computed.
    """
    with explained() as console:
        from softsim.compute.machine import choose
        from softsim.scene.loading import load_scene
        from softsim.scene.steps import load_steps

        choice = choose(device.value, threads)
        steps = load_steps(scene, overrides or [])
        loaded = None if steps else load_scene(scene, overrides or [])
        # Taichi is imported from here on: an error before is reported at once.
        from softsim.compute.backend import default_cache_folder
        from softsim.output.compiling import compiling
        from softsim.run.batch import new_solver
        from softsim.run.scenes import foreseen_models, ready_model

        models = [ready_model(loaded, choice)] if loaded else foreseen_models(steps, choice)
        for k, model in enumerate(models):
            began = time.perf_counter()
            with compiling(console):
                new_solver([model], choice)
            which = f"step '{steps[k].name}'" if steps else scene.name
            console.print(f"{which}: kernels ready after {time.perf_counter() - began:.1f} s")
        console.print(f"kernels in {default_cache_folder()}", highlight=False, soft_wrap=True)


def check(
    scene: ScenePath,
    overrides: Overrides = None,
    device: Annotated[
        DeviceName, typer.Option(help="Device that the run would use.")
    ] = DeviceName.auto,
    threads: Threads = "auto",
    duration: Annotated[
        bool, typer.Option(help="Estimate the run time with a short trial run, or not.")
    ] = True,
    modes: Annotated[
        int | None, typer.Option(min=1, help="Number of natural modes to compute for each body.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the figure modes.png; default: runs/SCENE_modes."),
    ] = None,
) -> None:
    """Check a scene before a run: print its size, loads, contact, stable step and run time.

    The run time is estimated with a short trial run; the exit code is 3 if a guard stops it. With
    --modes, the natural frequencies of each body are printed too, with its fixed or tied nodes
    held.
    """
    if out is not None and modes is None:
        raise typer.BadParameter(
            "is the folder of the figure of --modes, which is not given", param_hint="--out"
        )
    with explained() as console:
        from softsim.compute.machine import choose
        from softsim.scene.loading import load_scene
        from softsim.scene.steps import load_steps

        choice = choose(device.value, threads)
        steps = load_steps(scene, overrides or [])
        loaded = steps[0].loaded if steps else load_scene(scene, overrides or [])
        # Taichi is imported from here on: an error before is told at once.
        from softsim.cli.run_tables import acting_tables, model_table
        from softsim.materials.library import disagreement_notes
        from softsim.run.scenes import foreseen_models, ready_model
        from softsim.solver.plausibility import output_warnings, plausibility_warnings

        models = foreseen_models(steps, choice) if steps else [ready_model(loaded, choice)]
        warnings = 0
        for k, model in enumerate(models):
            if steps:
                console.rule(f"step {k + 1} of {len(steps)}: {steps[k].name}")
            console.print(model_table(model))
            from_scene = steps[k].loaded if steps else loaded
            for table in acting_tables(from_scene, model):
                console.print(table, highlight=False)
            found = plausibility_warnings(model) | output_warnings(model, from_scene.scene.output)
            for text in found.values():
                warnings += 1
                console.print(f"warning: {text}", highlight=False)
        for note in disagreement_notes(loaded):
            console.print(f"note: {note}", highlight=False)
        model, stopped = models[0], ""
        if duration:
            from softsim.cli.run_tables import duration_table
            from softsim.run.pilot import predicted_duration
            from softsim.solver.guards import thinning_advice

            if steps:
                console.print(
                    f"estimate for step '{steps[0].name}' only; later steps start from its result"
                )
            predicted = predicted_duration(loaded, model, choice, console=console)
            console.print(duration_table(predicted, model, choice))
            stopped = predicted.stopped
            if stopped:
                console.print(
                    f"warning: {stopped}\n  the run itself may get further; "
                    f"{thinning_advice(model)}",
                    highlight=False,
                )
        if modes is not None:
            folder = out or Path("runs") / f"{scene.stem}_modes"
            _tell_modes(model, modes, choice.device_for(model.corner_count), folder, console)
        finding = f"{count_text(warnings, 'warning')}, see above" if warnings else "no warnings"
        if stopped:
            finding = "the trial run was stopped by a guard, see above"
        console.print(f"{scene}: {finding}", highlight=False, soft_wrap=True)
        if stopped:
            raise typer.Exit(StabilityError.exit_code)


def _tell_modes(model: "Model", count: int, device: str, folder: Path, console: Console) -> None:
    """Print the natural modes of each body and draw their shapes into a folder."""
    from softsim.cli.run_tables import modes_remarks, modes_table
    from softsim.compute import backend
    from softsim.output.folder import RunFolder
    from softsim.report.vibrations import draw_modes
    from softsim.solver.natural_modes import joined_bodies, movable_bodies, natural_modes

    bodies = movable_bodies(model)
    figure = RunFolder(folder).path / "modes.png"
    backend.start(device)
    found = [natural_modes(model, body, count) for body in bodies]
    for name in sorted({b.name for b in joined_bodies(model)} - {b.name for b in bodies}):
        console.print(f"all nodes of '{name}' are held: it has no natural modes")
    for modes in found:
        console.print(modes_remarks(modes), highlight=False)
        console.print(modes_table(modes))
    draw_modes(found, figure)
    console.print(f"mode shapes: {figure}", highlight=False)


def assess(
    layout: Annotated[
        Path,
        typer.Argument(help="Scene file with a pipe_path and no robot.", show_default=False),
    ],
    robot: Annotated[str, typer.Option(help="Standard robot to place in the layout.")] = "pfr",
    overrides: Overrides = None,
    out: Annotated[
        Path | None, typer.Option(help="Run folder; default: runs/LAYOUT_ROBOT.")
    ] = None,
    device: Device = DeviceName.auto,
    threads: Threads = "auto",
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue from the checkpoint in the run folder.")
    ] = False,
    repeats: Annotated[
        int | None,
        typer.Option(
            min=2,
            help="Number of runs with random friction, start position and motor phase; the pass "
            "rate is printed.",
        ),
    ] = None,
    friction_range: Annotated[
        float,
        typer.Option(
            min=0.0, max=100.0, help="With --repeats: variation of friction, plus or minus [%]."
        ),
    ] = 10.0,
    start_range: Annotated[
        str,
        typer.Option(help="With --repeats: variation of the start along the pipe, plus or minus."),
    ] = "2 mm",
    seed: Annotated[
        int, typer.Option(min=0, help="With --repeats: seed of the random numbers.")
    ] = 1,
    workers: Workers = None,
) -> None:
    """Determine whether a robot gets through a layout of pipes: exit code 0 if it passes, 5 if not.

    Values in LAYOUT override those of the robot. The run ends as soon as the verdict is certain,
    or after 60 s of simulated time unless LAYOUT has the key `time`. With --repeats the exit code
    is 0 only if all runs pass; repeat the command to continue after an interruption.
    """
    with explained() as console:
        from softsim.scene.loading import load_layout

        loaded = load_layout(layout, robot, overrides or [])
        if repeats is not None:
            from softsim.study.loading import Spread, repeated_assessment

            start = quantity("--start-range", start_range, "m")
            spread = Spread(repeats, friction_range / 100.0, start, seed)
            study = repeated_assessment(layout, robot, loaded, spread, overrides or [])
            folder = out or Path("runs") / f"{layout.stem}_{robot}_repeats"
            _assess_repeatedly(loaded, study, folder, device.value, workers, console)
            return
        folder = out or Path("runs") / f"{layout.stem}_{robot}"
        from softsim.run import run as run_scene  # imports Taichi

        with ended_by(lambda: _show_passage(folder, console)):
            run_scene(loaded, [], folder, device.value, resume, console, threads)


def _assess_repeatedly(
    loaded: "LoadedScene",
    study: "LoadedStudy",
    folder: Path,
    device: str,
    workers: int | None,
    console: Console,
) -> None:
    """Run the repeats of an assessment; print their table and the pass rate.

    Raises
    ------
    ExpectationError: not all runs passed, as the scene expects.
    """
    from softsim.analysis.passage import assumptions
    from softsim.builder import build_model
    from softsim.cli.reporting import report_study
    from softsim.cli.study_tables import print_results
    from softsim.report.study.findings import VERDICT, Findings
    from softsim.report.study.plots import pass_rate_in_words
    from softsim.report.table import Table
    from softsim.study.loading import describe
    from softsim.sweep.engine import pool_for  # imports dask
    from softsim.sweep.study import sweep

    rests_on = assumptions(build_model(loaded))
    console.print(Table(describe(study)))
    frame = sweep(study, folder, pool_for(folder, device, workers), device, console=console)
    print_results(study, frame, folder, console)
    report_study(folder, console)
    findings = Findings.read(folder)
    rate = pass_rate_in_words(findings)
    console.print(rate, style="bold", highlight=False, markup=False, soft_wrap=True)
    for text in rests_on:
        console.print(text, highlight=False, markup=False, soft_wrap=True)
    passed = VERDICT in frame.columns and bool((frame[VERDICT] == "passed").fill_null(False).all())
    if loaded.scene.expect.passes and not passed:
        raise ExpectationError(rate, hint="the scene requires that all runs pass")


def _show_passage(folder: Path, console: Console) -> None:
    """Draw the report of an assessment; print its segments and its verdict, if available."""
    from softsim.output.folder import read_summary
    from softsim.report.figures import segments

    with drawing_can_stop(folder):
        report_what_there_is(folder, console)
    report = read_summary(folder).get("layout")
    if report is not None:
        console.print(segments(report))
        console.print(report["sentence"], style="bold", highlight=False, soft_wrap=True)
        single = "single run; use --repeats N to see how the verdict depends on friction and start"
        for text in (report["margin"], *report["assumptions"], single):
            console.print(text, highlight=False, markup=False, soft_wrap=True)
        console.print(f"results in {folder}", highlight=False)


# -------------------------------------------------------------------------------------------------
# Commands on studies: run all cases, or search for the optimum.


def sweep(
    study: StudyPath,
    overrides: StudyOverrides = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the study; default: runs/STUDY.")
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    device: Device = DeviceName.auto,
    batch: Annotated[
        str, typer.Option(metavar="N|auto", help="Number of cases that a worker runs at once.")
    ] = "auto",
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only list the cases and estimate their run time.")
    ] = False,
    yes: Annotated[
        bool, typer.Option("--yes", help="Run many cases without asking for confirmation.")
    ] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Run failed cases again.")
    ] = False,
) -> None:
    """Run all cases of a study on all cores and write a table with one row per case.

    Stored cases are not run again. Repeat the command to continue an interrupted study, or to run
    the new cases of a changed one.
    """
    with explained() as console:
        from softsim.cli import study_tables
        from softsim.study.loading import load_study

        loaded = load_study(study, overrides or [])
        folder = out or Path("runs") / study.stem
        study_tables.confirm_size(loaded, folder, yes, console)
        again = study_tables.again(retry_failed)
        if dry_run:
            study_tables.print_plan(loaded, folder, device.value, workers, again, console)
            return
        from softsim.sweep.engine import pool_for  # imports dask
        from softsim.sweep.study import sweep as run_sweep

        pool = pool_for(folder, device.value, workers, scheduler)
        size = study_tables.asked_batch(batch, device.value)
        frame = run_sweep(loaded, folder, pool, device.value, size, again, console)
        study_tables.print_results(loaded, frame, folder, console)
        report_study(folder, console)


def optimize(
    study: StudyPath,
    overrides: StudyOverrides = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the trials; default: runs/STUDY_optimum.")
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    device: Device = DeviceName.auto,
    trials: Annotated[
        int | None, typer.Option(min=1, help="Total number of trials; default: that of the study.")
    ] = None,
) -> None:
    """Find the best values of the factors of a study and write a table with one row per trial.

    The key `optimize` of the study defines the objective. The values of a trial depend on the
    results of earlier ones. Repeat the command to continue after an interruption; a larger --trials
    extends a finished search.
    """
    with explained() as console:
        from softsim.study.loading import load_study

        loaded = load_study(study, overrides or [])
        folder = out or Path("runs") / f"{study.stem}_optimum"
        from softsim.cli.study_tables import print_best, print_results
        from softsim.compute.machine import device_of_trials
        from softsim.sweep.engine import pool_for  # imports dask
        from softsim.sweep.study import optimize as run_trials

        taken = device_of_trials(device.value)
        pool = pool_for(folder, taken, workers, scheduler)
        table = run_trials(loaded, folder, pool, taken, trials, console)
        print_results(loaded, table, folder, console)
        report_study(folder, console)
        print_best(loaded, folder, console)
