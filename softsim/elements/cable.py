"""Cable with stretching and bending stiffness, discretised by nodes on a line, in 2D or 3D.

Each segment between two nodes is a spring, each joint between two segments an angle spring; with
the lengths l of the segments and the angle theta between the tangents t1, t2 at a joint,
    E = sum EA / (2 l_0) (l - l_0)^2 + sum EI / (2 h) K^2,    K = 2 tan(theta / 2).
K is the curvature integrated over the tributary length h of a joint, half of both its segments
(Bergou, Wardetzky, Robinson, Audoly, Grinspun, Discrete Elastic Rods, 2008, sec. 4.2): infinite
where the cable is folded up. Forces are the exact derivatives; with c = t1 . t2
    K^2 = 4 (1 - c) / (1 + c) = 4 |t2 - t1|^2 / |t1 + t2|^2,    d(K^2)/dc = -8 / (1 + c)^2,
    dc/dx at the far ends: -(t2 - c t1) / l1 and (t1 - c t2) / l2.
At rest it is straight. It has no torsional stiffness: a round, straight cable that is free to roll
is not twisted.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import Number, index_field, real_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, Stage, Term


@dataclass(frozen=True)
class Cable:
    """Data of a cable.

    nodes (k,): numbers of its nodes in the model, in order. lengths (k - 1,) [m]: of the segments
    at rest; joint_lengths (k - 2,) [m]: tributary length of each joint. stretching_stiffness EA
    [N], bending_stiffness EI [N m^2]. gauge: the segment whose tension the history records.
    """

    name: str
    nodes: np.ndarray
    lengths: np.ndarray
    joint_lengths: np.ndarray
    stretching_stiffness: float
    bending_stiffness: float
    gauge: int

    @property
    def columns(self) -> dict[str, str]:
        """Columns that its term adds to the history -> unit."""
        return {f"{self.name}_tension": "N"}

    @property
    def segments(self) -> np.ndarray:
        """Nodes of each segment (k - 1, 2)."""
        return np.stack([self.nodes[:-1], self.nodes[1:]], axis=1)

    @property
    def joints(self) -> np.ndarray:
        """Nodes of each joint (k - 2, 3): its own node between the two neighbours."""
        return np.stack([self.nodes[:-2], self.nodes[1:-1], self.nodes[2:]], axis=1)

    @property
    def spring_stiffness(self) -> np.ndarray:
        """EA / l_0 (k - 1,) [N/m]."""
        return self.stretching_stiffness / self.lengths

    @property
    def joint_stiffness(self) -> np.ndarray:
        """EI / h (k - 2,) [N m]."""
        return self.bending_stiffness / self.joint_lengths

    def tangents(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the unit tangents (k - 1, d) and lengths (k - 1,) [m] of the segments.

        x (n, d) [m]: positions of the model's nodes.
        """
        edges = np.diff(x[self.nodes], axis=0)
        lengths = np.linalg.norm(edges, axis=1)
        return edges / lengths[:, None], lengths

    def folding(self, x: np.ndarray) -> np.ndarray:
        """Return tan^2(theta / 2) (k - 2,) of each joint with the model's nodes at x (n, d) [m]."""
        t, _ = self.tangents(x)
        apart, along = t[1:] - t[:-1], t[1:] + t[:-1]
        return np.asarray((apart**2).sum(axis=1) / (along**2).sum(axis=1))


class CableTerm(Term):
    """Force term of a cable. tension_impulse (scenarios,) [N s]: of its gauge since last reset."""

    def __init__(self, nodes: Nodes, cable: Cable) -> None:
        self.nodes, self.column = nodes, next(iter(cable.columns))
        self.segments, self.joints = Number(len(cable.segments)), Number(len(cable.joints))
        self.gauge = Number(cable.gauge)
        self.segment, self.joint = index_field(cable.segments), index_field(cable.joints)
        self.length = real_field(cable.lengths)
        self.spring_stiffness = real_field(cable.spring_stiffness)
        self.joint_stiffness = real_field(cable.joint_stiffness)
        self.first_pull = nodes.corner_forces.reserve(cable.segments)
        self.first_bend = nodes.corner_forces.reserve(cable.joints)
        self.tension_impulse = real_field(np.zeros(nodes.scenarios))

    def passes(self) -> dict[Stage, list[Pass]]:
        return {
            Stage.MOVE: [
                Pass("cables", int(self.segments), (self.stretch,)),
                Pass("cables", int(self.joints), (self.bend,)),
            ]
        }

    def state_fields(self) -> dict[str, ti.Field]:
        return {"tension_impulse": self.tension_impulse}

    def impulses(self) -> list[ti.Field]:
        return [self.tension_impulse]

    def readings(self, scenario: int, interval: float) -> dict[str, float]:
        """Return the mean tension of the gauge [N]."""
        impulse = float(fields.read_row(self.tension_impulse, scenario))
        return {self.column: impulse / interval if interval > 0.0 else 0.0}

    @ti.func
    def edge(self, s, a, b):
        """Return the unit vector from node a to node b, and the distance [m]."""
        way = self.nodes.position[s, b] - self.nodes.position[s, a]
        length = way.norm()
        return way / length, length

    @ti.func
    def stretch(self, s, i, t, dt):
        """Write the forces of segment i on its nodes."""
        tangent, length = self.edge(s, self.segment[i, 0], self.segment[i, 1])
        tension = self.spring_stiffness[i] * (length - self.length[i])
        self.nodes.corner_forces.write(s, self.first_pull + 2 * i, tension * tangent)
        self.nodes.corner_forces.write(s, self.first_pull + 2 * i + 1, -tension * tangent)
        if i == self.gauge.read():
            self.tension_impulse[s] = self.tension_impulse[s] + tension * dt

    @ti.func
    def bend(self, s, j, t, dt):
        """Write the forces of joint j on its nodes."""
        t1, l1 = self.edge(s, self.joint[j, 0], self.joint[j, 1])
        t2, l2 = self.edge(s, self.joint[j, 1], self.joint[j, 2])
        c = t1.dot(t2)
        slope = 4.0 * self.joint_stiffness[j] / ((1.0 + c) * (1.0 + c))  # -dE/dc
        before, after = -slope / l1 * (t2 - c * t1), slope / l2 * (t1 - c * t2)
        self.nodes.corner_forces.write(s, self.first_bend + 3 * j, before)
        self.nodes.corner_forces.write(s, self.first_bend + 3 * j + 1, -before - after)
        self.nodes.corner_forces.write(s, self.first_bend + 3 * j + 2, after)

    @ti.func
    def stored_energy(self, s, part):
        """Return the energy of stretching and bending [J]."""
        energy = ti.cast(0.0, backend.real)
        for i in range(self.segments.first(part), self.segments.first(part + 1)):
            _, length = self.edge(s, self.segment[i, 0], self.segment[i, 1])
            stretch = length - self.length[i]
            energy += 0.5 * self.spring_stiffness[i] * stretch * stretch
        for j in range(self.joints.first(part), self.joints.first(part + 1)):
            t1, _ = self.edge(s, self.joint[j, 0], self.joint[j, 1])
            t2, _ = self.edge(s, self.joint[j, 1], self.joint[j, 2])
            folding = (t2 - t1).norm_sqr() / (t1 + t2).norm_sqr()
            energy += 2.0 * self.joint_stiffness[j] * folding
        return energy


# -------------------------------------------------------------------------------------------------
# Upper bound of the stiffness of a cable, the same for every component of its nodes.
#
# A segment under the tension T has the stiffness EA / l_0 along itself and T / l across, which is
# less.
#
# A joint stores E = 2 B tan^2(theta / 2), B = EI / h (elements/cable.py). With T = tan^2(theta / 2)
# and psi the rotations of its edges, the differences of their transverse displacements over their
# lengths,
#     in the plane of the bend  B (1 + T) (1 + 3 T) (psi_2 - psi_1)^2,
#     out of it  B (1 + T) ((1 + T) (psi_2 - psi_1)^2 - 2 T (psi_1^2 + psi_2^2)),
# the second less than the first. The angle of an edge e has a second variation of its own, at most
# |de|^2 / l^2, which enters with the factor E' = 2 B sqrt(T) (1 + T).


class CableStiffness:
    """Stiffness of a cable in any configuration.

    stencils: nodes (a, m) of its segments, then of its joints.
    """

    def __init__(self, cable: Cable) -> None:
        self.cable, self.name = cable, f"cable '{cable.name}'"
        self.stencils = [cable.segments.T, cable.joints.T]

    def at(self, x: np.ndarray) -> list[np.ndarray]:
        """Return the stiffness (a, a, m) [N/m] of each stencil with the nodes at x (n, d) [m]."""
        return [self.of_segments(), self.of_joints(x)]

    def of_segments(self) -> np.ndarray:
        """Return the stiffness (2, 2, k - 1) [N/m] of the segments."""
        return self.cable.spring_stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])[:, :, None]

    def of_joints(self, x: np.ndarray) -> np.ndarray:
        """Return the stiffness (3, 3, k - 2) [N/m] of the joints with the nodes at x (n, d) [m]."""
        _, lengths = self.cable.tangents(x)
        T, B = self.cable.folding(x), self.cable.joint_stiffness
        nothing = np.zeros(len(T))
        before = np.stack([-1.0 / lengths[:-1], 1.0 / lengths[:-1], nothing])
        after = np.stack([nothing, -1.0 / lengths[1:], 1.0 / lengths[1:]])
        bend = after - before
        turning = B * (1.0 + T) * (1.0 + 3.0 * T) * squares(bend)
        return turning + 2.0 * B * np.sqrt(T) * (1.0 + T) * (squares(before) + squares(after))


def squares(b: np.ndarray) -> np.ndarray:
    """Return b b^T (a, a, m) of b (a, m)."""
    return b[:, None] * b
