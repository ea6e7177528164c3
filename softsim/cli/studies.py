"""Many runs of a scene: sweep a study, seek its optimum."""

from pathlib import Path
from typing import Annotated

import typer

from softsim.cli.options import DeviceName, Scheduler, StudyOverrides, StudyPath, Workers, explained
from softsim.cli.reporting import report_study


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
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only list the cases, and tell their cost.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Many cases are meant.")] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Run again what has failed.")
    ] = False,
) -> None:
    """Run all cases of a study on all cores: a table, with a row a case.

    What is stored is not run again: a study that was stopped goes on, one that was changed runs
    what is new.
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
    device: Annotated[DeviceName, typer.Option(help="Where to run.")] = DeviceName.auto,
    trials: Annotated[
        int | None, typer.Option(min=1, help="How many there are in the end; default: as it says.")
    ] = None,
) -> None:
    """Seek the best values of a study's factors: a table, with a row a trial.

    The study says under `optimize` what is best. Each trial is a run whose values follow from those
    before. The same command goes on where it was stopped, and with more --trials beyond its end.
    """
    with explained() as console:
        from softsim.study.loading import load_study

        loaded = load_study(study, overrides or [])
        folder = out or Path("runs") / f"{study.stem}_optimum"
        from softsim.cli.study_tables import print_best, print_results
        from softsim.machine import device_of_trials
        from softsim.sweep.engine import pool_for  # imports dask
        from softsim.sweep.study import optimize as run_trials

        taken = device_of_trials(device.value)
        pool = pool_for(folder, taken, workers, scheduler)
        table = run_trials(loaded, folder, pool, taken, trials, console)
        print_results(loaded, table, folder, console)
        report_study(folder, console)
        print_best(loaded, folder, console)
