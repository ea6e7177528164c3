"""What a chain's file says, as a chain: numbers of the nodes, and refusals that need several keys
at once.
"""

import math

import numpy as np

from softsim.chain.backbone import BENDINGS, BendingForce, Links, WaveForce
from softsim.chain.chain import Chain, Force
from softsim.chain.ground import (
    DAMPERS,
    Drag,
    Limbs,
    NormalFriction,
    Thrust,
    Weight,
    WeightFriction,
)
from softsim.chain.integrators import REAL_STABILITY
from softsim.chain.loading import LoadedChain
from softsim.chain.motor import TURNS, Motor
from softsim.chain.schema import ChainScene
from softsim.units import format_quantity

LEAST_STEPS = 10
"""To a turn of the motor."""


def build_chain(loaded: LoadedChain) -> Chain:
    """The chain of a file.

    Raises
    ------
    SceneError: rows that do not fit, nodes lighter than their silicone, too long a step.
    """
    _refuse_rows(loaded)
    _refuse_weightless(loaded)
    s = loaded.scene
    count = s.rows.count - s.rows.under_head + 1
    on_head = np.eye(count)[0]
    behind = 1.0 - on_head
    masses = s.masses.head * on_head + s.masses.node * behind
    rows = s.rows.under_head * on_head + behind
    # The head stands in the middle of its rows.
    lengths = np.full(count - 1, s.rows.pitch)
    lengths[0] *= 0.5 * (s.rows.under_head + 1)
    limbs = Limbs(s.rows.limbs * s.limbs.stiffness * rows)
    pushing = {"head": on_head, "all": np.ones(count)}[s.limbs.thrust]
    added = {"in_head": 0.0, "added": s.motor.eccentric_mass}[s.motor.weight]
    turning = TURNS[s.motor.rotation] * math.tau * s.motor.frequency
    chain = Chain(
        masses,
        Links(lengths, 1.0 / masses, 1.0 / s.constraint_time),
        stores={
            "weight": Weight(s.gravity * (masses + added * on_head), s.slope),
            "limbs": limbs,
            "bending": BendingForce(BENDINGS[s.backbone.bending](s.backbone.bending_stiffness)),
        },
        motor=Motor(s.motor.eccentric_mass * s.motor.eccentricity, turning, on_head),
        others={
            "thrust": Thrust(limbs, s.limbs.thrust_ratio * pushing),
            "wave": WaveForce(s.wave_tension),
            "damping": DAMPERS[s.limbs.damped](s.limbs.damping),
            "drag": Drag(s.drag * on_head),
            "friction": _friction(s, masses, limbs),
        },
    )
    _refuse_long_steps(loaded, chain, limbs)
    return chain


def _friction(s: ChainScene, masses: np.ndarray, limbs: Limbs) -> Force:
    mu, speed = s.friction.coefficient, s.friction.full_speed
    if s.friction.load == "normal_force":
        return NormalFriction(limbs, mu, speed)
    return WeightFriction(mu * s.gravity * math.cos(s.slope) * masses, speed)


def _refuse_rows(loaded: LoadedChain) -> None:
    rows, length = loaded.scene.rows, loaded.scene.backbone.length
    if rows.under_head >= rows.count:
        raise loaded.error(
            ("rows", "under_head"),
            f"under_head: {rows.under_head} of {rows.count} rows leave none behind the head",
            f"at most {rows.count - 1}",
        )
    gaps = rows.count - 1
    if gaps * rows.pitch > length * (1.0 + 1e-9):
        taken, given = format_quantity(gaps * rows.pitch, "m"), format_quantity(length, "m")
        raise loaded.error(
            ("rows", "pitch"),
            f"pitch: {rows.count} rows take {taken}, the backbone has {given}",
            f"a pitch of at most {format_quantity(length / gaps, 'm')}, or fewer rows",
        )


def _refuse_weightless(loaded: LoadedChain) -> None:
    s = loaded.scene
    strip = s.backbone
    silicone = strip.density * strip.length * strip.width * strip.thickness
    nodes = s.masses.head + (s.rows.count - s.rows.under_head) * s.masses.node
    if nodes < silicone:
        raise loaded.error(
            ("masses",),
            f"masses: the nodes weigh {format_quantity(nodes, 'kg')} in all, less than the "
            f"backbone, {format_quantity(silicone, 'kg')}",
            "the head's mass is that of motor, housing and the silicone under it",
        )


def _refuse_long_steps(loaded: LoadedChain, chain: Chain, limbs: Limbs) -> None:
    """Steps must follow the motor, fixed ones what is fastest: rates of one node add up at most."""
    s = loaded.scene
    if s.time.increment >= s.time.end:
        raise loaded.error(
            ("time", "increment"), "increment: must be less than the end of the time"
        )
    turn = 1.0 / s.motor.frequency
    if s.time.increment > turn / LEAST_STEPS:
        raise loaded.error(
            ("time", "increment"),
            f"increment: {format_quantity(s.time.increment, 's')} leaves less than {LEAST_STEPS} "
            f"steps to a turn of the motor, {format_quantity(turn, 's')}",
            f"at most {format_quantity(turn / LEAST_STEPS, 's')}",
        )
    m = chain.masses
    upwards = s.limbs.damping / m + np.sqrt(limbs.stiffnesses / m)
    along = s.friction.coefficient * s.gravity / s.friction.full_speed + s.drag / m
    fastest = max(float(np.max([upwards, along])), 1.0 / s.constraint_time)
    stable = REAL_STABILITY / fastest
    if s.time.integrator == "fixed" and s.time.increment > stable:
        raise loaded.error(
            ("time", "increment"),
            f"increment: {format_quantity(s.time.increment, 's')} is too long for what decays "
            f"within {format_quantity(1.0 / fastest, 's')}",
            f"at most {format_quantity(stable, 's')}",
        )
