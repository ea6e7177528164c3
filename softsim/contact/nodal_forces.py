"""Forces, impulses and contact times of the nodes that may touch walls."""

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.fields import Number, index_field, real_field, vector_field


class NodalForces:
    """Contact forces of nodes, their impulses and statistics.

    Fields, (scenarios, touched_count): normal_force [N] and force (d) [N] now; normal_impulse, its
    part carried while slipping slipping_impulse, and impulse (d), all [N s] since they were last
    cleared; over the whole run contact_time [s], returns (the number of times that a node
    chattered) and penetration, the largest depth of a node [m].
    """

    def __init__(self, scenarios: int, count: int, dimension: int) -> None:
        self.touched_count, self.dimension = Number(count), dimension
        numbers, vectors = np.zeros((scenarios, count)), np.zeros((scenarios, count, dimension))
        self.normal_force, self.force = real_field(numbers), vector_field(vectors)
        self.normal_impulse, self.impulse = real_field(numbers), vector_field(vectors)
        self.slipping_impulse, self.contact_time = real_field(numbers), real_field(numbers)
        self.penetration, self.returns = real_field(numbers), index_field(numbers)

    def nodal_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {
            "contact_time": self.contact_time,
            "penetration": self.penetration,
            "returns": self.returns,
            "normal_force": self.normal_force,
            "force": self.force,
            "normal_impulse": self.normal_impulse,
            "slipping_impulse": self.slipping_impulse,
            "impulse": self.impulse,
        }

    @property
    def pressing_force(self) -> ti.Field:
        """Normal forces (scenarios, k) [N] of the nodes, or of what touches in their place."""
        return self.normal_force

    def impulses(self) -> list[ti.Field]:
        """Return the fields of the impulses of each node."""
        return [self.normal_impulse, self.slipping_impulse, self.impulse]

    def forget_times(self, scenario: int) -> None:
        """Set the statistics of the whole run to zero in a scenario."""
        fields.write_row(self.contact_time, scenario, 0)
        fields.write_row(self.penetration, scenario, 0)
        fields.write_row(self.returns, scenario, 0)

    @ti.func
    def note(self, s, i, force, normal, slipping, depth, dt):
        """Record the force [N] of node i and its penetration.

        normal, slipping [N]: its normal force, and the part of that carried while slipping. depth
        [m]: its penetration.
        """
        self.penetration[s, i] = ti.max(self.penetration[s, i], depth)
        self.force[s, i] = force
        self.normal_force[s, i] = normal
        self.normal_impulse[s, i] = self.normal_impulse[s, i] + normal * dt
        self.slipping_impulse[s, i] = self.slipping_impulse[s, i] + slipping * dt
        self.impulse[s, i] = self.impulse[s, i] + force * dt
        if normal > 0.0:
            self.contact_time[s, i] = self.contact_time[s, i] + dt

    @ti.func
    def total_force(self, s):
        """Return the sum of the forces on the nodes now (d) [N]."""
        total = ti.Vector.zero(backend.real, self.dimension)
        for i in range(self.touched_count.read()):
            total += self.force[s, i]
        return total
