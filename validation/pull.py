"""What a history says of the pull of a robot that a tendon holds: how large, how noisy.

The force is the running mean of the tension, the noise what is left of the tension without it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from validation.motion import NAN, History, falls

WINDOW = 0.05  # s, of the running mean: three turns of the motor at 64 Hz, short against the fall


@dataclass(frozen=True)
class Pull:
    """One pressure cycle of a held robot, (rows,) each.

    pressure [Pa], tension [N]; began: the row where the pressure begins to fall; window: rows of
    the running mean.
    """

    pressure: np.ndarray
    tension: np.ndarray
    began: int
    window: int

    @property
    def mean(self) -> np.ndarray:
        """Running mean of the tension (rows,) [N]."""
        return np.asarray(uniform_filter1d(self.tension, self.window))

    @property
    def peak(self) -> float:
        """Largest running mean [N]: a single blow does not count."""
        return float(self.mean.max())

    @property
    def noise(self) -> np.ndarray:
        """Tension about its running mean (rows,) [N]."""
        return self.tension - self.mean

    @property
    def scatter_inflating(self) -> float:
        """Root mean square of the noise [N] while the pressure rises through the upper half of the
        range in which it falls: below that the spikes hardly hold, and the motor shakes the robot.
        """
        middle = 0.5 * (self.pressure[-1] + self.pressure.max())
        begin = int(np.argmax(self.pressure >= middle))
        return self._scatter(begin, int(np.argmax(self.pressure)))

    def scatter_falling(self, begin: float, end: float) -> float:
        """The same [N] between two shares of the time in which the pressure falls."""
        rows = len(self.tension) - 1 - self.began
        return self._scatter(self.began + round(begin * rows), self.began + round(end * rows))

    def noisy_from(self, limit: float) -> float:
        """The pressure [Pa] at which, while it falls, the running scatter first exceeds `limit`
        [N]; the lowest pressure where it never does.
        """
        # The filter adds and subtracts, so that round-off may leave less than nothing.
        scatter = np.sqrt(np.maximum(uniform_filter1d(self.noise**2, self.window), 0.0))
        # The running mean cuts the corner where the fall begins: no noise.
        first = self.began + self.window
        beyond = np.flatnonzero(scatter[first:] > limit)
        return float(self.pressure[first + beyond[0] if len(beyond) else -1])

    def _scatter(self, begin: int, end: int) -> float:
        # Half a window off both ends: there the running mean cuts the corner between two stages.
        half = self.window // 2
        inside = self.noise[begin + half : end - half]
        return float(np.sqrt(np.mean(inside**2))) if len(inside) else NAN


def pull_of(history: History) -> Pull | None:
    """The first pressure cycle; None of a run that failed, or without a fall."""
    cycles = falls(history)
    if not cycles:
        return None
    rows = len(cycles[0].time)
    step = float(np.median(np.diff(history["time"])))
    return Pull(
        history["pressure"][:rows], history["pull"][:rows], cycles[0].began, round(WINDOW / step)
    )
