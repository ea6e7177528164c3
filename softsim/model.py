"""The frozen model: connectivity, masses, parameters, all in numpy; names have become numbers.

A `Model` is one scenario. Several scenarios of one mesh (other pressure, frequency, friction,
pipe) run side by side in one solver.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from softsim import backend
from softsim.contact.cylinder import Cylinder
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.sphere import Sphere
from softsim.contact.wall import Wall
from softsim.elements.axisymmetric import Axisymmetric
from softsim.elements.cable import Cable
from softsim.elements.fibre import Fibre
from softsim.elements.geometry import Geometry, nodal_sums
from softsim.elements.layer import Layer
from softsim.elements.region import Region
from softsim.elements.ties import Ties
from softsim.loads.load import Load, of_kind
from softsim.loads.pressure import FollowerPressure
from softsim.mass_scaling import MassScaling
from softsim.mesh.mesh import facet_owners
from softsim.rigid.body import RigidBodyData
from softsim.sharing import Own, alike

L = TypeVar("L", bound=Load)


@dataclass(frozen=True)
class Body:
    """A meshed body. points (n, d) [m]; cells (m, corners) numbered within the body, each of which
    is in one of its regions; all bodies' are written with as many corners.

    node_sets, facet_sets: numbered within the model (within the body plus first_node). cell_sets:
    numbers of cells within the body.
    remarks: texts that say what reading its mesh changed. not_read: what its mesh file says besides
    the mesh, such as "*MATERIAL rubber".
    """

    name: str
    first_node: int
    points: np.ndarray
    cells: np.ndarray
    regions: tuple[Region, ...]
    node_sets: Own[dict[str, np.ndarray]]
    facet_sets: Own[dict[str, np.ndarray]]
    cell_sets: Own[dict[str, np.ndarray]]
    remarks: Own[tuple[str, ...]]
    not_read: Own[tuple[str, ...]]

    @property
    def nodes(self) -> slice:
        """Its nodes among those of the model."""
        return slice(self.first_node, self.first_node + len(self.points))

    @property
    def mass(self) -> float:
        """Of its elements [kg]."""
        return sum(float(r.volumes.sum()) * r.material.density for r in self.regions)

    def nodal_mean(self, of_regions: Iterable[np.ndarray]) -> np.ndarray:
        """Mean by volume (n,), where regions meet, of values (n,) of each region's nodes."""
        volumes = [r.nodal_volumes for r in self.regions]
        whole, mean = sum(volumes), np.zeros(len(self.points))
        for values, volume in zip(of_regions, volumes, strict=True):
            mean += np.where(volume > 0.0, values * (volume / whole), 0.0)
        return mean

    @property
    def surface_areas(self) -> np.ndarray:
        """Area of its surface at rest (n,) [m^2] that each node stands for."""
        facets = self.facet_sets["surface"] - self.first_node
        owners, areas = facet_owners(facets, self.cells), np.zeros(len(self.points))
        for region in self.regions:
            own = facets[np.isin(owners, region.numbers)]
            shares = region.geometry.corner_areas(self.points, own)
            areas += nodal_sums(own, shares, len(self.points))
        return areas

    def joined(self, of_regions: Iterable[np.ndarray]) -> np.ndarray:
        """Values (m, ...) of all cells, in their order, from those of each region."""
        numbers = np.concatenate([r.numbers for r in self.regions])
        return np.concatenate(list(of_regions))[np.argsort(numbers)]


@dataclass(frozen=True)
class ContactData:
    """Nodes (k,) that may touch, and per node k_n, k_t [N/m], the dashpots c_n, c_t [N s/m] and the
    mass that it has to move [kg].
    """

    nodes: np.ndarray
    penalty_stiffness: np.ndarray
    tangential_stiffness: np.ndarray
    damping: np.ndarray
    tangential_damping: np.ndarray
    effective_mass: Own[np.ndarray]
    friction_coefficient: Own[float]


@dataclass(frozen=True)
class CableData:
    """A cable of a radius [m], and the contact of its nodes that are not held."""

    cable: Cable
    radius: float
    contact: ContactData


@dataclass(frozen=True)
class SelfContactData:
    """Surfaces of deformable bodies that may touch themselves and each other.

    nodes: their vertices (k,). facets (f, d), numbered as nodes. Points are the vertices, then the
    facets' centroids (k + f,): point_size at rest [m], point_part the connected part of the bodies
    that each belongs to, point_areas the area [m^2] that it stands for, penalty_stiffness k_n
    [N/m], damping_time c_n / k_n [s]. facet_areas (f,) [m^2]; facet_stiffness: contact stiffness
    per area (f,) [Pa/m]. tangential_ratio: k_t / k_n; tangential_damping_fraction: c_t / c_n.
    point_group (k + f,): number of the group of each point; may_touch (groups, groups): True for
    groups in contact with each other, friction_coefficient (groups, groups) between them.
    """

    nodes: np.ndarray
    facets: np.ndarray
    point_size: np.ndarray
    point_part: np.ndarray
    point_areas: np.ndarray
    facet_areas: np.ndarray
    facet_stiffness: np.ndarray
    penalty_stiffness: np.ndarray
    damping_time: np.ndarray
    tangential_ratio: float
    tangential_damping_fraction: float
    point_group: np.ndarray
    may_touch: np.ndarray
    friction_coefficient: Own[np.ndarray]

    @property
    def facet_size(self) -> np.ndarray:
        """Size of each facet at rest (f,) [m]."""
        return self.point_size[len(self.nodes) :]

    @property
    def facet_part(self) -> np.ndarray:
        """Connected part of the bodies (f,) that each facet belongs to."""
        return self.point_part[len(self.nodes) :]

    def summed_at_nodes(self, of_points: np.ndarray) -> np.ndarray:
        """Return the sum (k,) over each vertex and its part of the centroids around it of values of
        all points (k + f,).
        """
        d = self.facets.shape[1]
        own, centroids = np.split(of_points, [len(self.nodes)])
        number = np.searchsorted(self.nodes, self.facets)
        return own + np.bincount(number.ravel(), np.repeat(centroids / d, d), len(self.nodes))


@dataclass(frozen=True)
class CornerData:
    """Convex corners of walls in the plane against facets (f, 2), numbered as nodes, of these
    lengths at rest (f,) [m]. Of each corner k_n, k_t [N/m] and the dashpots c_n, c_t [N s/m].
    together: upper bound of the weights that a node of the facets carries of corners on them.
    """

    facets: np.ndarray
    facet_size: np.ndarray
    penalty_stiffness: float
    tangential_stiffness: float
    damping: float
    tangential_damping: float
    together: float


@dataclass(frozen=True)
class OutlineData:
    """Shape of rigid body number `body`, where it is at rest.

    `support`: nodes that may lie against it from outside, or None.
    """

    body: int
    shape: Sphere | Cylinder
    support: ContactData | None


@dataclass(frozen=True)
class Probe:
    """A quantity that the history records: `kind` names it, of `members`: nodes (k,) or, for an
    enclosed volume, facets (k, corners).
    """

    name: str
    kind: str
    members: np.ndarray
    geometry: Geometry


@dataclass(frozen=True, eq=False)
class Passage:
    """The way of rigid body number `body` along pipes, and when there is nothing more to wait for.

    items: what the user's lists of the pipes say, an entry a text. length: of the body along the
    pipe [m]. outline: its nodes that touch walls (k,). start: arc length of its centre at rest;
    goals: where it has passed, by the branch of the network, infinite of one without an exit [m].
    It has stopped when it gains less than `least_progress` [m]
    within `patience` pressure cycles, or `patience_time` [s] where it is not `in_cycles`.
    """

    network: PipeNetwork
    items: tuple[str, ...]
    body: int
    length: float
    outline: np.ndarray
    start: float
    goals: tuple[float, ...]
    in_cycles: bool
    patience: int
    patience_time: float
    least_progress: float

    def goal_beyond(self, branch: int) -> float:
        """The goal of a branch [m]; where it has no exit, the nearest of all."""
        goal = self.goals[branch]
        return goal if goal < float("inf") else min(self.goals)


@dataclass(frozen=True, eq=False)
class Crossing:
    """The ground that a body, its nodes (k,), is to cross along x: its rear end gets past `goal`;
    what it meets begins at `foot` [m]. patience: time without progress [s] after which it is stuck.
    """

    nodes: np.ndarray
    goal: float
    foot: float
    patience: float


@dataclass(frozen=True, eq=False)
class Robot:
    """Parts of which a run tells: number of the rigid body `frame`, name of the load `chamber`, a
    pressure, rows: node sets (k,) whose contact is counted, sides: those of their nodes that lie
    at the top or bottom, left or right at rest, name of the probe `track`, in space, whose way over
    the ground is told. None, or no rows, where there is none. assumptions: sentences that a verdict
    states.
    """

    frame: int | None
    chamber: str | None
    rows: dict[str, np.ndarray]
    sides: dict[str, np.ndarray]
    track: str | None
    assumptions: tuple[str, ...] = ()


# Share of the unbalanced force that resists the motion under dynamic relaxation: Cundall's.
LOCAL_DAMPING = 0.8


@dataclass(frozen=True)
class SteadyProbe:
    """A probe, by name and columns of the history, that has come to rest when it stayed `within`
    this share of its value for the last half of the time since `since` [s].
    """

    name: str
    columns: tuple[str, ...]
    within: float
    since: float


@dataclass(frozen=True)
class Relaxation:
    """Dynamic relaxation to equilibrium: within `longest` [s], until the unbalanced force is below
    `tolerance` of the inner ones, or a probe is steady; not before `shortest` [s] are over.
    """

    longest: float
    tolerance: float
    until: SteadyProbe | None = None
    shortest: float = 0.0


@dataclass(frozen=True, eq=False)
class Model:
    """One scenario. Arrays over all nodes: points, velocity (n, d), mass (n,), is_free (n, d).

    A component is free when it follows its own force: neither fixed, prescribed nor tied to a
    rigid body or a facet. After the nodes of bodies come those of cables. The last nodes, without
    mass, are the vertices of rigid surfaces and the corners of rigid outlines. ties: of nodes to
    facets, whose corners have their masses. loads: whatever acts from outside, prescribed motions
    too; sorted by kind.
    gravity (d,) [m/s^2]: all of it; starting_gravity: at t = 0, where it rises over a profile.
    load_names: of the loads, as the scene calls what they come from. start_time [s]: 0, or where a
    step begins; end_time: the latest; cycles: of the pressure in the robot's chamber, with which
    the run ends, or None. time_increment: the user's step [s], or None for the stable one.
    friction_memory [s], friction_slip_length [m]: within which the limit of friction on walls and
    outlines follows the normal force (contact/laws.py). self_contact: None where surfaces do
    not touch each other; corners: None where walls have none. mass_scaling: None where masses are
    as they are. relaxation: after the loads' time of a static procedure, or None where inertia is
    real; settling: before t = 0, or None. passage: what a layout asks, or None; crossing: what is
    asked of a ground, or None.
    """

    bodies: tuple[Body, ...]
    cables: tuple[CableData, ...]
    layers: tuple[Layer, ...]
    fibres: tuple[Fibre, ...]
    points: np.ndarray
    velocity: Own[np.ndarray]
    mass: np.ndarray
    is_free: np.ndarray
    ties: Ties
    rigid_bodies: tuple[RigidBodyData, ...]
    outlines: tuple[OutlineData, ...]
    walls: tuple[Wall, ...]
    contact: ContactData
    friction_memory: Own[float]
    friction_slip_length: Own[float]
    self_contact: SelfContactData | None
    corners: CornerData | None
    loads: tuple[Load, ...]
    load_names: Own[tuple[str, ...]]
    probes: Own[tuple[Probe, ...]]
    gravity: Own[np.ndarray]
    starting_gravity: Own[np.ndarray]
    robot: Own[Robot]
    start_time: Own[float]
    end_time: Own[float]
    cycles: Own[int | None]
    time_increment: Own[float | None]
    safety_factor: Own[float]
    least_step: Own[float]
    bulk_viscosity: float
    mass_scaling: MassScaling | None
    energy_error_limit: Own[float]
    relaxation: Relaxation | None
    settling: Relaxation | None
    passage: Own[Passage | None]
    crossing: Own[Crossing | None]

    @property
    def dimension(self) -> int:
        """Coordinates of a node: 2 or 3."""
        return self.points.shape[1]

    @property
    def is_axisymmetric(self) -> bool:
        """True if x is the radius and y the axis of revolution."""
        return any(isinstance(region.geometry, Axisymmetric) for region in self.regions)

    @property
    def regions(self) -> tuple[Region, ...]:
        """Of all bodies."""
        return tuple(region for body in self.bodies for region in body.regions)

    @property
    def meshed_count(self) -> int:
        """Nodes of all bodies."""
        return sum(len(b.points) for b in self.bodies)

    @property
    def element_count(self) -> int:
        """Elements of all bodies."""
        return sum(len(b.cells) for b in self.bodies)

    @property
    def corner_count(self) -> int:
        """Corners of these, each of its own: about how much work they are."""
        return sum(b.cells.size for b in self.bodies)

    @property
    def most_lanes(self) -> int:
        """Elements in a lane vector with which a CPU is fastest."""
        quads = all(region.has_hourglass_modes for region in self.regions)
        return backend.QUAD_LANES if quads else backend.CPU_LANES

    @property
    def added_turning(self) -> float:
        """Largest share by which mass scaling adds to a body's inertia against turning [-]."""
        scaling = self.mass_scaling
        if scaling is None:
            return 0.0
        return max(
            scaling.of_nodes(b.nodes).added_turning(b.points, self.mass[b.nodes])
            for b in self.bodies
        )

    @property
    def wall_contacts(self) -> tuple[ContactData, ...]:
        """Of all that may touch walls: bodies, then each cable."""
        return (self.contact, *(cable.contact for cable in self.cables))

    @property
    def pressures(self) -> tuple[FollowerPressure, ...]:
        """Of chambers, in the order of the scene."""
        return self.of_kind(FollowerPressure)

    @property
    def chamber(self) -> FollowerPressure | None:
        """The pressure of the robot's chamber, if it has one."""
        return next((p for p in self.pressures if p.name == self.robot.chamber), None)

    def of_kind(self, kind: type[L]) -> tuple[L, ...]:
        """The loads of a kind, in the order of the scene."""
        return of_kind(self.loads, kind)

    def can_share(self, other: "Model") -> bool:
        """Whether both can be scenarios of one solver. Not those of a static procedure, which ends
        when it ends.
        """
        dynamic = self.relaxation is None and other.relaxation is None
        return dynamic and alike(self, other)
