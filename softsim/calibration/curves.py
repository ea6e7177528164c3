"""The force on a pipe's wall over a rising pressure, from the history of a slow inflation."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from softsim.errors import CalibrationError


@dataclass(frozen=True)
class WallCurve:
    """Wall force of a slowly inflated body in a pipe.

    pressure (k,) [Pa], rising; force (k,) [N]: sum of the normal forces on the wall; rows (k,):
    rows of spikes that touch; kinetic_share (k,): kinetic over internal energy [-].
    """

    pressure: np.ndarray
    force: np.ndarray
    rows: np.ndarray
    kinetic_share: np.ndarray

    @property
    def touch(self) -> float:
        """Pressure [Pa] above which contact is never lost.

        Raises CalibrationError if there is no contact at the highest pressure.
        """
        if self.force[-1] == 0.0:
            raise CalibrationError(
                f"no contact with the pipe up to {self.highest / 1e3:.4g} kPa",
                "inflate further (--highest), or choose a narrower pipe",
            )
        apart = np.flatnonzero(self.force == 0.0)
        return float(self.pressure[apart[-1] + 1 if len(apart) else 0])

    @property
    def highest(self) -> float:
        """Highest pressure of the curve [Pa]."""
        return float(self.pressure[-1])

    @property
    def largest_kinetic_share(self) -> float:
        """Largest ratio of kinetic to internal energy during contact [-]: small if quasi-static."""
        return float(self.kinetic_share[self.pressure >= self.touch].max())

    def force_at(self, pressure: np.ndarray) -> np.ndarray:
        """Return the force [N] at pressures [Pa]."""
        return np.interp(pressure, self.pressure, self.force)

    def rows_at(self, pressure: np.ndarray) -> np.ndarray:
        """Return the rows in contact in the sample nearest to pressures [Pa]."""
        between = 0.5 * (self.pressure[1:] + self.pressure[:-1])
        return self.rows[np.searchsorted(between, pressure)]

    def pressure_at(self, force: np.ndarray) -> np.ndarray:
        """Return the first pressures [Pa] at which the wall force reaches `force` [N]; else NaN."""
        touching = self.pressure >= self.touch
        pressure, felt = self.pressure[touching], self.force[touching]
        # The force may fall for a moment, as a row lets go: the first sample that reaches counts.
        reached = np.searchsorted(np.maximum.accumulate(felt), force)
        found = np.where(reached == 0, pressure[0], np.nan)
        crossed = (reached > 0) & (reached < len(felt))
        after = reached[crossed]
        share = (force[crossed] - felt[after - 1]) / (felt[after] - felt[after - 1])
        found[crossed] = pressure[after - 1] + share * (pressure[after] - pressure[after - 1])
        return found


def wall_curve(history: Mapping[str, np.ndarray]) -> WallCurve:
    """Return the curve of a run whose pressure only rises, from its history.

    The force in a history is the mean since the previous row, so its pressure is that halfway.
    Raises CalibrationError if the history has too few rows.
    """
    pressure = history["pressure"]
    if len(pressure) < 3:
        raise CalibrationError(
            "the history of the inflation has fewer than three rows",
            "inflate more slowly (--ramp)",
        )
    internal = np.maximum(history["internal_energy"][1:], np.finfo(float).tiny)
    halfway = 0.5 * (pressure[1:] + pressure[:-1])
    rising = np.concatenate([[True], np.diff(halfway) > 0.0])
    return WallCurve(
        halfway[rising],
        history["wall_force_normal"][1:][rising],
        history["rows_in_contact"][1:][rising],
        (history["kinetic_energy"][1:] / internal)[rising],
    )
