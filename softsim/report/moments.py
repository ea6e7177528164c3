"""Moments of a run that are drawn: start, full inflation, onset of motion, end."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

FULL = 0.999
"""Fraction of the highest pressure above which the body counts as fully inflated."""

SMOOTHING = 20
"""Ratio of the observed time to the window over which the vibration is averaged."""

MOVED, AT_REST = 0.10, 0.05
"""Fractions of the total displacement that define motion and rest.

Above the first the body has moved, below the second it is at rest.
"""


WORTH_A_PICTURE = 0.02
"""Fraction of the displacement of the whole run below which a motion has no onset."""


@dataclass(frozen=True)
class Moment:
    """Named time [s]."""

    name: str
    time: float


def moments(
    time: np.ndarray, pressures: Mapping[str, np.ndarray], displacement: np.ndarray
) -> list[Moment]:
    """Return the moments of a run that inflates and deflates, in order of time.

    With several chambers these are the start, the full inflation of each chamber, and the end.
    time [s], pressures [Pa] by the name of each chamber, and displacement [m] along the pipe
    have the shape (rows,). Without pressure (none, all zero or NaN) the moments are start,
    quarter, half and end. A run without motion has no onset.
    """
    begin, end = float(time[0]), float(time[-1])
    fulls = {
        name: pressure >= FULL * np.nanmax(pressure)
        for name, pressure in pressures.items()
        if np.nanmax(pressure, initial=0.0) > 0.0
    }
    if not fulls:
        names = {"start": 0.0, "quarter": 0.25, "half": 0.5, "end": 1.0}
        return [Moment(name, begin + part * (end - begin)) for name, part in names.items()]
    if len(pressures) > 1:
        inflated_at = {name: float(time[np.argmax(full)]) for name, full in fulls.items()}
        found = [Moment(f"{name} inflated", at) for name, at in inflated_at.items()]
        found.sort(key=lambda moment: moment.time)
        return [Moment("start", begin), *found, Moment("end", end)]
    [full] = fulls.values()
    inflated = int(np.argmax(full))
    found = [Moment("start", begin), Moment("full inflation", float(time[inflated]))]
    if inflated == 0:
        found.pop(0)
    after = slice(*_first_deflation(full, inflated))
    watched = displacement[after]
    onset = onset_of_motion(watched)
    if onset is not None and np.ptp(watched) > WORTH_A_PICTURE * np.ptp(displacement):
        found.append(Moment("onset of motion", float(time[after][onset])))
    return [*found, Moment("end", end)]


def onset_of_motion(displacement: np.ndarray) -> int | None:
    """Return the index at which a vibrating body starts to move; None if it stays in place.

    The vibration is averaged out. The body has moved once its displacement exceeds the fraction
    MOVED of the total and the amplitude of its oscillation. The onset is the last row before
    that below AT_REST / MOVED of this threshold: an oscillation that returns is no motion.
    """
    if len(displacement) < 2 or not np.isfinite(displacement).all():
        return None
    smooth = _moving_average(displacement, max(len(displacement) // SMOOTHING, 1))
    swing = float(np.quantile(np.abs(displacement - smooth), 0.99))
    away = smooth - smooth[0]
    away = away * np.sign(away[np.argmax(np.abs(away))])
    moved = max(MOVED * float(away.max()), swing)
    if away.max() <= moved:
        return None
    first = int(np.argmax(away > moved))
    resting = np.flatnonzero(away[:first] < moved * AT_REST / MOVED)
    return int(resting[-1])


def _first_deflation(full: np.ndarray, inflated: int) -> tuple[int, int]:
    """Return the rows from the first decrease of the pressure to the next full one or the end."""
    falling = inflated + _first(~full[inflated:])
    return falling, falling + _first(full[falling:])


def _first(condition: np.ndarray) -> int:
    """Return the index of the first true value, or the length if there is none."""
    return int(np.argmax(condition)) if condition.any() else len(condition)


def _moving_average(values: np.ndarray, window: int) -> np.ndarray:
    """Return the mean over `window` values around each value.

    The ends are extended by the mean of a window there, because an end value may be a peak.
    """
    padded = np.pad(values, (window // 2, (window - 1) // 2), mode="mean", stat_length=window)
    return np.convolve(padded, np.full(window, 1.0 / window), mode="valid")
