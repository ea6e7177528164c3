"""Ties of nodes to facets: the place of each node on its facet, and checks."""

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from softsim.builder.names import MeshedBody, Names, in_mm
from softsim.elements.ring_section import RingSection
from softsim.elements.ties import Ties
from softsim.errors import MeshError
from softsim.mesh.bearing import side_lengths
from softsim.mesh.closest import at, closest_on_facets
from softsim.mesh.quality import check
from softsim.scene.tree import Keys

# Of the mean side of the facets: how far off them a node may lie where the scene says nothing.
USUAL_TOLERANCE = 0.05
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
    usual = USUAL_TOLERANCE * float(sides[sides > 0.0].mean())
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
