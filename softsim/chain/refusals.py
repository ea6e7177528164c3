"""Checks of a chain's scene for values that contradict each other."""

import math

from softsim.chain.loading import LoadedChain
from softsim.chain.motion import REAL_STABILITY
from softsim.scene.chain import ChainScene
from softsim.units import format_quantity

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
