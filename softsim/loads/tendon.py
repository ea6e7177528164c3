"""A tendon from a rigid body to a force gauge far away: a spring that pulls and never pushes.

With u the displacement of the body's centre of mass, d the unit vector towards the gauge and s the
slack, the elongation is e = -u.d - s (the gauge is so far away that d does not turn). Where e > 0
the tendon pulls the body with T = k e along d, else it hangs loose. Its energy k e^2/2 is stored,
as ABAQUS counts that of springs: in the internal energy (ALLSE), not in the external work.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.fields import real_field, vector_field


@ti.data_oriented
class Tendon:
    """A tendon on rigid body number `body`.

    stiffness: k (scenarios,) [N/m]. directions: d (scenarios, dimension). slack: s (scenarios,)
    [m]. Its `impulse` (scenarios,) [N s] is the integral of T since it was last cleared.
    """

    count = 1

    def __init__(
        self,
        rigid_bodies: Any,
        body: int,
        stiffness: np.ndarray,
        directions: np.ndarray,
        slack: np.ndarray,
    ) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.stiffness, self.slack = real_field(stiffness), real_field(slack)
        self.direction = vector_field(directions)
        self.impulse = real_field(np.zeros(len(stiffness)))

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {"impulse": self.impulse}

    def clear_impulses(self, scenario: int) -> None:
        """Start a new interval over which the tension in a scenario is averaged."""
        fields.write_row(self.impulse, scenario, 0.0)

    @ti.func
    def elongation(self, s):
        """e [m] where the tendon is taut, else zero."""
        u = self.rigid_bodies.displacement(s, self.body)
        return ti.max(-u.dot(self.direction[s]) - self.slack[s], ti.cast(0.0, backend.real))

    @ti.func
    def pull(self, s, i, t, dt):
        """Pull the body towards the gauge with k e."""
        tension = self.stiffness[s] * self.elongation(s)
        self.rigid_bodies.hold(s, self.body, tension * self.direction[s])
        self.impulse[s] = self.impulse[s] + tension * dt

    @ti.func
    def stored_energy(self, s):
        """k e^2 / 2 [J]."""
        e = self.elongation(s)
        return 0.5 * self.stiffness[s] * e * e
