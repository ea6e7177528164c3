"""What a chain's file says, as a chain: the numbers of its nodes."""

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
from softsim.chain.loading import LoadedChain
from softsim.chain.motor import TURNS, Motor
from softsim.chain.refusals import refuse_masses, refuse_rows, refuse_steps
from softsim.scene.chain import ChainScene


def build_chain(loaded: LoadedChain) -> Chain:
    """The chain of a file.

    Raises
    ------
    SceneError: rows that do not fit, nodes lighter than their silicone, too long a step.
    """
    refuse_rows(loaded)
    refuse_masses(loaded)
    refuse_steps(loaded)
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
    return Chain(
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


def _friction(s: ChainScene, masses: np.ndarray, limbs: Limbs) -> Force:
    mu, speed = s.friction.coefficient, s.friction.full_speed
    if s.friction.load == "normal_force":
        return NormalFriction(limbs, mu, speed)
    return WeightFriction(mu * s.gravity * math.cos(s.slope) * masses, speed)
