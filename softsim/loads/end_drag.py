"""What goes on beyond the end of a cable, and is not simulated: it drags along the cable.

Friction is that of loads/sliding.py, the line being the last segment's direction; across it the end
is free. The spring's energy is stored (ALLSE), sliding is dissipated by friction (ALLFD). Nothing
depends on time: before t = 0 it acts as after.
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
    """A spring of `stiffness` [N/m] at node `end` slides at `drag` [N] along the way to it from the
    node `before`. place, axis: (d,), of the end and of that way at rest [m, -].
    """

    before: int
    end: int
    place: np.ndarray
    axis: np.ndarray
    stiffness: Own[float]
    drag: Own[float]

    @property
    def largest_force(self) -> float:
        """Its drag [N]."""
        return self.drag

    def term(
        self, alike: Sequence["EndDrag"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "EndDragTerm":
        """The drag on the node."""
        return EndDragTerm(nodes, alike)


class EndDragTerm(Term):
    """Fields, (scenarios,), of the last increment's end: place (d) [m] of the node, axis (d),
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
        """Of an increment."""
        return {Stage.MOVE: [Pass("cables", 1, (self.pull,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        names = ("place", "axis", "stretch", "dissipation")
        return {name: getattr(self, name) for name in names}

    def forget_dissipation(self, scenario: int) -> None:
        """Begin the books anew in a scenario."""
        fields.write_row(self.dissipation, scenario, 0.0)

    @ti.func
    def pull(self, s, i, t, dt):
        """Follow the end to where it is now, and hold it there."""
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
        """k s^2 / 2 [J]."""
        return once(part) * 0.5 * self.stiffness[s] * self.stretch[s] * self.stretch[s]

    @ti.func
    def dissipated_energy(self, s, part):
        """Dissipated so far by friction, and nothing else [J]."""
        return once(part) * ti.Vector([self.dissipation[s], 0.0])
