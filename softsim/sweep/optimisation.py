"""An optimisation: trials, each a case of which the results so far choose the values."""

from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import polars
from rich.console import Console

from softsim.errors import OutputError, SceneError
from softsim.output.folder import RunFolder
from softsim.output.stop_conditions import MakesStopCondition
from softsim.output.study_folder import CASES
from softsim.scene.tree import nearest
from softsim.study.axes import Goal
from softsim.study.cases import DONE, FAILED, LOST, PRUNED, Case, case_key, resolved
from softsim.study.loading import LoadedStudy
from softsim.study.measures import MeasureColumn
from softsim.study.schema import Objective, Prune
from softsim.sweep.engine import completed
from softsim.sweep.job import Job, Outcome, stored_outcome
from softsim.sweep.ledger import StudyTable, kept_ledger, record_of
from softsim.sweep.trials import JOURNAL, PruningCondition, Trials
from softsim.sweep.work import Simulate, simulate
from softsim.sweep.worker_pool import WorkerPool


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
    objective, goal = asked(study)
    console = console or Console()
    RunFolder(folder / CASES)  # is made here, or refused
    column = next(measure for measure in study.measures if measure.name == goal.measure)
    trials = Trials(folder, study.search_space, column, goal.sense, objective.seed)
    table, count = StudyTable(study.factors, study.measures), count or objective.trials
    plan = Plan(folder.resolve(), column, objective.prune, device, study.study.keep)
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
        value = column.value(outcome.summary) if outcome.status == DONE else None
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


def asked(study: LoadedStudy) -> tuple[Objective, Goal]:
    """What a study wants optimised. SceneError: it says none, or nothing varies in it."""
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
    return objective, goal


@dataclass(frozen=True)
class Plan:
    """Makes jobs of trials in `folder`. column: the measure that is sought; prune: how trials are
    stopped early; device, keep: as jobs have them.
    """

    folder: Path
    column: MeasureColumn
    prune: Prune | None
    device: str
    keep: str

    def job(self, case: Case) -> Job:
        """The job of a trial. SceneError: its values make no scene."""
        key = case_key(resolved(case))
        pruning: tuple[MakesStopCondition, ...] = ()
        if self.prune is not None:
            pruning = (
                partial(PruningCondition, self.folder, case.number, self.column, self.prune),
            )
        return Job(case, key, self.folder / CASES / key, self.device, self.keep, pruning)

    def refused(self, case: Case, error: SceneError) -> tuple[Job, Outcome]:
        """What became of a trial whose values make no scene."""
        reason = " ".join(error.message.split())
        return Job(case, "", self.folder / CASES), Outcome("", FAILED, reason)

    def stored(self, case: Case) -> tuple[Job, Outcome]:
        """What became of a trial that has ended. OutputError: its run is not there."""
        try:
            job = self.job(case)
        except SceneError as error:
            return self.refused(case, error)
        outcome = stored_outcome(job.folder)
        if outcome is None:
            raise OutputError(
                f"trial {case.number} in {self.folder / JOURNAL} belongs to a run that is not in "
                f"{self.folder / CASES}: since then the scene, its overrides or softsim changed",
                hint="choose another folder with --out, or remove the journal",
            )
        return job, outcome
