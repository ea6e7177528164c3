"""Conditions that end a run before its end time, evaluated after each row of its history."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from softsim import units
from softsim.scene.loading import LoadedScene
from softsim.scene.reporting import did_you_mean

if TYPE_CHECKING:  # studies read this before Taichi is needed
    from softsim.model import Model, SteadyProbe

# Rows of the history that a probe is seen in before it counts as steady.
LEAST_ROWS = 16


class StopCondition(Protocol):
    """Interface of a stop condition.

    It depends on the rows of the history alone, so that a resumed run ends at the same row.
    """

    @property
    def name(self) -> str:
        """Name of the condition in the summary of a run that it ended."""

    @property
    def is_over(self) -> bool:
        """True if the run is to end."""

    def see_row(self, row: Mapping[str, float]) -> None:
        """Process a row of the history: column -> number, SI."""


MakesStopCondition = Callable[["Model"], StopCondition]
"""Function that makes a condition for the model of the run that it may end."""


def see_history(conditions: Sequence[StopCondition], history: Mapping[str, np.ndarray]) -> None:
    """Pass the rows that a run has written before to the conditions."""
    for numbers in zip(*(column.tolist() for column in history.values()), strict=True):
        row = dict(zip(history, numbers, strict=True))
        for condition in conditions:
            condition.see_row(row)


def ended_by(conditions: Sequence[StopCondition]) -> str | None:
    """Return the name of the condition that ended the run; None if none did."""
    return next((condition.name for condition in conditions if condition.is_over), None)


class CycleLimit:
    """Stop condition: the given number of pressure cycles is done."""

    name = "cycles"

    def __init__(self, cycles: int) -> None:
        self.cycles = cycles
        self.is_over = False

    def see_row(self, row: Mapping[str, float]) -> None:
        self.is_over = self.is_over or row["cycles_done"] >= self.cycles


class ColumnReached:
    """Stop condition: a column of the history is above a limit, or below it, in SI."""

    def __init__(self, column: str, limit: float, is_above: bool) -> None:
        self.column, self.limit, self.is_above = column, limit, is_above
        self.name = f"{column} {'above' if is_above else 'below'} its limit"
        self.is_over = False

    def see_row(self, row: Mapping[str, float]) -> None:
        value = row[self.column]
        self.is_over |= value > self.limit if self.is_above else value < self.limit


def column_reached(loaded: LoadedScene, columns: Mapping[str, str]) -> ColumnReached | None:
    """Return the condition of a scene's time.reach; None if it has none.

    columns: columns of its history, name -> unit.

    Raises SceneError: there is no such column, or the limit has another unit.
    """
    asked, keys = loaded.scene.time.reach, ("time", "reach")
    if asked is None:
        return None
    if asked.column not in columns:
        raise loaded.error(
            (*keys, "column"),
            f"the history has no column '{asked.column}'",
            did_you_mean(asked.column, columns),
        )
    side, given = ("below", asked.below) if asked.above is None else ("above", asked.above)
    unit = columns[asked.column]
    try:
        limit = float(str(given)) if unit == "-" else units.parse(str(given), unit)
    except ValueError as error:
        hint = "expected a number without a unit" if unit == "-" else ""
        raise loaded.error((*keys, side), str(error), hint) from None
    return ColumnReached(asked.column, limit, side == "above")


class ProbeAtRest:
    """Stop condition of a static run: a probe is steady.

    Over the last half of the time, a quantity that decays as exp(-t / T) changes by more than its
    remainder once t > T log 4, and one that decays as 1 / t changes by as much as its remainder.
    """

    def __init__(self, probe: "SteadyProbe") -> None:
        self.probe = probe
        self.name = f"probe '{probe.name}' at rest"
        self.is_over = False
        self.times: list[float] = []
        self.values: list[list[float]] = []

    def see_row(self, row: Mapping[str, float]) -> None:
        probe, now = self.probe, row["time"]
        if now < probe.since:
            return
        self.times.append(now)
        self.values.append([row[column] for column in probe.columns])
        late = np.searchsorted(self.times, 0.5 * (probe.since + now))
        if len(self.times) - late >= LEAST_ROWS:
            seen = np.array(self.values[late:])
            change = float(np.linalg.norm(np.ptp(seen, axis=0)))
            self.is_over |= change <= probe.within * float(np.linalg.norm(seen[-1]))
