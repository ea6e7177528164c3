"""A sweep: all cases of a study, those that are stored already left out; its table."""

from collections.abc import Collection, Iterable
from contextlib import AbstractContextManager
from importlib.metadata import version
from pathlib import Path

import polars
from rich.console import Console

from softsim.output.folder import RunFolder
from softsim.output.study_folder import CASES, StudyRecord
from softsim.study.axes import Axis
from softsim.study.cases import LOST, PRUNED, key_of
from softsim.study.loading import REPEAT, LoadedStudy
from softsim.study.preview import settings
from softsim.sweep.crew import Crew
from softsim.sweep.engine import completed
from softsim.sweep.job import Job, known_outcome
from softsim.sweep.ledger import StudyTable, kept_ledger
from softsim.sweep.work import Simulate, simulate


def sweep(
    study: LoadedStudy,
    folder: Path,
    crew: AbstractContextManager[Crew],
    device: str = "auto",
    batch: int = 1,
    again: Collection[str] = (LOST, PRUNED),
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
    SceneError: there is no design. ClusterError: workers cannot be worked with. OutputError: a disk
    refuses. Interrupted: SIGINT or SIGTERM came. After each of them the same call goes on.
    """
    console = console or Console()
    jobs = jobs_of(study, folder, device)
    RunFolder(folder / CASES)  # is made here, or refused
    table = table_of(study)
    waiting = fill(table, jobs, again)
    console.print(f"{len(jobs)} cases, {len(jobs) - len(waiting)} of them stored")
    record = record_of(study, len(jobs))
    with kept_ledger(folder, record, table, len(waiting), console) as ledger:
        if waiting:
            with crew as workers:
                for ended in completed(waiting, workers, again, batch, ledger.keep_up, simulate):
                    ledger.note(*ended)
    return table.frame()


def jobs_of(study: LoadedStudy, folder: Path, device: str = "auto") -> list[Job]:
    """The job of each case, in the order of the table."""
    cases = folder.resolve() / CASES
    return [
        Job(case, key, cases / key, device, study.study.keep)
        for case, key in ((case, key_of(case)) for case in study.cases())
    ]


def collect(study: LoadedStudy, folder: Path) -> polars.DataFrame:
    """The table, from the folders of the cases alone: a measure that is new needs no run."""
    table = table_of(study)
    fill(table, jobs_of(study, folder), again=())
    return table.frame()


def table_of(study: LoadedStudy) -> StudyTable:
    """Its table, without rows."""
    repeats = (Axis(REPEAT),) if study.repeats > 1 else ()
    return StudyTable((*study.factors, *repeats), study.measures)


def record_of(study: LoadedStudy, case_count: int) -> StudyRecord:
    """What study.json says of a study."""
    return StudyRecord(
        title=study.title,
        source=str(study.path),
        factors=tuple(study.factors),
        measures=tuple(measure.axis for measure in study.measures),
        plots=tuple(study.plots),
        goal=study.goal,
        repeats=study.repeats,
        case_count=case_count,
        version=version("softsim"),
        settings=dict(settings(study)),
    )


def fill(table: StudyTable, jobs: Iterable[Job], again: Collection[str]) -> list[Job]:
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
