"""`Simulation`: the run of a scene under the control of a program.

It is a run of a batch (batch.py) that is recorded in memory (record.py): checks, blocks of
increments and rows are those of `run`. A step that ends within a block does a part of it, and the
next step continues there, so that steps of any length have the increments of the run. Each run of a
batch has blocks, time and commands of its own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral
from pathlib import Path
from signal import Signals
from typing import Any

import numpy as np

from softsim.compute import backend
from softsim.compute.machine import AUTO, choose
from softsim.errors import Interrupted, Option, SimulationError, SoftsimError
from softsim.interruption import stop_signals
from softsim.loads.nodal import Rotor, RotorForce
from softsim.loads.pressure import PressureSource
from softsim.model import Model
from softsim.output.folder import Checkpoint
from softsim.output.observation import wall_forces
from softsim.rigid import Pose
from softsim.run.batch import Batch, CallMonitors, Monitor
from softsim.run.callbacks import Rows
from softsim.run.control import Feedback, LoadCommands, number
from softsim.run.record import MemoryRecord
from softsim.run.scenes import ready_model
from softsim.run.statics import LoadStepping, Parameter, derivatives
from softsim.scene.loading import Loaded, LoadedScene, load_scene, scene_of, scene_said
from softsim.scene.measures import WITHOUT_DERIVATIVE
from softsim.scene.reporting import did_you_mean
from softsim.scene.schema import Scene


@dataclass(frozen=True)
class State:
    """State of a simulation at one time, returned by `Simulation.state`.

    Attributes
    ----------
    time : float
        Simulated time [s].
    positions : dict of str to ndarray
        For each body, positions of its nodes (n, d) [m]; d is 2 or 3.
    velocities : dict of str to ndarray
        For each body, velocities of its nodes (n, d) [m/s], half a time step later.
    forces : dict of str to ndarray
        For each body, nodal forces without the weight (n, d) [N].
    contact_forces : dict of str to ndarray
        For each body, forces of the walls on its nodes (n, d) [N].
    poses : dict of str to Pose
        For each rigid body, the position of its `centre` (d,) [m] and its orientation.

    Examples
    --------
    >>> from softsim import Simulation
    >>> state = Simulation("block.yaml").state()
    >>> state.time
    0.0
    >>> state.positions["block"].shape == state.velocities["block"].shape
    True
    """

    time: float
    positions: dict[str, np.ndarray]
    velocities: dict[str, np.ndarray]
    forces: dict[str, np.ndarray]
    contact_forces: dict[str, np.ndarray]
    poses: dict[str, Pose]


@dataclass(frozen=True)
class Saved:
    """Saved state of one simulation, from which it continues bit for bit.

    Only the simulation that returned it from `Simulation.save` can restore it.
    """

    model: Model = field(repr=False)
    checkpoint: Checkpoint
    rows: int
    asked: float
    left: int
    block_start: float
    done_in_block: int
    is_commanded: bool
    sources: list[PressureSource] = field(repr=False)
    rotors: list[RotorForce] = field(repr=False)


class Simulation:
    """The run of a scene in steps, with loads that a program sets.

    Without commands, steps of any length give the same results, bit for bit, as `run`. Nothing is
    written to disk.

    Parameters
    ----------
    scene : Path, str, dict, Scene or LoadedScene
        Path of a scene file, a dict with the content of one, an object of the schema
        (`softsim.scene.schema.Scene`), or a scene from `load_scene`.
    overrides : sequence of str
        Values that override those of the scene: "time.end=3 s". Only for a path or a dict.
    device : {"auto", "cpu", "cuda"}
        Device of the computation.
    threads : int or "auto"
        Number of CPU threads. "auto": one for a small model, else all processors.

    Raises
    ------
    SceneError, MeshError, DeviceError
        The scene cannot be run.
    StabilityError
        The relaxation of `time.settle` does not reach equilibrium.

    Notes
    -----
    A process has one simulation at a time. A new simulation or run ends the previous one.

    Examples
    --------
    Halve the pressure after 2 ms, and compare with the scene's own profile:

    >>> from softsim import Simulation
    >>> simulation = Simulation("block.yaml")
    >>> simulation.step(2e-3)
    >>> start = simulation.save()
    >>> simulation.set_load("air", 1e3, within=1e-3)  # [Pa], [s]
    >>> simulation.step(3e-3)
    >>> round(simulation.row["pressure"])  # [Pa]
    1000
    >>> simulation.restore(start)
    >>> simulation.step(simulation.end_time - simulation.time)
    >>> round(simulation.row["pressure"]), simulation.finished
    (5000, True)
    """

    def __init__(
        self,
        scene: Path | str | Mapping[str, Any] | Scene | LoadedScene,
        overrides: Sequence[str] = (),
        device: str = AUTO,
        threads: int | str = AUTO,
    ) -> None:
        batch, [record] = _recorded_batch(scene, 1, overrides, device, threads)
        self._attach(batch, record, 0)

    @classmethod
    def _of_batch(cls, batch: Batch, record: MemoryRecord, number: int) -> "Simulation":
        """Return the simulation that controls a run of a batch, which has reached t = 0."""
        simulation = cls.__new__(cls)
        simulation._attach(batch, record, number)
        return simulation

    def _attach(self, batch: Batch, record: MemoryRecord, number: int) -> None:
        self.loaded, self.model, self.record = record.loaded, record.model, record
        self._batch, self._device = batch, backend.device()
        self._run, self._solver = batch.runs[number], batch.solver
        self._scenario = self._run.scenario
        self._commands = LoadCommands(self._run)
        self._calls = CallMonitors(self._run, (), ())
        self._asked, self._left = 0.0, 0
        self._start = self.save()

    # --- time ------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._scenario.time

    @property
    def increment_count(self) -> int:
        """Number of increments done."""
        return self._scenario.increment_count

    @property
    def finished(self) -> bool:
        """True if the run has ended: at its end time, or by a condition of the scene."""
        return self._run.outcome is not None

    def step(self, duration: float) -> None:
        """Advance by a duration, or to the end of the run if that comes first.

        A step ends with the first time step that reaches its end, so it overshoots by less than
        one time step. Overshoots do not add up: n steps of one duration end where one step of n
        times that duration does. Only the last step counts from the present time, so that
        `step(end_time - time)` reaches the end of the run.

        Parameters
        ----------
        duration : float
            Simulated time [s].

        Raises
        ------
        SimulationError
            The duration is not a positive number, or exceeds the end time of the scene.
        StabilityError, ExpectationError
            As from `run`.
        Interrupted
            The process received SIGINT or SIGTERM. The simulation is intact and can continue.
        """
        _step_together([self], [duration])
        if self.failure is not None:
            raise self.failure

    @property
    def failure(self) -> SoftsimError | None:
        """Error that stopped the run, or the failed expectation at its end; None without one."""
        return self._run.outcome if isinstance(self._run.outcome, SoftsimError) else None

    @property
    def _is_behind(self) -> bool:
        """True as long as the run has neither ended nor reached the requested time."""
        missing = self._asked - self.time
        return not self.finished and missing > 1e-9 * self._scenario.time_increment

    def _time_after(self, duration: float) -> float:
        """Return the time [s] to which a step of a duration [s] is to advance."""
        asked = self._asked + duration
        leads_to_end = self.time + duration >= self.end_time * (1.0 - 1e-12)
        return max(asked, self.end_time) if leads_to_end else asked

    def _increments_to_asked(self) -> int:
        """Return the increments up to the requested time [s] or the end of the block."""
        to_asked = np.ceil((self._asked - self.time) / self._scenario.time_increment - 1e-9)
        return min(self._left, max(1, int(to_asked)))

    def _refuse_step(self, duration: float, asked: float) -> None:
        self._refuse_stale()
        if not 0.0 < duration < np.inf:
            raise SimulationError(
                f"a step of {duration} s: the duration must be finite and greater than zero"
            )
        if self.finished:
            raise SimulationError(
                f"the simulation has ended at t = {self.time:.6g} s",
                hint="call reset() to start again, or restore() to go back",
            )
        static = self.model.relaxation  # goes on until forces balance, within a limit
        end = self.end_time + (0.0 if static is None else static.longest)
        if asked > end * (1.0 + 1e-9):
            raise SimulationError(
                f"a step to t = {asked:.6g} s: the scene ends at {end:.6g} s",
                hint="set a later time.end in the scene",
            )

    def _refuse_stale(self) -> None:
        """Raise SimulationError if a newer solver has ended this one."""
        if backend.device() is not self._device:
            raise SimulationError(
                "another simulation or run was started in this process, which ended this one",
                hint="make a new Simulation of the scene; use one process for each simulation "
                "that runs at the same time",
            )

    @property
    def end_time(self) -> float:
        """End time of the scene [s]; a static run may continue beyond it."""
        return self.model.end_time

    # --- what is seen ----------------------------------------------------------------------------

    @property
    def history(self) -> dict[str, np.ndarray]:
        """Rows of the history so far: an array (rows,) for each column, in SI units."""
        return self.record.rows()

    @property
    def row(self) -> dict[str, float]:
        """Latest row of the history: a number for each column, in SI units.

        A new row is added every `output.history_interval`.
        """
        return self.record.history.last

    def state(self) -> State:
        """Return the present state, in new arrays.

        Returns
        -------
        State
            Positions, velocities and forces of all nodes, and poses of rigid bodies.
        """
        self._refuse_stale()
        read, terms = self._scenario.read, self._scenario.terms

        def by_body(values: np.ndarray) -> dict[str, np.ndarray]:
            return {body.name: values[body.nodes] for body in self.model.bodies}

        bodies = enumerate(self.model.rigid_bodies)
        return State(
            self.time,
            by_body(self._scenario.positions()),
            by_body(read(terms.nodes.velocity)),
            by_body(read(terms.nodes.force)),
            by_body(wall_forces(self._scenario)),
            {body.name: self._scenario.pose(k) for k, body in bodies},
        )

    def gradient(self, output: str, parameters: Sequence[str]) -> dict[str, float]:
        """Return derivatives of an output with respect to numbers of the scene.

        They are those of the last equilibrium that Newton's method has found, at the present time.

        Parameters
        ----------
        output : str
            Column of `row`: of a probe, a pressure, a volume, a force or an energy.
        parameters : sequence of str
            Paths of the scene, as in `overrides`: a material constant, a thickness, the value of a
            load, a dimension of a mesh generator.

        Returns
        -------
        dict of str to float
            Path -> derivative, in SI units: [m/Pa] for a displacement over C10.

        Raises
        ------
        SimulationError
            It is no static simulation by Newton's method, or has no equilibrium yet; loads were set
            by `set_load`; the column has no derivative (a count, an error, a sum over the load
            steps); a dimension changes the number of elements; the state depends on the path of
            the loads, as with friction.
        SceneError
            The scene has no such path, or its value is no number, or is zero.
        StabilityError
            The tangent stiffness is singular, as at a limit point.

        Notes
        -----
        Each parameter costs two or three models, built with slightly different values, and a few
        evaluations of their forces; no other equilibrium is computed. Within about 1e-6 of their
        value, derivatives equal those of whole simulations. The next equilibria do not change.

        Examples
        --------
        >>> from softsim import Simulation
        >>> simulation = Simulation("block.yaml", ["time.procedure=static"])
        >>> simulation.step(simulation.end_time)
        >>> derivatives = simulation.gradient("body_y", ["loads.air.profile.value"])
        >>> derivatives["loads.air.profile.value"] < 0.0  # [m/Pa], downwards
        True
        """
        self._refuse_stale()
        run, stepping = self._run, self._run.stepping
        if not isinstance(stepping, LoadStepping):
            raise SimulationError(
                "gradient() needs a static simulation by Newton's method",
                hint="set time.procedure: static, without time.settle and time.until",
            )
        if output not in self.row:
            hint = did_you_mean(output, list(self.row))
            raise SimulationError(f"the history has no column '{output}'", hint)
        if output in WITHOUT_DERIVATIVE:
            raise SimulationError(
                f"'{output}' has no derivative: it is a count, an error, or a sum over load steps"
            )
        term_of, s = self._scenario.term_of, self._scenario.number
        if any(term_of(p).sources[s] is not p.source for p in self.model.pressures):
            raise SimulationError(
                "gradient() needs the loads of the scene, and set_load() has replaced one",
                hint="give its value in the scene, or as an override",
            )
        found = derivatives(
            stepping,
            run.callback(Rows).observer,
            [Parameter.at(run.files.loaded, p, Option(f"parameter {p}")) for p in parameters],
        )
        return {path: of_columns[output] for path, of_columns in found.items()}

    # --- what is commanded -----------------------------------------------------------------------

    @property
    def chambers(self) -> tuple[str, ...]:
        """Names of the chambers that `set_load` accepts: all but those of a network."""
        return self._commands.chambers

    def set_load(self, name: str, value: float, within: float = 0.0) -> None:
        """Change the pressure or filling of a chamber linearly, and hold it.

        The command replaces the scene's profile of this chamber, and its event control if it has
        one.

        Parameters
        ----------
        name : str
            Name of the chamber, one of `chambers`.
        value : float
            Gauge pressure [Pa]; for `added_volume` and `added_gas` the volume [m^3] or mass [kg]
            added since the start.
        within : float
            Duration of the change [s].

        Raises
        ------
        SimulationError
            There is no such chamber, a number is not valid, the mass of gas exceeds the largest
            one in the scene's profile, or a network sets the pressure.
        """
        self._refuse_stale()
        self._commands.set_load(name, value, within)

    def set_motor(self, frequency: float, name: str | None = None) -> None:
        """Set the frequency of a motor, which keeps its present angle.

        The force of an eccentric mass grows with the square of the frequency.

        Parameters
        ----------
        frequency : float
            Frequency [Hz].
        name : str, optional
            Name of the motor. Default: all motors.

        Raises
        ------
        SimulationError
            There is no such motor, or the frequency is not valid.
        """
        self._refuse_stale()
        self._commands.set_motor(frequency, name)

    def _motors(self) -> tuple[Rotor, ...]:
        return self.model.of_kind(Rotor)

    def watch(self, monitor: Monitor) -> None:
        """Let a monitor follow the simulation, as `softsim.live.view` does.

        Parameters
        ----------
        monitor : Monitor
            Its `start` is called now, its `update` after each block of increments of `step`. If an
            `update` raises an error, a warning is logged and the monitor is called no more.
        """
        self._refuse_stale()
        monitor.start(self._run)
        self._calls.monitors.append(monitor)

    # --- back to an earlier moment ---------------------------------------------------------------

    def save(self) -> Saved:
        """Return the present state, which `restore` accepts.

        Returns
        -------
        Saved
            State of this simulation.
        """
        self._refuse_stale()
        self._run.checkpoint()
        s, term_of = self._scenario.number, self._scenario.term_of
        return Saved(
            self.model,
            self.record.checkpoint,
            len(self.record.history.kept),
            self._asked,
            self._left,
            float(self._solver.block_starts[s]),
            int(self._solver.done_in_block[s]),
            self._run.callback(Feedback).is_commanded,
            [term_of(pressure).sources[s] for pressure in self.model.pressures],
            [term_of(motor).rotors[s] for motor in self._motors()],
        )

    def restore(self, saved: Saved) -> None:
        """Return to a saved state of this simulation; it continues bit for bit.

        Parameters
        ----------
        saved : Saved
            State from `save` of the same simulation.

        Raises
        ------
        SimulationError
            The state is from another simulation. Nothing is changed.
        """
        self._refuse_stale()
        if not isinstance(saved, Saved) or saved.model is not self.model:
            raise SimulationError(
                "restore() needs a state returned by save() of the same simulation",
                hint="a new Simulation of the same scene cannot restore states of another one",
            )
        s, term_of = self._scenario.number, self._scenario.term_of
        del self.record.history.kept[saved.rows :]
        self._run.resume(saved.checkpoint)
        self._asked, self._left = saved.asked, saved.left
        self._solver.block_starts[s] = saved.block_start
        self._solver.done_in_block[s] = saved.done_in_block
        for pressure, source in zip(self.model.pressures, saved.sources, strict=True):
            term_of(pressure).follow(s, source)
        for motor, rotor in zip(self._motors(), saved.rotors, strict=True):
            term_of(motor).follow(s, rotor)
        if saved.is_commanded:
            self._run.callback(Feedback).end()

    def reset(self, seed: int | None = None) -> None:
        """Return to the start, without compiling again.

        Parameters
        ----------
        seed : int, optional
            Seed of random start angles of all motors. Default: the angles of the scene.

        Raises
        ------
        SimulationError
            The seed is not a non-negative integer.
        """
        if seed is not None and not (isinstance(seed, Integral) and seed >= 0):
            raise SimulationError(
                f"reset({seed!r}): the seed must be a whole number of at least 0, or None"
            )
        self.restore(self._start)
        if seed is None:
            return
        phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(self._motors()))
        for motor, phase in zip(self._motors(), phases.tolist(), strict=True):
            rotor = motor.rotor.at_phase(phase)
            self._scenario.term_of(motor).follow(self._scenario.number, rotor)


class SimulationBatch:
    """Simulations of one scene that are computed side by side.

    Each is a `Simulation` with commands, history, states and resets of its own, and gives the same
    results as alone: bit for bit, but up to round-off where a pressure follows from the volume of
    its chamber. On a GPU they are computed in parallel. On a CPU they are computed one after the
    other: that saves starts, not increments.

    Parameters
    ----------
    scene, overrides, device, threads
        As of `Simulation`.
    count : int
        Number of simulations.

    Attributes
    ----------
    simulations : tuple of Simulation
        The simulations. `step` of one of them advances only this one.

    Raises
    ------
    SimulationError
        The count is not a positive integer, or the scene is static, which cannot be in a batch.
    SceneError, MeshError, DeviceError, StabilityError
        As from `Simulation`.

    Examples
    --------
    >>> from softsim import SimulationBatch
    >>> batch = SimulationBatch("block.yaml", 2)
    >>> first, second = batch.simulations
    >>> first.set_load("air", 1e3, within=1e-3)  # [Pa], [s]
    >>> batch.step(6e-3)
    >>> round(first.row["pressure"]), round(second.row["pressure"])  # [Pa]
    (1000, 5000)
    >>> first.reset()
    >>> batch.step([1e-3, 0.0])  # only the first
    >>> first.time < second.time
    True
    """

    def __init__(
        self,
        scene: Path | str | Mapping[str, Any] | Scene | LoadedScene,
        count: int,
        overrides: Sequence[str] = (),
        device: str = AUTO,
        threads: int | str = AUTO,
    ) -> None:
        if not (isinstance(count, Integral) and count >= 1):
            raise SimulationError(f"a batch has a whole number of simulations, not {count!r}")
        batch, records = _recorded_batch(scene, int(count), overrides, device, threads)
        self.simulations: tuple[Simulation, ...] = tuple(
            Simulation._of_batch(batch, record, s) for s, record in enumerate(records)
        )

    def step(self, durations: float | Sequence[float]) -> None:
        """Advance the simulations, each as by `Simulation.step`.

        An error of a simulation is its `failure`, and the others continue.

        Parameters
        ----------
        durations : float or sequence of float
            Simulated time [s] of each simulation, (count,), or one for all. A simulation stays as
            it is where the duration is zero, and if it has ended.

        Raises
        ------
        SimulationError
            A duration is not valid, or exceeds the end time of the scene. Nothing is changed.
        Interrupted
            The process received SIGINT or SIGTERM. The simulations are intact and can continue.
        """
        given = np.asarray(durations)
        if given.shape not in ((), (1,), (len(self.simulations),)):
            raise SimulationError(
                f"durations of shape {given.shape}: give one, or one for each of the "
                f"{len(self.simulations)} simulations"
            )
        each = np.broadcast_to(given, len(self.simulations)).tolist()
        going = [
            (simulation, duration)
            for simulation, duration in zip(self.simulations, each, strict=True)
            if duration != 0.0 and not simulation.finished
        ]
        if going:
            simulations, steps = zip(*going, strict=True)
            _step_together(simulations, steps)


def _recorded_batch(
    scene: Path | str | Mapping[str, Any] | Scene | LoadedScene,
    count: int,
    overrides: Sequence[str],
    device: str,
    threads: int | str,
) -> tuple[Batch, list[MemoryRecord]]:
    """Return a batch of runs of a scene at t = 0, and their records."""
    loaded = _loaded(scene, overrides)
    choice = choose(device, threads)
    model = ready_model(loaded, choice)
    if count > 1 and model.takes_load_steps:
        raise SimulationError(
            "a static scene cannot be simulated in a batch", hint="use one Simulation"
        )
    warnings: dict[str, str] = {}  # once, not of each
    records = [MemoryRecord(loaded, model, warnings) for _ in range(count)]
    batch = Batch(records, choice, [()] * count)
    for error in batch.unsettled.values():
        raise error
    batch.act()
    return batch, records


def _step_together(simulations: Sequence[Simulation], durations: Sequence[float]) -> None:
    """Advance simulations of one batch that have not ended, each by its duration [s]."""
    steps = [number(duration, "the duration of a step") for duration in durations]
    asked = [s._time_after(step) for s, step in zip(simulations, steps, strict=True)]
    for simulation, step, time in zip(simulations, steps, asked, strict=True):
        simulation._refuse_step(step, time)
    for simulation, time in zip(simulations, asked, strict=True):
        simulation._asked = time
    with stop_signals() as signals:
        while behind := [simulation for simulation in simulations if simulation._is_behind]:
            if signals:
                for simulation in behind:
                    simulation._asked = simulation.time
                raise Interrupted(
                    f"stopped by {Signals(signals[0]).name} at t = {behind[0].time:.6g} s",
                    hint="call step() to continue",
                )
            _advance(behind)
            for simulation in behind:
                simulation._calls.signals = signals
                simulation._calls.before_block()


def _advance(simulations: Sequence[Simulation]) -> None:
    """Compute the block of increments of each, or the part of it up to the requested time."""
    batch = simulations[0]._batch
    if beginning := [simulation for simulation in simulations if simulation._left == 0]:
        lengths = batch.next_blocks([simulation._run for simulation in beginning])
        for simulation in beginning:
            simulation._left = int(lengths[simulation._scenario.number])
    going = [simulation for simulation in simulations if not simulation.finished]
    counts = np.zeros(len(batch.runs), dtype=int)
    for simulation in going:
        count = counts[simulation._scenario.number] = simulation._increments_to_asked()
        simulation._left -= count
    batch.continue_block(counts)
    if ending := [simulation._run for simulation in going if simulation._left == 0]:
        batch.end_blocks(ending)


def _loaded(
    scene: Path | str | Mapping[str, Any] | Scene | LoadedScene, overrides: Sequence[str]
) -> LoadedScene:
    if isinstance(scene, Path | str):
        return load_scene(scene, overrides)
    if isinstance(scene, Mapping):
        return scene_said(scene, overrides)
    if overrides:
        raise SimulationError(
            "overrides apply to a scene file or a dict",
            hint="change the scene object, or pass the overrides when you load the file",
        )
    if isinstance(scene, Loaded):
        return scene
    if not isinstance(scene, Scene):
        raise SimulationError(
            f"a {type(scene).__name__} is not a scene",
            hint="give the path of a scene file, a dict, a Scene or a loaded scene",
        )
    return scene_of(scene)
