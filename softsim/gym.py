"""Gymnasium environment in which an agent sets the pressure of a chamber.

It requires the extra `gym` (`pip install 'softsim[gym]'`).
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
    """Environment with the pressure of a chamber as action and history columns as observation.

    Parameters
    ----------
    simulation : Simulation
        Simulation of the scene.
    chamber : str
        Name of the chamber whose pressure is set.
    lowest, highest : float
        Pressures [Pa] of the actions -1 and 1.
    interval : float
        Duration of an action [s], in which the pressure changes linearly. It should not be shorter
        than `output.history_interval` of the scene.
    observed : sequence of str
        History columns of the observation.
    progress : str
        History column whose increase is the reward.
    time_price : float
        Reward subtracted for each second.

    Attributes
    ----------
    action_space : gymnasium.spaces.Box
        Actions (1,) from -1 to 1. Actions outside are clipped, as MuJoCo clips the controls of
        actuators.
    observation_space : gymnasium.spaces.Box
        Observations (len(observed),), the latest row of the history, in SI units.

    Raises
    ------
    SimulationError
        The simulation has no such chamber or column, or a number is not valid.

    Notes
    -----
    An episode is terminated when a condition of the scene ends the run, for example when the robot
    has passed its pipe, or when a check stops it (`info["failure"]` holds the reason). It is
    truncated at the end time of the scene.

    Examples
    --------
    >>> import numpy as np
    >>> from softsim import Simulation
    >>> from softsim.gym import PressureEnv
    >>> env = PressureEnv(
    ...     Simulation("block.yaml"), "air", lowest=0.0, highest=5e3, interval=5e-3,
    ...     observed=["pressure", "body_y"], progress="body_y",
    ... )
    >>> observation, info = env.reset(seed=1)
    >>> observation, reward, terminated, truncated, info = env.step(np.array([0.0]))
    >>> round(float(observation[0]), -2)  # [Pa], in the latest row of the history
    2500.0
    >>> reward < 0.0  # the block is compressed
    True
    >>> observation, reward, terminated, truncated, info = env.step(np.array([1.0]))
    >>> terminated, truncated
    (False, True)
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
        """Start an episode.

        Parameters
        ----------
        seed : int, optional
            Seed of the start angles of motors.
        options : dict, optional
            Not used.

        Returns
        -------
        observation : ndarray
            First observation (len(observed),).
        info : dict
            Simulated time [s] under "time".
        """
        super().reset(seed=seed)
        self.simulation.reset(seed)
        return self._observation(), self._info()

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Change the pressure as the action says, for one interval.

        Parameters
        ----------
        action : ndarray
            Action (1,) from -1 to 1.

        Returns
        -------
        observation : ndarray
            Latest row of the history (len(observed),).
        reward : float
            Increase of the column `progress`, minus the price of the time.
        terminated, truncated : bool
            True if the run has ended by a condition or a check; true at its end time.
        info : dict
            Simulated time [s] under "time"; the reason under "failure" if a check stopped the run.

        Raises
        ------
        SimulationError
            The action is not one finite number.
        """
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
                f"pressures from {self.lowest:g} to {self.highest:g} Pa every {self.interval:g} "
                "s: highest must be above lowest, and interval above zero"
            )

    def _clipped(self, action: np.ndarray) -> float:
        """Return the number of an action, clipped to the action space. Raises SimulationError."""
        given = np.asarray(action)
        if given.dtype.kind not in "iuf" or given.size != 1 or not np.isfinite(given).all():
            raise SimulationError(f"an action is one finite number from -1 to 1, not {action!r}")
        return float(np.clip(given, -1.0, 1.0).item())

    def _observation(self) -> np.ndarray:
        row = self.simulation.row
        return np.array([row[name] for name in self.observed])

    def _info(self) -> dict[str, Any]:
        return {"time": self.simulation.time}
