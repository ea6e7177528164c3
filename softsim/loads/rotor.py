"""The term that lets a vibration motor pull on a rigid body."""

from typing import Any

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import real_field, vector_field
from softsim.loads.vibration import RotorData


@ti.data_oriented
class Rotor:
    """A motor on rigid body number `body`; one RotorData a scenario."""

    count = 1

    def __init__(self, rigid_bodies: Any, body: int, rotors: list[RotorData]) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.cosine = vector_field(np.array([r.cosine for r in rotors]))
        self.sine = vector_field(np.array([r.sine for r in rotors]))
        self.speed = real_field(np.array([2.0 * np.pi * r.frequency for r in rotors]))
        self.spin_up = real_field(np.array([r.spin_up for r in rotors]))
        self.phase = real_field(np.array([r.phase for r in rotors]))

    @ti.func
    def pull(self, s, i, t, dt):
        """Apply the force of time t; before zero the motor stands still."""
        spin_up = self.spin_up[s]
        share = ti.cast(1.0, backend.real)
        turned = t - 0.5 * spin_up
        if t < spin_up:
            u = t / spin_up
            share = u * u * (3.0 - 2.0 * u)
            turned = spin_up * u * u * u * (1.0 - 0.5 * u)
        if t < 0.0:
            share = 0.0
        angle = self.phase[s] + self.speed[s] * turned
        force = ti.cos(angle) * self.cosine[s] + ti.sin(angle) * self.sine[s]
        self.rigid_bodies.apply(s, self.body, share * share * force)
