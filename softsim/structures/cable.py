"""Cables: with bending stiffness, discretised by nodes on a line; or pulled through eyelets."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import Number, index_field, once, real_field, vector_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, PerScenario, Samples, Stage, Term, WorkingTerm
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.surface_contact import ALLOWED_PENETRATION, ContactData, PenaltyStiffness
from softsim.contact.wall import OffsetWall, Wall
from softsim.loads.load import Load, LoadTargets, over_time
from softsim.loads.profile import Profile, ProfileTable, over_the_run
from softsim.rigid import RigidBodies
from softsim.scene.bodies import CableSpec
from softsim.scene.loading import LoadedScene
from softsim.scene.loads import PulledCableSpec
from softsim.scene.names import MeshedBody, Names, PlacedCable, in_mm, model_vector
from softsim.scene.text import Keys
from softsim.structures.fibre import in_bodies, refuse_all_around
from softsim.structures.structure import NodalStiffness, Structure

# -------------------------------------------------------------------------------------------------
# Cable with stretching and bending stiffness, in 2D or 3D, by nodes on a line.
#
# Each segment between two nodes is a spring, each joint between two segments an angle spring; with
# the lengths l of the segments and the angle theta between the tangents t1, t2 at a joint,
#     E = sum EA / (2 l_0) (l - l_0)^2 + sum EI / (2 h) K^2,    K = 2 tan(theta / 2).
# K is the curvature integrated over the tributary length h of a joint, half of both its segments
# (Bergou, Wardetzky, Robinson, Audoly, Grinspun, Discrete Elastic Rods, 2008, sec. 4.2): infinite
# where the cable is folded up. Forces are the exact derivatives; with c = t1 . t2
#     K^2 = 4 (1 - c) / (1 + c) = 4 |t2 - t1|^2 / |t1 + t2|^2,    d(K^2)/dc = -8 / (1 + c)^2,
#     dc/dx at the far ends: -(t2 - c t1) / l1 and (t1 - c t2) / l2.
# At rest it is straight. It has no torsional stiffness: a round, straight cable that is free to
# roll is not twisted.


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


# -------------------------------------------------------------------------------------------------
# Cables that run through eyelets in bodies and are pulled: tendon-driven fingers, grippers.
#
# The cable has no mass and slides through its eyelets without friction, so its tension T is
# constant along its length. An eyelet lies in an element and follows its corners with the shape
# functions N_aj,
#
#     x_a = sum_j N_aj x_j,
#
# or is fixed in space. With the length L = sum_a |x_(a+1) - x_a| and the unit vectors t_a from one
# eyelet to the next, the force on each eyelet is
#
#     f_a = T (t_a - t_(a-1)) = -T dL/dx_a,    f_j = sum_a N_aj f_a,
#
# which preserves force and moment (as in SOFA's CableConstraint). A winch draws in the length p,
# against which the cable stretches by e, or applies a tension S that does not depend on the length:
#
#     T = k e + S,    e = max(0, L - L_0 + p).
#
# The energy k e^2 / 2 is stored (ALLSE), the winch's work is int k e dp - int S dL. A cable never
# pushes.


@dataclass(frozen=True, eq=False)
class PulledCable(Load, Structure):
    """Cable through k eyelets: a structure that a winch loads.

    corners (k, c): corners of the element around each eyelet, numbered in the model. weights (k,
    c): shape functions there; zero for an eyelet that is fixed in space, whose position is its row
    of anchors (k, d) [m], which is zero for the others. rest_length: L_0 [m]. stiffness: k [N/m].
    pull: p [m over s], tension: S [N over s]; one of the two is zero.
    """

    name: str
    corners: np.ndarray
    weights: np.ndarray
    anchors: PerScenario[np.ndarray]
    rest_length: PerScenario[float]
    stiffness: PerScenario[float]
    pull: PerScenario[Profile]
    tension: PerScenario[Profile]
    kind: ClassVar[str] = "pulled cable"

    @property
    def title(self) -> str:
        return f"cable '{self.name}'"

    @property
    def columns(self) -> dict[str, str]:
        return {f"{self.name}_tension": "N", f"{self.name}_drawn_in": "m"}

    def term(
        self, scenarios: Sequence["PulledCable"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "PulledCableTerm":
        return PulledCableTerm(nodes, scenarios)

    @property
    def largest_force(self) -> float:
        """Largest prescribed tension [N]."""
        return float(self.tension.values.max())

    def time_scaled(self, factor: float) -> "PulledCable":
        pull, tension = (course.time_scaled(factor) for course in (self.pull, self.tension))
        return replace(self, pull=pull, tension=tension)

    def largest_tension(self, length: float) -> float:
        """Return the largest tension T [N] at any time for this length [m]."""
        elongation = max(0.0, length - self.rest_length + float(self.pull.values.max()))
        return self.stiffness * elongation + float(self.tension.values.max())

    def places(self, x: np.ndarray) -> np.ndarray:
        """Return the positions of the eyelets (k, d) [m] with all nodes at x (n, d) [m]."""
        return self.anchors + np.einsum("kc,kcd->kd", self.weights, x[self.corners])

    def lines(self, x: np.ndarray) -> dict[str, list[np.ndarray]]:
        return {"fibres": [self.places(x)]}

    def stiffness_bound(self, x: np.ndarray) -> list[NodalStiffness]:
        """Return the transverse stiffness of the pieces between eyelets, with the nodes at x.

        A piece of the length l has at most T / l B B^T, where B are the weights of its nodes in
        x_b - x_a and T is the largest tension that the winch ever produces at this length.
        """
        lengths = np.linalg.norm(np.diff(self.places(x), axis=0), axis=1)
        across = self.largest_tension(float(lengths.sum())) / lengths
        pieces = np.concatenate([self.corners[:-1], self.corners[1:]], axis=1).T
        B = np.concatenate([-self.weights[:-1], self.weights[1:]], axis=1).T
        return [NodalStiffness(self.title, pieces, across * B[:, None] * B)]

    def stiffness_roots(self, x: np.ndarray) -> list[np.ndarray]:
        """Return sqrt(k) dL/dx (n, d) [(N/m)^1/2]: a slack cable counts as taut."""
        return [np.sqrt(self.stiffness) * self.length_gradient(x)]

    def length_gradient(self, x: np.ndarray) -> np.ndarray:
        """Return dL/dx (n, d) [-]."""
        ways = np.diff(self.places(x), axis=0)
        t = ways / np.linalg.norm(ways, axis=1)[:, None]
        nothing = np.zeros((1, t.shape[1]))
        of_eyelets = np.concatenate([nothing, t]) - np.concatenate([t, nothing])
        gradient = np.zeros_like(x)
        np.add.at(gradient, self.corners, self.weights[:, :, None] * of_eyelets[:, None])
        return gradient


class PulledCableTerm(WorkingTerm):
    """Kernel class of a cable in its eyelets.

    Fields (scenarios,) of the last increment: elongation e [m]; drawn_in, L_0 + e - L [m], by which
    the unstretched length between the ends has decreased; held, the tension S [N]; impulse [N s] of
    T since last cleared.
    """

    def __init__(self, nodes: Nodes, cables: Sequence[PulledCable]) -> None:
        super().__init__(nodes.scenarios, 1)
        first = cables[0]
        self.nodes, self.columns = nodes, list(first.columns)
        self.eyelets, self.corner_count = Number(len(first.corners)), first.corners.shape[1]
        self.node, self.weight = index_field(first.corners), real_field(first.weights)
        self.anchor = vector_field(np.stack([cable.anchors for cable in cables]))
        self.rest_length = real_field(np.array([cable.rest_length for cable in cables]))
        self.stiffness = real_field(np.array([cable.stiffness for cable in cables]))
        self.pull_course = ProfileTable([cable.pull for cable in cables])
        self.tension_course = ProfileTable([cable.tension for cable in cables])
        self.first_slot = nodes.corner_forces.reserve(first.corners)
        nothing = np.zeros(nodes.scenarios)
        self.elongation, self.drawn_in, self.held, self.impulse = (
            real_field(nothing) for _ in range(4)
        )

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.MOVE: [Pass("cables", 1, (self.pull,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        names = ("elongation", "drawn_in", "held", "impulse")
        return super().state_fields() | {name: getattr(self, name) for name in names}

    def impulses(self) -> list[ti.Field]:
        return [self.impulse]

    def sampled(self) -> list[ti.Field]:
        return [self.impulse, self.drawn_in]

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the mean tension [N] and the present drawn-in length [m]."""
        tension = samples.mean(samples.read(self.impulse))
        return dict(zip(self.columns, (tension, samples.read(self.drawn_in)), strict=True))

    @ti.func
    def place(self, s, a):
        """Return the position of eyelet a (d) [m]."""
        place = self.anchor[s, a]
        for c in range(self.corner_count):
            place += self.weight[a, c] * self.nodes.position[s, self.node[a, c]]
        return place

    @ti.func
    def pull(self, s, i, t, dt):
        """Write the forces of the cable on the nodes of its eyelets."""
        longer = -self.rest_length[s]  # L - L_0
        for a in range(self.eyelets.read() - 1):
            longer += (self.place(s, a + 1) - self.place(s, a)).norm()
        stretched = ti.cast(0.0, backend.real)
        if self.stiffness[s] > 0.0:  # a winch that keeps a tension lets nothing stretch
            stretched = ti.max(stretched, longer + self.pull_course.at(s, t))
        held = self.tension_course.at(s, t)
        self._book(s, stretched, stretched - longer, held)
        tension = self.stiffness[s] * stretched + held
        self.impulse[s] = self.impulse[s] + tension * dt
        behind = ti.Vector.zero(backend.real, self.nodes.dimension)  # t_(a-1)
        for a in range(self.eyelets.read()):
            ahead = ti.Vector.zero(backend.real, self.nodes.dimension)
            if a < self.eyelets.read() - 1:
                ahead = (self.place(s, a + 1) - self.place(s, a)).normalized()
            force = tension * (ahead - behind)
            for c in range(self.corner_count):
                slot = self.first_slot + self.corner_count * a + c
                self.nodes.corner_forces.write(s, slot, self.weight[a, c] * force)
            behind = ahead

    @ti.func
    def _book(self, s, stretched, drawn_in, held):
        """Add the work of the winch by the trapezoidal rule, consistent with central differences.

        For the spring k e it is k e dp = k e d(drawn in): where these differ, the cable is slack.
        """
        spring = 0.5 * self.stiffness[s] * (self.elongation[s] + stretched)
        way = drawn_in - self.drawn_in[s]
        shortened = way - (stretched - self.elongation[s])  # -dL
        self.work[s, 0] = self.work[s, 0] + spring * way + 0.5 * (self.held[s] + held) * shortened
        self.elongation[s], self.drawn_in[s], self.held[s] = stretched, drawn_in, held

    @ti.func
    def stored_energy(self, s, part):
        """Return k e^2 / 2 [J]."""
        return once(part) * 0.5 * self.stiffness[s] * self.elongation[s] * self.elongation[s]


# -------------------------------------------------------------------------------------------------
# Pulled cables of a scene.


# Of a cable's length: eyelets that are no farther from each other are at one place.
SAME_PLACE = 1e-6


def pulled_cable(loaded: LoadTargets, load: PulledCableSpec, keys: Keys) -> PulledCable:
    """Return a cable through eyelets."""
    names = loaded.names
    refuse_all_around(names, "a cable", keys)
    places = np.array(
        [names.vector(place, (*keys, "eyelets", k)) for k, place in enumerate(load.eyelets)]
    )
    corners, weights = in_bodies(names, places, load.tolerance, (*keys, "eyelets"))
    anchors = np.zeros_like(places)
    if load.pulled_from is not None:
        anchor = names.vector(load.pulled_from, (*keys, "pulled_from"))
        corners, weights = (np.pad(rows, ((1, 0), (0, 0))) for rows in (corners, weights))
        anchors = np.concatenate([anchor[None], anchors])
    pull, tension = driven(loaded, load, keys)
    cable = PulledCable(
        name=str(keys[-1]), corners=corners, weights=weights, anchors=anchors, rest_length=0.0,
        stiffness=load.stiffness or 0.0, pull=pull, tension=tension,
    )  # fmt: skip
    held = cable.places(loaded.points)
    pieces = np.linalg.norm(np.diff(held, axis=0), axis=1)
    shortest = int(np.argmin(pieces))
    if pieces[shortest] <= SAME_PLACE * pieces.sum():
        at_anchor = load.pulled_from is not None and shortest == 0
        raise names.loaded.error(
            (*keys, "pulled_from" if at_anchor else "eyelets"),
            f"two successive points of '{keys[-1]}' are at the same place, {in_mm(held[shortest])}",
            "leave one of them out",
        )
    return replace(cable, rest_length=float(pieces.sum()))


def driven(loaded: LoadTargets, load: PulledCableSpec, keys: Keys) -> tuple[Profile, Profile]:
    """Return the drawn-in length [m] of a cable and its tension [N] over time [s] of the whole run.

    The one that the scene does not give is zero.
    """
    names = loaded.names
    key, given = "profile", None
    for name, values in (
        ("pull_profile", load.pull_profile), ("tension_profile", load.tension_profile)
    ):  # fmt: skip
        if values is not None:
            key, given = name, over_the_run(names, values, keys)
    course = over_time(loaded, load, keys) if given is None else given
    if (course.values < 0.0).any():
        raise names.loaded.error(
            (*keys, key),
            f"falls to {course.values.min():.4g}: a cable can only pull",
            "use values of at least 0",
        )
    pull = 1.0 if key == "pull_profile" else load.pull or 0.0
    tension = 1.0 if key == "tension_profile" else load.tension or 0.0
    return course.times_factor(pull), course.times_factor(tension)
