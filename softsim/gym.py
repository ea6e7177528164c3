"""A gymnasium environment: an agent sets a chamber's pressure, a scene tells what becomes of it.

It takes the extra `gym` (`pip install 'softsim[gym]'`).
"""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import gymnasium
import numpy as np

from softsim.errors import ExpectationError, SimulationError, StabilityError
from softsim.run.simulation import Simulation
from softsim.scene.reporting import did_you_mean


class PressureEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """A chamber's pressure as action, columns of the history as observation.

    An action (1,) from -1 to 1 is a pressure between `lowest` and `highest` [Pa], to which the
    chamber goes linearly within the `interval` [s] of an action. An action beyond this range is
    clipped to it, as the control range of a MuJoCo actuator clips. What is seen is the latest row
    of the history, so that the interval should be no shorter than the scene's
    `output.history_interval`. The reward is what the column `progress` has gained, less
    `time_price` for each second. An episode is terminated where the scene ends by a condition of
    its own, as when the robot has passed its pipe, or where a guard stops it (`info["failure"]`
    says why), and truncated at the scene's end time.

    Raises
    ------
    SimulationError: the simulation has no such chamber or column, or `lowest`, `highest` and
    `interval` are no range and no time; from `step`: an action that is not one finite number.
    """

    def __init__(
        self,
        simulation: Simulation,
        chamber: str,
        lowest: float,
        highest: float,
        interval: float,
        observed: Sequence[str],
        progress: str,
        time_price: float = 0.0,
    ) -> None:
        self.simulation, self.chamber, self.observed = simulation, chamber, tuple(observed)
        self.lowest, self.highest, self.interval = lowest, highest, interval
        self.progress, self.time_price = progress, time_price
        self._refuse_unusable()
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))
        self.observation_space = gymnasium.spaces.Box(
            -np.inf, np.inf, (len(self.observed),), np.float64
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; the seed draws the angle at which motors start."""
        super().reset(seed=seed)
        self.simulation.reset(seed)
        return self._observation(), self._info()

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Let the pressure go where the action says, and see what becomes of it."""
        simulation, before = self.simulation, self.simulation.row
        began = simulation.time
        share = 0.5 * (1.0 + self._clipped(action))
        pressure = self.lowest + share * (self.highest - self.lowest)
        simulation.set_load(self.chamber, pressure, within=self.interval)
        left = simulation.end_time - simulation.time
        try:
            with suppress(ExpectationError):  # a verdict on an episode that is done
                simulation.step(min(self.interval, left))
        except StabilityError as error:
            return self._observation(), 0.0, True, False, self._info() | {"failure": error.message}
        after, took = simulation.row, simulation.time - began
        reward = after[self.progress] - before[self.progress] - self.time_price * took
        at_end = simulation.time >= simulation.end_time
        return (
            self._observation(), reward, simulation.finished and not at_end, at_end, self._info()
        )  # fmt: skip

    def _refuse_unusable(self) -> None:
        """Raise SimulationError for a chamber, column or number with which no episode can run."""
        for name, known, called in (
            (self.chamber, self.simulation.chambers, "chamber"),
            *((name, tuple(self.simulation.row), "column") for name in self.observed),
            (self.progress, tuple(self.simulation.row), "column"),
        ):
            if name not in known:
                hint = did_you_mean(str(name), known)
                raise SimulationError(f"the simulation has no {called} '{name}'", hint)
        numbers = np.array([self.lowest, self.highest, self.interval, self.time_price])
        if numbers.dtype.kind not in "iuf" or not np.isfinite(numbers).all():
            raise SimulationError("lowest, highest, interval and time_price must be finite numbers")
        if not (self.lowest < self.highest and self.interval > 0.0):
            raise SimulationError(
                f"pressures from {self.lowest:g} to {self.highest:g} Pa each {self.interval:g} s: "
                "highest must be above lowest, and interval above zero"
            )

    def _clipped(self, action: np.ndarray) -> float:
        """Return the number of an action, clipped to the action space. SimulationError: none."""
        given = np.asarray(action)
        if given.dtype.kind not in "iuf" or given.size != 1 or not np.isfinite(given).all():
            raise SimulationError(f"an action is one finite number from -1 to 1, not {action!r}")
        return float(np.clip(given, -1.0, 1.0).item())

    def _observation(self) -> np.ndarray:
        row = self.simulation.row
        return np.array([row[name] for name in self.observed])

    def _info(self) -> dict[str, Any]:
        return {"time": self.simulation.time}
