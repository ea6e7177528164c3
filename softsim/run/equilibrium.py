"""Equilibria of a scene, with natural modes and harmonic response about them.

Any scene, also one of a dynamic procedure, is loaded statically by Newton's method: its motors are
left out, and so is what ends a run. The model has its Maxwell branches, which a static run lacks.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from softsim.builder import build_model
from softsim.builder.bodies import with_branches
from softsim.compute.machine import Choice
from softsim.errors import ModesError, Option, OutputError, SceneError, StabilityError
from softsim.loads.nodal import Rotor
from softsim.model import Model, Probe
from softsim.output.folder import CHECKPOINT, HISTORY, SCENE, read_checkpoint, read_summary
from softsim.output.history import read_history
from softsim.output.observation import probe_values
from softsim.run.batch import Batch
from softsim.run.record import MemoryRecord, Progress
from softsim.run.scenes import ready_model
from softsim.run.statics import ADVICE, LoadStepping
from softsim.scene.loading import LoadedScene, load_scene, read_scene, validated
from softsim.scene.loads import EccentricMass, OverTime, SinusoidalForce
from softsim.scene.measures import OF_PROBES
from softsim.scene.outputs import Expect, probe_columns
from softsim.scene.reporting import did_you_mean
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.stable_step import first_time_increment
from softsim.statics.forces import StaticForces
from softsim.statics.modes import Friction, HarmonicResponse, SmallVibrations, at_full_speed
from softsim.statics.newton import LoadSteps, Newton, NoEquilibriumError
from softsim.units import QUANTITY

LEAST_STEPS = 20
"""Number of load steps up to the last load, at least: friction depends on the path."""

ROUND_OFF = 1e-8
"""Amplitude over the largest of its unit, below which it is round-off of zero."""

OTHER_LOADS_COMPLETE = 0.1
"""Fraction of the load time after which all loads but the one of interest are complete."""


@dataclass(frozen=True)
class LoadRange:
    """Load of a scene that rises from zero to `high`; of interest are values from `low` on.

    Both are in `unit` as written, "" without one. origin: option that gives it.
    """

    name: str
    low: float
    high: float
    unit: str
    origin: Option

    @classmethod
    def read(cls, text: str, option: str) -> "LoadRange":
        """Return the range in a text: "air=0..23 kPa", or "air=18 kPa", whose low is its high.

        Raises SceneError.
        """
        at = Option(f"{option} {text}")
        name, equals, values = (part.strip() for part in text.partition("="))
        bounds = _bounds(values, at)
        if not (equals and name and bounds):
            raise SceneError(
                f"'{text}' is not a load with its value",
                "write air='18 kPa' or air='0..23 kPa'",
                at,
            )
        start, end, unit = bounds
        if end == 0.0:
            raise SceneError(f"'{text}' is no load", "leave the load out of the scene", at)
        if not 0.0 <= start / end <= 1.0:
            raise SceneError(
                f"'{values}' does not lead away from zero",
                "a load is applied from zero on: write the value nearer to zero first", at,
            )  # fmt: skip
        return cls(name, start, end, unit, at)

    def values(self, count: int) -> np.ndarray:
        """Return evenly spaced values (count,) from `low` to `high`."""
        return np.linspace(self.low, self.high, count)

    def fraction_of_time(self, value: float) -> float:
        """Return the fraction of the load time at which a load that is varied has a value."""
        return OTHER_LOADS_COMPLETE + (1.0 - OTHER_LOADS_COMPLETE) * value / self.high

    def shown(self, value: float) -> str:
        """Return a value of the load as text."""
        return f"{value:.5g} {self.unit}".rstrip()


def _bounds(text: str, at: Option) -> tuple[float, float, str] | None:
    """Return both numbers and the unit of "0..23 kPa", or of "18 kPa"; None for other texts.

    Raises SceneError for two units.
    """
    low, dots, high = (part.strip() for part in text.partition(".."))
    first, last = QUANTITY.fullmatch(low), QUANTITY.fullmatch(high if dots else low)
    if not (first and last):
        return None
    if first["unit"] not in ("", last["unit"]):
        raise SceneError(f"'{text}' has two units", f"write both values in {last['unit']}", at)
    return float(first["number"]), float(last["number"]), last["unit"]


def frequency_range(text: str, option: str) -> tuple[float, float]:
    """Return both frequencies [Hz] of a text "20..250 Hz". Raises SceneError."""
    at = Option(f"{option} {text}")
    bounds = _bounds(text, at)
    if bounds is None or bounds[2] != "Hz" or not 0.0 < bounds[0] < bounds[1]:
        raise SceneError(f"'{text}' is not a range of frequencies", "write '20..250 Hz'", at)
    return bounds[:2]


def scene_with_loads(
    path: Path,
    overrides: Sequence[str],
    loads: Sequence[LoadRange] = (),
    over: LoadRange | None = None,
    at: str | None = None,
) -> LoadedScene:
    """Return a scene in which these loads rise in proportion to time, up to `high` at the end.

    Gravity without a profile rises within the first OTHER_LOADS_COMPLETE of the time. over: load
    that is varied; it rises after the others, see `LoadRange.fraction_of_time`. at: text of the
    time that is the end, such as "0.2 s", or None.

    Raises SceneError.
    """
    ending = [] if at is None else [f"time.end={at}"]
    loaded = load_scene(path, [*overrides, *ending])
    more = []
    environment = loaded.scene.environment
    if environment.gravity_profile is None and np.any(environment.gravity):
        duration = OTHER_LOADS_COMPLETE * loaded.scene.time.end
        more.append(
            f"environment.gravity_profile={{kind: ramp, value: 1, duration: {duration!r} s}}"
        )
    for load in [*loads, *([over] if over else [])]:
        spec, key = _profile_of(loaded, load)
        end, high = loaded.scene.time.end, f"{load.high!r} {load.unit}"
        complete = end * (OTHER_LOADS_COMPLETE if over else 1.0)
        profile = f"{{kind: ramp, value: {high}, duration: {complete!r} s}}"
        if load is over:
            zero = f"0 {load.unit}"
            points = f"[[0 s, {zero}], [{complete!r} s, {zero}], [{end!r} s, {high}]]"
            profile = f"{{kind: table, points: {points}}}"
        more.append(f"loads.{load.name}.{key}={profile}")
        if getattr(spec, "ramp", 0.0) != 0.0:
            more.append(f"loads.{load.name}.ramp=0 s")
    return load_scene(path, [*overrides, *ending, *more]) if more else loaded


def _profile_of(loaded: LoadedScene, load: LoadRange) -> tuple[Any, str]:
    """Return a load of a scene and the key of its profile. Raises SceneError if there is none."""
    known, name = loaded.scene.loads, load.name
    if name not in known:
        hint = did_you_mean(name, list(known)) if known else "the scene has no loads"
        raise SceneError(f"there is no load '{name}'", hint, load.origin)
    spec = known[name]
    keys = ("pull_profile", "tension_profile", "profile")
    given = [key for key in keys if getattr(spec, key, None) is not None]
    if not given and not isinstance(spec, OverTime):
        raise SceneError(f"'{name}' has no profile, so it has no value", "", load.origin)
    return spec, given[0] if given else "profile"


def scene_of_run(folder: Path) -> LoadedScene:
    """Return the scene of a run folder, as it was run. Raises SceneError, OutputError."""
    file = folder / SCENE
    if not file.is_file():
        raise OutputError(f"{folder} is not a run folder: it has no {SCENE}", "give a scene or one")
    path = Path(read_summary(folder).get("scene", file))
    return validated(read_scene(file), path, [])


def static(loaded: LoadedScene) -> LoadedScene:
    """Return a scene loaded statically by Newton's method, without motors and what ends a run."""
    scene = loaded.scene
    time = scene.time.model_copy(
        update={
            "procedure": "static", "method": "newton", "control": "load", "settle": None,
            "until": None, "cycles": None, "reach": None,
        }
    )  # fmt: skip
    motors = motor_frequencies(loaded)
    loads = {name: load for name, load in scene.loads.items() if name not in motors}
    update = {
        "time": time, "loads": loads, "layout": None, "crossing": None, "expect": Expect(),
    }  # fmt: skip
    return replace(loaded, scene=scene.model_copy(update=update))


def motor_frequencies(loaded: LoadedScene) -> dict[str, float]:
    """Return the frequency [Hz] of each motor of a scene, by the name of the load."""
    return {
        name: load.frequency
        for name, load in loaded.scene.loads.items()
        if isinstance(load, EccentricMass | SinusoidalForce)
    }


def motors(loaded: LoadedScene) -> dict[str, Rotor]:
    """Return the motors of a scene by name. Raises SceneError if it has none, MeshError."""
    if not motor_frequencies(loaded):
        raise SceneError(
            "the scene has no motor, so nothing makes it vibrate",
            "add a load of the kind sinusoidal_force or eccentric_mass to a rigid body",
            loaded.tree.origin,
        )
    model = build_model(loaded)  # a static model refuses motors
    return {name: load for name, load in model.named_loads.items() if isinstance(load, Rotor)}


@dataclass(frozen=True, eq=False)
class MotorResponse:
    """Harmonic response to a motor over frequencies (f,) [Hz].

    own_frequency [Hz]: of the motor in the scene. force (f,): its amplitude [N]. amplitudes: column
    -> (f,), complex, SI, with the phase against the angle of an
    eccentric mass, or against a sinusoidal force. units: column -> SI unit.
    contact_changes (f,): largest number of points that begin or cease to touch, or begin to slip,
    in a cycle; above zero the result is not valid.
    """

    motor: str
    own_frequency: float
    frequencies: np.ndarray
    force: np.ndarray
    amplitudes: dict[str, np.ndarray]
    units: dict[str, str]
    contact_changes: np.ndarray

    def warnings(self) -> list[str]:
        """Return a sentence on the intervals of frequencies at which the response is not valid."""
        changed = np.flatnonzero(self.contact_changes)
        if not len(changed):
            return []
        runs = np.split(self.frequencies[changed], np.flatnonzero(np.diff(changed) > 1) + 1)
        intervals = [
            f"from {run[0]:.4g} to {run[-1]:.4g} Hz" if len(run) > 1 else f"at {run[0]:.4g} Hz"
            for run in runs
        ]
        return [
            f"{', '.join(intervals)} ({len(changed)} of {len(self.frequencies)} frequencies) "
            "contact opens, closes or begins to slip within a cycle, at up to "
            f"{self.contact_changes.max()} points, so there the linear response is not valid: run "
            "the scene in time"
        ]


class Preloaded:
    """Equilibria of a scene over its load time.

    model: of the static run that finds them.

    Raises SceneError, MeshError, DeviceError: the scene cannot be loaded.
    """

    def __init__(self, loaded: LoadedScene, choice: Choice) -> None:
        self.loaded = static(loaded)
        self.model: Model = ready_model(self.loaded, choice)
        self._viscoelastic = with_branches(loaded, self.model)
        [run] = Batch([MemoryRecord(self.loaded, self.model)], choice, [()]).runs
        stepping = run.stepping
        assert isinstance(stepping, LoadStepping)
        self._solver, self._newton = run.scenario.solver, stepping.newton
        self._steps = stepping.steps

    @property
    def time(self) -> float:
        """Load time [s] of the last equilibrium."""
        return self._newton.forces.time

    @property
    def end(self) -> float:
        """Load time [s] at the end of the scene."""
        return self.model.end_time

    def reach(self, time: float) -> None:
        """Find the equilibrium at a load time [s]. Raises StabilityError if there is none."""
        longest = self.end / LEAST_STEPS
        while self.time < time * (1.0 - 1e-12):
            left = time - self.time
            step = left / max(1.0, np.ceil(left / longest - 1e-9))
            try:
                with np.errstate(over="ignore", invalid="ignore"):
                    self._steps.advance(self.time + step)
            except NoEquilibriumError as error:
                raise StabilityError(
                    f"{error}; the last equilibrium is at t = {self.time:.6g} s of "
                    f"{self.end:.6g} s",
                    ADVICE,
                ) from None

    def take_up(self, folder: Path) -> None:
        """Continue from the checkpoint of a static run of the scene, and balance it.

        Raises OutputError if there is none; ModesError if the run was dynamic; StabilityError if no
        equilibrium is near.
        """
        checkpoint, history = read_checkpoint(folder / CHECKPOINT), read_history(folder / HISTORY)
        time = Progress.written(checkpoint.progress).time
        along_path = history.get("load_time")  # of a run by arc length, whose clock is another one
        self._solver.take_over(checkpoint.state, time if along_path is None else along_path[-1])
        forces = StaticForces(self._solver)
        self._newton = Newton(forces, self._newton.tolerance)
        forces.accept(self._newton.find(forces.start).at, 0.0)
        self._steps = LoadSteps(self._newton)

    @cached_property
    def _vibrating(self) -> ExplicitSolver:
        """Solver of the model with its Maxwell branches.

        The static run has none: a trial state that inverts an element would spoil their strain.
        """
        solver = ExplicitSolver([self._viscoelastic])
        solver.compile()
        solver.begin(first_time_increment(self._viscoelastic))
        return solver

    def vibrations(self, friction: Friction) -> SmallVibrations:
        """Return the small vibrations about the last equilibrium. Raises ModesError."""
        solver = self._vibrating
        solver.take_over(self._solver.state(), self.time)
        return SmallVibrations(StaticForces(solver), friction)

    def response(
        self, harmonic: HarmonicResponse, name: str, motor: Rotor, frequencies: Iterable[float]
    ) -> MotorResponse:
        """Return the harmonic response to a motor. Raises ModesError if it moves nothing."""
        rows: list[dict[str, complex]] = []
        computed, forces, changes = [], [], []
        for frequency in frequencies:
            rotor = at_full_speed(motor, frequency)
            force = harmonic.force_of(motor, rotor)
            if not force.any():
                raise ModesError(
                    f"the motor '{name}' acts on a body that is held, so nothing moves"
                )
            motion = harmonic.motion(frequency, force)
            rows.append(self._amplitudes(harmonic.vibrations, motion))
            computed.append(frequency)
            forces.append(max(np.linalg.norm(rotor.cosine), np.linalg.norm(rotor.sine)))
            changes.append(harmonic.contact_changes(motion))
        amplitudes = {c: np.array([row[c] for row in rows]) for c in rows[0]}
        units = self._units()
        largest = dict.fromkeys(units.values(), 0.0)  # by unit
        for column, values in amplitudes.items():
            largest[units[column]] = max(largest[units[column]], float(np.abs(values).max()))
        for column, values in amplitudes.items():
            values[np.abs(values) < ROUND_OFF * largest[units[column]]] = 0.0
        return MotorResponse(
            name, motor.rotor.frequency, np.array(computed), np.array(forces), amplitudes,
            units, np.array(changes),
        )  # fmt: skip

    def _units(self) -> dict[str, str]:
        """Return the SI units of the columns of `_amplitudes`."""
        axes = "xyz"[: self.model.dimension]
        bodies = {f"{body.name}_{axis}": "m" for body in self.model.rigid_bodies for axis in axes}
        probes = [p for p in self.model.probes if p.kind != "reaction"]
        return bodies | {
            c: OF_PROBES[p.kind].unit for p in probes for c in probe_columns(p.name, p.kind, axes)
        }

    def _amplitudes(self, vibrations: SmallVibrations, motion: np.ndarray) -> dict[str, complex]:
        """Return the amplitudes of bodies and of probes of places, by column, SI."""
        of_nodes, of_bodies = vibrations.displaced(motion)
        axes = "xyz"[: self.model.dimension]
        amplitudes = {
            f"{body.name}_{axis}": complex(of_bodies[number, k])
            for number, body in enumerate(self.model.rigid_bodies)
            for k, axis in enumerate(axes)
            if body.free[k]
        }
        for probe in self.model.probes:
            if probe.kind == "reaction":
                continue
            names = probe_columns(probe.name, probe.kind, axes)
            if amplitudes.keys() & set(names):
                raise ModesError(f"a probe and a rigid body are both named '{probe.name}'")
            x = vibrations.at.x
            values = self._rate(probe, x, of_nodes.real) + 1j * self._rate(probe, x, of_nodes.imag)
            amplitudes |= dict(zip(names, values.tolist(), strict=True))
        return amplitudes

    def _rate(self, probe: Probe, x: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Return the derivative (columns,) of a probe with the nodes at x along (n, d)."""
        step = 1e-6 * float(np.ptp(x, axis=0).max()) / max(float(np.abs(along).max()), 1e-300)
        ends = [probe_values(self.model, probe, x + sign * step * along) for sign in (-1.0, 1.0)]
        return (ends[1] - ends[0]) / (2.0 * step)


def refuse_dynamic(loaded: LoadedScene, folder: Path) -> None:
    """Raise ModesError unless the scene of a run folder is static."""
    if loaded.scene.time.procedure == "dynamic":
        raise ModesError(
            f"the run in {folder} is dynamic, so it does not end in an equilibrium",
            hint="give the scene instead, or run it with --set time.procedure=static",
        )
