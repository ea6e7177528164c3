"""Conditions on node sets: held components, masses, velocities; probes of node sets."""

from collections.abc import Sequence

import numpy as np

from softsim.builder.chambers import lids, refuse_open_chamber
from softsim.compute.mass_scaling import MassScaling, edges_of, grouped
from softsim.elements.geometry import nodal_sums
from softsim.elements.plane_strain import PlaneStrain
from softsim.elements.ring_section import RingSection
from softsim.loads.load import joined_facets
from softsim.mesh.mesh import SURFACE
from softsim.model import Body, Probe
from softsim.scene import outputs
from softsim.scene.conditions import Fixed, InitialVelocity, PointMass, Symmetry
from softsim.scene.names import Names, in_mm
from softsim.scene.text import Keys
from softsim.structures.structure import Structure
from softsim.structures.ties import Ties


def lumped_mass(
    names: Names, bodies: tuple[Body, ...], structures: Sequence[Structure], node_count: int
) -> np.ndarray:
    """Return the mass (n,) [kg] of each node: from its elements, structures and point masses."""
    mass = np.zeros(node_count)
    for b in bodies:
        for r in b.regions:
            shares = r.geometry.mass_shares(r.points, r.cells)
            per_corner = r.material.density * r.volumes[:, None] * shares
            mass[b.nodes] += nodal_sums(r.cells, per_corner, len(r.points))
    for keys, condition in names.conditions(PointMass):
        nodes = names.node_set(condition.nodes, (*keys, "nodes"))
        mass[nodes] += condition.mass / len(nodes)
    for structure in structures:
        mass += structure.nodal_mass(node_count)
    return mass


def mass_scaling(
    names: Names, bodies: tuple[Body, ...], points: np.ndarray, is_free: np.ndarray
) -> MassScaling | None:
    """Return groups of nodes that are free in every direction, or None if the scene wants none.

    Raises SceneError if no two nodes are near enough.
    """
    wanted = names.scene.solver.mass_scaling
    if wanted is None:
        return None
    of_bodies = [edges_of(b.cells + b.first_node, b.facet_sets[SURFACE]) for b in bodies]
    edges, crosses = map(np.concatenate, zip(*of_bodies, strict=True))
    group, count = grouped(points, edges, crosses, np.all(is_free, axis=1), wanted.within)
    if count == 0:
        shortest = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1).min()
        raise names.loaded.error(
            ("solver", "mass_scaling", "within"),
            f"no two nodes that are free in all directions are within {wanted.within * 1e3:.3g} "
            f"mm of each other; the shortest element edge is {shortest * 1e3:.3g} mm",
            "increase mass_scaling.within, or leave mass_scaling out",
        )
    return MassScaling(group, count, wanted.factor)


def held_components(names: Names, bodies: tuple[Body, ...], points: np.ndarray) -> np.ndarray:
    """Return True (n, d) for fixed components.

    They are fixed by body, by condition, or by the axis of a half section.
    """
    held = np.zeros(points.shape, dtype=bool)
    for b in bodies:
        for k, set_name in enumerate(names.scene.bodies[b.name].fixed):
            held[names.node_set(f"{b.name}.{set_name}", ("bodies", b.name, "fixed", k))] = True
        if names.is_axisymmetric:
            held[b.nodes, 0] |= b.points[:, 0] < 1e-12
    for keys, fixed in names.conditions(Fixed):
        nodes = names.node_set(fixed.nodes, (*keys, "nodes"))
        letters = fixed.directions or "xyz"[: names.dimension]
        for k, letter in enumerate(letters):
            held[nodes, names.axis(letter, (*keys, "directions", k))] = True
    for keys, plane in names.conditions(Symmetry):
        nodes = names.node_set(plane.nodes, (*keys, "nodes"))
        axis = names.axis(plane.normal, (*keys, "normal"))
        off = np.ptp(points[nodes, axis])
        if off > 1e-9 * np.ptp(points, axis=0).max():
            raise names.loaded.error(
                (*keys, "nodes"),
                f"the nodes of '{plane.nodes}' do not lie in a plane normal to {plane.normal}: "
                f"their {plane.normal} coordinates differ by {off * 1e3:.3g} mm",
                "choose a node set in the plane of symmetry, or the direction normal to it",
            )
        held[nodes, axis] = True
    return held


def initial_velocity(
    names: Names, bodies: tuple[Body, ...], points: np.ndarray, mass: np.ndarray
) -> np.ndarray:
    """Return the initial velocity of each node (n, d) [m/s].

    points (n, d) [m], mass (n,) [kg].
    """
    velocity = np.zeros_like(points)
    for b in bodies:
        given = names.scene.bodies[b.name].initial_velocity
        velocity[b.nodes] = names.vector(given, ("bodies", b.name, "initial_velocity"))
    for keys, condition in names.conditions(InitialVelocity):
        nodes = names.node_set(condition.nodes, (*keys, "nodes"))
        translation = names.vector(condition.velocity, (*keys, "velocity"))
        velocity[nodes] = translation + spin(names, condition, points[nodes], mass[nodes], keys)
    return velocity


def spin(
    names: Names,
    condition: InitialVelocity,
    points: np.ndarray,
    mass: np.ndarray,
    keys: Keys,
) -> np.ndarray:
    """Return omega x (x - c) (k, d) [m/s] of nodes at `points` (k, d) [m] with `mass` (k,) [kg]."""
    given = condition.angular_velocity
    if given is None:
        return np.zeros_like(points)
    if condition.about is None:
        centre = mass @ points / mass.sum()
    else:
        centre = names.vector(condition.about, (*keys, "about"))
    arms = np.zeros((len(points), 3))
    arms[:, : names.dimension] = points - centre
    omega = angular_velocity(names, given, (*keys, "angular_velocity"))
    return np.cross(omega, arms)[:, : names.dimension]


def angular_velocity(names: Names, given: float | tuple[float, ...], keys: Keys) -> np.ndarray:
    """Return an angular velocity (3,) [rad/s]; a section has its component about z alone."""
    if names.is_axisymmetric:
        raise names.loaded.error(
            keys,
            "an axisymmetric model cannot turn",
            "leave angular_velocity out, or use a 3D model (formulation solid)",
        )
    if not isinstance(given, tuple):
        return np.array([0.0, 0.0, given])
    if len(given) != 3 or names.dimension == 2:
        raise names.loaded.error(
            keys,
            f"angular_velocity has {len(given)} components, which does not fit a model of "
            f"{names.dimension} dimensions",
            "give one value, about z; in 3D give three, about x, y and z",
        )
    return np.array(given)


def probes(names: Names, points: np.ndarray, is_free: np.ndarray, ties: Ties) -> tuple[Probe, ...]:
    """Return the probes that the history records in addition to its own columns."""
    result = []
    for name, probe in names.scene.output.probes.items():
        keys = ("output", "probes", name)
        if isinstance(probe, outputs.VolumeProbe):
            facets = joined_facets(names, probe.facets, keys)
            body = names.bodies[probe.facets[0].partition(".")[0]]
            geometry = names.common_geometry(facets, keys)
            remedy = "hold the rim (bodies.NAME.fixed)"
            refuse_open_chamber(names, facets, points, ~is_free, remedy, keys)
            closed = np.concatenate([facets, lids(names, facets, points, ~is_free)])
            members = geometry.pressed(closed, body.first_node)
        else:
            members = names.node_set(probe.nodes, (*keys, "nodes"))
            geometry = names.geometry
            refuse_radius_without_axis(names, probe.kind, keys)
            refuse_rotation_of_line(names, probe.kind, points[members], keys)
            refuse_reaction_of_tied(names, probe.kind, members, points, ties, keys)
        result.append(Probe(name, probe.kind, members, geometry))
    return tuple(result)


def refuse_reaction_of_tied(
    names: Names, kind: str, members: np.ndarray, points: np.ndarray, ties: Ties, keys: Keys
) -> None:
    """Raise SceneError if a reaction probe contains tied nodes.

    The force on a tied node acts on the nodes of its facet.
    """
    tied = np.intersect1d(members, ties.nodes)
    if kind == "reaction" and len(tied):
        raise names.loaded.error(
            (*keys, "nodes"),
            f"the node at {in_mm(points[tied[0]])} is tied to a facet, so its force acts on the "
            "nodes of the facet",
            "leave tied nodes out of the set; use the nodes of the facet instead",
        )


def refuse_rotation_of_line(names: Names, kind: str, points: np.ndarray, keys: Keys) -> None:
    """Raise SceneError if nodes at these places (n, d) [m] do not determine a rotation."""
    if kind != "rotation":
        return
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    needed = points.shape[1] - 1
    spread = len(sizes) >= needed and sizes[needed - 1] > 1e-6 * sizes[0]
    if not spread:
        raise names.loaded.error(
            (*keys, "nodes"),
            "the nodes are at one place" if needed == 1 else "the nodes are in one line",
            "their rotation is not determined: name a set of a face",
        )


def refuse_radius_without_axis(names: Names, kind: str, keys: Keys) -> None:
    """Raise SceneError if a radius is measured in a plane section, which has no axis."""
    if kind == "radius" and isinstance(names.geometry, PlaneStrain | RingSection):
        raise names.loaded.error(
            (*keys, "kind"),
            f"a {names.geometry.name} model has no axis from which a radius could be measured",
            "record the displacement",
        )
