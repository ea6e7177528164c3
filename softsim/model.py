"""Immutable model of a scenario in numpy: connectivity, masses and parameters, numbers for names.

A `Model` is one scenario. Several scenarios of one mesh (other pressure, frequency, friction,
pipe) run side by side in one solver.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from softsim.compute import backend
from softsim.compute.mass_scaling import MassScaling
from softsim.compute.term import PerScenario, equal_but_per_scenario
from softsim.contact.adhesion import Adhesion, PairLaws
from softsim.contact.deformable_surface import SurfaceData
from softsim.contact.forces import Penalty
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.simple_walls import Cylinder, Sphere
from softsim.contact.surface_contact import ContactData
from softsim.contact.wall import Wall
from softsim.elements.geometry import Geometry, Region, nodal_sums
from softsim.elements.hoop import Axisymmetric
from softsim.loads.load import Load
from softsim.loads.pressure import FollowerPressure
from softsim.mesh.mesh import facet_owners
from softsim.rigid import RigidBodyData
from softsim.structures.structure import Structure
from softsim.structures.ties import Ties

T = TypeVar("T")


@dataclass(frozen=True)
class Body:
    """Meshed body.

    points (n, d) [m]; cells (m, corners) numbered within the body, each in one of its regions; all
    bodies have the same number of corners per cell.

    node_sets, facet_sets: numbered within the model (within the body plus first_node). cell_sets:
    numbers of cells within the body. remarks: warnings on changes made when its mesh was read.
    not_read: contents of its mesh file that are ignored, such as "*MATERIAL rubber".
    """

    name: str
    first_node: int
    points: np.ndarray
    cells: np.ndarray
    regions: tuple[Region, ...]
    node_sets: PerScenario[dict[str, np.ndarray]]
    facet_sets: PerScenario[dict[str, np.ndarray]]
    cell_sets: PerScenario[dict[str, np.ndarray]]
    remarks: PerScenario[tuple[str, ...]]
    not_read: PerScenario[tuple[str, ...]]

    @property
    def nodes(self) -> slice:
        """Slice of its nodes in the model."""
        return slice(self.first_node, self.first_node + len(self.points))

    @property
    def mass(self) -> float:
        """Mass of its elements [kg]."""
        return sum(float(r.volumes.sum()) * r.material.density for r in self.regions)

    def nodal_mean(self, of_regions: Iterable[np.ndarray]) -> np.ndarray:
        """Return nodal values (n,) from those of each region.

        Where regions meet they are averaged by volume.
        """
        volumes = [r.nodal_volumes for r in self.regions]
        whole, mean = sum(volumes), np.zeros(len(self.points))
        for values, volume in zip(of_regions, volumes, strict=True):
            mean += np.where(volume > 0.0, values * (volume / whole), 0.0)
        return mean

    @property
    def surface_areas(self) -> np.ndarray:
        """Tributary area of each node on the surface at rest (n,) [m^2]."""
        facets = self.facet_sets["surface"] - self.first_node
        owners, areas = facet_owners(facets, self.cells), np.zeros(len(self.points))
        for region in self.regions:
            own = facets[np.isin(owners, region.numbers)]
            shares = region.geometry.corner_areas(self.points, own)
            areas += nodal_sums(own, shares, len(self.points))
        return areas

    def joined(self, of_regions: Iterable[np.ndarray]) -> np.ndarray:
        """Return values (m, ...) of all cells, in their order, from those of each region."""
        numbers = np.concatenate([r.numbers for r in self.regions])
        return np.concatenate(list(of_regions))[np.argsort(numbers)]


@dataclass(frozen=True)
class SelfContactData(SurfaceData):
    """Surfaces of deformable bodies that may touch themselves and each other.

    penalty: springs and dashpots of the points (k + f,). friction_coefficient (groups, groups);
    adhesion: its laws, None where nothing adheres.
    """

    penalty: Penalty
    friction_coefficient: PerScenario[np.ndarray]
    adhesion: PairLaws | None = None


@dataclass(frozen=True)
class CornerData:
    """Contact of convex wall corners in the plane with facets (f, 2), numbered as nodes.

    facet_size: lengths at rest (f,) [m]. penalty: springs and dashpots of each corner (1,).
    together: upper bound of the sum of contact weights of corners at a facet node.
    """

    facets: np.ndarray
    facet_size: np.ndarray
    penalty: Penalty
    together: float


@dataclass(frozen=True)
class OutlineData:
    """Shape of rigid body number `body` in its position at rest.

    `support`: nodes that may lie against it from outside, or None.
    """

    body: int
    shape: Sphere | Cylinder
    support: ContactData | None


@dataclass(frozen=True)
class Probe:
    """Quantity recorded in the history.

    kind: name of the quantity. members: nodes (k,) or, for an enclosed volume, facets (k, corners).
    """

    name: str
    kind: str
    members: np.ndarray
    geometry: Geometry


@dataclass(frozen=True, eq=False)
class Passage:
    """Path of rigid body number `body` along pipes, and the criteria that end the run.

    items: entries of the user's lists of the pipes, as texts. length: of the body along the pipe
    [m]. outline: its nodes that touch walls (k,). start: arc length of its centre at rest; goals:
    arc lengths [m] beyond which it has passed, by branch of the network, infinite for a branch
    without an exit. It has stopped when it gains less than `least_progress` [m] within `patience`
    pressure cycles, or within `patience_time` [s] if not `in_cycles`.
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
        """Return the goal of a branch [m]; the nearest goal of all if it has no exit."""
        goal = self.goals[branch]
        return goal if goal < float("inf") else min(self.goals)


@dataclass(frozen=True, eq=False)
class Crossing:
    """Ground that a body has to cross along x.

    nodes (k,): of the body. goal: place [m] that its rear end has to pass.

    foot: start of the obstacle [m]. patience: time without progress [s] after which it is stuck.
    """

    nodes: np.ndarray
    goal: float
    foot: float
    patience: float


@dataclass(frozen=True, eq=False)
class Robot:
    """Parts of a robot that a run reports on; None or empty if absent.

    frame: number of the rigid body. chamber: name of the pressure load. rows: node sets (k,) whose
    contacts are counted; sides: their nodes at the top or bottom, left or right at rest. track:
    name of the probe in space whose path over the ground is reported. assumptions: sentences that a
    verdict states.
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
    """Probe whose steady state ends a relaxation.

    name, columns: of the probe in the history. It is steady once it varied by no more than the
    fraction `within` of its value over the second half of the time since `since` [s].
    """

    name: str
    columns: tuple[str, ...]
    within: float
    since: float


@dataclass(frozen=True)
class Relaxation:
    """Search for equilibrium by dynamic relaxation or by Newton's method.

    It takes `shortest` to `longest` [s] and ends when the unbalanced force is below `tolerance`
    times the internal forces, or a probe is steady. by_newton: True if a static procedure finds its
    equilibria by Newton's method instead, to the same tolerance; follows_path: True if it follows
    their path through limit points of the loads, by arc length.
    """

    longest: float
    tolerance: float
    until: SteadyProbe | None = None
    shortest: float = 0.0
    by_newton: bool = False
    follows_path: bool = False


@dataclass(frozen=True, eq=False)
class Model:
    """Model of one scenario.

    Arrays over all nodes: points, velocity (n, d), mass (n,), is_free (n, d).

    A component is free when it follows its own force: neither fixed, prescribed nor tied to a rigid
    body or a facet. After the nodes of bodies come those of structures. The last nodes, without
    mass, are the vertices of rigid surfaces and the corners of rigid outlines. ties: of nodes to
    facets, whose corners have their masses. loads: all external actions, including prescribed
    motions, sorted by kind. gravity (d,) [m/s^2]: final value; starting_gravity: at t = 0, if it
    rises over a profile. load_names: names of the loads in the scene. start_time [s]: 0, or the
    start of a step; end_time [s]: the latest end; cycles: pressure cycles of the robot's chamber
    after which the run ends, or None. time_increment: the user's step [s], or None for the stable
    one. friction_memory [s], friction_slip_length [m]: time and slip over which the limit of
    friction on walls and outlines follows the normal force (contact/forces.py). adhesions: that
    of the nodes of `contact` to each wall, None where nothing adheres. self_contact: None
    without contact between surfaces; corners: None if walls have none. mass_scaling: None if masses
    are not scaled. relaxation: after the loads of a static procedure, None in dynamics; settling:
    relaxation before t = 0, or None. passage, crossing: criteria of a pipe layout and of a ground,
    or None.
    """

    bodies: tuple[Body, ...]
    structures: tuple[Structure, ...]
    points: np.ndarray
    velocity: PerScenario[np.ndarray]
    mass: np.ndarray
    is_free: np.ndarray
    ties: Ties
    rigid_bodies: tuple[RigidBodyData, ...]
    outlines: tuple[OutlineData, ...]
    walls: tuple[Wall, ...]
    contact: ContactData
    adhesions: tuple[Adhesion | None, ...]
    friction_memory: PerScenario[float]
    friction_slip_length: PerScenario[float]
    self_contact: SelfContactData | None
    corners: CornerData | None
    loads: tuple[Load, ...]
    load_names: PerScenario[tuple[str, ...]]
    probes: PerScenario[tuple[Probe, ...]]
    gravity: PerScenario[np.ndarray]
    starting_gravity: PerScenario[np.ndarray]
    robot: PerScenario[Robot]
    start_time: PerScenario[float]
    end_time: PerScenario[float]
    cycles: PerScenario[int | None]
    time_increment: PerScenario[float | None]
    safety_factor: PerScenario[float]
    least_step: PerScenario[float]
    bulk_viscosity: float
    mass_scaling: MassScaling | None
    energy_error_limit: PerScenario[float]
    relaxation: Relaxation | None
    settling: Relaxation | None
    passage: PerScenario[Passage | None]
    crossing: PerScenario[Crossing | None]

    @property
    def dimension(self) -> int:
        """Number of coordinates of a node: 2 or 3."""
        return self.points.shape[1]

    @property
    def is_axisymmetric(self) -> bool:
        """True if x is the radius and y the axis of revolution."""
        return any(isinstance(region.geometry, Axisymmetric) for region in self.regions)

    @property
    def regions(self) -> tuple[Region, ...]:
        """Regions of all bodies."""
        return tuple(region for body in self.bodies for region in body.regions)

    @property
    def meshed_count(self) -> int:
        """Number of nodes of all bodies."""
        return sum(len(b.points) for b in self.bodies)

    @property
    def element_count(self) -> int:
        """Number of elements of all bodies."""
        return sum(len(b.cells) for b in self.bodies)

    @property
    def corner_count(self) -> int:
        """Number of element nodes, counted per element: a measure of the work."""
        return sum(b.cells.size for b in self.bodies)

    @property
    def most_lanes(self) -> int:
        """Elements per lane vector with which a CPU is fastest."""
        quads = all(region.has_hourglass_modes for region in self.regions)
        return backend.QUAD_LANES if quads else backend.CPU_LANES

    @property
    def added_turning(self) -> float:
        """Largest relative increase of a body's rotational inertia by mass scaling [-]."""
        scaling = self.mass_scaling
        if scaling is None:
            return 0.0
        return max(
            scaling.of_nodes(b.nodes).added_turning(b.points, self.mass[b.nodes])
            for b in self.bodies
        )

    @property
    def all_structures(self) -> tuple[Structure, ...]:
        """Structures of the scene, ties, and the loads that are structures as well."""
        loads = (load for load in self.loads if isinstance(load, Structure))
        return (*self.structures, self.ties, *loads)

    @property
    def first_outline_node(self) -> int:
        """Number of the first node behind those of bodies and structures."""
        return self.meshed_count + sum(len(s.own_nodes) for s in self.structures)

    @property
    def wall_contacts(self) -> tuple[ContactData, ...]:
        """Contact data of all that may touch walls: the bodies, then each structure."""
        of_structures = (s.wall_contact for s in self.structures)
        return (self.contact, *(contact for contact in of_structures if contact is not None))

    @property
    def named_loads(self) -> dict[str, Load]:
        """Loads by name, in order; those that were added to a built model have no name."""
        return dict(zip(self.load_names, self.loads, strict=False))

    @cached_property
    def pressures(self) -> tuple[FollowerPressure, ...]:
        """Pressures of chambers, in the order of the scene."""
        return self.of_kind(FollowerPressure)

    @property
    def chamber(self) -> FollowerPressure | None:
        """Pressure of the robot's chamber, or None."""
        return next((p for p in self.pressures if p.name == self.robot.chamber), None)

    @property
    def takes_load_steps(self) -> bool:
        """True if a static procedure finds its equilibria by Newton's method."""
        return self.relaxation is not None and self.relaxation.by_newton

    def of_kind(self, kind: type[T]) -> tuple[T, ...]:
        """Return the loads and structures of a kind, in the order of the scene."""
        return tuple(x for x in (*self.structures, *self.loads) if isinstance(x, kind))

    def can_share(self, other: "Model") -> bool:
        """Return True if both models can be scenarios of one solver.

        Models of a static procedure cannot, because each ends at its own time.
        """
        dynamic = self.relaxation is None and other.relaxation is None
        return dynamic and equal_but_per_scenario(self, other)
