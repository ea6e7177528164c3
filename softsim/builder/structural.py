"""Structural components: cables, layers, fibres, eyelets and ties."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_array

from softsim.builder.contact import ALLOWED_PENETRATION, PenaltyStiffness
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.wall import OffsetWall, Wall
from softsim.elements.axisymmetric import Axisymmetric
from softsim.elements.geometry import nodal_sums
from softsim.elements.ring_section import RingSection
from softsim.elements.solid import triangles_of
from softsim.errors import MeshError
from softsim.mesh.mesh import SURFACE
from softsim.mesh.quality import check
from softsim.mesh.surface import at, closest_on_facets, side_lengths
from softsim.scene import structural
from softsim.scene.loading import LoadedScene
from softsim.scene.names import MeshedBody, Names, PlacedCable, close_names, in_mm, model_vector
from softsim.scene.text import Keys
from softsim.structures.cable import Cable
from softsim.structures.fibre import Fibre, Fibres, embedded
from softsim.structures.layer import Layer
from softsim.structures.structure import Structure
from softsim.structures.ties import Ties


def built_structures(
    names: Names, points: np.ndarray, is_free: np.ndarray
) -> tuple[Structure, ...]:
    """Return the structures of a scene without contact, with the nodes at points (n, d) [m].

    The order is that of the forces in a sum: cables, layers, fibres. is_free (n, d): of all nodes.
    Raises SceneError where a structure cannot be built.
    """
    fibres = tuple(fibre(names, name) for name in names.scene.fibres)
    return (
        *(cable(names, name, is_free) for name in names.cables),
        *(layer(names, name, points) for name in names.scene.layers),
        *([Fibres(fibres)] if fibres else []),
    )


def touching_structures(
    names: Names, structures: Sequence[Structure], is_free: np.ndarray, stiffness: PenaltyStiffness,
    walls: Sequence[Wall],
) -> tuple[Structure, ...]:  # fmt: skip
    """Return the structures with the contact of cables with walls.

    Raises SceneError if a cable starts inside a wall.
    """
    return tuple(
        touching_cable(names, one, is_free, stiffness, walls) if isinstance(one, Cable) else one
        for one in structures
    )


# -------------------------------------------------------------------------------------------------
# Cables: their nodes along a line, their contact with walls.

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
        if isinstance(geometry, Axisymmetric):
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


def along(
    loaded: LoadedScene, name: str, data: structural.CableSpec, corners: np.ndarray
) -> np.ndarray:
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
# Places in bodies: the elements around them, and how far outside they may lie.

# Default distance from the surface that a place or a tied node may have, over the mean side of its
# facets.
SURFACE_TOLERANCE = 0.05


def refuse_all_around(names: Names, what: str, keys: Keys) -> None:
    """Raise SceneError in an axisymmetric or ring model, where `what` would be a closed sheet."""
    if isinstance(names.geometry, Axisymmetric | RingSection):
        raise names.loaded.error(
            keys,
            f"{what} in a model that is {names.geometry.name} would be a closed sheet around the "
            "axis",
            "write formulation solid or plane_strain, or use a layer instead",
        )


def usual_tolerance(body: MeshedBody) -> float:
    """Return the default tolerance [m]: how far outside of a body a place may lie."""
    facets, points = body.mesh.facet_sets[SURFACE], body.mesh.points
    sides = side_lengths(points, facets)
    return SURFACE_TOLERANCE * float(sides[sides > 0.0].mean())


def in_bodies(
    names: Names, places: np.ndarray, tolerance: float | None, keys: Keys
) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (k, c) that each place (k, d) [m] follows, and their weights (k, c).

    They belong to the body in which the place lies, or to which it is closest. tolerance: how far
    it may lie outside [m], None: the usual one. Raises SceneError at `keys` with the number of a
    place that is farther away.
    """
    found = []
    for body in names.bodies.values():
        mesh = body.mesh
        nodes, weights, moved = embedded(places, mesh.points, mesh.cells, mesh.facet_sets[SURFACE])
        most = usual_tolerance(body) if tolerance is None else tolerance
        found.append((body.first_node + nodes, weights, moved, np.full(len(places), most)))
    nodes, weights, moved, allowed = (np.stack(parts) for parts in zip(*found, strict=True))
    closest, each = np.argmin(moved, axis=0), np.arange(len(places))
    outside = np.flatnonzero(moved[closest, each] > allowed[closest, each])
    if len(outside):
        k = int(outside[0])
        name = list(names.bodies)[closest[k]]
        raise names.loaded.error(
            (*keys, k),
            f"{in_mm(places[k])} is outside all bodies: {moved[closest[k], k] * 1e3:.3g} mm from "
            f"'{name}', more than the tolerance of {allowed[closest[k], k] * 1e3:.3g} mm",
            "place it inside a body",
        )
    return nodes[closest, each], weights[closest, each]


# A helix is a polygon with so many sides a turn, at least.
LEAST_SIDES = 8

MOST_BARS = 100_000
"""Number of bars above which a fibre is refused: its places would not fit in memory."""


def fibre(names: Names, name: str) -> Fibre:
    """Return a fibre of a scene.

    Raises SceneError in an axisymmetric model or a ring section, for a fibre without a length, and
    for one that leaves its body.
    """
    data, keys = names.scene.fibres[name], ("fibres", name)
    refuse_all_around(names, "a fibre", keys)
    if data.body not in names.bodies:
        raise names.loaded.error(
            (*keys, "body"),
            f"there is no body '{data.body}'",
            close_names(data.body, list(names.bodies), "bodies"),
        )
    body = names.bodies[data.body]
    if data.helix is None:
        places = along_corners(names, name)
    else:
        places = along_helix(names, data.helix, data.spacing, (*keys, "helix"))
    points = body.mesh.points
    nodes, weights, moved = embedded(places, points, body.mesh.cells, body.mesh.facet_sets[SURFACE])
    refuse_outside(names, name, body, places, moved)
    held = at(weights, points[nodes])
    area = 0.25 * np.pi * data.diameter**2
    return Fibre(
        name=name,
        corners=body.first_node + nodes,
        weights=weights,
        lengths=np.linalg.norm(np.diff(held, axis=0), axis=1),
        stretching_stiffness=data.youngs_modulus * area,
        mass_per_length=data.density * area,
        bears_compression=data.bears_compression,
    )


def along_corners(names: Names, name: str) -> np.ndarray:
    """Return places (k, d) [m] along a fibre: its points, and places evenly between them."""
    data = names.scene.fibres[name]
    assert data.points is not None
    corners = [
        names.vector(point, ("fibres", name, "points", k)) for k, point in enumerate(data.points)
    ]
    places = [corners[0]]
    for k, (start, end) in enumerate(pairwise(corners)):
        length = float(np.linalg.norm(end - start))
        if length == 0.0:
            raise names.loaded.error(
                ("fibres", name, "points", k + 1),
                f"'{name}' has two successive points at {in_mm(start)}",
                "leave one of them out",
            )
        count = bar_count(names, length, data.spacing, ("fibres", name, "spacing"))
        places += [start + (end - start) * step / count for step in range(1, count)]
        places.append(end)
    return np.array(places)


def bar_count(names: Names, length: float, spacing: float, keys: Keys) -> int:
    """Return the number of bars of about `spacing` [m] on a length [m] of a fibre.

    Raises SceneError above MOST_BARS.
    """
    count = length / spacing
    if not count <= MOST_BARS:
        raise names.loaded.error(
            keys,
            f"a fibre of {length:.4g} m would have {count:.3g} bars; at most {MOST_BARS} are "
            "possible",
            "set spacing to about half of the element size; check pitch and turns of a helix",
        )
    return max(1, round(count))


def along_helix(names: Names, helix: structural.Helix, spacing: float, keys: Keys) -> np.ndarray:
    """Return places (k, 3) [m], evenly spaced along a helix.

    Raises SceneError in a section, and if the spacing makes too coarse a polygon of it.
    """
    if names.dimension == 2:
        raise names.loaded.error(
            keys,
            "a helix is not possible in a plane section",
            "write points, or use formulation solid",
        )
    axis = names.axis(helix.direction, (*keys, "direction"))
    a_turn = float(np.hypot(2.0 * np.pi * helix.radius, helix.pitch))
    if spacing * LEAST_SIDES > a_turn:
        raise names.loaded.error(
            (*keys[:-1], "spacing"),
            f"a turn of the helix is {a_turn * 1e3:.4g} mm long, less than {LEAST_SIDES} bars of "
            f"{spacing * 1e3:.4g} mm",
            f"set spacing to at most {a_turn / LEAST_SIDES * 1e3:.3g} mm",
        )
    count = bar_count(names, helix.turns * a_turn, spacing, (*keys[:-1], "spacing"))
    turned = helix.turns * np.linspace(0.0, 1.0, count + 1)
    sense = 1.0 if helix.handedness == "right" else -1.0
    angle = helix.start_angle + sense * 2.0 * np.pi * turned
    across = [helix.radius * np.cos(angle), helix.radius * np.sin(angle)]
    # The first column is along the axis; those after it follow as y after x.
    places = np.roll(np.stack([helix.pitch * turned, *across], axis=1), axis, axis=1)
    return places + names.vector(helix.center, (*keys, "center"))


def refuse_outside(
    names: Names, name: str, body: MeshedBody, places: np.ndarray, moved: np.ndarray
) -> None:
    """Raise SceneError if a place (k, d) [m] of a fibre is too far outside its body.

    moved (k,) [m]: its distance from the body, which must not exceed the tolerance.
    """
    data = names.scene.fibres[name]
    tolerance = usual_tolerance(body) if data.tolerance is None else data.tolerance
    out = np.flatnonzero(moved > tolerance)
    if not len(out):
        return
    worst = int(np.argmax(moved))
    raise names.loaded.error(
        ("fibres", name, "helix" if data.points is None else "points"),
        f"'{name}' leaves body '{data.body}' at {in_mm(places[out[0]])}; at "
        f"{in_mm(places[worst])} it is {moved[worst] * 1e3:.3g} mm outside, more than the "
        f"tolerance of {tolerance * 1e3:.3g} mm",
        f"place it inside the body, or raise the tolerance (fibres.{name}.tolerance)",
    )


# -------------------------------------------------------------------------------------------------
# Thin layers on facets of bodies: their material data and their mass.


def layer(names: Names, name: str, points: np.ndarray) -> Layer:
    """Return a layer of a scene, with the nodes at points (n, d) [m].

    Layers on the same facets add up. Raises SceneError in a ring section, and on the axis.
    """
    data, keys = names.scene.layers[name], ("layers", name)
    if isinstance(names.geometry, RingSection):
        raise names.loaded.error(
            keys,
            "a ring_section cannot have a layer: the hoop stretch at its surface is not defined",
            "write formulation plane_strain, axisymmetric or solid",
        )
    facets, areas = layer_facets(names, name)
    masses = nodal_sums(facets, data.density * data.thickness * areas, len(points))
    if names.dimension == 3:
        facets, share = triangles_of(facets)
        gradients, areas = on_triangles(points[facets])
        whole = areas > 0.0  # not what is left of a triangle among quadrilaterals
        facets, gradients, areas = facets[whole], gradients[whole], share * areas[whole]
    else:
        gradients, areas = on_edges(points[facets]), areas.sum(axis=1)
    around = np.zeros(len(facets))
    if isinstance(names.geometry, Axisymmetric):
        radius = points[facets][:, :, 0].mean(axis=1)
        refuse_axis(names, data.facets, points, facets, radius, (*keys, "facets"))
        around = 1.0 / radius
    return Layer(
        name=name,
        facets=facets,
        gradients=gradients,
        around=around,
        volumes=data.thickness * areas,
        youngs_modulus=data.youngs_modulus,
        poisson_ratio=data.poisson_ratio,
        masses=masses,
    )


def layer_facets(names: Names, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the facets (m, corners) of a layer, and their corners' areas (m, corners) [m^2]."""
    data = names.scene.layers[name]
    facets = names.facet_set(data.facets, ("layers", name, "facets"))
    areas = np.zeros(facets.shape)
    for body, region, chosen in names.bounded(facets):
        of_body = facets[chosen] - body.first_node
        areas[chosen] = region.geometry.corner_areas(body.mesh.points, of_body)
    return facets, areas


def on_edges(ends: np.ndarray) -> np.ndarray:
    """Return gradients (m, 2, 1) [1/m] along edges between these ends (m, 2, d) [m]."""
    inverse = 1.0 / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return np.stack([-inverse, inverse], axis=1)[:, :, None]


def on_triangles(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return gradients (m, 3, 2) [1/m] in the plane of triangles, and their areas (m,) [m^2].

    The corners are (m, 3, 3) [m]; the directions are the first side and across it. The gradients of
    a flat triangle are zero.
    """
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.linalg.norm(e, axis=1)
    double = np.linalg.norm(np.cross(e, f), axis=1)
    whole = double > 1e-12 * (length**2 + (f**2).sum(axis=1))
    length, double = np.where(whole, length, 1.0), np.where(whole, double, 1.0)
    along, height = (e * f).sum(axis=1) / length, double / length
    zero = np.zeros(len(e))
    second = np.stack([1.0 / length, -along / double], axis=1)
    third = np.stack([zero, 1.0 / height], axis=1)
    gradients = np.stack([-second - third, second, third], axis=1)
    return gradients, np.where(whole, 0.5 * double, 0.0)


def refuse_axis(
    names: Names, reference: str, points: np.ndarray, facets: np.ndarray, radius: np.ndarray,
    keys: Keys,
) -> None:  # fmt: skip
    """Raise SceneError if a facet lies on the axis, where it would have no circumference."""
    on_axis = np.flatnonzero(radius < 1e-12)
    if len(on_axis):
        raise names.loaded.error(
            keys,
            f"the facet of '{reference}' at {in_mm(points[facets[on_axis[0]]].mean(axis=0))} lies "
            "on the axis",
            "leave it out of the set: a facet on the axis is not part of the surface of the body",
        )


# -------------------------------------------------------------------------------------------------
# Ties of nodes to facets: the place of each node on its facet, and checks.

# Of the model's size: a node that is moved by less was there already.
ROUND_OFF = 1e-12
# A corner with less weight carries nothing.
NO_WEIGHT = 1e-9


def placed_ties(names: Names) -> tuple[Names, Ties]:
    """Return the scene's bodies with tied nodes moved onto their facets, and all ties.

    Raises SceneError for a node that is too far from its facets, follows two of them, follows
    itself or a tied node, or cannot be moved.
    """
    tied, corners, weights, shifts = [], [], [], []
    points = np.concatenate([body.mesh.points for body in names.bodies.values()])
    for name, data in names.scene.ties.items():
        keys = ("ties", name)
        names.body(data.nodes, (*keys, "nodes"))  # nodes of a cable cannot be tied
        nodes = np.unique(names.node_set(data.nodes, (*keys, "nodes")))
        facets = names.facet_set(data.facets, (*keys, "facets"))
        refuse_ring_section(names, keys)
        facet, shares = closest_on_facets(points[nodes], points, facets)
        followed = facets[facet]
        places = at(shares, points[followed])
        refuse_far_nodes(names, name, points, nodes, places, facets)
        refuse_common_cells(names, name, points, nodes, followed)
        tied.append(nodes)
        corners.append(followed)
        weights.append(shares)
        shifts.append(np.linalg.norm(places - points[nodes], axis=1))
    if not tied:
        none = np.zeros((0, names.dimension))
        return names, Ties(np.zeros(0, dtype=int), none.astype(int), none, np.zeros(0))
    refuse_chains(names, points, tied, corners)
    ties = Ties(*(np.concatenate(parts) for parts in (tied, corners, weights, shifts)))
    moved = ties.followed(points)
    bodies = {
        name: moved_body(names, name, body, points, moved) for name, body in names.bodies.items()
    }
    return replace(names, bodies=bodies), ties


def moved_body(
    names: Names, name: str, body: MeshedBody, points: np.ndarray, moved: np.ndarray
) -> MeshedBody:
    """Return a body whose nodes are moved from their `points` (n, d) [m] to `moved`."""
    nodes = slice(body.first_node, body.first_node + len(body.mesh.points))
    way = np.linalg.norm(moved[nodes] - points[nodes], axis=1)
    if not way.any():
        return body
    mesh = replace(body.mesh, points=moved[nodes])
    try:
        check(mesh)
    except MeshError as error:
        by = [k for k, data in names.scene.ties.items() if data.nodes.startswith(f"{name}.")]
        raise names.loaded.error(
            ("ties", by[0]),
            f"with its tied nodes on the facets, the mesh of '{name}' is not valid: "
            f"{error.message}",
            "move the nodes closer to the facets, or lower the tolerance",
        ) from None
    shifted = int((way > ROUND_OFF * np.ptp(points)).sum())
    remark = f"{shifted} tied nodes moved onto facets, by at most {way.max() * 1e3:.3g} mm"
    return replace(body, mesh=mesh, remarks=(*body.remarks, *([remark] if shifted else [])))


def refuse_ring_section(names: Names, keys: Keys) -> None:
    """Raise SceneError in a ring section, where both strips would have to be tied equally."""
    if isinstance(names.geometry, RingSection):
        raise names.loaded.error(
            keys,
            "a ring_section cannot be tied: its two strips form one ring",
            "write formulation plane_strain, axisymmetric or solid",
        )


def refuse_far_nodes(
    names: Names,
    name: str,
    points: np.ndarray,
    nodes: np.ndarray,
    places: np.ndarray,
    facets: np.ndarray,
) -> None:
    """Raise SceneError if a node (k,) is farther than the tolerance from its place (k, d) [m]."""
    data = names.scene.ties[name]
    apart = points[nodes] - places
    distance = np.linalg.norm(apart, axis=1)
    sides = side_lengths(points, facets)
    usual = SURFACE_TOLERANCE * float(sides[sides > 0.0].mean())
    tolerance = usual if data.tolerance is None else data.tolerance
    far = np.flatnonzero(distance > tolerance)
    if not len(far):
        return
    worst = int(np.argmax(distance))
    given = data.tolerance is not None
    raise names.loaded.error(
        ("ties", name, "tolerance") if given else ("ties", name),
        f"the node of '{data.nodes}' at {in_mm(points[nodes[worst]])} is "
        f"{distance[worst] * 1e3:.4g} mm away from the facets of '{data.facets}'; {len(far)} "
        f"of {len(nodes)} nodes are more than {tolerance * 1e3:.4g} mm away"
        + ("" if given else ", 5 % of the mean side of the facets"),
        "leave nodes that are not to be tied out of the set, move the bodies closer together, or "
        f"raise the tolerance (ties.{name}.tolerance)",
    )


def refuse_common_cells(
    names: Names, name: str, points: np.ndarray, nodes: np.ndarray, corners: np.ndarray
) -> None:
    """Raise SceneError if a node (k,) shares an element with a corner (k, c) that it would follow.

    That would prevent the element from deforming.
    """
    data, count = names.scene.ties[name], len(points)
    cells = np.concatenate([b.mesh.cells + b.first_node for b in names.bodies.values()])
    of_cells = members(cells, count)
    beside = of_cells[:, nodes].T @ of_cells  # (k, n): in how many elements two nodes are
    shared = beside.multiply(members(corners, count))
    row, _ = shared.nonzero()
    if len(row):
        raise names.loaded.error(
            ("ties", name, "nodes"),
            f"the node of '{data.nodes}' at {in_mm(points[nodes[row[0]]])} belongs to an element "
            f"that shares a node with the facet of '{data.facets}' to which it would be tied",
            "tie nodes to facets of another body, or across a gap",
        )


def members(lists: np.ndarray, count: int) -> csr_array:
    """Return a sparse matrix (k, n), nonzero in each row at the listed nodes (k, m).

    count: number n of nodes.
    """
    rows = np.repeat(np.arange(len(lists)), lists.shape[1])
    return csr_array((np.ones(rows.size), (rows, lists.ravel())), shape=(len(lists), count))


def refuse_chains(
    names: Names, points: np.ndarray, tied: list[np.ndarray], corners: list[np.ndarray]
) -> None:
    """Raise SceneError if a node is tied twice, or follows nodes that are tied."""
    by = np.full(len(points), -1)
    keys = list(names.scene.ties)
    for number, nodes in enumerate(tied):
        again = nodes[by[nodes] >= 0]
        if len(again):
            raise names.loaded.error(
                ("ties", keys[number], "nodes"),
                f"the node at {in_mm(points[again[0]])} is already tied by '{keys[by[again[0]]]}'",
                "a node can be tied to one surface only: leave it out of one of the sets",
            )
        by[nodes] = number
    for number, followed in enumerate(corners):
        chained = followed[by[followed] >= 0]
        if len(chained):
            raise names.loaded.error(
                ("ties", keys[number], "facets"),
                f"the node of a facet at {in_mm(points[chained[0]])} is itself tied, by "
                f"'{keys[by[chained[0]]]}'",
                "tie both to one surface, or exchange nodes and facets of one tie",
            )


def refuse_held_nodes(
    names: Names, ties: Ties, points: np.ndarray, fixed: np.ndarray, held: np.ndarray
) -> None:
    """Raise SceneError if a tied node is prescribed, tied to a rigid body or fixed (n, d).

    It may be fixed only where all nodes that it follows are, as on a plane of symmetry. held (n,
    d): held in any way.
    """
    carries = (ties.weights > NO_WEIGHT)[:, :, None]
    alike = np.where(carries, fixed[ties.corners], True).all(axis=1)
    wrong = np.flatnonzero((held[ties.nodes] & ~(fixed[ties.nodes] & alike)).any(axis=1))
    if not len(wrong):
        return
    node = int(ties.nodes[wrong[0]])
    name = tie_of(names, node)
    raise names.loaded.error(
        ("ties", name, "nodes"),
        f"the node of '{names.scene.ties[name].nodes}' at {in_mm(points[node])} is fixed, "
        "prescribed or tied to a rigid body, but its facet is not",
        "hold the facet instead, or leave the node out of the set",
    )


def tie_of(names: Names, node: int) -> str:
    """Return the name of the tie of a node."""
    return next(
        name
        for name, data in names.scene.ties.items()
        if node in names.node_set(data.nodes, ("ties", name, "nodes"))
    )
