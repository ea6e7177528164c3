"""A sweep: all cases of a study, those that are stored already left out; its table."""

from collections.abc import Collection
from contextlib import AbstractContextManager
from pathlib import Path

import polars
from rich.console import Console

from softsim.output.folder import RunFolder
from softsim.output.study_folder import CASES
from softsim.study.cases import LOST, PRUNED
from softsim.study.loading import LoadedStudy
from softsim.sweep.engine import completed
from softsim.sweep.ledger import NOTHING_LEFT, StudyTable, kept_ledger, record_of, told_size
from softsim.sweep.work import Simulate, simulate
from softsim.sweep.worker_pool import WorkerPool


def sweep(
    study: LoadedStudy,
    folder: Path,
    pool: AbstractContextManager[WorkerPool],
    device: str = "auto",
    batch: int = 1,
    again: Collection[str] = (LOST, PRUNED),
    console: Console | None = None,
    simulate: Simulate = simulate,
) -> polars.DataFrame:
    """Run what is not stored in `folder` yet, and return the table, which is there too.

    Parameters
    ----------
    pool: `local_pool(workers)` or `remote_pool(address, folder)`; it starts if there is work.
    device: auto, cpu, cuda. batch: cases that a worker runs at once. again: statuses of stored
    cases that are run again.

    Raises
    ------
    SceneError: there is no design. ClusterError: workers cannot be worked with. OutputError: a disk
    refuses. Interrupted: SIGINT or SIGTERM came. After each of them the same call goes on.
    """
    console = console or Console()
    RunFolder(folder / CASES)  # is made here, or refused
    table, record = StudyTable.of(study), record_of(study, study.case_count)
    rounds = table.open_rounds(study, folder, device, again)
    waiting, left = next(rounds, NOTHING_LEFT)
    console.print(told_size(study, len(table.rows) - len(waiting)))
    with kept_ledger(folder, record, table, left, console) as ledger:
        if waiting:
            with pool as workers:
                while waiting:
                    ledger.progress.expect(left)
                    for ended in completed(
                        waiting, workers, again, batch, ledger.keep_up, simulate
                    ):
                        ledger.note(*ended)
                    waiting, left = next(rounds, NOTHING_LEFT)
    return table.frame()


def collect(study: LoadedStudy, folder: Path) -> polars.DataFrame:
    """The table, from the folders of the cases alone: a measure that is new needs no run."""
    table = StudyTable.of(study)
    next(table.open_rounds(study, folder, "auto", again=()), None)
    return table.frame()
