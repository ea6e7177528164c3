"""A sweep: all cases of a study, those that are stored already left out; its table."""

from collections.abc import Collection
from contextlib import AbstractContextManager
from pathlib import Path

import polars
from rich.console import Console

from softsim.errors import Interrupted
from softsim.output.study_folder import CASES, LOST
from softsim.study.loaded import LoadedStudy
from softsim.sweep.crew import Crew
from softsim.sweep.engine import completed
from softsim.sweep.ledger import Ledger
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
    SceneError: there is no design. ClusterError: workers cannot be worked with. OutputError: a disk
    refuses. Interrupted: SIGINT or SIGTERM came. After each of them the same call goes on.
    """
    console = console or Console()
    jobs = jobs_of(study, folder, device)
    (folder / CASES).mkdir(parents=True, exist_ok=True)
    table = table_of(study)
    waiting = fill(table, jobs, again)
    console.print(f"{len(jobs)} cases, {len(jobs) - len(waiting)} of them stored")
    ledger, progress = (
        Ledger(folder, record_of(study, len(jobs)), table),
        StudyProgress(len(waiting), console),
    )

    def meanwhile(in_flight: int) -> None:
        progress.show(in_flight)
        ledger.write_if_due()

    status = "interrupted"
    try:
        if waiting:
            with crew as workers:
                for job, outcome in completed(waiting, workers, again, batch, meanwhile, simulate):
                    ledger.note(job, outcome)
                    progress.note(outcome)
        status = "done"
    except Interrupted as stop:
        raise Interrupted(f"{stop.message}, {progress.told}", stop.hint) from None
    finally:
        progress.close()
        ledger.close(status)
    return table.frame()
