"""Energy dissipated by contact, node by node, for every kind of contact.

The work of every contact force is integrated by the trapezoidal rule, consistent with central
differences. Of the work of the friction force T over the displacement d of an increment, in which
the elastic slip changes by e, the spring stores k_t s . e with the mean s. The rest is exactly

    friction  T . (d - e),    dashpot  (T - k_t s) . e,

where T and s are means over both ends of the increment and d - e is the slip. When a node leaves,
both drop to zero.
"""

import numpy as np
import taichi as ti

from softsim import fields
from softsim.fields import Number, real_field
from softsim.term import Term


class Dissipation(Term):
    """Dissipated energies of `count` nodes in each scenario.

    Fields, (scenarios, count): friction_dissipation and damping_dissipation [J].
    """

    def __init__(self, scenarios: int, count: int) -> None:
        self.count = Number(count)
        self.friction_dissipation = real_field(np.zeros((scenarios, count)))
        self.damping_dissipation = real_field(np.zeros((scenarios, count)))

    def forget_dissipation(self, scenario: int) -> None:
        """Set the dissipated energies of a scenario to zero."""
        fields.write_row(self.friction_dissipation, scenario, 0.0)
        fields.write_row(self.damping_dissipation, scenario, 0.0)

    @ti.func
    def book_normal(self, s, i, dashpot_before, dashpot, way):
        """Add the work of the normal dashpot over an increment.

        Arguments are the dashpot forces [N] at both ends of the increment, in which the gap grew by
        `way` [m].
        """
        work = 0.5 * (dashpot_before + dashpot) * way
        self.damping_dissipation[s, i] = self.damping_dissipation[s, i] - work

    @ti.func
    def book_tangential(self, s, i, force_before, force, before, stretch, stiffness, slipped):
        """Add the work of friction and of the tangential dashpot over an increment.

        Arguments are the forces T [N] and elastic slips s [m] at both ends of the increment, in
        which the node `slipped` [m] along the surface.
        """
        mean_force, elastic_way = 0.5 * (force_before + force), stretch - before
        mean_dashpot = mean_force - 0.5 * stiffness * (before + stretch)
        self.friction_dissipation[s, i] = self.friction_dissipation[s, i] + mean_force.dot(slipped)
        self.damping_dissipation[s, i] = self.damping_dissipation[s, i] + mean_dashpot.dot(
            elastic_way
        )

    @ti.func
    def dissipated_energy(self, s, part):
        """Return the energy dissipated so far by friction and by damping [J]."""
        energy = ti.Vector([0.0, 0.0])
        for i in range(self.count.first(part), self.count.first(part + 1)):
            energy[0] += self.friction_dissipation[s, i]
            energy[1] += self.damping_dissipation[s, i]
        return energy
