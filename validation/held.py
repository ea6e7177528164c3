"""A held robot that is slowly inflated in a pipe and emptied again, with a sleeve of any stiffness.

The forces of a hyperelastic body whose constants are all multiplied by one factor are multiplied by
it: in equilibrium it has the same shape at as many times the pressure, and presses, and pulls on
its tendon, as many times as hard. So one run, with a sleeve `stiffness` times as stiff as stated,
tells of all. The weight and the tendon's stiffness are not multiplied: both are small against what
they are compared with, and right at the stiffness of the run.

Pressures in kPa, forces in N, of the plane section.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from validation.cases import Outcome
from validation.motion import NAN, History
from validation.thesis import WEIGHT

MEDIAN = 5  # history rows: what touches and leaves the wall from row to row is no row in contact


@dataclass(frozen=True)
class Held:
    """What a run says; (rows,) each of a branch, in the order in which the pressure reaches them.

    stiffness: of the run's sleeve, times the stated one. pressure, falling: highest so far, and
    lowest so far of the fall. rows_in_contact [-], pull, on_top, top_falling: rows of spikes that
    touch, force on the tendon and on the upper wall.
    """

    stiffness: float
    pressure: np.ndarray
    rows_in_contact: np.ndarray
    pull: np.ndarray
    on_top: np.ndarray
    falling: np.ndarray
    top_falling: np.ndarray

    def rows_at(self, pressure: float, factor: float) -> float:
        """Rows that are pressed on the walls at a pressure that rises; NaN beyond the run. None
        before the robot fills the pipe: while the upper wall carries less than the weight, it lies
        on some of its rows.
        """
        at = self._reached(pressure, factor)
        if at is None:
            return NAN
        fills = self.on_top_at(pressure, factor) >= WEIGHT
        return float(self.rows_in_contact[at]) if fills else 0.0

    def pull_at(self, pressure: float, factor: float) -> float:
        """Force on the tendon at a pressure that rises; NaN beyond the run."""
        return self._force_at(self.pull, pressure, factor)

    def on_top_at(self, pressure: float, factor: float) -> float:
        """Force on the upper wall at a pressure that rises; NaN beyond the run."""
        return self._force_at(self.on_top, pressure, factor)

    def release(self, force: float, factor: float) -> float:
        """The pressure at which, while it falls, the upper wall carries less than `force` for the
        first time; NaN where it never does.
        """
        below = np.flatnonzero(self.top_falling * factor / self.stiffness < force)
        if not len(below) or below[0] == 0:
            return NAN
        return float(self.falling[below[0]]) * factor / self.stiffness

    def _force_at(self, force: np.ndarray, pressure: float, factor: float) -> float:
        at = self._reached(pressure, factor)
        return NAN if at is None else float(force[at]) * factor / self.stiffness

    def _reached(self, pressure: float, factor: float) -> int | None:
        reached = np.flatnonzero(self.pressure >= pressure * self.stiffness / factor)
        return int(reached[0]) if len(reached) else None


def held(outcome: Outcome, stiffness: float) -> Held | None:
    """Of a run with such a sleeve, driven by volume up and down again; None where it failed."""
    if outcome.failure:
        return None
    history = outcome.history
    pressure = 1e-3 * history["pressure"]
    top = int(np.argmax(history["chamber_volume"]))
    rising, falling = slice(0, top + 1), slice(top, None)
    on_top = upper_force(history)
    return Held(
        stiffness,
        np.maximum.accumulate(pressure[rising]),
        median_filter(history["rows_in_contact"], MEDIAN)[rising],
        history["pull"][rising],
        on_top[rising],
        np.minimum.accumulate(pressure[falling]),
        on_top[falling],
    )


def upper_force(history: History) -> np.ndarray:
    """Normal force on the upper one of two level walls (rows,) [N]: both carry
    `wall_force_normal`, the lower one `wall_force_y` more than the upper.
    """
    force = 0.5 * (history["wall_force_normal"] - history["wall_force_y"])
    return np.asarray(median_filter(np.maximum(force, 0.0), MEDIAN))
