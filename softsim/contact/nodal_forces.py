"""What walls do to each node that may touch: forces, impulses, times in contact."""

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.fields import Number, index_field, real_field, vector_field


class NodalForces:
    """Fields, (scenarios, touched_count): normal_force [N] and force (d) [N] now; since they were
    last cleared [N s] normal_impulse, the part of it that was carried in slip slipping_impulse, and
    impulse (d); over the whole run contact_time [s], returns, the number of times that a node
    chattered, and penetration, the largest depth of a node [m].
    """

    def __init__(self, scenarios: int, count: int, dimension: int) -> None:
        self.touched_count, self.dimension = Number(count), dimension
        numbers, vectors = np.zeros((scenarios, count)), np.zeros((scenarios, count, dimension))
        self.normal_force, self.force = real_field(numbers), vector_field(vectors)
        self.normal_impulse, self.impulse = real_field(numbers), vector_field(vectors)
        self.slipping_impulse, self.contact_time = real_field(numbers), real_field(numbers)
        self.penetration, self.returns = real_field(numbers), index_field(numbers)

    def nodal_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
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
        """What presses on each of those that touch now (scenarios, k) [N]."""
        return self.normal_force

    def impulses(self) -> list[ti.Field]:
        """Of the forces of each node."""
        return [self.normal_impulse, self.slipping_impulse, self.impulse]

    def forget_times(self, scenario: int) -> None:
        """Begin the counts over the whole run anew."""
        fields.write_row(self.contact_time, scenario, 0)
        fields.write_row(self.penetration, scenario, 0)
        fields.write_row(self.returns, scenario, 0)

    @ti.func
    def note(self, s, i, force, normal, slipping, depth, dt):
        """Record that node i has this force [N] now, is pressed with `normal` [N], in slip with
        `slipping` [N], and lies `depth` [m] deep.
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
        """Sum of the forces on the nodes now (d) [N]."""
        total = ti.Vector.zero(backend.real, self.dimension)
        for i in range(self.touched_count.read()):
            total += self.force[s, i]
        return total
