"""Self-contact: the surfaces that a scene names, and how stiff they are against each other."""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from softsim.builder.contact import ALLOWED_PENETRATION, Stiffness
from softsim.builder.names import Names, close_names, in_mm
from softsim.elements.quadrature import simplex_gradients
from softsim.elements.ties import Ties
from softsim.mesh.bearing import nodes_per_facet_bound
from softsim.mesh.mesh import SURFACE, simplex_facets, simplexes
from softsim.model import Body, ContactData, SelfContactData

# Of the penalty stiffness against a wall. Two surfaces that press each other are as stiff as one
# after the other, a half; the nodes of each are held against the facets of the other, a half each.
# Where facets are uneven, so that one corner bears many nodes, less, but no less than this.
LARGEST_SHARE, LEAST_SHARE = 0.25, 0.125


def self_contact(
    names: Names,
    bodies: Sequence[Body],
    points: np.ndarray,
    ties: Ties,
    mass: np.ndarray,
    stiffness: Stiffness,
) -> SelfContactData | None:
    """What contact.self_contact names, or None where it names nothing.

    points (n, d) [m] of all nodes, mass (n,) [kg] that a force on each has to move. Raises
    SceneError for a name that does not exist, and for bodies that start inside each other.
    """
    references = names.scene.contact.self_contact
    if not references:
        return None
    named = [named_facets(names, r, k) for k, r in enumerate(references)]
    facets = np.unique(np.concatenate([simplex_facets(f)[0] for f in named]), axis=0)
    nodes = np.unique(facets)
    part = connected_parts(bodies, ties, len(points))
    refuse_overlap(names, bodies, points, part, nodes)
    sides = np.linalg.norm(points[facets] - points[np.roll(facets, 1, axis=1)], axis=2)
    facet_size = sides.max(axis=1)
    size = np.zeros(len(points))
    np.maximum.at(size, facets, facet_size[:, None])
    return SelfContactData(
        contact=surface_against_surface(names, points, facets, mass, stiffness),
        facets=facets,
        node_size=size[nodes],
        facet_size=facet_size,
        node_part=part[nodes],
        facet_part=part[facets[:, 0]],
    )


def named_facets(names: Names, reference: str, k: int) -> np.ndarray:
    """Facets (f, d) of a body's whole surface, or of "body.set"; entry k of the list."""
    keys = ("contact", "self_contact", k)
    if "." in reference:
        return names.facet_set(reference, keys)
    if reference not in names.bodies:
        raise names.loaded.error(
            keys,
            f"there is no body '{reference}'",
            close_names(reference, list(names.bodies), "bodies"),
        )
    return names.facet_set(f"{reference}.{SURFACE}", keys)


def surface_against_surface(
    names: Names, points: np.ndarray, facets: np.ndarray, mass: np.ndarray, stiffness: Stiffness
) -> ContactData:
    """Contact data of the corners of facets (f, d) against facets.

    No node is stiffer than most: of two that press each other the softer decides. The dashpot is
    sized by a node's own mass, even where it is tied to a rigid body: what it touches is as light.
    """
    settings = names.scene.contact
    nodes = np.unique(facets)
    of_walls = stiffness.penalty[nodes]
    median = np.median(of_walls)
    evened = np.minimum(of_walls, median)
    # What may add up at a corner (stability/contact_stiffness.py) is then no more than a wall adds.
    share = of_walls / (2.0 * (evened + median * nodes_per_facet_bound(points, facets, nodes)))
    k_n = np.clip(share.min(), LEAST_SHARE, LARGEST_SHARE) * evened
    damping = 2.0 * settings.damping_ratio * np.sqrt(k_n * mass[nodes])
    friction = settings.self_friction_coefficient
    return ContactData(
        nodes=nodes,
        penalty_stiffness=k_n,
        tangential_stiffness=settings.tangential_stiffness_ratio * k_n,
        damping=damping,
        tangential_damping=settings.tangential_damping_fraction * damping,
        effective_mass=mass[nodes],
        friction_coefficient=settings.friction_coefficient if friction is None else friction,
    )


def connected_parts(bodies: Sequence[Body], ties: Ties, node_count: int) -> np.ndarray:
    """Number of the part (n,) that each node is connected with through cells and ties."""
    cells = np.concatenate([b.cells + b.first_node for b in bodies])
    first = np.repeat(cells[:, :1], cells.shape[1] - 1, axis=1).ravel()
    first, second = np.append(first, ties.nodes), np.append(cells[:, 1:], ties.corners[:, 0])
    links = coo_array((np.ones(len(first)), (first, second)), shape=(node_count, node_count))
    return connected_components(links, directed=False)[1]


def refuse_overlap(
    names: Names, bodies: Sequence[Body], points: np.ndarray, part: np.ndarray, nodes: np.ndarray
) -> None:
    """No node that may touch starts inside another part: it would belong to the wrong side."""
    for body in bodies:
        cells = body.cells + body.first_node
        for other in np.unique(part[cells[:, 0]]):
            of_part = cells[part[cells[:, 0]] == other]
            strangers = nodes[part[nodes] != other]
            depth = depth_inside(points[strangers], points, of_part)
            deepest = int(np.argmax(depth)) if len(depth) else 0
            if len(depth) and depth[deepest] > ALLOWED_PENETRATION:
                raise names.loaded.error(
                    ("contact", "self_contact"),
                    f"a node at {in_mm(points[strangers[deepest]])} starts inside body "
                    f"'{body.name}'",
                    "move one of them so that they do not overlap",
                )


def depth_inside(places: np.ndarray, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """How deep (k,) [m] each place (k, d) lies in the body of these cells, at least: the distance
    to the outer sides of the simplexes at the place, zero outside.

    A side between two cells that hold the place does not count: its distance to one is that to the
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
    """Distance from a place to the outer facets of those cells (m, d + 1) that hold it."""
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
