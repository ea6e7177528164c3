"""What contact has dissipated so far, node by node: the books of every kind of contact."""

import numpy as np
import taichi as ti

from softsim.fields import real_field


@ti.data_oriented
class Dissipation:
    """Of `count` nodes in so many scenarios. Fields, (scenarios, count): friction_dissipation and
    damping_dissipation [J].
    """

    def __init__(self, scenarios: int, count: int) -> None:
        self.count = count
        self.friction_dissipation = real_field(np.zeros((scenarios, count)))
        self.damping_dissipation = real_field(np.zeros((scenarios, count)))

    @ti.func
    def dissipated_energy(self, s):
        """Dissipated so far by friction and by damping [J]."""
        energy = ti.Vector([0.0, 0.0])
        for i in range(self.count):
            energy[0] += self.friction_dissipation[s, i]
            energy[1] += self.damping_dissipation[s, i]
        return energy
