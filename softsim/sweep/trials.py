"""The trials of an optimisation, kept in a journal beside its table.

The first lie evenly. Then a tree-structured Parzen estimator chooses their values (Bergstra et al.
2011, as optuna has it): where good trials are dense and bad ones rare. Those in flight count as
bad, so that workers do not all try the same. Each trial has random numbers of its own: an
optimisation that was interrupted goes on as if it had not been. Trials that promise little may be
stopped early.
"""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import optuna
from optuna.storages.journal import JournalFileBackend, JournalStorage
from optuna.study import StudyDirection
from optuna.trial import TrialState

from softsim.errors import OutputError, SceneError
from softsim.model import Model
from softsim.output.measures import measures
from softsim.output.stop_conditions import MakesStopCondition
from softsim.output.study_folder import CASES
from softsim.study.cases import FAILED, Case, Value, case_key, resolved
from softsim.study.design import even_shares
from softsim.study.factors import Interval, Space, at, rounded
from softsim.study.measures import MeasureColumn
from softsim.study.schema import Prune, SobolDesign
from softsim.sweep.job import PRUNING, Job, Outcome, stored_outcome

JOURNAL = "trials.journal"
NAME = "optimisation"
"""Of optuna's study in the journal."""

SETTINGS = "settings"

START = 8
"""Trials that have nothing to learn from; a power of two, for which a Sobol sequence is even."""


SAMPLER: dict[str, Any] = {
    "n_startup_trials": START, "n_ei_candidates": 24, "multivariate": True, "group": False,
    "constant_liar": True,
}  # fmt: skip
"""Options of the sampler, whose defaults differ between versions of optuna."""

OPTUNA = "optuna"
"""Attribute of optuna's study: the version that began it."""


@dataclass(frozen=True)
class Trial:
    """Values of the factors to try. number: from 1, that of its case."""

    number: int
    values: Mapping[str, Value]


def storage_in(folder: Path) -> JournalStorage:
    """The journal in a study's folder; several processes may write to it."""
    return JournalStorage(JournalFileBackend(str(folder / JOURNAL)))


def trial_in(study: optuna.Study, storage: JournalStorage, number: int) -> optuna.Trial:
    """A trial that runs, by its number from 1."""
    study_id = storage.get_study_id_from_name(study.study_name)
    return optuna.Trial(
        study, storage.get_trial_id_from_study_id_trial_number(study_id, number - 1)
    )


class Trials:
    """Asks optuna for the next trial, and tells it what came of each.

    space: all that each factor can be. column: the measure that is sought; sense: maximize or
    minimize. Raises OutputError where the journal in `folder` belongs to another optimisation.
    """

    def __init__(
        self, folder: Path, space: Mapping[str, Space], column: MeasureColumn, sense: str, seed: int
    ) -> None:
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self.space, self.seed = space, seed
        self.storage = storage_in(folder)
        self.study = optuna.create_study(
            study_name=NAME,
            storage=self.storage,
            direction=StudyDirection[sense.upper()],
            load_if_exists=True,
        )
        self._refuse_another(folder, settings(space, column, sense))
        self._refuse_another_optuna(folder)
        known = len(self.study.get_trials(deepcopy=False))
        for point in even_points(space, seed)[known:]:
            self.study.enqueue_trial(point)

    @property
    def count(self) -> int:
        """How many were asked for so far."""
        trials = self.study.get_trials(deepcopy=False)
        return sum(frozen.state is not TrialState.WAITING for frozen in trials)

    def is_open(self, count: int) -> bool:
        """Whether there is anything to run until there are `count`."""
        running = self.study.get_trials(deepcopy=False, states=(TrialState.RUNNING,))
        return bool(running) or self.count < count

    def ended(self) -> Iterator[Trial]:
        """Those of which the journal knows what came of them."""
        for frozen in self.study.get_trials(deepcopy=False):
            if frozen.state.is_finished():
                fixed = optuna.trial.FixedTrial(frozen.params)
                yield self._suggested(fixed, frozen.number + 1)

    def to_run(self, count: int) -> Iterator[Trial]:
        """Those that were in flight when the optimisation was stopped, then new ones until there
        are `count`. What came of one must be told before the next is pulled that is to know it.
        """
        for frozen in self.study.get_trials(states=(TrialState.RUNNING,)):
            number = frozen.number + 1
            self._draw_for(number)
            yield self._suggested(trial_in(self.study, self.storage, number), number)
        while (number := self.count + 1) <= count:
            self._draw_for(number)
            yield self._suggested(self.study.ask(), number)

    def tell(self, number: int, value: Value | None, pruned: bool = False) -> None:
        """What came of a trial: its objective; None where its run failed or did not find it."""
        if pruned:
            self.study.tell(number - 1, state=TrialState.PRUNED)
        elif value is None or not math.isfinite(float(value)):
            self.study.tell(number - 1, state=TrialState.FAIL)
        else:
            self.study.tell(number - 1, float(value))

    def _draw_for(self, number: int) -> None:
        """Random numbers that depend on the seed and the trial alone."""
        seed = int(np.random.SeedSequence((self.seed, number)).generate_state(1)[0])
        self.study.sampler = optuna.samplers.TPESampler(seed=seed, **SAMPLER)

    def _suggested(self, trial: optuna.trial.BaseTrial, number: int) -> Trial:
        values = {name: suggested(trial, name, space) for name, space in self.space.items()}
        return Trial(number, values)

    def _refuse_another(self, folder: Path, wanted: dict[str, Any]) -> None:
        stored = self.study.user_attrs.get(SETTINGS)
        if stored is None:
            self.study.set_user_attr(SETTINGS, wanted)
            return
        differing = [key for key, value in wanted.items() if stored[key] != value]
        if differing:
            raise OutputError(
                f"{folder / JOURNAL} was started with other {' and '.join(differing)}: its trials "
                "do not apply to this study",
                hint="choose another folder with --out, or remove the journal: the stored runs "
                "are kept, and reused if they fit",
            )

    def _refuse_another_optuna(self, folder: Path) -> None:
        """Refuse to continue what another major version of optuna began: with the same seed it
        chooses other values.
        """
        began = self.study.user_attrs.get(OPTUNA)
        if began is None:
            self.study.set_user_attr(OPTUNA, optuna.__version__)
        elif began.split(".")[0] != optuna.__version__.split(".")[0]:
            raise OutputError(
                f"{folder / JOURNAL} was started with optuna {began}, and this is optuna "
                f"{optuna.__version__}: the remaining trials would use other values",
                hint=f'install "optuna=={began.split(".")[0]}.*", or choose another folder with '
                "--out",
            )


def suggested(trial: optuna.trial.BaseTrial, name: str, space: Space) -> Value:
    """The value that a trial has, or now gets, for a factor. Levels that are numbers keep their
    order; labels have none.
    """
    if isinstance(space, Interval):
        if space.is_whole:
            return trial.suggest_int(name, int(space.low), int(space.high))
        return rounded(trial.suggest_float(name, space.low, space.high, log=space.logarithmic))
    if any(isinstance(level, str) for level in space):
        label: str = trial.suggest_categorical(name, [str(level) for level in space])
        return label
    return sorted(space)[trial.suggest_int(name, 0, len(space) - 1)]


def even_points(space: Mapping[str, Space], seed: int) -> list[dict[str, Value]]:
    """START points of a scrambled Sobol sequence, as parameters of trials. optuna's own QMCSampler
    draws the first trial at random.
    """
    shares = even_shares(SobolDesign(kind="sobol", count=START, seed=seed), len(space))
    ranges = {name: parameters(one) for name, one in space.items()}
    return [
        {name: at(ranges[name], share) for name, share in zip(ranges, point, strict=True)}
        for point in shares
    ]


def parameters(space: Space) -> Space:
    """What optuna's parameter of a factor can be: levels that are numbers go by their place."""
    if isinstance(space, Interval) or any(isinstance(level, str) for level in space):
        return space
    return tuple(range(len(space)))


def settings(space: Mapping[str, Space], column: MeasureColumn, sense: str) -> dict[str, Any]:
    """What must be the same for trials to be comparable, as JSON gives it back."""
    factors = {
        name: asdict(one) if isinstance(one, Interval) else list(one) for name, one in space.items()
    }
    content = {"factors": factors, "goal": {"sense": sense, "measure": asdict(column)}}
    result: dict[str, Any] = json.loads(json.dumps(content))
    return result


@dataclass(frozen=True)
class TrialJobs:
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
                f"{self.folder / CASES}: the scene, its overrides or softsim changed since "
                "then",
                hint="choose another folder with --out, or remove the journal",
            )
        return job, outcome


PARTS = 10
"""A run is looked at after each of so many parts of it."""


class PruningCondition:
    """Ends the run of a trial that is worse than the median of the finished ones were by then.

    It works in the worker: what the run has found so far goes into the journal in `folder`, where
    those of the other trials are. number: of the trial, from 1. column: the measure that is
    sought. model: of its run.
    """

    name = PRUNING

    def __init__(
        self, folder: Path, number: int, column: MeasureColumn, prune: Prune, model: Model
    ) -> None:
        self.folder, self.number, self.column, self.prune = folder, number, column, prune
        self.model = model
        self.history: dict[str, list[float]] = {}
        self.parts_seen = 0
        self.is_over = False

    def see_row(self, row: Mapping[str, float]) -> None:
        """A row of the history."""
        for name, number in row.items():
            self.history.setdefault(name, []).append(number)
        part = int(PARTS * self.share(row) + 1e-9)
        if self.parts_seen < part < PARTS and not self.is_over:
            self.parts_seen = part
            self.is_over = self._is_hopeless(100 * part // PARTS)

    def share(self, row: Mapping[str, float]) -> float:
        """How much of the run is done: of its time, or of the cycles that it waits for."""
        model = self.model
        share = row["time"] / model.end_time
        return share if model.cycles is None else max(share, row["cycles_done"] / model.cycles)

    def _is_hopeless(self, percent: int) -> bool:
        """Report what was found so far, and hold it against the others. A measure that is not there
        yet, such as one of a cycle that goes on, says nothing.
        """
        history = {name: np.array(numbers) for name, numbers in self.history.items()}
        value = self.column.value(measures(self.model, history), history)
        if value is None:
            return False
        storage = storage_in(self.folder)
        study = optuna.load_study(
            study_name=NAME,
            storage=storage,
            sampler=optuna.samplers.RandomSampler(),  # nothing is drawn here
            pruner=optuna.pruners.MedianPruner(
                self.prune.after_trials, round(100 * self.prune.after_share)
            ),
        )
        known = study.get_trials(deepcopy=False)[self.number - 1].intermediate_values
        if percent in known:  # a run that goes on shows its rows again
            return False
        trial = trial_in(study, storage, self.number)
        trial.report(float(value), percent)
        return trial.should_prune()
