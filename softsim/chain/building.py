"""Construction of a chain from its scene."""

import math
from collections.abc import Sequence

import numpy as np

from softsim.chain.backbone import BENDINGS, BendingForce, Links, WaveForce
from softsim.chain.chain import TURNS, Chain, Force, Motors
from softsim.chain.ground import (
    DAMPERS,
    Drag,
    Limbs,
    NormalFriction,
    Thrust,
    Weight,
    WeightFriction,
)
from softsim.chain.lattice import Lattice, ladder, line
from softsim.chain.loading import LoadedChain
from softsim.chain.refusals import refuse_masses, refuse_motors, refuse_rows, refuse_steps
from softsim.scene.chain import ChainScene


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
