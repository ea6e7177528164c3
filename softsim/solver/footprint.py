"""Memory that the fields of a model take on a device, told from the model before anything starts.

Fields are counted per element, node, touching node and facet, as the classes that own them make
them (elements/linear.py, nodes.py, contact/surface_contact.py, loads/pressure.py). What several
scenarios of one mesh share is counted once. Left out: what does not grow with the mesh (rigid
bodies, profiles), and the padding of the last lane vector.
"""

from dataclasses import dataclass

import numpy as np

from softsim.contact.list_sizes import MOST_FACETS, MOST_NODES, margin_and_room
from softsim.elements.axisymmetric import Axisymmetric
from softsim.elements.geometry import Geometry
from softsim.elements.plane_strain import PlaneStrain
from softsim.elements.ring_section import RingSection
from softsim.elements.solid import Solid
from softsim.errors import DeviceError
from softsim.loads.gravity import GravityProfile
from softsim.machine import Place
from softsim.model import ContactData, Model, SelfContactData

REAL, INTEGER = 8, 4  # bytes
# Components stored of the edges (with the hoop stretch) and of a tensor, by the kind of element.
EDGE_COMPONENTS: dict[type[Geometry], int] = {
    PlaneStrain: 4, Axisymmetric: 5, RingSection: 5, Solid: 9,
}  # fmt: skip
SYMMETRIC_COMPONENTS: dict[type[Geometry], int] = {
    PlaneStrain: 4, Axisymmetric: 4, RingSection: 4, Solid: 6,
}  # fmt: skip
# What a process takes beside its fields: bytes, and bytes an element. CPU: Python, Taichi and
# compiled kernels; working arrays of the start, the guards and frames (both measured, the second at
# 208,000 triangles). CUDA: a context of some 0.5 GB and Taichi's own pool of 1 GiB (its
# device_memory_GB); working arrays live in the CPU's memory.
BESIDE = {"cpu": (300e6, 1000.0), "cuda": (1.6e9, 0.0)}


@dataclass(frozen=True)
class Footprint:
    """Bytes: `shared` by all scenarios, and `each` scenario's own."""

    shared: int
    each: int

    def of(self, scenarios: int) -> int:
        """Bytes that so many scenarios of one mesh take."""
        return self.shared + scenarios * self.each


def footprint(model: Model) -> Footprint:
    """Memory of all fields that grow with the mesh."""
    d, nodes = model.dimension, len(model.points)
    # Mass, 1/mass, rest position; its place in the lists of slots.
    shared = nodes * (REAL * (1 + 2 * d) + INTEGER)
    # Position, velocity, force; work of local damping.
    each = nodes * REAL * (3 * d + 1)
    if model.of_kind(GravityProfile):
        each += nodes * REAL  # work that came too late
    for body in model.bodies:
        corners = body.cells.shape[1]
        components = SYMMETRIC_COMPONENTS[type(body.geometry)]
        # Corner nodes, slots in the nodes' order, cells in the nodes' order; identity, volume and
        # determinant at rest.
        shared += len(body.cells) * (3 * INTEGER * corners + REAL * (components + 2))
        # Corner forces; edges, present volume, pressure; branches, their last C_bar and work.
        count = len(body.material.branches)
        branches = (count + 1) * components + 1 if count else 0
        tensors = EDGE_COMPONENTS[type(body.geometry)] + branches
        each += len(body.cells) * REAL * (corners * d + tensors + 2)
        if isinstance(body.geometry, RingSection):
            rings = body.cells[body.geometry.is_ring]
            diameters = len(np.unique(rings)) // 2
            # Places of a cell's diameters, two constants; cells in the diameters' order; ends,
            # slots, place in the list.
            shared += len(body.cells) * (INTEGER * corners + 2 * REAL)
            shared += rings.size * INTEGER + diameters * 5 * INTEGER
            # Tension of a cell; length and direction of a diameter, forces on its ends.
            each += len(body.cells) * REAL + diameters * REAL * (3 + 2 * d)
        # Nodal volume and its inverse, viscosity, place in the list; J, pressure, its viscous part,
        # dissipation.
        shared += len(body.points) * (3 * REAL + INTEGER)
        each += len(body.points) * 4 * REAL
    for contact, surfaces in _contacts(model):
        # Node, slot; four constants.
        shared += len(contact.nodes) * (2 * INTEGER + 4 * REAL)
        # A surface: anchor, friction; dashpot, limit, age, when it was left, whether it touches.
        # Force, impulse and slot; normal force and two impulses, two dissipations, time, returns.
        at_surface = REAL * (2 * d + 4) + INTEGER
        each += len(contact.nodes) * (surfaces * at_surface + REAL * (3 * d + 6) + INTEGER)
    shared += REAL * sum(wall.stored_numbers for wall in model.walls)
    if model.self_contact is not None:
        own, lists = _self_contact_bytes(model.self_contact, d)
        shared += own
        each += lists
    for load in model.pressures:
        shared += load.facets.size * 2 * INTEGER  # nodes and slots
        each += load.facets.size * REAL * d + len(load.facets) * REAL  # forces, work
    return Footprint(shared, each)


def _self_contact_bytes(data: SelfContactData, d: int) -> tuple[int, int]:
    """What self-contact takes, shared by all scenarios and of each of them."""
    nodes, facets = len(data.contact.nodes), len(data.facets)
    room = margin_and_room(data.facet_size)[2]
    # Number, size, part and four constants; slot. Corners, the facets around them; size, part.
    shared = nodes * (4 * INTEGER + 5 * REAL) + facets * ((3 * d + 1) * INTEGER + REAL)
    # List, its length, facet touched, whether loaded; place, stretch, friction, force, slot, forces
    # on corners; gap, dashpot, normal force, two dissipations.
    at_node = INTEGER * (room * MOST_FACETS[d] + 3) + REAL * (5 * d + d * d + 5)
    # List, its length, cells; place, radius.
    at_facet = INTEGER * (room * MOST_NODES[d] + 5) + REAL * (d + 1)
    return shared, nodes * at_node + facets * at_facet


def _contacts(model: Model) -> list[tuple[ContactData, int]]:
    """Each list of nodes with the number of surfaces that it is held against."""
    against_walls = [(model.contact, len(wall.names)) for wall in model.walls]
    supports = [(o.support, 1) for o in model.outlines if o.support is not None]
    return against_walls + supports


def refuse_too_large(model: Model, device: str, place: Place | None) -> None:
    """Refuse a model that does not fit the free memory of the place where it is to run.

    device: "cpu" or "cuda". place: its memory, None where nobody tells; then nothing is refused.

    Raises DeviceError saying how many elements would fit.
    """
    if place is None:
        return
    free, (fixed, an_element) = place.memory.free, BESIDE[device]
    growing = an_element * model.element_count + footprint(model).of(1)
    need = fixed + growing
    if need <= free:
        return
    elements = int(model.element_count * max(0.0, free - fixed) / growing)
    way_out = f"at most {elements:,} elements of this kind" if elements else "free some memory"
    if device == "cuda":
        way_out += ", or --device cpu"
    raise DeviceError(
        f"{model.element_count:,} elements need {_gigabytes(need)}, "
        f"{_gigabytes(free)} are free on {place.name}",
        hint=way_out,
    )


def scenarios_that_fit(model: Model, device: str, place: Place | None) -> int | None:
    """How many scenarios of a model fit the free memory of the place where they are to run; None
    where nobody tells (place: None).
    """
    if place is None:
        return None
    size, (fixed, an_element) = footprint(model), BESIDE[device]
    left = place.memory.free - fixed - an_element * model.element_count - size.shared
    return max(0, int(left // size.each))


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.3g} GB"
