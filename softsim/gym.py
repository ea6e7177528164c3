"""Gymnasium environments in which an agent sets the pressure of a chamber: one robot, or many.

They require the extra `gym` (`pip install 'softsim[gym]'`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from softsim.compute.machine import AUTO
from softsim.errors import ExpectationError, SimulationError, SoftsimError, StabilityError
from softsim.run.simulation import Simulation, SimulationBatch
from softsim.scene.loading import LoadedScene
from softsim.scene.reporting import did_you_mean
from softsim.scene.schema import Scene


@dataclass(frozen=True)
class PressureTask:
    """Actions, observations and rewards of a chamber whose pressure an agent sets.

    The fields are the parameters of `PressureEnv`.
    """

    chamber: str
    lowest: float
    highest: float
    interval: float
    observed: tuple[str, ...]
    progress: str
    time_price: float

    def refuse_unusable(self, simulation: Simulation) -> None:
        """Raise SimulationError for a chamber, column or number with which no episode can run."""
        for name, known, called in (
            (self.chamber, simulation.chambers, "chamber"),
            *((name, tuple(simulation.row), "column") for name in self.observed),
            (self.progress, tuple(simulation.row), "column"),
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

    def action_space(self) -> gymnasium.spaces.Box:
        """Return the space of an action (1,)."""
        return gymnasium.spaces.Box(-1.0, 1.0, (1,))

    def observation_space(self) -> gymnasium.spaces.Box:
        """Return the space of an observation (len(observed),)."""
        return gymnasium.spaces.Box(-np.inf, np.inf, (len(self.observed),), np.float64)

    def pressure(self, action: np.ndarray) -> float:
        """Return the pressure [Pa] of an action, clipped to its space. Raises SimulationError."""
        given = np.asarray(action)
        if given.dtype.kind not in "iuf" or given.size != 1 or not np.isfinite(given).all():
            raise SimulationError(f"an action is one finite number from -1 to 1, not {action!r}")
        share = 0.5 * (1.0 + float(np.clip(given, -1.0, 1.0).item()))
        return self.lowest + share * (self.highest - self.lowest)

    def command(self, simulation: Simulation, pressure: float) -> float:
        """Set the pressure [Pa] at the end of the next interval; return the duration of it [s]."""
        simulation.set_load(self.chamber, pressure, within=self.interval)
        return min(self.interval, simulation.end_time - simulation.time)

    def observation(self, simulation: Simulation) -> np.ndarray:
        """Return the observed columns of the latest row of the history."""
        row = simulation.row
        return np.array([row[name] for name in self.observed])

    def info(self, simulation: Simulation) -> dict[str, Any]:
        """Return the simulated time [s]."""
        return {"time": simulation.time}

    def outcome(
        self,
        simulation: Simulation,
        before: Mapping[str, float],
        began: float,
        failure: SoftsimError | None,
    ) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Return observation, reward, terminated, truncated and info after an interval.

        before: latest row at its beginning, the time `began` [s]. failure: error of the simulation;
        it is raised unless it belongs to an episode that is done.
        """
        observation, info = self.observation(simulation), self.info(simulation)
        if isinstance(failure, StabilityError):
            return observation, 0.0, True, False, info | {"failure": failure.message}
        if failure is not None and not isinstance(failure, ExpectationError):
            raise failure
        gained = simulation.row[self.progress] - before[self.progress]
        reward = gained - self.time_price * (simulation.time - began)
        at_end = simulation.time >= simulation.end_time
        return observation, reward, simulation.finished and not at_end, at_end, info


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
        self.simulation, self.interval = simulation, interval
        self.task = PressureTask(
            chamber, lowest, highest, interval, tuple(observed), progress, time_price
        )
        self.task.refuse_unusable(simulation)
        self.action_space = self.task.action_space()
        self.observation_space = self.task.observation_space()

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
        return self.task.observation(self.simulation), self.task.info(self.simulation)

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
        simulation, task = self.simulation, self.task
        pressure = task.pressure(action)
        before, began = simulation.row, simulation.time
        failure: SoftsimError | None = None
        try:
            simulation.step(task.command(simulation, pressure))
        except (StabilityError, ExpectationError) as error:
            failure = error
        return task.outcome(simulation, before, began, failure)


class PressureVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """Vector environment of many robots, each as in `PressureEnv`; `make_vec` makes one.

    Parameters
    ----------
    batch : SimulationBatch
        Simulations of the scene, one for each environment.
    chamber, lowest, highest, interval, observed, progress, time_price
        As of `PressureEnv`.

    Attributes
    ----------
    num_envs : int
        Number of environments n.
    single_action_space, action_space : gymnasium.spaces.Box
        Actions of one environment (1,) and of all (n, 1), from -1 to 1.
    single_observation_space, observation_space : gymnasium.spaces.Box
        Observations of one environment (len(observed),) and of all (n, len(observed)).

    Raises
    ------
    SimulationError
        The simulations have no such chamber or column, or a number is not valid.

    Notes
    -----
    Observations, rewards, flags and infos are those of `gymnasium.vector.SyncVectorEnv`. An episode
    that is over starts again in the next step (`AutoresetMode.NEXT_STEP`): this step ignores the
    action of the environment and returns the first observation, the reward 0 and no flags, while
    the other environments continue. Each environment has time and end of its own, and gives the
    same numbers as a `PressureEnv`, see `SimulationBatch`.

    Examples
    --------
    >>> import numpy as np
    >>> from softsim import SimulationBatch
    >>> from softsim.gym import PressureVectorEnv
    >>> envs = PressureVectorEnv(
    ...     SimulationBatch("block.yaml", 2), "air", lowest=0.0, highest=5e3, interval=5e-3,
    ...     observed=["pressure"], progress="body_y",
    ... )
    >>> observations, infos = envs.reset()
    >>> observations, rewards, terminated, truncated, infos = envs.step(np.ones((2, 1)))
    >>> observations, infos = envs.reset(options={"reset_mask": np.array([True, False])})
    >>> np.round(observations, -2).tolist()  # [Pa]
    [[0.0], [5000.0]]
    """

    def __init__(
        self,
        batch: SimulationBatch,
        chamber: str,
        lowest: float,
        highest: float,
        interval: float,
        observed: Sequence[str],
        progress: str,
        time_price: float = 0.0,
    ) -> None:
        self.batch, self.num_envs = batch, len(batch.simulations)
        self.task = PressureTask(
            chamber, lowest, highest, interval, tuple(observed), progress, time_price
        )
        self.task.refuse_unusable(batch.simulations[0])
        self.metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}
        self.single_action_space = self.task.action_space()
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.single_observation_space = self.task.observation_space()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._is_over = np.zeros(self.num_envs, dtype=bool)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode of each environment.

        Parameters
        ----------
        seed : int or sequence of int, optional
            Seeds of the start angles of motors: one for each environment, or `seed`, `seed + 1` ...
        options : dict, optional
            `{"reset_mask": mask}` with a boolean array (n,) resets only these environments; the
            others stay as they are.

        Returns
        -------
        observations : ndarray
            Latest observations (n, len(observed)).
        infos : dict
            Simulated times [s] of the reset environments under "time".

        Raises
        ------
        SimulationError
            A seed is not a non-negative integer, or there are not n of them, or the mask is no
            boolean array (n,).
        """
        mask = np.asarray((options or {}).get("reset_mask", np.ones(self.num_envs, dtype=bool)))
        if mask.dtype != bool or mask.shape != (self.num_envs,):
            raise SimulationError(f"reset_mask must be a boolean array ({self.num_envs},)")
        seeds: Sequence[int | None]
        if seed is None or isinstance(seed, int | np.integer):
            seeds = [None if seed is None else int(seed) + k for k in range(self.num_envs)]
        else:
            seeds = seed
        if len(seeds) != self.num_envs:
            raise SimulationError(f"{len(seeds)} seeds for {self.num_envs} environments")
        infos: dict[str, Any] = {}
        for k in np.flatnonzero(mask):
            infos = self._restart(int(k), seeds[int(k)], infos)
        return self._observations(), infos

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Change the pressures as the actions say, for one interval.

        Parameters
        ----------
        actions : ndarray
            Actions (n, 1) from -1 to 1.

        Returns
        -------
        observations : ndarray
            Latest rows of the histories (n, len(observed)).
        rewards : ndarray
            Rewards (n,) as of `PressureEnv.step`.
        terminated, truncated : ndarray
            Flags (n,) as of `PressureEnv.step`.
        infos : dict
            Simulated times [s] under "time"; reasons under "failure" of runs that a check stopped.

        Raises
        ------
        SimulationError
            The actions are not n finite numbers. Nothing is changed.
        """
        simulations, task = self.batch.simulations, self.task
        if np.shape(actions) != (self.num_envs, 1):
            raise SimulationError(
                f"actions are an array ({self.num_envs}, 1), not of shape {np.shape(actions)}"
            )
        infos: dict[str, Any] = {}
        going = np.flatnonzero(~self._is_over)
        pressures = {k: task.pressure(actions[k]) for k in going}
        for k in np.flatnonzero(self._is_over):
            infos = self._restart(int(k), None, infos)
        durations, before, began = np.zeros(self.num_envs), {}, {}
        for k in going:
            before[k], began[k] = simulations[k].row, simulations[k].time
            durations[k] = task.command(simulations[k], pressures[k])
        self.batch.step(durations.tolist())
        rewards = np.zeros(self.num_envs)
        terminated, truncated = np.zeros((2, self.num_envs), dtype=bool)
        for k in going:
            _, rewards[k], terminated[k], truncated[k], info = task.outcome(
                simulations[k], before[k], began[k], simulations[k].failure
            )
            infos = self._add_info(infos, info, int(k))
        self._is_over = terminated | truncated
        return self._observations(), rewards, terminated, truncated, infos

    def _restart(self, k: int, seed: int | None, infos: dict[str, Any]) -> dict[str, Any]:
        """Start an episode of environment k, and return the infos with that of its start."""
        self.batch.simulations[k].reset(seed)
        self._is_over[k] = False
        return self._add_info(infos, self.task.info(self.batch.simulations[k]), k)

    def _observations(self) -> np.ndarray:
        return np.array([self.task.observation(each) for each in self.batch.simulations])


def make_vec(
    scene: Path | str | Mapping[str, Any] | Scene | LoadedScene,
    count: int,
    chamber: str,
    lowest: float,
    highest: float,
    interval: float,
    observed: Sequence[str],
    progress: str,
    time_price: float = 0.0,
    overrides: Sequence[str] = (),
    device: str = AUTO,
    threads: int | str = AUTO,
) -> PressureVectorEnv:
    """Return a vector environment of `count` robots of one scene.

    Parameters
    ----------
    scene, overrides, device, threads
        As of `softsim.Simulation`.
    count : int
        Number of environments.
    chamber, lowest, highest, interval, observed, progress, time_price
        As of `PressureEnv`.

    Returns
    -------
    PressureVectorEnv
        Environments that are computed side by side.

    Raises
    ------
    SimulationError
        A parameter is not valid.
    SceneError, MeshError, DeviceError, StabilityError
        As from `softsim.Simulation`.

    Examples
    --------
    >>> import numpy as np
    >>> from softsim.gym import make_vec
    >>> envs = make_vec(
    ...     "block.yaml", 2, "air", lowest=0.0, highest=5e3, interval=5e-3,
    ...     observed=["pressure", "body_y"], progress="body_y",
    ... )
    >>> observations, infos = envs.reset(seed=1)
    >>> observations.shape
    (2, 2)
    >>> observations, rewards, terminated, truncated, infos = envs.step(np.array([[0.0], [1.0]]))
    >>> bool(rewards[1] < rewards[0] < 0.0)  # the blocks are compressed
    True
    >>> infos["time"].shape
    (2,)
    """
    batch = SimulationBatch(scene, count, overrides, device, threads)
    return PressureVectorEnv(
        batch, chamber, lowest, highest, interval, observed, progress, time_price
    )
