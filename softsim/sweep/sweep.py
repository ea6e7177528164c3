"""A sweep: all cases of a study, those that are stored already left out; its table."""

from collections.abc import Collection, Iterable
from contextlib import AbstractContextManager
from dataclasses import fields
from importlib.metadata import version
from pathlib import Path

import polars
from rich.console import Console

from softsim.errors import Interrupted
from softsim.output.study_folder import CASES, LOST, Axis, StudyRecord
from softsim.study.loading import LoadedStudy
from softsim.study.resolution import case_key, resolved
from softsim.sweep.crew import Crew
from softsim.sweep.engine import completed
from softsim.sweep.job import Job, known_outcome
from softsim.sweep.ledger import Ledger
from softsim.sweep.progress import StudyProgress
from softsim.sweep.simulation import simulate
from softsim.sweep.table import StudyTable
from softsim.sweep.work import Simulate


def jobs_of(study: LoadedStudy, folder: Path, device: str = "auto") -> list[Job]:
    """The job of each case, in the order of the table. Raises SceneError: a case is no scene."""
    cases = folder.resolve() / CASES
    jobs = []
    for case in study.cases():
        key = case_key(resolved(case))
        jobs.append(Job(case, key, cases / key, device, study.study.keep))
    return jobs


def collect(study: LoadedStudy, folder: Path) -> polars.DataFrame:
    """The table, from the folders of the cases alone: a measure that is new needs no run."""
    table = StudyTable(study.factors, study.measures)
    _fill(table, jobs_of(study, folder), again=())
    return table.frame()


def sweep(
    study: LoadedStudy,
    folder: Path,
    crew: AbstractContextManager[Crew],
    device: str = "auto",
    batch: int = 1,
    again: Collection[str] = (LOST,),
    console: Console | None = None,
    simulate: Simulate = simulate,
) -> polars.DataFrame:
    """Run what is not stored in `folder` yet, and return the table, which is there too.

    Parameters
    ----------
    crew: `local_crew(workers)` or `remote_crew(address, folder)`; it starts if there is work.
    device: auto, cpu, cuda. batch: cases that a worker runs at once. again: statuses of stored
    cases that are run again.

    Raises
    ------
    SceneError: a case is no scene. ClusterError: workers cannot be worked with. OutputError: a disk
    refuses. Interrupted: SIGINT or SIGTERM came. After each of them the same call goes on.
    """
    console = console or Console()
    jobs = jobs_of(study, folder, device)
    (folder / CASES).mkdir(parents=True, exist_ok=True)
    table = StudyTable(study.factors, study.measures)
    waiting = _fill(table, jobs, again)
    ledger = Ledger(folder, record_of(study), table)
    console.print(f"{len(jobs)} cases, {len(jobs) - len(waiting)} of them stored")
    if waiting:
        with crew as workers:
            _run(waiting, workers, ledger, batch, again, console, simulate)
    ledger.close("done")
    return table.frame()


def record_of(study: LoadedStudy) -> StudyRecord:
    """What study.json says of a study."""
    return StudyRecord(
        title=study.title,
        source=str(study.path),
        factors=tuple(study.factors),
        measures=tuple(_axis(measure) for measure in study.measures),
        plots=tuple(study.plots),
        goal=study.goal,
        repeats=1 if study.study.repeats is None else study.study.repeats.count,
        case_count=study.case_count,
        version=version("softsim"),
    )


def _axis(measure: Axis) -> Axis:
    """A measure without how it is read."""
    return Axis(**{field.name: getattr(measure, field.name) for field in fields(Axis)})


def _fill(table: StudyTable, jobs: Iterable[Job], again: Collection[str]) -> list[Job]:
    """Note what is stored; the jobs that are not."""
    waiting = []
    for job in jobs:
        outcome = known_outcome(job, again)
        if outcome is None:
            waiting.append(job)
        else:
            table.note(job, outcome)
    table.add_waiting(waiting)
    return waiting


def _run(
    jobs: list[Job],
    workers: Crew,
    ledger: Ledger,
    batch: int,
    again: Collection[str],
    console: Console,
    simulate: Simulate,
) -> None:
    progress = StudyProgress(console, len(jobs))

    def meanwhile(in_flight: int) -> None:
        progress.show(in_flight)
        ledger.write_if_due()

    try:
        for job, outcome in completed(jobs, workers, again, batch, meanwhile, simulate):
            ledger.note(job, outcome)
            progress.note(outcome)
    except Interrupted as stop:
        raise Interrupted(
            f"{stop.message} after {progress.ended.total()} of {len(jobs)} cases",
            hint="the same command goes on where it was",
        ) from None
    finally:
        progress.close()
        ledger.close("interrupted")
