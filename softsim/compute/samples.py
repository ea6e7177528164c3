"""Fields of a scenario at the times of several rows of its history.

Columns of the history are computed for many rows at once: a small numpy operation takes a few
microseconds, as long as it takes for a hundred rows together. So a row copies the fields that its
columns need, and the columns follow later (output/observation.py).
"""

from collections.abc import Mapping, Sequence

import numpy as np
import taichi as ti

from softsim.compute.fields import Row

# Rows whose columns are computed together, and the memory for their fields [bytes].
MOST_ROWS = 256
MOST_BYTES = 2**25


class Samples:
    """Fields of a scenario at the times of several rows of its history.

    Parameters
    ----------
    scenario : int
        Number of the scenario.
    times, load_times : ndarray, (rows,) [s]
        Simulated time of each row, and the time at which its loads are taken.
    intervals : ndarray, (rows,) [s]
        Time since the impulses were cleared.
    values : mapping of Field to ndarray, (rows, ...)
        Values of each field.
    """

    def __init__(
        self,
        scenario: int,
        times: np.ndarray,
        load_times: np.ndarray,
        intervals: np.ndarray,
        values: Mapping[ti.Field, np.ndarray],
    ) -> None:
        self.scenario, self.times, self.load_times = scenario, times, load_times
        self.intervals, self.values = intervals, values

    def __len__(self) -> int:
        return len(self.times)

    @property
    def rates(self) -> np.ndarray:
        """Factors (rows,) [1/s] of impulses to mean forces; 0 in an interval of no time."""
        return self.mean(np.ones(len(self)))

    def read(self, field: ti.Field) -> np.ndarray:
        """Return the values (rows, ...) of a field; its term lists it in `sampled`."""
        return self.values[field]

    def mean(self, impulses: np.ndarray) -> np.ndarray:
        """Return the mean forces (rows, ...) [N] of impulses [N s]; 0 in an interval of no time."""
        shape = (-1, *(1 for _ in impulses.shape[1:]))
        intervals = self.intervals.reshape(shape)
        nothing = np.zeros(impulses.shape)
        return np.divide(impulses, intervals, out=nothing, where=intervals > 0.0)


class Sampler:
    """Sampler of fields of one scenario, which holds up to `most` samples.

    most: reduced where the fields are so large that the samples would need more than MOST_BYTES.
    """

    def __init__(self, scenario: int, fields: Sequence[ti.Field], most: int) -> None:
        self.scenario, self.fields = scenario, list(dict.fromkeys(fields))
        self.row = Row(self.fields, scenario)
        self.most = max(1, min(most, MOST_BYTES // max(1, self.row.bytes)))
        self.arrays, self.clocks = self.row.arrays(self.most), np.zeros((self.most, 3))
        self.count = 0

    @property
    def is_full(self) -> bool:
        """True if no further sample fits."""
        return self.count == self.most

    def take(self, time: float, load_time: float, interval: float) -> None:
        """Copy the present fields; the times [s] are those of one row of Samples."""
        self.clocks[self.count] = time, load_time, interval
        self.row.copy_to(self.arrays, self.count)
        self.count += 1

    def handed_over(self) -> Samples:
        """Return the samples taken so far, and begin anew; they are valid until the next `take`."""
        count, self.count = self.count, 0
        values = [array[:count] for array in self.arrays]
        times, load_times, intervals = self.clocks[:count].T
        return Samples(
            self.scenario, times, load_times, intervals, dict(zip(self.fields, values, strict=True))
        )


def present(
    scenario: int, fields: Sequence[ti.Field], time: float = 0.0, interval: float = 0.0
) -> Samples:
    """Return one sample of the present fields of a scenario; times [s] as in Samples."""
    sampler = Sampler(scenario, fields, most=1)
    sampler.take(time, time, interval)
    return sampler.handed_over()
