"""Conditions that end a run before its end time, asked after each row of its history."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:  # studies read this before Taichi is needed
    from softsim.model import Model


class StopCondition(Protocol):
    """Decides from the rows of the history alone, so that a resumed run decides alike."""

    @property
    def name(self) -> str:
        """What the summary says has ended the run."""

    @property
    def is_over(self) -> bool:
        """True if the run is to end."""

    def see_row(self, row: Mapping[str, float]) -> None:
        """A row of the history, as it is written: column -> number, SI."""


MakesStopCondition = Callable[["Model"], StopCondition]
"""Makes a condition for the model of the run that it may end."""


def see_history(conditions: Sequence[StopCondition], history: Mapping[str, np.ndarray]) -> None:
    """Show conditions the rows that a run has written before."""
    for numbers in zip(*(column.tolist() for column in history.values()), strict=True):
        row = dict(zip(history, numbers, strict=True))
        for condition in conditions:
            condition.see_row(row)


def ended_by(conditions: Sequence[StopCondition]) -> str | None:
    """Name of the condition that ended the run, None where none did."""
    return next((condition.name for condition in conditions if condition.is_over), None)


class CycleLimit:
    """Ends a run when so many pressure cycles are done."""

    name = "cycles"

    def __init__(self, cycles: int) -> None:
        self.cycles = cycles
        self.is_over = False

    def see_row(self, row: Mapping[str, float]) -> None:
        """A row of the history."""
        self.is_over = self.is_over or row["cycles_done"] >= self.cycles
