"""Contact: stiffness, damping and mass of each node."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from softsim.contact.adhesion import Adhesion, CohesiveLaw, PairLaws, SeparationRate
from softsim.contact.deformable_surface import SurfaceData
from softsim.contact.forces import Penalty
from softsim.contact.surface_contact import ALLOWED_PENETRATION, ContactData
from softsim.contact.wall import Wall
from softsim.elements.geometry import nodal_sums, simplex_gradients
from softsim.elements.hoop import RingSection
from softsim.elements.plane_elements import PlaneStrain
from softsim.materials.material import Material
from softsim.mesh.mesh import (
    SURFACE,
    facet_owners,
    find_rows,
    signed_volumes,
    simplex_facets,
    simplexes,
)
from softsim.mesh.surface import depth_in_surface, side_lengths
from softsim.model import Body, SelfContactData
from softsim.rigid import RigidBodyData
from softsim.scene.bodies import Fixed, Symmetry
from softsim.scene.names import Names, close_names, in_mm
from softsim.scene.text import Keys
from softsim.scene.walls import AdhesionRateSpec, AdhesionSpec, Contact
from softsim.structures.ties import Ties

SHORTER_THAN_DEPTH = (
    "the range of the adhesion is shorter than the depth F / k_n of the penalty contact"
)


def penalty_stiffness(names: Names, bodies: Sequence[Body], node_count: int) -> np.ndarray:
    """Return k_n (n,) [N/m] of every node: the user's, or the bulk modulus times the node's depth.

    The depth is the thickness of a section, the circumference of a ring, or the size of a node's
    surroundings in space. The value is the stiffness of one element across its own size, so a
    contact is as stiff as the solid behind it, for any mesh. That of a cable is the stiffness of a
    segment along itself.
    """
    given = names.scene.contact.penalty_stiffness
    if isinstance(given, float):
        return np.full(node_count, given)
    soft = [nodal_bulk_modulus(b) * nodal_depth(b) for b in bodies]
    stiffness = np.full(node_count, max(s.max() for s in soft))
    for b, s in zip(bodies, soft, strict=True):
        stiffness[b.nodes] = s
    for name, placed in names.cables.items():
        along = names.scene.cables[name].stretching_stiffness
        stiffness[placed.nodes] = along / placed.lengths.mean()
    return stiffness


def nodal_depth(body: Body) -> np.ndarray:
    """Return the depth of the body at each node (n,) [m], see `penalty_stiffness`."""
    volume = np.sum([r.nodal_volumes for r in body.regions], axis=0)
    if body.points.shape[1] == 3:
        return (volume / body.cells.shape[1]) ** (1.0 / 3.0)
    area = signed_volumes(body.points, body.cells)[:, None]
    return volume / nodal_sums(body.cells, area, len(body.points))


def nodal_bulk_modulus(body: Body) -> np.ndarray:
    """Return the bulk modulus (n,) [Pa] around each node."""
    count = len(body.points)
    return body.nodal_mean(np.full(count, r.material.bulk_modulus) for r in body.regions)


def contact_mass(
    points: np.ndarray,
    mass: np.ndarray,
    is_free: np.ndarray,
    rigid_bodies: Sequence[RigidBodyData],
) -> np.ndarray:
    """Return the mass (n,) [kg] that a contact at each node has to move.

    A free node: its own. A node of a rigid body: 1/m = 1/M + r^2/I, its worst direction. A fixed
    node: infinite.
    """
    effective = np.where(is_free.any(axis=1), mass, np.inf)
    for body in rigid_bodies:
        arm_squared = ((points[body.tied] - body.centre) ** 2).sum(axis=1)
        smallest = np.diag(body.inertia)[list(body.free[3:])].min(initial=np.inf)
        effective[body.tied] = 1.0 / (1.0 / body.mass + arm_squared / smallest)
    return effective


# -------------------------------------------------------------------------------------------------
# Adhesion of nodes to walls.


def adhesions(
    names: Names,
    bodies: Sequence[Body],
    points: np.ndarray,
    walls: Sequence[Wall],
    contact: ContactData,
) -> tuple[Adhesion | None, ...]:
    """Return the adhesion of the nodes of `contact` to each wall, None where nothing adheres.

    points (n, d) [m] of all nodes. On a facet, the last entry of the scene counts that names it and
    the wall. Raises SceneError for names that do not exist, for entries without effect, and for
    ranges that the penalty contact or the wall does not resolve.
    """
    every = names.scene.contact.adhesion
    specs = {name: spec for name, spec in every.items() if spec.between is None}
    if not specs:
        return (None,) * len(walls)
    for name, spec in specs.items():
        refuse_missing_walls(names, ("contact", "adhesion", name), spec)
    facets, corner_areas, is_named = adhering_facets(names, specs, bodies, points)
    softest = least_modulus(bodies, facets[is_named.any(axis=0)])
    laws = [cohesive_law(spec) for spec in specs.values()]

    def areas_at(surface: str) -> np.ndarray:
        """Return the area (entries, k) [m^2] of each node by the entry that counts at a surface."""
        wall = surface.partition(".")[0]
        applies = [not spec.walls or wall in spec.walls for spec in specs.values()]
        ranks = np.where(is_named & np.array(applies)[:, None], np.arange(len(specs))[:, None], -1)
        own = [ranks.max(axis=0) == number for number in range(len(specs))]
        areas = [nodal_sums(facets[o], corner_areas[o], len(points)) for o in own]
        return np.array(areas)[:, contact.nodes]

    found: list[Adhesion | None] = []
    for wall in walls:
        areas = np.stack([areas_at(surface) for surface in wall.names], axis=2)
        refuse_different_rates(names, dict(zip(specs, laws, strict=True)), areas)
        adhesion = Adhesion.of_areas(laws, areas, contact.penalty.k_n, softest)
        refuse_unresolved_range(names, wall, adhesion, contact.penalty.k_n)
        found.append(adhesion if areas.any() else None)
    return tuple(found)


# Default of `fastest` over `speed`: it bounds the range; with n = 0.6 the work is 64 w0 there.
FASTEST = 1000.0


def separation_rate(spec: AdhesionRateSpec | None) -> SeparationRate | None:
    """Return the rate dependence of an entry of contact.adhesion, or None without it."""
    if spec is None:
        return None
    fastest = FASTEST * spec.speed if spec.fastest is None else spec.fastest
    return SeparationRate(spec.speed, spec.exponent, fastest)


def refuse_different_rates(
    names: Names, laws: Mapping[str, CohesiveLaw], areas: np.ndarray
) -> None:
    """Raise SceneError if laws with different rates have an area (laws, k, w) at the same node.

    laws: those of the entries of contact.adhesion, by name.
    """
    rated = [
        (name, law.rate, own > 0.0)
        for (name, law), own in zip(laws.items(), areas, strict=True)
        if law.rate is not None
    ]
    for (one, of_one, has_one), (other, of_other, has_other) in combinations(rated, 2):
        if of_one != of_other and (has_one & has_other).any():
            raise names.loaded.error(
                ("contact", "adhesion", other, "rate"),
                f"it differs from that of '{one}', and surfaces of both entries share nodes",
                f"give '{one}' and '{other}' the same rate, or surfaces without a common node",
            )


def refuse_missing_walls(names: Names, keys: Keys, spec: AdhesionSpec) -> None:
    """Raise SceneError if an entry of contact.adhesion names unknown walls, or there is no wall."""
    if not names.scene.environment.walls:
        raise names.loaded.error(
            keys, "there is no wall to adhere to", "add environment.walls; bodies adhere to walls"
        )
    for k, name in enumerate(spec.walls):
        names.require_wall(name, (*keys, "walls", k))


def least_modulus(bodies: Sequence[Body], facets: np.ndarray) -> float:
    """Return the smallest E* [Pa] of slow loads of the bodies of these facets, infinite of rigid
    ones.
    """
    of_bodies = [b for b in bodies if ((facets >= b.nodes.start) & (facets < b.nodes.stop)).any()]
    materials = [region.material for body in of_bodies for region in body.regions]
    moduli = (reduced_modulus(m.law.initial_shear_modulus, m.bulk_modulus) for m in materials)
    return min(moduli, default=np.inf)


def adhering_facets(
    names: Names, specs: Mapping[str, AdhesionSpec], bodies: Sequence[Body], points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the facets (f, d) that entries of contact.adhesion name, the areas (f, d) [m^2] of
    their corners, and which entry names which facet (entries, f).

    Raises SceneError if an entry names no facet with an area.
    """
    named = {
        name: [
            named_facets(names, surface, ("contact", "adhesion", name, "surfaces", k))
            for k, surface in enumerate(spec.surfaces or tuple(names.bodies))
        ]
        for name, spec in specs.items()
    }
    surfaces = surfaces_of(names, bodies, points, [f for entry in named.values() for f in entry])
    facets, corner_areas, _ = (np.concatenate(parts) for parts in zip(*surfaces, strict=True))
    is_named = np.array([are_among(facets, entry) for entry in named.values()])
    for name, found in zip(named, is_named, strict=True):
        if not found.any():
            raise names.loaded.error(
                ("contact", "adhesion", name),
                "no facet of its surfaces can adhere: they belong to rigid bodies or lie in planes "
                "of symmetry",
                "name surfaces of deformable bodies",
            )
    return facets, corner_areas, is_named


def refuse_unresolved_range(names: Names, wall: Wall, adhesion: Adhesion, k_n: np.ndarray) -> None:
    """Raise SceneError if the range of adhesion is shorter than the depth F / k_n at some node, or
    longer than the gaps that are exact.

    k_n: penalty stiffness (k,) [N/m].
    """
    adheres = adhesion.attraction > 0.0
    reach, depth = adhesion.reach[adheres], (adhesion.attraction / k_n[:, None])[adheres]
    if (reach < depth).any():
        worst = int(np.argmax(depth / reach))
        raise names.loaded.error(
            ("contact", "adhesion"),
            SHORTER_THAN_DEPTH,
            longer_than_depth(reach[worst], depth[worst]),
        )
    longest = adhesion.longest_reach[adheres].max(initial=0.0)
    if longest > wall.band():
        of_rate = "" if adhesion.rate is None else ", lower rate.fastest"
        raise names.loaded.error(
            ("contact", "adhesion"),
            f"its range is {1e3 * longest:.3g} mm, and the gaps of the wall "
            f"'{wall.names[0]}' are exact up to {1e3 * wall.band():.3g} mm",
            f"raise pull_off_stress{of_rate} or set a shorter range, or a larger spacing of the "
            "wall",
        )


# -------------------------------------------------------------------------------------------------
# Contact between bodies: the surfaces that a scene names, and their stiffness.

# Compression at which bodies go contact.allowed_penetration into each other.
REFERENCE_STRAIN = 0.1
# Name of the surfaces of contact.self_contact, together.
SELF = ""
# Longest range of adhesion between bodies over the smallest facet.
LONGEST_RANGE = 0.5
# Ratio of facet sizes up to which both sides contribute to the area that adheres.
ALIKE = 1.5


def self_contact(
    names: Names,
    bodies: Sequence[Body],
    points: np.ndarray,
    ties: Ties,
    tied: Sequence[np.ndarray],
    mass: np.ndarray,
) -> SelfContactData | None:
    """Return the surfaces that contact.self_contact and contact.pairs name, or None where they name
    nothing.

    points (n, d) [m] of all nodes; tied: those tied to each rigid body with a surface; mass (n,)
    [kg] that a force on each has to move. Raises SceneError for a name that does not exist, for
    surfaces that are planes of symmetry as a whole, and for bodies that start inside each other.
    """
    settings = names.scene.contact
    by_name = named_surfaces(names)
    if not by_name:
        return None
    named = list(by_name.values())
    surfaces = surfaces_of(names, bodies, points, named)
    for rigid in names.surfaces.values():
        if any(f is rigid.facets for f in named):
            surfaces.append(rigid_surface_of(names, points, rigid.facets))
    facets, corner_areas, moduli = (np.concatenate(parts) for parts in zip(*surfaces, strict=True))
    refuse_no_facets(names, moduli)
    nodes = np.unique(facets)
    part = connected_parts(bodies, ties, tied, len(points))
    refuse_overlap(names, bodies, points, part, nodes)
    longest = side_lengths(points, facets).max(axis=1)
    size = np.zeros(len(points))
    np.maximum.at(size, facets, longest[:, None])
    vertex_areas, centroid_areas = simpson_areas(corner_areas)
    per_area = stiffness_per_area(settings, points, facets, corner_areas, moduli)

    def at_points(at_vertices: np.ndarray, at_centroids: np.ndarray) -> np.ndarray:
        """Return the values (k + f,) of all points: of a vertex the sum over its facets' (f, d)."""
        return np.concatenate([nodal_sums(facets, at_vertices, len(points))[nodes], at_centroids])

    point_group, is_in = point_groups(contact_surfaces(settings, by_name), nodes, facets)
    friction = friction_between(settings, is_in)
    surfaces_named = Surfaces(facets, longest, per_area, by_name, is_in, friction >= 0.0)
    surface = SurfaceData(
        nodes=nodes,
        facets=facets,
        point_size=np.concatenate([size[nodes], longest]),
        point_part=np.concatenate([part[nodes], part[facets[:, 0]]]),
        point_areas=at_points(vertex_areas, centroid_areas),
        facet_areas=corner_areas.sum(axis=1),
        facet_stiffness=per_area,
        point_group=point_group,
        may_touch=friction >= 0.0,
    )
    # Each of the two half passes has half of the stiffness.
    k_n = 0.5 * at_points(per_area[:, None] * vertex_areas, per_area * centroid_areas)
    is_rigid = np.isin(nodes, facets[np.isinf(moduli)])
    c_n = k_n * damping_times(settings.damping_ratio, surface, k_n, mass, is_rigid)
    return SelfContactData(
        **vars(surface),
        penalty=Penalty.from_settings(settings, k_n, c_n),
        friction_coefficient=friction,
        adhesion=pair_laws(names, bodies, surfaces_named),
    )


def refuse_no_facets(names: Names, moduli: np.ndarray) -> None:
    """Raise a SceneError where no facet is left, or only those of rigid bodies, whose modulus is
    infinite.
    """
    if not len(moduli):
        raise names.loaded.error(
            ("contact", "self_contact"),
            "all of its facets lie in planes of symmetry, or are held in the normal direction",
            "name the surfaces that may touch",
        )
    if np.isinf(moduli).all():
        raise names.loaded.error(
            ("contact", "self_contact"),
            "only rigid bodies are named: the contact stiffness is derived from a deformable body",
            "name a deformable body as well",
        )


def stiffness_per_area(
    settings: Contact,
    points: np.ndarray,
    facets: np.ndarray,
    corner_areas: np.ndarray,
    moduli: np.ndarray,
) -> np.ndarray:
    """Return the contact stiffness per area (f,) [Pa/m] of facets (f, d): by it the pressure of a
    compression by REFERENCE_STRAIN makes the allowed penetration; or what the user gives for a node
    over the area of the facets around it.

    A facet of a rigid body is as stiff as the stiffest one that it may touch: the other decides.
    """
    if settings.penalty_stiffness == "auto":
        size = side_lengths(points, facets).mean(axis=1)
        per_area = REFERENCE_STRAIN * moduli / (settings.allowed_penetration * size)
    else:
        areas = nodal_sums(facets, corner_areas, len(points))
        per_area = (settings.penalty_stiffness / areas[facets]).mean(axis=1)
    rigid = np.isinf(moduli)
    return np.where(rigid, per_area[~rigid].max(), per_area)


def damping_times(
    damping_ratio: float,
    surface: SurfaceData,
    k_n: np.ndarray,
    mass: np.ndarray,
    is_rigid: np.ndarray,
) -> np.ndarray:
    """Return c_n / k_n of each point (k + f,) [s], with the mass (n,) [kg] of all nodes; is_rigid:
    True for vertices (k,) of rigid bodies, which have no mass of their own and take the median.

    Two equal nodes m that press each other have the springs k and dashpots c of both half passes:
    c = 2 zeta sqrt(k m / 2) / 2 of each, with k = 2 k_n.
    """
    nodes, own = surface.nodes, surface.summed_at_nodes(k_n)
    time = np.zeros(len(mass))
    time[nodes] = damping_ratio * np.sqrt(mass[nodes] / np.maximum(own, 1e-300))
    time[nodes[is_rigid]] = np.median(time[nodes[~is_rigid]])
    return np.concatenate([time[nodes], time[surface.facets].mean(axis=1)])


def cut_faces(names: Names, points: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Return True (f,) for facets that lie in a plane of symmetry, or whose nodes are fixed along
    one direction, across the facet: the body continues behind them.
    """
    cut = np.zeros(len(facets), dtype=bool)
    flat = 1e-9 * np.ptp(points, axis=0).max()
    for name, condition in names.scene.conditions.items():
        if isinstance(condition, Symmetry):
            letter = condition.normal
        elif isinstance(condition, Fixed) and condition.directions and not condition.directions[1:]:
            letter = condition.directions[0]
        else:
            continue
        held = names.node_set(condition.nodes, ("conditions", name, "nodes"))
        across = points[facets][:, :, "xyz".index(letter)]
        cut |= np.isin(facets, held).all(axis=1) & (np.ptp(across, axis=1) <= flat)
    return cut


def surfaces_of(
    names: Names, bodies: Sequence[Body], points: np.ndarray, named: Sequence[np.ndarray]
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return `surface_of` each body, of its facets among the named ones (f, corners) that are free
    to touch something.
    """
    surfaces = []
    for body in bodies:
        first, end = body.nodes.start, body.nodes.stop
        own = [f for f in named if len(f) and first <= f.flat[0] < end]
        whole = np.unique(np.concatenate([body.facet_sets[SURFACE][:0], *own]), axis=0)
        surfaces.append(surface_of(body, points, whole[~cut_faces(names, points, whole)]))
    return surfaces


def are_among(facets: np.ndarray, named: Iterable[np.ndarray]) -> np.ndarray:
    """Return True (f,) for facets (f, d) that are, or are half of, one of the named ones."""
    rows = [np.zeros((0, facets.shape[1]), dtype=int)]
    rows += [np.sort(simplex_facets(f)[0], axis=1) for f in named]
    return find_rows(np.sort(facets, axis=1), np.unique(np.concatenate(rows), axis=0)) >= 0


def surface_of(
    body: Body, points: np.ndarray, facets: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the edges or triangles (f, d) of facets of a body, the areas (f, d) [m^2] that their
    corners stand for, and the modulus E / (1 - nu^2) (f,) [Pa] of the material behind them.

    Facets on the axis of a body of revolution have no area: they are left out.
    """
    d = points.shape[1]
    owners = facet_owners(facets - body.first_node, body.cells)
    triangles, numbers = simplex_facets(facets)
    areas, moduli = np.zeros(triangles.shape), np.zeros(len(triangles))
    for region in body.regions:
        own = np.isin(owners[numbers], region.numbers)
        areas[own] = region.geometry.corner_areas(points, triangles[own])
        moduli[own] = plane_strain_modulus(region.material)
    bears = areas.sum(axis=1) > 1e-12 * np.ptp(points, axis=0).max() ** 2
    return triangles[bears].reshape(-1, d), areas[bears].reshape(-1, d), moduli[bears]


def rigid_surface_of(
    names: Names, points: np.ndarray, facets: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the same of facets (f, d) of a rigid body, whose modulus is infinite. In a section it
    is as thick as the first deformable body.
    """
    geometry = names.geometry
    if isinstance(geometry, RingSection):
        geometry = PlaneStrain(geometry.thickness)
    areas = geometry.corner_areas(points, facets)
    return facets, areas, np.full(len(facets), np.inf)


def plane_strain_modulus(material: Material) -> float:
    """Return E / (1 - nu^2) [Pa] of fast loads."""
    return reduced_modulus(material.instantaneous_shear_modulus, material.bulk_modulus)


def reduced_modulus(mu: float, kappa: float) -> float:
    """Return E* = E / (1 - nu^2) [Pa] = 4 mu (3 kappa + mu) / (3 kappa + 4 mu)."""
    return 4.0 * mu * (3.0 * kappa + mu) / (3.0 * kappa + 4.0 * mu)


def simpson_areas(corner_areas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the areas that the vertices (f, d) and the centroid (f,) of facets stand for in
    Simpson's rule, of those of their linear shape functions (f, d); uneven ones too, as of rings.
    """
    d, whole = corner_areas.shape[1], corner_areas.sum(axis=1)
    return corner_areas - whole[:, None] / (d + 1), whole * d / (d + 1)


def named_surfaces(names: Names) -> dict[str, np.ndarray]:
    """Return the facets (f, corners) of the surfaces of contact between bodies, by name.

    They are those that contact.self_contact, contact.pairs, and entries of contact.adhesion name.
    """
    settings = names.scene.contact
    found: dict[str, np.ndarray] = {}
    for k, reference in enumerate(settings.self_contact):
        found[reference] = named_facets(names, reference, ("contact", "self_contact", k))
    for k, pair in enumerate(settings.pairs):
        for side, reference in enumerate(pair.between):
            keys = ("contact", "pairs", k, "between", side)
            found[reference] = named_facets(names, reference, keys)
    for name, spec in between_bodies(settings).items():
        for side, reference in enumerate(spec.between or ()):
            at_entry = ("contact", "adhesion", name, "between", side)
            found[reference] = named_facets(names, reference, at_entry)
    return found


def contact_surfaces(
    settings: Contact, by_name: Mapping[str, np.ndarray]
) -> dict[str, list[np.ndarray]]:
    """Return the facets of contact.self_contact under the name SELF, and of each other surface."""
    adhering = [spec.between or () for spec in between_bodies(settings).values()]
    of_pairs = [name for pair in [*(p.between for p in settings.pairs), *adhering] for name in pair]
    itself = [by_name[name] for name in settings.self_contact]
    return {SELF: itself, **{name: [by_name[name]] for name in of_pairs}}


def point_groups(
    surfaces: Mapping[str, Sequence[np.ndarray]], nodes: np.ndarray, facets: np.ndarray
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the group (k + f,) of each vertex (k,) and facet (f, d), and for each surface which
    groups are in it (groups,).

    Facets that are in the same surfaces make a group. A vertex is in all surfaces of the facets
    around it.
    """
    columns = []
    for parts in surfaces.values():
        of_facets = are_among(facets, parts)
        columns.append(np.concatenate([np.isin(nodes, facets[of_facets]), of_facets]))
    groups, number = np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)
    return number.reshape(-1), dict(zip(surfaces, groups.T, strict=True))


def friction_between(settings: Contact, is_in: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the friction coefficient (groups, groups) between any two groups, -1 where they do not
    touch. The last of several pairs counts.
    """
    usual = settings.self_friction_coefficient
    usual = settings.friction_coefficient if usual is None else usual
    friction = np.where(either_way(is_in, (SELF, SELF)), usual, -1.0)
    for pair in settings.pairs:
        given = pair.friction_coefficient
        friction[either_way(is_in, pair.between)] = usual if given is None else given
    return friction


def either_way(is_in: Mapping[str, np.ndarray], between: tuple[str, str]) -> np.ndarray:
    """Return True (groups, groups) where one group is in the first surface and the other in the
    second.
    """
    one, other = (is_in[name] for name in between)
    both: np.ndarray = np.outer(one, other) | np.outer(other, one)
    return both


def between_bodies(settings: Contact) -> dict[str, AdhesionSpec]:
    """Return the entries of contact.adhesion between two surfaces of bodies."""
    return {name: spec for name, spec in settings.adhesion.items() if spec.between is not None}


@dataclass(frozen=True)
class Surfaces:
    """Facets (f, d) that touch, their side lengths [m] and contact stiffness per area [Pa/m] (f,).

    by_name: facets of the surfaces that the scene names. is_in: for each, True (groups,) for the
    groups in it. may_touch: True (groups, groups) for groups in contact with each other.
    """

    facets: np.ndarray
    sizes: np.ndarray
    stiffness: np.ndarray
    by_name: Mapping[str, np.ndarray]
    is_in: Mapping[str, np.ndarray]
    may_touch: np.ndarray

    def facets_in(self, name: str) -> np.ndarray:
        """Return True (f,) for the facets of a surface."""
        return are_among(self.facets, [self.by_name[name]])


def pair_laws(names: Names, bodies: Sequence[Body], surfaces: Surfaces) -> PairLaws | None:
    """Return the adhesion between groups, or None where nothing adheres. The last of several
    entries counts.

    Raises SceneError for entries without effect, rigid bodies among themselves, and ranges that are
    not resolved.
    """
    specs = between_bodies(names.scene.contact)
    if not specs:
        return None
    shape = surfaces.may_touch.shape
    work, stress, length, tau = np.zeros((4, *shape))
    portion, owner, zones = np.full(shape, 0.5), np.full(shape, -1), []
    for number, (name, spec) in enumerate(specs.items()):
        assert spec.between is not None
        law, own = cohesive_law(spec), either_way(surfaces.is_in, spec.between) & surfaces.may_touch
        if not own.any():
            raise names.loaded.error(
                ("contact", "adhesion", name, "between"),
                "these surfaces are not in contact with each other",
                f"add {{between: [{', '.join(spec.between)}]}} to contact.pairs",
            )
        zones.append(resolved_zone(names, name, law, bodies, surfaces))
        owner[own], work[own], stress[own] = number, law.work, law.pull_off_stress or 0.0
        length[own] = law.range or 0.0
        tau[own] = -1.0 if law.shear_strength is None else law.shear_strength
        ordered = finer_first(surfaces, spec.between)
        if ordered is not None:
            finer, coarser = (surfaces.is_in[side] for side in ordered)
            portion[np.outer(finer, coarser) & own] = 1.0
            portion[np.outer(coarser, finer) & own] = 0.0
    for number, name in enumerate(specs):
        if not (owner == number).any():
            raise names.loaded.error(
                ("contact", "adhesion", name),
                "it has no effect: later entries name the same surfaces",
                "leave it out, or put it after them",
            )
    zone, size = min(zones, key=lambda found: found[0] / found[1])
    return PairLaws(work, stress, length, tau, portion, zone, size)


def finer_first(surfaces: Surfaces, between: tuple[str, str]) -> tuple[str, str] | None:
    """Return the surface whose points contribute the whole area and the other one, None if both
    contribute half.

    Points that stand for more than the facets opposite would adhere where nothing is.
    """
    sizes = {side: float(np.median(surfaces.sizes[surfaces.facets_in(side)])) for side in between}
    finer, coarser = sorted(between, key=lambda side: sizes[side])
    return (finer, coarser) if sizes[coarser] > ALIKE * sizes[finer] else None


def resolved_zone(
    names: Names, name: str, law: CohesiveLaw, bodies: Sequence[Body], surfaces: Surfaces
) -> tuple[float, float]:
    """Return the length of the cohesive zone and the size of the largest facet [m] of an entry.

    Raises SceneError for two rigid bodies, and for a range that is shorter than the depth of the
    penalty contact, or longer than the distance in which facets are found.
    """
    keys: Keys = ("contact", "adhesion", name)
    between = names.scene.contact.adhesion[name].between or ("", "")
    compliance = sum(1.0 / least_modulus(bodies, surfaces.by_name[side]) for side in between)
    if compliance == 0.0:
        raise names.loaded.error(
            (*keys, "between"), "both bodies are rigid", "name at least one deformable body"
        )
    own = surfaces.facets_in(between[0]) | surfaces.facets_in(between[1])
    stiffness, sizes = surfaces.stiffness[own], surfaces.sizes[own]
    of_soft, of_stiff = (float(law.stress(1.0 / k)) for k in (stiffness.min(), stiffness.max()))
    depth = of_soft / float(stiffness.min())
    reach, least = 2.0 * law.work / of_soft - depth, float(sizes.min())
    if reach < depth:
        raise names.loaded.error(keys, SHORTER_THAN_DEPTH, longer_than_depth(reach, depth))
    if reach > LONGEST_RANGE * least:
        raise names.loaded.error(
            keys,
            f"its range is {1e3 * reach:.3g} mm, and the smallest facet is {1e3 * least:.3g} mm: "
            f"bodies attract each other over at most {LONGEST_RANGE:g} of a facet",
            "raise pull_off_stress or set a shorter range, or use larger elements",
        )
    return law.work / compliance / of_stiff**2, float(sizes.max())


def cohesive_law(spec: AdhesionSpec) -> CohesiveLaw:
    """Return the law of an entry of contact.adhesion."""
    return CohesiveLaw(
        spec.work_of_adhesion,
        spec.pull_off_stress,
        spec.range,
        spec.shear_strength,
        separation_rate(spec.rate),
    )


def longer_than_depth(reach: float, depth: float) -> str:
    """Return what to change where the range is shorter than the depth [m]."""
    return (
        f"lower pull_off_stress by a factor of {np.sqrt(2.0 * depth / (reach + depth)):.3g} or "
        "more, set a longer range, or raise the stiffness of the contact"
    )


def named_facets(names: Names, reference: str, keys: Keys) -> np.ndarray:
    """Return the facets (f, d) of a body's whole surface, or of "body.set".

    Those of a rigid body belong to its mesh surface, "body" or "body.surface".
    """
    rigid, _, part = reference.partition(".")
    if rigid in names.scene.rigid_bodies and rigid not in names.bodies:
        if rigid not in names.surfaces or part not in ("", SURFACE):
            raise names.loaded.error(
                keys,
                f"the rigid body '{rigid}' has no "
                + (f"facet set '{part}'" if rigid in names.surfaces else "mesh surface"),
                f'write "{rigid}.surface"'
                if rigid in names.surfaces
                else f"give rigid_bodies.{rigid}.surface: {{file: NAME.stl}}",
            )
        return names.surfaces[rigid].facets
    if "." in reference:
        return names.facet_set(reference, keys)
    if reference not in names.bodies:
        raise names.loaded.error(
            keys,
            f"there is no body '{reference}'",
            close_names(reference, list(names.bodies), "bodies"),
        )
    return names.facet_set(f"{reference}.{SURFACE}", keys)


def connected_parts(
    bodies: Sequence[Body], ties: Ties, surfaces: Sequence[np.ndarray], node_count: int
) -> np.ndarray:
    """Return the number of the part (n,) to which each node is connected.

    Connections are cells, ties, and rigid bodies with a surface. surfaces: the nodes tied to each
    of these.
    """
    cells = np.concatenate([b.cells + b.first_node for b in bodies])
    first = np.repeat(cells[:, :1], cells.shape[1] - 1, axis=1).ravel()
    first = np.concatenate([first, ties.nodes, *(np.repeat(t[:1], len(t)) for t in surfaces)])
    second = np.concatenate([cells[:, 1:].ravel(), ties.corners[:, 0], *surfaces])
    links = coo_array((np.ones(len(first)), (first, second)), shape=(node_count, node_count))
    return connected_components(links, directed=False)[1]


def refuse_overlap(
    names: Names, bodies: Sequence[Body], points: np.ndarray, part: np.ndarray, nodes: np.ndarray
) -> None:
    """Raise SceneError if a node that may touch starts inside another part: it would belong to the
    wrong side.
    """
    for name, surface in names.surfaces.items():
        if np.isin(surface.facets, nodes).any():
            strangers = nodes[part[nodes] != part[surface.first_node]]
            depth = depth_in_surface(points[strangers], points, surface.faces)
            refuse_depth(names, points[strangers], depth, f"the rigid body '{name}'")
    for body in bodies:
        cells = body.cells + body.first_node
        for other in np.unique(part[cells[:, 0]]):
            of_part = cells[part[cells[:, 0]] == other]
            strangers = nodes[part[nodes] != other]
            depth = depth_inside(points[strangers], points, of_part)
            refuse_depth(names, points[strangers], depth, f"body '{body.name}'")


def refuse_depth(names: Names, places: np.ndarray, depth: np.ndarray, what: str) -> None:
    """Raise SceneError if one of the places (k, d) is deep (k,) [m] inside of something."""
    deepest = int(np.argmax(depth)) if len(depth) else 0
    if len(depth) and depth[deepest] > ALLOWED_PENETRATION:
        raise names.loaded.error(
            ("contact", "self_contact"),
            f"a node at {in_mm(places[deepest])} starts inside {what}",
            "move one of them so that they do not overlap",
        )


def depth_inside(places: np.ndarray, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return how deep (k,) [m] each place (k, d) lies in the body of these cells, at least.

    It is the distance to the outer sides of the simplexes at the place, zero outside. A side
    between two cells that hold the place does not count, since its distance to one is that to the
    other. So a place on an inner node is as deep as the cells around it are high.
    """
    cells = simplexes(cells, points.shape[1])
    corners = points[cells]
    centres = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centres[:, None], axis=2).max()
    near = cKDTree(centres).query_ball_point(places, reach)
    gradients = simplex_gradients(points, cells)
    depth = np.zeros(len(places))
    for k, held in enumerate(near):
        if held:
            depth[k] = _depth_in_cells(places[k], corners[held], gradients[held], cells[held])
    return depth


def _depth_in_cells(
    place: np.ndarray, corners: np.ndarray, gradients: np.ndarray, cells: np.ndarray
) -> float:
    """Return the distance of a place to the outer facets of the cells (m, d + 1) that hold it."""
    weights = np.einsum("mci,mi->mc", gradients, place - corners[:, 0])
    weights[:, 0] += 1.0
    holding = (weights > -1e-9).all(axis=1)
    if not holding.any():
        return 0.0
    height = weights[holding] / np.linalg.norm(gradients[holding], axis=2)
    facets = np.stack(
        [np.sort(np.delete(cells[holding], c, axis=1), axis=1) for c in range(cells.shape[1])],
        axis=1,
    )
    _, number, count = np.unique(
        facets.reshape(-1, facets.shape[2]), axis=0, return_inverse=True, return_counts=True
    )
    outer = (count[number.ravel()] == 1).reshape(height.shape)
    return float(height[outer].min())
