"""Run of a chain, from its scene to the folder of results; chains as cases of studies."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from softsim.apps.chain.mechanics import (
    BENDINGS,
    DAMPERS,
    TURNS,
    BendingForce,
    Chain,
    Drag,
    Force,
    Lattice,
    Limbs,
    Links,
    Motors,
    NormalFriction,
    Thrust,
    WaveForce,
    Weight,
    WeightFriction,
    ladder,
    line,
)
from softsim.apps.chain.motion import (
    REAL_STABILITY,
    Motion,
    measures,
    simulate,
    track_measures,
    yaw,
)
from softsim.apps.chain.scene import ChainScene, LoadedChain, produced_by_chain
from softsim.errors import SceneError
from softsim.output.folder import HISTORY, SCENE, SUMMARY, RunFolder, claimed
from softsim.output.history import History
from softsim.scene.measures import Measure
from softsim.scene.text import Tree, child
from softsim.study.cases import Program, Source
from softsim.units import format_quantity

# -------------------------------------------------------------------------------------------------
# Checks of a scene for values that contradict each other.

LEAST_STEPS = 10
"""Least number of steps per turn of the motor."""

MOST_STEPS = 1_000_000
"""Largest number of steps of a run, which stores all of them in a few hundred megabytes."""


def refuse_rows(loaded: LoadedChain) -> None:
    """Raise SceneError if no row is behind the head, or the rows are longer than the backbone."""
    rows, length = loaded.scene.rows, loaded.scene.backbone.length
    if rows.under_head >= rows.count:
        raise loaded.error(
            ("rows", "under_head"),
            f"under_head: {rows.under_head} of {rows.count} rows leave no row behind the head",
            f"at most {rows.count - 1}",
        )
    gaps = rows.count - 1
    if gaps * rows.pitch > length * (1.0 + 1e-9):
        taken, given = format_quantity(gaps * rows.pitch, "m"), format_quantity(length, "m")
        raise loaded.error(
            ("rows", "pitch"),
            f"pitch: {rows.count} rows take {taken}, but the backbone is {given} long",
            f"a pitch of at most {format_quantity(length / gaps, 'm')}, or fewer rows",
        )


def refuse_masses(loaded: LoadedChain) -> None:
    """Raise SceneError if nodes weigh less than the silicone, or the head less than its motor."""
    s = loaded.scene
    if s.motor.eccentric_mass > s.masses.head:
        raise loaded.error(
            ("motor", "eccentric_mass"),
            f"eccentric_mass: {format_quantity(s.motor.eccentric_mass, 'kg')} is more than the "
            f"mass of the head, {format_quantity(s.masses.head, 'kg')}, which includes it",
        )
    strip = s.backbone
    silicone = strip.density * strip.length * strip.width * strip.thickness
    nodes = s.masses.head + (s.rows.count - s.rows.under_head) * s.masses.node
    if nodes < silicone:
        raise loaded.error(
            ("masses",),
            f"masses: the nodes have {format_quantity(nodes, 'kg')} in total, less than the "
            f"backbone, {format_quantity(silicone, 'kg')}",
            "masses.head includes the motor, its housing and the silicone under it",
        )


def refuse_motors(loaded: LoadedChain) -> None:
    """Raise SceneError if there is no middle node for the head, or frequencies contradict.

    motor.further sets the frequency of all motors and excludes frequencies of the sides.
    """
    s = loaded.scene
    if s.motor.place == "middle" and s.node_count % 2 == 0:
        others = s.node_count - 1
        raise loaded.error(
            ("motor", "place"),
            f"place: with {others} nodes beside the head, it has no place in the middle",
            f"set rows.under_head to {s.rows.under_head + 1}, or change the number of rows",
        )
    if s.motor.further and any(one.frequency is not None for one in s.lines):
        raise loaded.error(
            ("motor", "further"),
            "further: each side has its own motor frequency",
            "leave out motor.further, or the frequencies of the sides",
        )


def refuse_steps(loaded: LoadedChain) -> None:
    """Raise SceneError if there are too few or too many steps, or the steps are too long.

    Steps must resolve a turn of the motor; fixed ones must also be stable for the fastest rate.
    """
    s = loaded.scene
    own = [one.frequency or 0.0 for one in s.lines]
    fastest = max(s.motor.frequency, *s.motor.further.values(), *own)
    h, turn = s.time.increment, 1.0 / fastest
    if not h < s.time.end <= h * MOST_STEPS:
        raise loaded.error(
            ("time", "end"),
            f"end: {format_quantity(s.time.end, 's')} is {s.time.end / h:.3g} steps of "
            f"{format_quantity(h, 's')}",
            f"from 2 to {MOST_STEPS:,}",
        )
    if h > turn / LEAST_STEPS:
        raise loaded.error(
            ("time", "increment"),
            f"increment: {format_quantity(h, 's')} gives less than {LEAST_STEPS} steps per turn "
            f"of the motor, {format_quantity(turn, 's')}",
            f"at most {format_quantity(turn / LEAST_STEPS, 's')}",
        )
    rate = _fastest_rate(s)
    if s.time.integrator == "fixed" and h * rate > REAL_STABILITY:
        raise loaded.error(
            ("time", "increment"),
            f"increment: {format_quantity(h, 's')} is too long for a process with a time constant "
            f"of {format_quantity(1.0 / rate, 's')}",
            f"at most {format_quantity(REAL_STABILITY / rate, 's')}",
        )


def _fastest_rate(s: ChainScene) -> float:
    """Return an upper bound of the rates [1/s] of oscillation and damping of the nodes.

    Vertical b/m + sqrt(k/m), along the ground mu g / v0 + b/m, and that of the constraints. Bending
    adds at most 16 k_psi / L^2, the largest eigenvalue of second differences, to the stiffness k of
    a node's springs, and the wave 4 T / L.
    """
    shortest = s.rows.pitch
    bending = 16.0 * s.backbone.bending_stiffness / shortest**2 + 4.0 * s.wave_tension / shortest
    roughest = s.friction.coefficient * max(one.friction_share for one in s.lines)
    along = roughest * s.gravity / s.friction.full_speed
    limb = s.limbs.stiffness * max(one.limb_share for one in s.lines)
    nodes = ((s.masses.head, s.rows.under_head), (s.masses.node, 1))
    rates = [1.0 / s.constraint_time, along + s.drag / s.masses.head]
    for mass, rows in nodes:
        stiffness = rows * s.rows.limbs * limb + bending
        rates.append(s.limbs.damping / mass + math.sqrt(stiffness / mass))
    return max(rates)


# -------------------------------------------------------------------------------------------------
# Construction of a chain from its scene.


def build_chain(loaded: LoadedChain) -> Chain:
    """Return the chain of a validated scene.

    Raises
    ------
    SceneError
        Rows do not fit, the head has no place, nodes are lighter than their silicone, or the step
        is too long.
    """
    refuse_rows(loaded)
    refuse_masses(loaded)
    refuse_motors(loaded)
    refuse_steps(loaded)
    s = loaded.scene
    is_head = np.tile(_is_head(s), len(s.lines))
    masses = np.where(is_head, s.masses.head, s.masses.node)
    rows = np.where(is_head, s.rows.under_head, 1)
    lattice = _lattice(s)
    shares = _of_lines(s, [one.limb_share for one in s.lines])
    limbs = Limbs(s.rows.limbs * s.limbs.stiffness * rows * shares)
    pushing = {"head": is_head, "all": np.ones_like(is_head)}[s.limbs.thrust]
    added = {"in_head": 0.0, "added": s.motor.eccentric_mass}[s.motor.weight]
    return Chain(
        masses,
        np.flatnonzero(is_head),
        Links(lattice, 1.0 / masses, 1.0 / s.constraint_time),
        stores={
            "weight": Weight(s.gravity * (masses + added * is_head), s.slope),
            "limbs": limbs,
            "bending": BendingForce(
                BENDINGS[s.backbone.bending](s.backbone.bending_stiffness), lattice
            ),
        },
        motors=_motors(s, lattice),
        others={
            "thrust": Thrust(limbs, s.limbs.thrust_ratio * pushing, lattice),
            "wave": WaveForce(s.wave_tension, lattice),
            "damping": DAMPERS[s.limbs.damped](s.limbs.damping),
            "drag": Drag(s.drag * is_head),
            "friction": _friction(s, masses, limbs),
        },
    )


def _of_lines(s: ChainScene, values: Sequence[float]) -> np.ndarray:
    """Return the values of the lines at all nodes (n,)."""
    return np.repeat(values, s.node_count)


def _is_head(s: ChainScene) -> np.ndarray:
    """Return an array (n,) that is True for the node of a line with the motor."""
    last = s.node_count - 1
    at = {"front": 0, "middle": last // 2, "rear": last}[s.motor.place]
    return np.arange(s.node_count) == at


def _lattice(s: ChainScene) -> Lattice:
    """Return the lattice of nodes, with the head in the middle of its rows."""
    head = _is_head(s)
    gaps = np.where(head[:-1] | head[1:], 0.5 * (s.rows.under_head + 1), 1.0) * s.rows.pitch
    return line(gaps) if s.sides is None else ladder(gaps, s.sides.distance)


def _motors(s: ChainScene, lattice: Lattice) -> Motors:
    shares = [runs * one.motor_share for runs, one in zip(s.running, s.lines, strict=True)]
    frequencies = [one.frequency or s.motor.frequency for one in s.lines]
    is_head = np.tile(_is_head(s), len(s.lines))
    return Motors(
        s.motor.eccentric_mass * s.motor.eccentricity * _of_lines(s, shares) * is_head,
        TURNS[s.motor.rotation] * math.tau * _of_lines(s, frequencies),
        lattice,
    )


def _friction(s: ChainScene, masses: np.ndarray, limbs: Limbs) -> Force:
    mu = s.friction.coefficient * _of_lines(s, [one.friction_share for one in s.lines])
    if s.friction.load == "normal_force":
        return NormalFriction(limbs, mu, s.friction.full_speed)
    weights = s.gravity * math.cos(s.slope) * masses
    return WeightFriction(mu * weights, s.friction.full_speed)


# -------------------------------------------------------------------------------------------------
# Simulation, and the files in the folder of results.

MODEL = "chain"
"""Value of `model` in the summary of a chain."""


AXES = {2: "xz", 3: "xyz"}
"""Names of the components of a vector, by their number."""


@dataclass(frozen=True, eq=False)
class ChainResults:
    """Results of a chain.

    Attributes
    ----------
    motion : Motion
        Times (k,) [s], positions and velocities (k, n, d) [m, m/s] of all nodes.
    summary : dict
        Content of summary.json, in SI units.
    """

    motion: Motion
    summary: dict[str, Any]


def run_chain(loaded: LoadedChain, folder: Path) -> ChainResults:
    """Simulate a chain, and write scene, history and summary into a folder.

    Parameters
    ----------
    loaded : LoadedChain
        Chain from `load_chain`.
    folder : Path
        Folder of the results.

    Returns
    -------
    ChainResults
        Motion and summary.

    Raises
    ------
    SceneError
        The chain cannot be built.
    StabilityError
        The motion cannot be computed.
    OutputError
        The folder cannot be written, or another run uses it.

    Examples
    --------
    >>> from pathlib import Path
    >>> from softsim.apps.chain.scene import load_chain
    >>> from softsim.apps.chain.running import run_chain
    >>> loaded = load_chain("leafbot5", ["time.end=0.1 s"])
    >>> results = run_chain(loaded, Path("runs/leafbot5"))
    >>> results.summary["status"]
    'done'
    >>> results.motion.p.shape[1:]  # nodes, x and z [m]
    (4, 2)
    """
    chain = build_chain(loaded)
    target = RunFolder(folder)
    with claimed(folder):
        (folder / SUMMARY).unlink(missing_ok=True)  # of a run before: this one is not done
        target.write_text_atomic(SCENE, loaded.resolved())
        began = time.monotonic()
        motion = simulate(chain, loaded.scene.time)
        told = measures(motion)
        further = {
            name: measures(simulate(chain.driven_at(frequency), loaded.scene.time))["speed"]
            for name, frequency in loaded.scene.motor.further.items()
        }
        summary = {
            "status": "done",
            "model": MODEL,
            "scene": loaded.path,
            "title": loaded.scene.title,
            "node_count": chain.node_count,
            "heads": (chain.heads + 1).tolist(),
            "motor_frequency": loaded.scene.motor.frequency,
            "time_increment": motion.times[1],
            "increments": len(motion.times) - 1,
            "simulated_time": motion.times[-1],
            "wall_time": time.monotonic() - began,
            **told,
            **(track_measures(motion) if loaded.scene.sides is not None else {}),
            "further_speeds": further,
        }
        _write_history(motion, loaded.scene.time.row_interval, folder / HISTORY)
        target.write_json_atomic(SUMMARY, summary)
    return ChainResults(motion, summary)


def _write_history(motion: Motion, interval: float, path: Path) -> None:
    """Write history.csv with rows about `interval` [s] apart."""
    stride = max(round(interval / motion.times[1]), 1)
    axes = AXES[motion.p.shape[-1]]
    columns: dict[str, tuple[str, np.ndarray]] = {"time": ("s", motion.times)}
    for node in range(motion.chain.node_count):
        for axis, name in enumerate(axes):
            columns[f"{name}{node + 1}"] = ("m", motion.p[:, node, axis])
    head = motion.chain.heads[0]
    for axis, name in enumerate(axes):
        columns[f"head_velocity_{name}"] = ("m/s", motion.v[:, head, axis])
    if "y" in axes:
        columns["centre_x"] = ("m", motion.centre[:, 0])
        columns["centre_y"] = ("m", motion.centre[:, 1])
        columns["yaw"] = ("rad", yaw(motion))
    columns |= {f"{name}_energy": ("J", energy) for name, energy in motion.energies.items()}
    columns |= {f"{name}_work": ("J", work) for name, work in motion.works.items()}
    history = History(path, {name: unit for name, (unit, _) in columns.items()})
    table = np.column_stack([values[::stride] for _, values in columns.values()])
    for row in table:
        history.append(dict(zip(columns, row, strict=True)))
    history.close()


# -------------------------------------------------------------------------------------------------
# Chains as cases of studies.


@dataclass(frozen=True)
class ChainSource(Source):
    """File of a chain."""

    root = ChainScene

    @staticmethod
    def refuse_unsupported(study: Tree) -> None:
        """Raise SceneError at options that chains do not support: a robot, early stopping."""
        robot, objective = child(study, "robot"), child(study, "optimize")
        if robot is not None and robot.value is not None:
            raise SceneError("a chain already is a robot", "leave robot out", robot.key_origin)
        prune = None if objective is None else child(objective, "prune")
        if prune is not None and prune.value is not None:
            hint = "leave prune out: a chain takes seconds"
            raise SceneError(
                "the trials of a chain cannot be stopped early", hint, prune.key_origin
            )

    @property
    def program(self) -> Program:
        """Function that runs its scene."""
        return run_chain

    @staticmethod
    def produced(scene: Any) -> dict[str, Measure]:
        """Return the measures of a run of a chain, by name."""
        return produced_by_chain(scene)

    @staticmethod
    def recorded(scene: Any) -> dict[str, Measure]:
        """Return the columns of a history that can be evaluated: none of a chain's."""
        return {}

    @property
    def command(self) -> tuple[str, ...]:
        """Command line that runs it."""
        return ("softsim", "chain", str(self.scene))
