"""The trials of an optimisation, stored in a journal beside its table.

The first trials are evenly distributed. Then a tree-structured Parzen estimator chooses the values
(Bergstra et al. 2011, implemented in optuna): where good trials are dense and bad ones rare.
Running trials count as bad, so that workers do not all try the same values. Each trial has its own
random numbers, so an interrupted optimisation continues as if it had not been interrupted.
Unpromising trials may be stopped early.
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

from softsim.analysis.measures import measures
from softsim.errors import OutputError, SceneError
from softsim.model import Model
from softsim.output.folder import CASES
from softsim.output.stop_conditions import MakesStopCondition
from softsim.study.cases import FAILED, Case, Value, case_key, resolved
from softsim.study.design import even_shares
from softsim.study.factors import Interval, Space, at, rounded
from softsim.study.measures import MeasureColumn
from softsim.study.schema import Prune, SobolDesign
from softsim.sweep.job import PRUNING, Job, Outcome, stored_outcome

JOURNAL = "trials.journal"
NAME = "optimisation"
"""Name of optuna's study in the journal."""

SETTINGS = "settings"

START = 8
"""Number of initial trials; a power of two, for which a Sobol sequence is even."""


SAMPLER: dict[str, Any] = {
    "n_startup_trials": START, "n_ei_candidates": 24, "multivariate": True, "group": False,
    "constant_liar": True,
}  # fmt: skip
"""Options of the sampler, whose defaults differ between versions of optuna."""

OPTUNA = "optuna"
"""Attribute of optuna's study: the version that started it."""


@dataclass(frozen=True)
class Trial:
    """Values of the factors to try. number: from 1, that of its case."""

    number: int
    values: Mapping[str, Value]


def storage_in(folder: Path) -> JournalStorage:
    """Return the journal in a study's folder; several processes may write to it."""
    return JournalStorage(JournalFileBackend(str(folder / JOURNAL)))


def trial_in(study: optuna.Study, storage: JournalStorage, number: int) -> optuna.Trial:
    """Return a running trial by its number, from 1."""
    study_id = storage.get_study_id_from_name(study.study_name)
    return optuna.Trial(
        study, storage.get_trial_id_from_study_id_trial_number(study_id, number - 1)
    )


class Trials:
    """Trials of an optimisation with optuna.

    space: factor -> interval or values. column: the objective. sense: maximize or minimize.
    Raises OutputError if the journal in `folder` belongs to another optimisation.
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
        """Number of trials started so far."""
        trials = self.study.get_trials(deepcopy=False)
        return sum(frozen.state is not TrialState.WAITING for frozen in trials)

    def is_open(self, count: int) -> bool:
        """Return True if trials are to be run until there are `count`."""
        running = self.study.get_trials(deepcopy=False, states=(TrialState.RUNNING,))
        return bool(running) or self.count < count

    def ended(self) -> Iterator[Trial]:
        """Yield the trials with a result in the journal."""
        for frozen in self.study.get_trials(deepcopy=False):
            if frozen.state.is_finished():
                fixed = optuna.trial.FixedTrial(frozen.params)
                yield self._suggested(fixed, frozen.number + 1)

    def to_run(self, count: int) -> Iterator[Trial]:
        """Yield the trials that were running at an interruption, then new ones up to `count`.

        A result must be given to `tell` before the first trial that is to use it is requested.
        """
        for frozen in self.study.get_trials(states=(TrialState.RUNNING,)):
            number = frozen.number + 1
            self._draw_for(number)
            yield self._suggested(trial_in(self.study, self.storage, number), number)
        while (number := self.count + 1) <= count:
            self._draw_for(number)
            yield self._suggested(self.study.ask(), number)

    def tell(self, number: int, value: Value | None, pruned: bool = False) -> None:
        """Record the objective of a trial; None if its run failed or did not give it."""
        if pruned:
            self.study.tell(number - 1, state=TrialState.PRUNED)
        elif value is None or not math.isfinite(float(value)):
            self.study.tell(number - 1, state=TrialState.FAIL)
        else:
            self.study.tell(number - 1, float(value))

    def _draw_for(self, number: int) -> None:
        """Set random numbers that depend on the seed and the trial number alone."""
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
        """Raise OutputError if another major version of optuna started the journal.

        It chooses other values with the same seed.
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
    """Return the value of a factor in a trial, chosen now if it has none.

    Numeric levels keep their order; labels have none.
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
    """Return START points of a scrambled Sobol sequence, as parameters of trials.

    optuna's own QMCSampler draws the first trial at random.
    """
    shares = even_shares(SobolDesign(kind="sobol", count=START, seed=seed), len(space))
    ranges = {name: parameters(one) for name, one in space.items()}
    return [
        {name: at(ranges[name], share) for name, share in zip(ranges, point, strict=True)}
        for point in shares
    ]


def parameters(space: Space) -> Space:
    """Return the values of optuna's parameter of a factor: numeric levels become their indices."""
    if isinstance(space, Interval) or any(isinstance(level, str) for level in space):
        return space
    return tuple(range(len(space)))


def settings(space: Mapping[str, Space], column: MeasureColumn, sense: str) -> dict[str, Any]:
    """Return the settings, in JSON types, that must agree for trials to be comparable."""
    factors = {
        name: asdict(one) if isinstance(one, Interval) else list(one) for name, one in space.items()
    }
    content = {"factors": factors, "goal": {"sense": sense, "measure": asdict(column)}}
    result: dict[str, Any] = json.loads(json.dumps(content))
    return result


@dataclass(frozen=True)
class TrialJobs:
    """Maker of the jobs of trials in `folder`.

    column: the objective. prune: settings of early stopping. device, keep: see `Job`.
    """

    folder: Path
    column: MeasureColumn
    prune: Prune | None
    device: str
    keep: str

    def job(self, case: Case) -> Job:
        """Return the job of a trial. Raises SceneError if its values make no valid scene."""
        key = case_key(resolved(case))
        pruning: tuple[MakesStopCondition, ...] = ()
        if self.prune is not None:
            pruning = (
                partial(PruningCondition, self.folder, case.number, self.column, self.prune),
            )
        return Job(case, key, self.folder / CASES / key, self.device, self.keep, pruning)

    def refused(self, case: Case, error: SceneError) -> tuple[Job, Outcome]:
        """Return job and outcome of a trial whose values make no valid scene."""
        reason = " ".join(error.message.split())
        return Job(case, "", self.folder / CASES), Outcome("", FAILED, reason)

    def stored(self, case: Case) -> tuple[Job, Outcome]:
        """Return job and outcome of an ended trial. Raises OutputError if its run is missing."""
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
"""Number of equal parts of a run; its trial is evaluated after each of them."""


class PruningCondition:
    """Stop condition of a trial that is worse than the median of finished ones at the same time.

    It runs in the worker and reports intermediate values to the journal in `folder`, which holds
    those of the other trials. number: of the trial, from 1. column: the objective. model: of the
    run.
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
        for name, number in row.items():
            self.history.setdefault(name, []).append(number)
        part = int(PARTS * self.share(row) + 1e-9)
        if self.parts_seen < part < PARTS and not self.is_over:
            self.parts_seen = part
            self.is_over = self._is_hopeless(100 * part // PARTS)

    def share(self, row: Mapping[str, float]) -> float:
        """Return the fraction of the run that is done, in time or in pressure cycles."""
        model = self.model
        share = row["time"] / model.end_time
        return share if model.cycles is None else max(share, row["cycles_done"] / model.cycles)

    def _is_hopeless(self, percent: int) -> bool:
        """Report the intermediate value, and return True if the trial is to be stopped.

        A measure that is not available yet, such as one of an unfinished cycle, is skipped.
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
