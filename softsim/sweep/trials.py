"""The trials of an optimisation, kept in a journal beside its table.

The first lie evenly. Then a tree-structured Parzen estimator chooses their values (Bergstra et al.
2011, as optuna has it): where good trials are dense and bad ones rare. Those in flight count as
bad, so that workers do not all try the same. Each trial has random numbers of its own: an
optimisation that was interrupted goes on as if it had not been.
"""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import optuna
from optuna.storages.journal import JournalFileBackend, JournalStorage
from optuna.study import StudyDirection
from optuna.trial import TrialState

from softsim.errors import OutputError
from softsim.study.cases import Value
from softsim.study.measures import MeasureColumn
from softsim.study.values import Interval, Space, rounded
from softsim.sweep.even_start import START, EvenStart

JOURNAL = "trials.journal"
NAME = "optimisation"
"""Of optuna's study in the journal."""

SETTINGS = "settings"


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

    @property
    def count(self) -> int:
        """How many were asked for so far."""
        return len(self.study.get_trials(deepcopy=False))

    def is_open(self, count: int) -> bool:
        """Whether there is anything to run until there are `count`."""
        running = self.study.get_trials(deepcopy=False, states=(TrialState.RUNNING,))
        return bool(running) or self.count < count

    def ended(self) -> Iterator[Trial]:
        """Those of which the journal knows what came of them."""
        for frozen in self.study.get_trials(deepcopy=False):
            if frozen.state.is_finished():
                yield self._suggested(_fixed(frozen), frozen.number + 1)

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
        if number <= START:
            self.study.sampler = EvenStart(list(self.space), self.seed, number)
            return
        seed = int(np.random.SeedSequence((self.seed, number)).generate_state(1)[0])
        self.study.sampler = optuna.samplers.TPESampler(
            n_startup_trials=START, seed=seed, constant_liar=True
        )

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
                f"{folder / JOURNAL} was begun with other {' and '.join(differing)}: its trials "
                "tell nothing here",
                hint="choose another folder with --out, or remove the journal: the runs in the "
                "folder are kept, and used again where they fit",
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


def settings(space: Mapping[str, Space], column: MeasureColumn, sense: str) -> dict[str, Any]:
    """What must be the same for trials to be comparable, as JSON gives it back."""
    factors = {
        name: asdict(one) if isinstance(one, Interval) else list(one) for name, one in space.items()
    }
    content = {"factors": factors, "goal": {"sense": sense, "measure": asdict(column)}}
    result: dict[str, Any] = json.loads(json.dumps(content))
    return result


def _fixed(frozen: optuna.trial.FrozenTrial) -> optuna.trial.BaseTrial:
    return optuna.trial.FixedTrial(frozen.params)
