"""What watches a run, row by row, and may end it before its time: a layout's verdict, a study's."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np


class Watch(Protocol):
    """Decides from the rows of the history alone, so that a resumed run decides alike."""

    @property
    def name(self) -> str:
        """What the summary says has ended the run."""

    @property
    def is_over(self) -> bool:
        """Whether there is nothing more to wait for."""

    def see_row(self, row: Mapping[str, float]) -> None:
        """A row of the history, as it is written: column -> number, SI."""


def see_history(watches: Sequence[Watch], history: Mapping[str, np.ndarray]) -> None:
    """Show watches the rows that a run has written before."""
    for numbers in zip(*(column.tolist() for column in history.values()), strict=True):
        row = dict(zip(history, numbers, strict=True))
        for watch in watches:
            watch.see_row(row)


def ended_by(watches: Sequence[Watch]) -> str | None:
    """Name of the watch that ended the run, None where none did."""
    return next((watch.name for watch in watches if watch.is_over), None)


class CycleWatch:
    """A watch that ends a run when so many pressure cycles are done."""

    name = "cycles"

    def __init__(self, cycles: int) -> None:
        self.cycles = cycles
        self.is_over = False

    def see_row(self, row: Mapping[str, float]) -> None:
        """A row of the history."""
        self.is_over = self.is_over or row["cycles_done"] >= self.cycles
