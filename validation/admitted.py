"""Values of one constant that a condition on computed numbers admits."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from validation.statements import Statement
from validation.verdicts import AGREES, UNKNOWN, Finding, all_between, shown_list

NOTHING = "none"


@dataclass(frozen=True)
class Condition:
    """Every number of `measured(value of the constant)` lies between `low` and `high` [unit].

    statement: of the thesis. name: short, for a table's heading. claim, reference: of its row.
    """

    statement: Statement
    name: str
    claim: str
    reference: str
    measured: Callable[[float], Sequence[float]]
    low: float
    high: float
    unit: str = ""

    def judge(self, value: float) -> Finding:
        """Whether it holds at a value of the constant."""
        return all_between(self.measured(value), self.low, self.high, self.unit)

    def shown(self, value: float) -> str:
        """The numbers, and a mark where they do not fit."""
        finding = self.judge(value)
        mark = {AGREES: "", UNKNOWN: " ?"}.get(finding.verdict, " x")
        return shown_list(self.measured(value)) + mark


def admitted(condition: Condition, values: np.ndarray) -> np.ndarray:
    """Return True (n,) for values that fit; an undecided one does not."""
    return np.array([condition.judge(float(value)).verdict == AGREES for value in values])


def told(fits: np.ndarray, values: np.ndarray) -> str:
    """The ranges of rising `values` (n,) that fit (n,), as people read them."""
    texts = (f"{values[first]:.2f} to {values[last]:.2f}" for first, last in _ranges(fits))
    return " and ".join(texts) or NOTHING


def told_of(condition: Condition, values: np.ndarray) -> str:
    """The ranges of rising `values` (n,) that a condition admits. An end beyond which it cannot be
    told, or nothing was tried, is left open: "up to 2.4", "from 2.2".
    """
    verdicts = [condition.judge(float(value)).verdict for value in values]
    is_open = np.array([True, *(verdict == UNKNOWN for verdict in verdicts), True])
    texts = []
    for first, last in _ranges(np.array([verdict == AGREES for verdict in verdicts])):
        low, high = f"{values[first]:.2f}", f"{values[last]:.2f}"
        ends = bool(is_open[first]), bool(is_open[last + 2])
        texts.append(
            {
                (False, False): f"{low} to {high}",
                (True, False): f"up to {high}",
                (False, True): f"from {low}",
                (True, True): f"all told, {low} to {high}",
            }[ends]
        )
    return " and ".join(texts) or NOTHING


def _ranges(fits: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of each run of True in (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], fits, [False])).astype(int)))
    pairs = zip(edges[::2], edges[1::2], strict=True)
    return [(int(first), int(beyond) - 1) for first, beyond in pairs]
