"""The frozen model: connectivity, masses, parameters, all in numpy; names have become numbers.

A `Model` is one scenario. Several scenarios of one mesh (other pressure, frequency, friction,
pipe) run side by side in one solver.
"""

from dataclasses import dataclass

import numpy as np

from softsim.loads.profile import Profile
from softsim.loads.vibration import RotorData
from softsim.materials.material import Material
from softsim.rigid.body import RigidBodyData


@dataclass(frozen=True)
class Body:
    """A meshed body. points (n, 2) [m]; cells (m, 3) numbered within the body.

    node_sets, facet_sets: numbered within the model (within the body plus first_node).
    """

    name: str
    first_node: int
    points: np.ndarray
    cells: np.ndarray
    thickness: float
    material: Material
    node_sets: dict[str, np.ndarray]
    facet_sets: dict[str, np.ndarray]

    @property
    def nodes(self) -> slice:
        """Its nodes among those of the model."""
        return slice(self.first_node, self.first_node + len(self.points))


@dataclass(frozen=True)
class ContactData:
    """Nodes (k,) that may touch, and per node k_n, k_t [N/m], the dashpot [N s/m] and the mass
    that it has to move [kg].
    """

    nodes: np.ndarray
    penalty_stiffness: np.ndarray
    tangential_stiffness: np.ndarray
    damping: np.ndarray
    effective_mass: np.ndarray
    friction_coefficient: float


@dataclass(frozen=True)
class WallsData:
    """Half planes: points (w, 2) [m] and unit normals (w, 2) into the free side."""

    names: tuple[str, ...]
    points: np.ndarray
    normals: np.ndarray


@dataclass(frozen=True)
class OutlineData:
    """Rectangle of rigid body number `body`: half_size (2,), centre (2,) in space at rest [m].

    `support`: nodes that may lie against it from outside, or None.
    """

    body: int
    half_size: np.ndarray
    centre: np.ndarray
    support: ContactData | None


@dataclass(frozen=True)
class PressureData:
    """Follower pressure on `facets` (k, 2); `body` closes the chamber, or is None.

    profile: what a gauge on the robot shows; section_profile: what acts on the plane model [Pa].
    """

    name: str
    facets: np.ndarray
    thickness: float
    profile: Profile
    section_profile: Profile
    body: int | None


@dataclass(frozen=True)
class RotorLoad:
    """A motor on rigid body number `body`."""

    body: int
    rotor: RotorData


@dataclass(frozen=True)
class NodalLoad:
    """Total `force` (2,) [N] on `nodes`, in full after `ramp` [s]."""

    nodes: np.ndarray
    force: np.ndarray
    ramp: float


@dataclass(frozen=True)
class Model:
    """One scenario. Arrays over all nodes: points, velocity (n, 2), mass (n,), is_free (n,).

    A node is free when it follows its own force: neither fixed nor tied to a rigid body. The last
    nodes, without mass, are the corners of rigid outlines. rows: sets whose contact is counted.
    increment: the user's time step [s], or None for the stable one.
    """

    bodies: tuple[Body, ...]
    points: np.ndarray
    velocity: np.ndarray
    mass: np.ndarray
    is_free: np.ndarray
    rigid_bodies: tuple[RigidBodyData, ...]
    outlines: tuple[OutlineData, ...]
    walls: WallsData
    contact: ContactData
    pressures: tuple[PressureData, ...]
    rotors: tuple[RotorLoad, ...]
    nodal_loads: tuple[NodalLoad, ...]
    gravity: np.ndarray
    rows: dict[str, np.ndarray]
    end_time: float
    increment: float | None
    safety_factor: float
    bulk_viscosity: float
    energy_error_limit: float

    @property
    def element_count(self) -> int:
        """Elements of all bodies."""
        return sum(len(b.cells) for b in self.bodies)
