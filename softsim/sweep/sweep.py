"""A sweep: all cases of a study, those that are stored already left out; its table."""

from collections.abc import Collection
from contextlib import AbstractContextManager, closing
from pathlib import Path

import polars
from rich.console import Console

from softsim.errors import Interrupted
from softsim.output.folder import RunFolder
from softsim.output.study_folder import CASES
from softsim.study.cases import LOST, PRUNED
from softsim.study.loading import LoadedStudy
from softsim.sweep.crew import Crew
from softsim.sweep.engine import completed
from softsim.sweep.ledger import kept_ledger
from softsim.sweep.planning import fill, jobs_of, record_of, table_of
from softsim.sweep.progress import StudyProgress
from softsim.sweep.simulation import simulate
from softsim.sweep.work import Simulate


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
    progress = StudyProgress(len(waiting), console)
    kept = kept_ledger(folder, record_of(study, len(jobs)), table)

    def meanwhile(in_flight: int) -> None:
        progress.show(in_flight)
        ledger.write_if_due()

    try:
        with closing(progress), kept as ledger:
            if waiting:
                with crew as workers:
                    for ended in completed(waiting, workers, again, batch, meanwhile, simulate):
                        ledger.note(*ended)
                        progress.note(ended[1])
    except Interrupted as stop:
        raise Interrupted(f"{stop.message}, {progress.told}", stop.hint) from None
    return table.frame()
