"""Search of an optimisation: a Parzen estimator for any study, descent for static scenes."""

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import optuna
from optuna.storages.journal import JournalFileBackend, JournalStorage
from optuna.study import StudyDirection
from optuna.trial import TrialState
from scipy.optimize import minimize

from softsim.analysis.measures import measures
from softsim.errors import OutputError, SceneError
from softsim.model import Model
from softsim.output.folder import CASES
from softsim.output.stop_conditions import MakesStopCondition
from softsim.scene.loading import keys_at
from softsim.scene.measures import WITHOUT_DERIVATIVE
from softsim.scene.text import nearest
from softsim.study.cases import FAILED, Case, Value, case_key, resolved
from softsim.study.design import Composition, even_shares, value_at
from softsim.study.factors import Interval, NumberFactor, Space, at, rounded
from softsim.study.loading import LoadedStudy
from softsim.study.measures import MAXIMIZE, History, HistoryColumn, MeasureColumn
from softsim.study.schema import Prune, SobolDesign
from softsim.sweep.job import PRUNING, Job, Outcome, stored_outcome

# -------------------------------------------------------------------------------------------------
# Trials, stored in a journal beside their table.
#
# The first trials are evenly distributed. Then a tree-structured Parzen estimator chooses the
# values (Bergstra et al. 2011, implemented in optuna): where good trials are dense and bad ones
# rare. Running trials count as bad, so that workers do not all try the same values. Each trial has
# its own random numbers, so an interrupted optimisation continues as if it had not been
# interrupted. Unpromising trials may be stopped early.

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


# -------------------------------------------------------------------------------------------------
# Descent in a static scene by the derivatives of its measures.
#
# L-BFGS-B (Byrd et al. 1995, SIAM J. Sci. Comput. 16:1190-1208, implemented in scipy) varies the
# factors within their ranges, one trial after the other. A trial is a static run that computes its
# derivatives (run/statics.py). The trials depend on the results of earlier ones alone: repeated, an
# optimisation finds its stored trials and continues.

RANGE = 10.0
"""Scaled range of a factor.

L-BFGS-B begins with a step along the gradient, which is scaled to a largest component of 1: a tenth
of the range.
"""

GRADIENT_TOLERANCE, VALUE_TOLERANCE = 1e-4, 1e-9
"""Gradient over that of the start, and relative change of the objective, that end the search."""


Evaluate = Callable[[np.ndarray], tuple[float, np.ndarray]]
"""Function that returns the objective and its gradient at scaled factors (k,)."""


class SearchEndedError(Exception):
    """The search is over: all trials are used, or one has failed."""


@dataclass(frozen=True)
class Dimension:
    """Factor of a descent with its range."""

    factor: NumberFactor
    space: Interval

    def value(self, x: float) -> float:
        """Return the value in the unit of the factor, at a scaled number x from 0 to RANGE."""
        return float(f"{self.space.number(x / RANGE):.12g}")

    def scaled(self, value: float) -> float:
        """Return the scaled number of a value."""
        return RANGE * self.space.share(value)

    def slope(self, x: float) -> float:
        """Return the derivative of the value, SI, over its scaled number."""
        return self.factor.size * self.space.slope(x / RANGE) / RANGE


class Descent:
    """Objective of a study as a function of its scaled factors (k,), with its gradient.

    Raises SceneError if a factor or a measure has no derivative.
    """

    def __init__(self, study: LoadedStudy, column: MeasureColumn, sense: str) -> None:
        self.study, self.column = study, column
        self.sign = -1.0 if sense == MAXIMIZE else 1.0
        self.dimensions = [self._dimension(factor) for factor in study.composition.factors]
        self.parts: list[HistoryColumn] = []
        for part in column.parts:
            if not (isinstance(part, HistoryColumn) and part.take == "last"):
                raise self._refusal("measures", part.name, "take: last of a column of the history")
            if part.of in WITHOUT_DERIVATIVE:
                raise self._refusal("measures", part.name, f"a derivative, unlike {part.of}")
            self.parts.append(part)
        objective = study.study.optimize
        if objective is not None and objective.prune is not None:
            raise self._refusal("optimize", "prune", "every trial: leave prune out")

    def _dimension(self, factor: Any) -> Dimension:
        space = factor.space
        if not (isinstance(factor, NumberFactor) and isinstance(space, Interval)):
            raise self._refusal("factors", factor.axis.name, "a range without a count")
        if space.is_whole:
            raise self._refusal("factors", factor.axis.name, "a number that is not whole")
        return Dimension(factor, space)

    def _refusal(self, part: str, name: str, needed: str) -> SceneError:
        """Return the error that the search needs something of a key that the study lacks."""
        place = nearest(self.study.tree, (part, name))[0]
        return SceneError(f"{name}: method: gradient needs {needed}", "", place.key_origin)

    def start(self) -> np.ndarray:
        """Return the scaled factors (k,) of the scene; the middle for a key without value.

        A value outside its range is moved to the nearest end.
        """
        alone: Composition = replace(self.study.composition, factors=())
        loaded = alone.loaded({})
        scaled = []
        for dimension in self.dimensions:
            factor, space = dimension.factor, dimension.space
            keys = keys_at(loaded.tree, factor.path, factor.path_origin, type(loaded.scene))
            value = value_at(loaded.scene, keys)
            inside = np.clip(value / factor.size, space.low, space.high) if value else None
            scaled.append(0.5 * RANGE if inside is None else dimension.scaled(float(inside)))
        return np.array(scaled)

    def case(self, number: int, x: np.ndarray) -> Case:
        """Return the case of scaled factors (k,), whose run computes the derivatives."""
        pairs = zip(self.dimensions, x.tolist(), strict=True)
        case = self.study.case(number, {d.factor.axis.name: d.value(s) for d, s in pairs})
        parameters = ", ".join(f'"{d.factor.path}"' for d in self.dimensions)
        ends = {part.end for part in self.parts}
        times = ", ".join(f"{time!r} s" for time in sorted(ends) if np.isfinite(time))
        if times and np.inf in ends:
            raise SceneError(
                "some measures of the objective have a time `to`, others have none",
                "give all of them one, the end of the run where it is meant",
                nearest(self.study.tree, ("measures",))[0].key_origin,
            )
        at = f", at: [{times}]" if times else ""
        asked = f"output.derivatives={{parameters: [{parameters}]{at}}}"
        return replace(case, overrides=(*case.overrides, asked))

    def value(
        self, x: np.ndarray, summary: Mapping[str, Any], history: History
    ) -> tuple[float, np.ndarray]:
        """Return the objective, to be minimised, and its gradient over the scaled factors (k,)."""
        value = self.column.value(summary, history)
        if value is None:
            raise SearchEndedError(f"a trial has no value of {self.column.name}")
        of_parts = [part.derivative(summary) for part in self.parts]
        partials = self.column.partials(summary, history)
        slopes = [
            sum(p * of_paths[d.factor.path] for p, of_paths in zip(partials, of_parts, strict=True))
            * d.slope(scaled)
            for d, scaled in zip(self.dimensions, x.tolist(), strict=True)
        ]
        return self.sign * float(value), self.sign * np.array(slopes)

    def minimise(self, evaluate: Evaluate, count: int) -> str:
        """Minimise by L-BFGS-B; return why the search ended.

        evaluate: runs a trial, and returns `value`, or raises SearchEndedError with the reason to
        stop. count: largest number of trials.
        """
        start = self.start()
        try:
            scale = max(float(np.abs(evaluate(start)[1]).max()), 1e-300)

            def scaled(x: np.ndarray) -> tuple[float, np.ndarray]:
                value, gradient = evaluate(x)
                return value / scale, gradient / scale

            found = minimize(
                scaled, start, jac=True, method="L-BFGS-B", bounds=[(0.0, RANGE)] * len(start),
                options={"gtol": GRADIENT_TOLERANCE, "ftol": VALUE_TOLERANCE, "maxfun": count},
            )  # fmt: skip
        except SearchEndedError as end:
            return str(end)
        steps = f"after {found.nit} step{'' if found.nit == 1 else 's'}"
        if found.success:
            return f"converged {steps}"
        return f"stopped {steps}: no lower value was found along the last direction"
