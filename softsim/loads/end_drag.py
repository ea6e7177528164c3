"""Drag of the part of a cable beyond its simulated end, along the direction of the cable.

Friction is that of loads/sliding.py along the direction of the last segment; across it the end is
free. The spring's energy is stored (ALLSE), sliding is dissipated by friction (ALLFD). The drag
does not depend on time: it acts before t = 0 as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim import fields
from softsim.fields import Number, once, real_field, vector_field
from softsim.loads.load import Load
from softsim.loads.sliding import dissipated, longest_stretch, stretched
from softsim.nodes import Nodes
from softsim.rigid.frame import RigidBodies
from softsim.sharing import Own
from softsim.term import Pass, Stage, Term


@dataclass(frozen=True, eq=False)
class EndDrag(Load):
    """Spring of `stiffness` [N/m] at node `end` that slides at the force `drag` [N].

    It acts along the line from node `before` to node `end`. place (d,) [m]: position of the end;
    axis (d,): unit vector along the line, both at rest.
    """

    before: int
    end: int
    place: np.ndarray
    axis: np.ndarray
    stiffness: Own[float]
    drag: Own[float]

    @property
    def largest_force(self) -> float:
        return self.drag

    def term(
        self, alike: Sequence["EndDrag"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "EndDragTerm":
        return EndDragTerm(nodes, alike)


class EndDragTerm(Term):
    """Kernel class of the drag on the end of a cable.

    Fields (scenarios,) at the end of the last increment: place (d) [m] of the node, axis (d),
    stretch [m]; dissipation [J] since the start.
    """

    def __init__(self, nodes: Nodes, drags: Sequence[EndDrag]) -> None:
        self.nodes = nodes
        self.before, self.end = Number(drags[0].before), Number(drags[0].end)
        self.slot = nodes.corner_forces.reserve(np.array([drags[0].end]))
        stiffness = np.array([drag.stiffness for drag in drags])
        self.stiffness = real_field(stiffness)
        self.longest = real_field(
            longest_stretch(stiffness, np.array([drag.drag for drag in drags]))
        )
        self.place = vector_field(np.stack([drag.place for drag in drags]))
        self.axis = vector_field(np.stack([drag.axis for drag in drags]))
        self.stretch, self.dissipation = (real_field(np.zeros(len(drags))) for _ in range(2))

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.MOVE: [Pass("cables", 1, (self.pull,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        names = ("place", "axis", "stretch", "dissipation")
        return {name: getattr(self, name) for name in names}

    def forget_dissipation(self, scenario: int) -> None:
        fields.write_row(self.dissipation, scenario, 0.0)

    @ti.func
    def pull(self, s, i, t, dt):
        """Update the stretch for the motion of the end and apply the drag to it."""
        k, before, axis_before = self.stiffness[s], self.stretch[s], self.axis[s]
        now = self.nodes.position[s, self.end.read()]
        along = now - self.nodes.position[s, self.before.read()]
        axis, way = along / along.norm(), now - self.place[s]
        after = stretched(before, axis_before, axis, way, self.longest[s])
        self.dissipation[s] = self.dissipation[s] + dissipated(
            k, before, after, axis_before, axis, way
        )
        self.place[s], self.axis[s], self.stretch[s] = now, axis, after
        self.nodes.corner_forces.write(s, self.slot, -k * after * axis)

    @ti.func
    def stored_energy(self, s, part):
        """Return k s^2 / 2 [J]."""
        return once(part) * 0.5 * self.stiffness[s] * self.stretch[s] * self.stretch[s]

    @ti.func
    def dissipated_energy(self, s, part):
        """Return the energy [J] dissipated so far by friction, and 0 for viscosity and damping."""
        return once(part) * ti.Vector([self.dissipation[s], 0.0])
