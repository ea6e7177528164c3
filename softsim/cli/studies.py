"""Commands on studies: run all cases, or search for the optimum."""

from pathlib import Path
from typing import Annotated

import typer

from softsim.cli.reporting import report_study
from softsim.options import (
    Device,
    DeviceName,
    Scheduler,
    StudyOverrides,
    StudyPath,
    Workers,
    explained,
)


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
