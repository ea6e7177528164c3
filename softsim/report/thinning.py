"""Thinning of vibrating signals: many samples become a mean line and the band around it."""

from dataclasses import dataclass

import numpy as np

BINS = 400
"""Default number of bins, about the number of columns that a figure resolves."""

NEIGHBOURS = np.array([1.0, 2.0, 1.0])
"""Weights of a bin and its neighbours in its mean.

A bin does not hold whole periods of a vibration; without this smoothing the remainder would appear
as ripples that the signal does not have.
"""


@dataclass(frozen=True)
class Band:
    """Signal in time bins: mean time, lowest, mean and highest value of each, (bins,)."""

    time: np.ndarray
    low: np.ndarray
    mean: np.ndarray
    high: np.ndarray


def thinned(time: np.ndarray, values: np.ndarray, bins: int = BINS) -> Band:
    """Return the band of `values` (rows,) in at most `bins` bins of equally many rows.

    Signals of up to twice as many rows are returned unchanged. Samples that are not finite are
    omitted; a bin without finite samples is NaN, a gap in the line.
    """
    rows = len(time)
    if rows <= 2 * bins:
        return Band(time, values, values, values)
    starts = np.linspace(0, rows, bins, endpoint=False).astype(int)
    finite = np.isfinite(values)
    count = np.add.reduceat(finite.astype(float), starts)
    total = np.add.reduceat(np.where(finite, values, 0.0), starts)
    empty = count == 0
    low = np.minimum.reduceat(np.where(finite, values, np.inf), starts)
    high = np.maximum.reduceat(np.where(finite, values, -np.inf), starts)
    # "same" of two short arrays would have the length of the longer one, whichever that is.
    weight = np.convolve(count, NEIGHBOURS)[1:-1]
    mean = np.convolve(total, NEIGHBOURS)[1:-1] / np.where(empty, 1.0, weight)
    return Band(
        time=np.add.reduceat(time, starts) / np.diff([*starts, rows]),
        low=np.where(empty, np.nan, low),
        mean=np.where(empty, np.nan, mean),
        high=np.where(empty, np.nan, high),
    )
