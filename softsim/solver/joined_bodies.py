"""Tied bodies joined into one body, which vibrates as a whole."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from softsim.model import Body, Model


def joined_bodies(model: Model) -> list[Body]:
    """Return the bodies of a model, with each group of tied bodies joined into one.

    Nodes of a body are numbered without a gap: bodies between two joined ones in the scene are
    joined to them too.
    """
    between = [(k, max(a, b)) for a, b in tied_pairs(model) for k in range(min(a, b), max(a, b))]
    group = linked_groups(np.array(between, dtype=int).reshape(-1, 2), len(model.bodies))
    groups = [np.flatnonzero(group == g) for g in dict.fromkeys(group.tolist())]
    return [joined([model.bodies[k] for k in members]) for members in groups]


def tied_pairs(model: Model) -> np.ndarray:
    """Return the numbers (k, 2) of the two bodies that each tied node joins."""
    starts = np.array([body.first_node for body in model.bodies])
    ends = np.column_stack([model.ties.nodes, model.ties.corners[:, 0]])
    return np.searchsorted(starts, ends, side="right") - 1


def linked_groups(pairs: np.ndarray, count: int) -> np.ndarray:
    """Return the number of the group (count,) of each of `count` bodies, linked by pairs (k, 2)."""
    links = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1])


def joined(bodies: Sequence[Body]) -> Body:
    """Return bodies with consecutive nodes as one body; a single body is returned unchanged.

    The sets of the joined body are named "body.set".
    """
    first = bodies[0]
    if len(bodies) == 1:
        return first
    points = np.concatenate([body.points for body in bodies])
    shifts = [body.first_node - first.first_node for body in bodies]
    before = np.cumsum([0, *(len(body.cells) for body in bodies)])
    regions = [
        replace(
            region, first_node=first.first_node, points=points, cells=region.cells + shift,
            numbers=region.numbers + cells,
        )
        for body, shift, cells in zip(bodies, shifts, before, strict=False)
        for region in body.regions
    ]  # fmt: skip
    return Body(
        name=" + ".join(body.name for body in bodies),
        first_node=first.first_node,
        points=points,
        cells=np.concatenate([b.cells + s for b, s in zip(bodies, shifts, strict=True)]),
        regions=tuple(regions),
        node_sets={f"{b.name}.{k}": nodes for b in bodies for k, nodes in b.node_sets.items()},
        facet_sets={f"{b.name}.{k}": facets for b in bodies for k, facets in b.facet_sets.items()},
        cell_sets={
            f"{b.name}.{name}": cells + start
            for b, start in zip(bodies, before, strict=False)
            for name, cells in b.cell_sets.items()
        },
        remarks=tuple(remark for body in bodies for remark in body.remarks),
        not_read=tuple(text for body in bodies for text in body.not_read),
    )
