"""A simulation to hold in Python: the run of a scene, step by step, with loads that are commanded.

It is a batch of one (batch.py) that is recorded in memory (record.py): guards, blocks of increments
and rows are those of `run`. A step that ends within a block does a part of it, and the next step
goes on there, so that steps of any length pass through the increments of the run.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral
from pathlib import Path
from signal import Signals
from typing import Any

import numpy as np

from softsim import backend
from softsim.builder.chambers import commanded
from softsim.errors import Interrupted, SimulationError, SoftsimError
from softsim.interruption import stop_signals
from softsim.loads import profile
from softsim.loads.drive import ControlledPressure
from softsim.loads.load import Load
from softsim.loads.pressure import FollowerPressure
from softsim.loads.pressure_control import Command
from softsim.loads.rotor import Rotor, RotorForce
from softsim.machine import AUTO, choose
from softsim.model import Model
from softsim.output.checkpoint import Checkpoint
from softsim.output.observation import Pose, frame_pose, wall_forces
from softsim.run.batch import Batch
from softsim.run.control import OpenLoop
from softsim.run.record import Memory
from softsim.run.scenes import ready_model
from softsim.scene.loading import Loaded, LoadedScene, load_scene, scene_of, scene_said
from softsim.scene.reporting import did_you_mean
from softsim.scene.schema import Scene


@dataclass(frozen=True)
class State:
    """A moment of a simulation, `time` [s].

    By the name of each body, a row for each of its nodes (n, d): positions [m]; velocities [m/s],
    half an increment later; forces [N], all but the weight; contact_forces [N], of walls. poses, by
    the name of each rigid body: place of its centre [m], and orientation.
    """

    time: float
    positions: dict[str, np.ndarray]
    velocities: dict[str, np.ndarray]
    forces: dict[str, np.ndarray]
    contact_forces: dict[str, np.ndarray]
    poses: dict[str, Pose]


@dataclass(frozen=True)
class Saved:
    """A saved moment of one simulation, from which it continues to the same bits.

    model: that of the simulation which saved it; no other one can restore it.
    """

    model: Model = field(repr=False)
    checkpoint: Checkpoint
    rows: int
    asked: float
    left: int
    block_start: float
    done_in_block: int
    is_commanded: bool
    drives: list[Any] = field(repr=False)
    rotors: list[RotorForce] = field(repr=False)


class Simulation:
    """The run of a scene, in steps. A process has one at a time: the next one ends it.

    Parameters
    ----------
    scene: path of a scene file, what one says as a dict, an object of the schema
        (`softsim.scene.schema.Scene`), or a loaded scene. overrides: "a.b.c=value", of a path or
        a dict only.
    device: auto, cpu, cuda. threads: CPU threads, a number or auto.

    Raises
    ------
    SceneError, MeshError, DeviceError: the scene cannot be run. StabilityError: bodies that are to
    settle find no rest.
    """

    def __init__(
        self,
        scene: Path | str | Mapping[str, Any] | Scene | LoadedScene,
        overrides: Sequence[str] = (),
        device: str = AUTO,
        threads: int | str = AUTO,
    ) -> None:
        self.loaded = _loaded(scene, overrides)
        choice = choose(device, threads)
        self.model = ready_model(self.loaded, choice)
        self.record = Memory(self.loaded, self.model)
        self._batch = Batch([self.record], choice, [()])
        self._device = backend.device()
        [self._run], self._solver = self._batch.runs, self._batch.solver
        self._scenario = self._run.scenario
        self._loads: dict[str, Load] = dict(
            zip(self.model.load_names, self.model.loads, strict=True)
        )
        self._asked, self._left = 0.0, 0
        self._is_commanded = False
        for error in self._batch.unsettled.values():
            raise error
        self._batch.write_due()
        self._start = self.save()

    # --- time ------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._scenario.time

    @property
    def finished(self) -> bool:
        """True at the end of the scene: its time, its cycles, the exit of its pipe."""
        return self._run.outcome is not None

    def step(self, duration: float) -> None:
        """Go on for `duration` [s]: up to the first increment that ends there or later, or to the
        end of the scene, if that comes first by a condition of its own.

        Durations add up, so that many steps do not drift: n of them end with the increment in which
        one of n times the duration ends.

        Raises
        ------
        SimulationError: no duration, or one that leads beyond the scene's end time.
        StabilityError, ExpectationError: as `run`. Interrupted: SIGINT or SIGTERM came; the
        simulation is whole and can go on.
        """
        duration = _number(duration, "the duration of a step")
        asked = self._asked + duration
        self._refuse_step(duration, asked)
        self._asked = asked
        with stop_signals() as signals:
            while self._is_before(asked) and not self.finished:
                if signals:
                    self._asked = self.time
                    raise Interrupted(
                        f"stopped by {Signals(signals[0]).name} at t = {self.time:.6g} s",
                        hint="call step() to continue",
                    )
                self._go_on(asked)
        if isinstance(self._run.outcome, SoftsimError):
            raise self._run.outcome

    def _is_before(self, asked: float) -> bool:
        return self.time < asked - 1e-9 * self._scenario.time_increment

    def _go_on(self, asked: float) -> None:
        """Do the block of increments, or as much of it as leads to the time that is asked [s]."""
        if self._left == 0:
            [self._left] = self._batch.next_blocks().tolist()
            if self.finished:
                return
        to_asked = np.ceil((asked - self.time) / self._scenario.time_increment - 1e-9)
        count = min(self._left, max(1, int(to_asked)))
        self._batch.go_on(np.array([count]))
        self._left -= count
        if self._left == 0:
            self._batch.end_blocks()

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
        """A second solver starts Taichi anew, and the fields of the first are gone."""
        if backend.device() is not self._device:
            raise SimulationError(
                "another simulation or run was started in this process, which ended this one",
                hint="make a new Simulation of the scene; use one process for each simulation "
                "that runs at the same time",
            )

    @property
    def end_time(self) -> float:
        """When the scene ends [s]; a static one may go on, until forces balance."""
        return self.model.end_time

    # --- what is seen ----------------------------------------------------------------------------

    @property
    def history(self) -> dict[str, np.ndarray]:
        """The rows of the history so far, column -> array, as `Results.history` has them."""
        return self.record.rows()

    @property
    def row(self) -> dict[str, float]:
        """The latest row of the history, column -> number: one each `output.history_interval`."""
        return self.record.history.last

    def state(self) -> State:
        """The present state, in arrays of the caller's own."""
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
            {body.name: frame_pose(self._scenario, k) for k, body in bodies},
        )

    # --- what is commanded -----------------------------------------------------------------------

    @property
    def chambers(self) -> tuple[str, ...]:
        """Names of the chambers, which `set_load` takes."""
        return self._names(FollowerPressure)

    def set_load(self, name: str, value: float, within: float = 0.0) -> None:
        """Let a chamber go to a value from what it has now, linearly `within` a time [s]; it stays
        there until the next command. The profile of the scene is over for it, events too.

        value: of a pressure, what its gauge shows [Pa]; of a liquid or gas, what was added since
        the start [m^3, kg].

        Raises SimulationError: no such chamber, no number, more gas than the scene ever lets in.
        """
        self._refuse_stale()
        load = self._named(name, FollowerPressure, "chamber")
        value = _number(value, f"the value of '{name}'")
        within = _number(within, f"the time within which '{name}' changes")
        if not (np.isfinite(value) and 0.0 <= within < np.inf):
            raise SimulationError(
                f"'{name}' cannot change to {value} within {within} s: both must be finite "
                "numbers, and the time at least zero"
            )
        scenario, term, now = self._scenario, self._scenario.term_of(load), self.time
        drive = term.drives[scenario.number]
        if isinstance(drive.course, ControlledPressure):
            start = float(scenario.read(term.pressure)) if within > 0.0 else value
            rate = (value - start) / within if within > 0.0 else 0.0
            term.source.obey(scenario.number, Command(start, now, rate, value))
        else:
            if drive.stiffens and value > (most := float(load.drive.profile.values.max())):
                raise SimulationError(
                    f"'{name}' cannot be set to {value:.6g}: the stable step was computed for at "
                    f"most {most:.6g}, the highest value of its profile in the scene",
                    hint="raise the highest value of the profile in the scene",
                )
            course = profile.ramp(now, float(drive.course.profile.at(now)), within, value)
            term.follow(scenario.number, commanded(self._said(name), drive, course))
        if load is self.model.chamber:
            self._command()

    def set_motor(self, frequency: float, name: str | None = None) -> None:
        """Let a motor turn at another frequency [Hz] from now on, its angle going on where it is;
        an eccentric mass pulls with the square of it. Without a name: all motors.

        Raises SimulationError: there is none of this name, or the frequency is no number.
        """
        self._refuse_stale()
        frequency = _number(frequency, "the frequency of a motor")
        if not 0.0 <= frequency < np.inf:
            raise SimulationError(f"the frequency of a motor cannot be {frequency} Hz")
        motors = self._motors() if name is None else [self._named(name, Rotor, "motor")]
        if not motors:
            raise SimulationError(
                "the scene has no motor", hint="add a load of kind eccentric_mass"
            )
        for motor in motors:
            term = self._scenario.term_of(motor)
            now = term.rotors[self._scenario.number]
            term.follow(self._scenario.number, motor.at_frequency(now, frequency, self.time))

    def _named(self, name: str, kind: type, called: str) -> Any:
        known = self._names(kind)
        if name not in known:
            hint = did_you_mean(str(name), known) if known else f"the scene has no {called}"
            raise SimulationError(f"there is no {called} '{name}'", hint)
        return self._loads[name]

    def _names(self, kind: type) -> tuple[str, ...]:
        return tuple(name for name, load in self._loads.items() if isinstance(load, kind))

    def _said(self, name: str) -> Any:
        return self.loaded.scene.loads[name]

    def _motors(self) -> tuple[Rotor, ...]:
        return self.model.of_kind(Rotor)

    def _command(self) -> None:
        """The pressure of the robot's chamber follows no profile and no events any more."""
        self._is_commanded = True
        self._run.loop = OpenLoop(self._scenario, None)

    # --- back to an earlier moment ---------------------------------------------------------------

    def save(self) -> Saved:
        """The present moment, to which `restore` leads back."""
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
            self._is_commanded,
            [term_of(pressure).drives[s] for pressure in self.model.pressures],
            [term_of(motor).rotors[s] for motor in self._motors()],
        )

    def restore(self, saved: Saved) -> None:
        """Go back to a moment that this simulation saved; what follows has the same bits.

        Raises SimulationError: the moment is that of another simulation; nothing changes then.
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
        self._run.outcome = None
        self._asked, self._left = saved.asked, saved.left
        self._solver.block_starts[s] = saved.block_start
        self._solver.done_in_block[s] = saved.done_in_block
        for pressure, drive in zip(self.model.pressures, saved.drives, strict=True):
            # The command of a controlled one is in the solver's state.
            if not isinstance(drive.course, ControlledPressure):
                term_of(pressure).follow(s, drive)
        for motor, rotor in zip(self._motors(), saved.rotors, strict=True):
            term_of(motor).follow(s, rotor)
        self._is_commanded = saved.is_commanded
        if self._is_commanded:
            self._command()

    def reset(self, seed: int | None = None) -> None:
        """Go back to the start, without compiling anew.

        seed: draws the angle at which each motor starts, which nobody knows of a real one; None:
        those of the scene.

        Raises SimulationError: a seed that is no whole number from 0 on.
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


def _number(value: Any, meaning: str) -> float:
    """Return a real number of any type, numpy's too, as float. SimulationError: it is none."""
    found = np.asarray(value)
    if found.dtype.kind not in "iuf" or found.size != 1:
        raise SimulationError(f"{meaning} must be a number, not {value!r}")
    return float(found.item())
