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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import Number, index_field, real_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, Samples, Stage, Term
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.surface_contact import ALLOWED_PENETRATION, ContactData, PenaltyStiffness
from softsim.contact.wall import OffsetWall, Wall
from softsim.rigid import RigidBodies
from softsim.scene.bodies import CableSpec
from softsim.scene.loading import LoadedScene
from softsim.scene.names import MeshedBody, Names, PlacedCable, in_mm, model_vector
from softsim.structures.structure import NodalStiffness, Structure


@dataclass(frozen=True, eq=False)
class Cable(Structure):
    """Data of a cable.

    nodes (k,): numbers of its nodes in the model, in order. lengths (k - 1,) [m]: of the segments
    at rest; joint_lengths (k - 2,) [m]: tributary length of each joint. mass_per_length [kg/m],
    stretching_stiffness EA [N], bending_stiffness EI [N m^2], radius [m]. gauge: the segment whose
    tension the history records. wall_contact: of its nodes that are not held.
    """

    name: str
    nodes: np.ndarray
    lengths: np.ndarray
    joint_lengths: np.ndarray
    mass_per_length: float
    stretching_stiffness: float
    bending_stiffness: float
    gauge: int
    radius: float
    wall_contact: ContactData | None = None
    kind: ClassVar[str] = "cable"

    @property
    def title(self) -> str:
        return f"cable '{self.name}'"

    @property
    def columns(self) -> dict[str, str]:
        return {f"{self.name}_tension": "N"}

    def term(
        self, scenarios: Sequence["Cable"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "CableTerm":
        return CableTerm(nodes, self)

    @property
    def own_nodes(self) -> np.ndarray:
        return self.nodes

    def nodal_mass(self, node_count: int) -> np.ndarray:
        """Return the mass (n,) [kg] at each node: half of the segments beside it."""
        halves = 0.5 * self.mass_per_length * self.lengths
        mass = np.zeros(node_count)
        mass[self.nodes] = np.append(halves, 0.0) + np.append(0.0, halves)
        return mass

    def shape_measures(self, x: np.ndarray) -> np.ndarray:
        """Return tan^2(theta / 2) (k - 2,) of each joint: stiffness grows with 1 + 4 of it."""
        return self.folding(x)

    def lines(self, x: np.ndarray) -> dict[str, list[np.ndarray]]:
        return {"cables": [x[self.nodes]]}

    def description(self) -> dict[str, str]:
        length = float(self.lengths.sum())
        text = f"{len(self.nodes)} nodes, {length * 1e3:.4g} mm, "
        return {self.title: text + f"{self.mass_per_length * length * 1e3:.4g} g"}

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

    # Upper bound of the stiffness, the same for every component of its nodes.
    #
    # A segment under the tension T has the stiffness EA / l_0 along itself and T / l across, which
    # is less.
    #
    # A joint stores E = 2 B tan^2(theta / 2), B = EI / h. With T = tan^2(theta / 2) and psi the
    # rotations of its edges, the differences of their transverse displacements over their lengths,
    #     in the plane of the bend  B (1 + T) (1 + 3 T) (psi_2 - psi_1)^2,
    #     out of it  B (1 + T) ((1 + T) (psi_2 - psi_1)^2 - 2 T (psi_1^2 + psi_2^2)),
    # the second less than the first. The angle of an edge e has a second variation of its own, at
    # most |de|^2 / l^2, which enters with the factor E' = 2 B sqrt(T) (1 + T).

    def stiffness_bound(self, x: np.ndarray) -> list[NodalStiffness]:
        """Return the stiffness of the segments, then of the joints, with the nodes at x (n, d)."""
        of_segments = self.spring_stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])[:, :, None]
        return [
            NodalStiffness(self.title, self.segments.T, of_segments),
            NodalStiffness(self.title, self.joints.T, self.joint_bound(x)),
        ]

    def joint_bound(self, x: np.ndarray) -> np.ndarray:
        """Return the stiffness (3, 3, k - 2) [N/m] of the joints with the nodes at x (n, d) [m]."""
        _, lengths = self.tangents(x)
        T, B = self.folding(x), self.joint_stiffness
        nothing = np.zeros(len(T))
        before = np.stack([-1.0 / lengths[:-1], 1.0 / lengths[:-1], nothing])
        after = np.stack([nothing, -1.0 / lengths[1:], 1.0 / lengths[1:]])
        bend = after - before
        turning = B * (1.0 + T) * (1.0 + 3.0 * T) * squares(bend)
        return turning + 2.0 * B * np.sqrt(T) * (1.0 + T) * (squares(before) + squares(after))


def squares(b: np.ndarray) -> np.ndarray:
    """Return b b^T (a, a, m) of b (a, m)."""
    return b[:, None] * b


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

    def sampled(self) -> list[ti.Field]:
        return [self.tension_impulse]

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the mean tension of the gauge [N]."""
        return {self.column: samples.mean(samples.read(self.tension_impulse))}

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
# Cables of a scene: their nodes along a line, their contact with walls.


LEAST_SEGMENTS = 4


def placed_cables(loaded: LoadedScene, bodies: Mapping[str, MeshedBody]) -> dict[str, PlacedCable]:
    """Return the cables of a scene, in its order.

    Their nodes are numbered one cable after the other, behind those of the bodies. Raises
    SceneError for a cable without a length, or too short for its segments.
    """
    geometry = next(iter(bodies.values())).geometry
    first_node = sum(len(body.mesh.points) for body in bodies.values())
    result = {}
    for name, data in loaded.scene.cables.items():
        keys = ("cables", name)
        if geometry.name == "axisymmetric":
            raise loaded.error(
                keys, "a cable in an axisymmetric model would be a disc", "leave the cable out"
            )
        if name in bodies:
            raise loaded.error(keys, f"a body is also called '{name}'", "rename one of them")
        corners = np.array(
            [
                model_vector(loaded, geometry.dimension, point, (*keys, "points", k))
                for k, point in enumerate(data.points)
            ]
        )
        points = along(loaded, name, data, corners)
        result[name] = PlacedCable(points, first_node)
        first_node += len(points)
    return result


def along(loaded: LoadedScene, name: str, data: CableSpec, corners: np.ndarray) -> np.ndarray:
    """Return nodes (k, d) [m], evenly spaced along the line through `corners` (c, d) [m]."""
    steps = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    for k in np.flatnonzero(steps == 0.0):
        raise loaded.error(
            ("cables", name, "points", int(k) + 1),
            f"'{name}' has two successive points at {in_mm(corners[k])}",
            "leave one of them out",
        )
    stations = np.concatenate([[0.0], np.cumsum(steps)])
    count = round(stations[-1] / data.segment_length)
    if count < LEAST_SEGMENTS:
        raise loaded.error(
            ("cables", name, "segment_length"),
            f"'{name}' is {stations[-1] * 1e3:.4g} mm long and has {count} segments of "
            f"{data.segment_length * 1e3:.4g} mm",
            f"at least {LEAST_SEGMENTS} are needed: set segment_length to at most "
            f"{stations[-1] * 1e3 / LEAST_SEGMENTS:.4g} mm",
        )
    places = np.linspace(0.0, stations[-1], count + 1)
    return np.stack([np.interp(places, stations, column) for column in corners.T], axis=1)


def cable_points(names: Names) -> np.ndarray:
    """Return the nodes (n, d) [m] of all cables."""
    return np.concatenate(
        [np.zeros((0, names.dimension)), *(placed.points for placed in names.cables.values())]
    )


def cables(names: Names, points: np.ndarray, is_free: np.ndarray) -> list[Cable]:
    """Return the cables of a scene without contact; is_free (n, d): of all nodes."""
    return [cable(names, name, is_free) for name in names.cables]


def cable(names: Names, name: str, is_free: np.ndarray) -> Cable:
    """Return a cable of a scene; is_free (n, d): of all nodes."""
    placed, data = names.cables[name], names.scene.cables[name]
    moves = is_free[placed.nodes].any(axis=1)
    held = ~(moves[:-1] | moves[1:])
    return Cable(
        name=name,
        nodes=placed.nodes,
        lengths=placed.lengths,
        joint_lengths=joint_lengths(placed.lengths, held),
        mass_per_length=data.mass_per_length,
        stretching_stiffness=data.stretching_stiffness,
        bending_stiffness=data.bending_stiffness,
        gauge=int(np.argmin(held)),
        radius=0.5 * data.diameter,
    )


def touching(
    names: Names,
    structures: Sequence[Structure],
    is_free: np.ndarray,
    stiffness: PenaltyStiffness,
    walls: Sequence[Wall],
) -> tuple[Structure, ...]:
    """Return structures with the contact of cables with walls.

    Raises SceneError if a cable starts inside a wall.
    """
    return tuple(
        touching_cable(names, one, is_free, stiffness, walls) if isinstance(one, Cable) else one
        for one in structures
    )


def touching_cable(
    names: Names,
    cable: Cable,
    is_free: np.ndarray,
    stiffness: PenaltyStiffness,
    walls: Sequence[Wall],
) -> Cable:
    """Return a cable whose nodes that are not held may touch walls."""
    name, placed = cable.name, names.cables[cable.name]
    friction = names.scene.cables[name].friction_coefficient
    if friction is None:
        friction = names.scene.contact.friction_coefficient
    moves = is_free[placed.nodes].any(axis=1)
    refuse_penetration(names, name, walls, placed.points[moves])
    refuse_beyond_pipes(names, name, walls, placed.points)
    return replace(cable, wall_contact=stiffness.contact(placed.nodes[moves], friction))


def joint_lengths(lengths: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Return the length (k - 2,) [m] that each joint represents: half of the segments beside it.

    A segment whose two ends are held does not bend and does not count, unless both segments are
    held.
    """
    bending = np.where(held, 0.0, lengths)
    either = np.where(held[:-1] & held[1:], lengths[:-1] + lengths[1:], bending[:-1] + bending[1:])
    return np.asarray(0.5 * either)


def refuse_penetration(names: Names, name: str, walls: Sequence[Wall], places: np.ndarray) -> None:
    """Raise SceneError if a node that may touch a wall, at places (k, d) [m], starts inside it."""
    for wall in walls:
        radius = 0.5 * names.scene.cables[name].diameter
        for surface, gap in OffsetWall(wall, radius).gaps(places).items():
            if gap.min() < -ALLOWED_PENETRATION:
                raise names.loaded.error(
                    ("cables", name, "points"),
                    f"'{name}' starts {-gap.min() * 1e3:.3g} mm inside the wall '{surface}' at "
                    f"{in_mm(places[gap.argmin()])}, with its radius of {radius * 1e3:.3g} mm",
                    "lay it along the free side of the wall",
                )


def refuse_beyond_pipes(names: Names, name: str, walls: Sequence[Wall], places: np.ndarray) -> None:
    """Raise SceneError if a cable with nodes at places (k, d) [m] lies only partly in a pipe.

    It would hang down over the rim at the start of the pipe.
    """
    for wall in walls:
        if not isinstance(wall, PipeNetwork):
            continue
        before = wall.locate(places)[1] < 0.0
        if before.any() and not before.all():
            longest = float(np.linalg.norm(np.diff(places[~before], axis=0), axis=1).sum())
            raise names.loaded.error(
                ("cables", name, "points"),
                f"{int(before.sum())} of the {len(places)} nodes of '{name}' lie outside the pipe "
                f"'{wall.name}', before its start",
                f"make it {longest * 1e3:.3g} mm long, or make the pipe longer at its start",
            )
