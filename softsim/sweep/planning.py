"""What is to be run of a study, and what is stored of it already."""

from collections.abc import Collection, Iterable
from importlib.metadata import version
from pathlib import Path

import polars

from softsim.output.study_folder import CASES, StudyRecord
from softsim.study.axes import Axis
from softsim.study.cases import key_of
from softsim.study.loading import REPEAT, LoadedStudy
from softsim.study.preview import settings
from softsim.sweep.job import Job, known_outcome
from softsim.sweep.table import StudyTable


def jobs_of(study: LoadedStudy, folder: Path, device: str = "auto") -> list[Job]:
    """The job of each case, in the order of the table."""
    cases = folder.resolve() / CASES
    jobs = []
    for case in study.cases():
        key = key_of(case)
        jobs.append(Job(case, key, cases / key, device, study.study.keep))
    return jobs


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
