"""Trials that promise little are stopped early."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import numpy as np
import optuna

from softsim.builder import build_model
from softsim.model import Model
from softsim.output.measures import measures
from softsim.study.cases import Case, resolved
from softsim.study.measures import MeasureColumn
from softsim.study.schema import Prune
from softsim.sweep.trials import NAME, storage_in, trial_in

PARTS = 10
"""A run is looked at after each of so many parts of it."""


class PruningWatch:
    """Ends the run of a trial that is worse than the median of the finished ones were by then.

    It works in the worker: what the run has found so far goes into the journal in `folder`, where
    those of the other trials are. column: the measure that is sought.
    """

    name = "pruning"

    def __init__(self, folder: Path, case: Case, column: MeasureColumn, prune: Prune) -> None:
        self.folder, self.case, self.column, self.prune = folder, case, column, prune
        self.history: dict[str, list[float]] = {}
        self.parts_seen = 0
        self.is_over = False

    @cached_property
    def model(self) -> Model:
        """What measures are taken of."""
        return build_model(resolved(self.case))

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
        value = self.column.value(measures(self.model, history))
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
        known = study.get_trials(deepcopy=False)[self.case.number - 1].intermediate_values
        if percent in known:  # a run that goes on shows its rows again
            return False
        trial = trial_in(study, storage, self.case.number)
        trial.report(float(value), percent)
        return trial.should_prune()
