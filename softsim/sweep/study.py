"""A study runs: all its cases, those that are stored already left out, or trials until the best is
found, each a case of which the results so far choose the values. From Python: `softsim.Study`.
"""

import sys
from collections.abc import Collection, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import polars
from rich.console import Console

from softsim.errors import ClusterError, SceneError
from softsim.machine import device_of_trials
from softsim.output.folder import RunFolder
from softsim.output.study_folder import CASES
from softsim.scene.tree import nearest
from softsim.study.axes import Goal
from softsim.study.cases import DONE, LOST, PRUNED, Case
from softsim.study.loading import LoadedStudy, load_study, study_from
from softsim.study.schema import Objective
from softsim.sweep.checks import refusals
from softsim.sweep.engine import WorkerPool, completed, pool_for
from softsim.sweep.job import Job, Outcome, Simulate, history_of, simulate
from softsim.sweep.ledger import NOTHING_LEFT, StudyTable, kept_ledger, record_of, told_size


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
    for line in refusals(waiting, device):
        console.print(line, highlight=False, markup=False, soft_wrap=True)
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


def optimize(
    study: LoadedStudy,
    folder: Path,
    pool: AbstractContextManager[WorkerPool],
    device: str = "auto",
    count: int | None = None,
    console: Console | None = None,
    simulate: Simulate = simulate,
) -> polars.DataFrame:
    """Try values of the factors until there are `count` trials, by default as many as the study
    says; return their table, which is in `folder` too. Its cases have the numbers of the trials.

    Parameters are those of `sweep`. A trial whose run fails, or does not find what is sought,
    teaches nothing; the others go on.

    Raises
    ------
    SceneError: the study does not say what to seek, or nothing varies in it. OutputError: the
    folder holds another optimisation, or a disk refuses. ClusterError: workers cannot be worked
    with. Interrupted: SIGINT or SIGTERM came; the same call goes on with the trials in flight.
    """
    from softsim.sweep.trials import TrialJobs, Trials  # imports optuna

    objective, goal, count = asked(study, count)
    console = console or Console()
    RunFolder(folder / CASES)  # is made here, or refused
    column = next(measure for measure in study.measures if measure.name == goal.measure)
    trials = Trials(folder, study.search_space, column, goal.sense, objective.seed)
    table = StudyTable(study.factors, study.measures)
    plan = TrialJobs(folder.resolve(), column, objective.prune, device, study.study.keep)
    for trial in trials.ended():
        table.note(*plan.stored(study.case(trial.number, trial.values)))
    console.print(f"{count} trials, {len(table.rows)} of them stored")
    record = replace(
        record_of(study, count),
        repeats=1,
        plots=study.plots if study.study.plots else (),
        bisection=None,
    )
    left = max(0, count - len(table.rows))

    def note(job: Job, outcome: Outcome) -> None:
        value = None
        if outcome.status == DONE:
            value = column.value(outcome.summary, history_of(job, [column]))
        trials.tell(job.case.number, value, outcome.status == PRUNED)
        ledger.note(job, outcome)

    def jobs() -> Iterator[Job]:
        for trial in trials.to_run(count):
            case = study.case(trial.number, trial.values)
            try:
                yield plan.job(case)
            except SceneError as error:
                note(*plan.refused(case, error))

    with kept_ledger(folder, record, table, left, console) as ledger:
        if trials.is_open(count):
            with pool as workers:
                for ended in completed(jobs(), workers, (LOST,), 1, ledger.keep_up, simulate):
                    note(*ended)
    return table.frame()


def asked(study: LoadedStudy, count: int | None) -> tuple[Objective, Goal, int]:
    """Return what a study wants optimised and the number of trials, `count` if that is given.

    Raises SceneError: it says none of them, or nothing varies in it.
    """
    objective, goal = study.study.optimize, study.goal
    if objective is None or goal is None:
        raise SceneError(
            f"{study.path}: the study does not say what to seek",
            f"add optimize: {{maximize: {study.measures[0].name}, trials: 40}}",
        )
    if all(isinstance(space, tuple) and len(space) == 1 for space in study.search_space.values()):
        raise SceneError(
            "no factor has more than one value: there is nothing to choose",
            "give a factor a range, or several values",
            nearest(study.tree, ("factors",))[0].key_origin,
        )
    count = count or objective.trials
    if count is None:
        raise SceneError(
            "the number of trials is not given",
            "write trials: 40 under optimize, or add --trials 40",
            nearest(study.tree, ("optimize",))[0].key_origin,
        )
    return objective, goal, count


class Study:
    """A scene, what varies in it, what is collected of each run.

    From a file, `Study("scenes/studies/deflation_rate.yaml", ["time.end=3 s"])`, or from the keys
    of one, `Study(scene="scenes/first_look.yaml", factors={...}, measures={...})`, with scene files
    relative to the current folder. Quantities are texts with units: "0.4 kPa".

    `run` and `optimize` start processes, which read the script that started them: a script calls
    them under `if __name__ == "__main__":`. A notebook shows their progress too.

    Raises SceneError where it is no study, with the place of what is wrong.
    """

    def __init__(
        self, file: Path | str | None = None, overrides: Sequence[str] = (), **keys: Any
    ) -> None:
        if (file is None) == (not keys) or (keys and overrides):
            raise TypeError(
                "a study comes from a file and overrides, or from keys: scene, set, factors, "
                "measures ..."
            )
        self.loaded = study_from(keys, Path()) if file is None else load_study(file, overrides)

    @property
    def cases(self) -> list[Case]:
        """All cases, in the order of the table; of a bisection those that it begins with."""
        return self.loaded.cases()

    def run(
        self,
        out: Path | str | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        device: str = "auto",
        batch: int = 1,
    ) -> polars.DataFrame:
        """Run what is not stored yet, and return the table, a row a case.

        out: folder, runs/STUDY by default. workers: processes, by default one a core; scheduler:
        address of a dask scheduler instead, whose workers share the disk. device: auto, cpu, cuda.
        batch: cases that a worker runs at once.

        Raises
        ------
        SceneError: a case is no scene. ClusterError, OutputError, DeviceError: workers, the disk or
        the device refuse. Interrupted: SIGINT or SIGTERM came; the same call goes on.
        """
        folder = Path(out or Path("runs") / self.loaded.path.stem)
        pool = _pool(folder, device, workers, scheduler)
        return sweep(self.loaded, folder, pool, device, batch)

    def optimize(
        self,
        out: Path | str | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        device: str = "auto",
        trials: int | None = None,
    ) -> polars.DataFrame:
        """Seek what the study says under `optimize`, and return the table, a row a trial.

        out: folder, runs/STUDY_optimum by default. trials: how many there are in the end, by
        default as many as the study says. device: auto is the CPU. The others, and what is raised,
        as for `run`.
        """
        folder = Path(out or Path("runs") / f"{self.loaded.path.stem}_optimum")
        taken = device_of_trials(device)
        pool = _pool(folder, taken, workers, scheduler)
        return optimize(self.loaded, folder, pool, taken, trials)

    def report(self, out: Path | str | None = None) -> Path:
        """Draw the figures, and write report.html, of what is in a folder so far; its path.

        out: folder of `run` or `optimize`, runs/STUDY by default. Raises OutputError: it holds no
        study.
        """
        from softsim.report.study.figures import draw_study  # imports matplotlib
        from softsim.report.study.page import write_study_page

        folder = Path(out or Path("runs") / self.loaded.path.stem)
        draw_study(folder)
        return write_study_page(folder)


def _pool(
    folder: Path, device: str, workers: int | None, scheduler: str | None
) -> AbstractContextManager[WorkerPool]:
    if scheduler is None:
        refuse_unguarded_script()
    return pool_for(folder, device, workers, scheduler)


def refuse_unguarded_script() -> None:
    """A process that is started runs the main script once more, all but what is guarded: a study
    there would start processes in its turn.
    """
    script = getattr(sys.modules["__main__"], "__file__", None)
    if script is None or not Path(script).is_file():
        return
    if "__main__" not in Path(script).read_text(encoding="utf-8", errors="replace"):
        raise ClusterError(
            f"{script} would start this study again in each of its processes",
            hint='call it under  if __name__ == "__main__":',
        )
