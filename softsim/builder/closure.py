"""Chambers: whether facets close one, and the lids that complete their surface to a volume."""

from itertools import pairwise

import numpy as np

from softsim.builder.names import Names, in_mm
from softsim.elements.geometry import Axisymmetric
from softsim.mesh.mesh import open_rim
from softsim.scene.tree import Keys


def joined_facets(names: Names, references: tuple[str, ...], keys: Keys) -> np.ndarray:
    """Facets (k, corners) of the named sets, none of them twice."""
    facets = np.concatenate(
        [names.facet_set(f, (*keys, "facets", k)) for k, f in enumerate(references)]
    )
    _, counts = np.unique(facets, axis=0, return_counts=True)
    if counts.max() > 1:
        raise names.loaded.error(
            (*keys, "facets"),
            f"{int((counts > 1).sum())} facet(s) are in more than one of these sets: the "
            "pressure would act on them twice",
            "name each part of the surface once",
        )
    owners = {f.partition(".")[0] for f in references}
    if len({names.bodies[o].geometry for o in owners}) > 1:
        raise names.loaded.error(
            (*keys, "facets"), "the facets belong to bodies of different thickness",
            "give each body a load of its own",
        )  # fmt: skip
    return facets


def refuse_open_chamber(
    names: Names,
    facets: np.ndarray,
    points: np.ndarray,
    held: np.ndarray,
    remedy: str,
    keys: Keys,
) -> None:
    """The surface must be closed, or end on `held` nodes (n,), or on the axis of a half section.

    remedy: how a rim is held, for people.
    """
    rim = np.unique(open_rim(facets))
    closed = held[rim]
    if isinstance(names.geometry, Axisymmetric):
        closed |= points[rim, 0] < 1e-12
    loose = rim[~closed]
    if len(loose):
        raise names.loaded.error(
            (*keys, "facets"),
            f"the chamber is open: its facets end at {in_mm(points[loose[0]])}, on a node that may "
            "move by itself",
            f"{remedy}, or choose facets that reach from one held end to the other",
        )


def lids(names: Names, facets: np.ndarray) -> np.ndarray:
    """Facets (k, corners) over the held rims of a surface, so that it encloses a volume.

    In a half section the lids run straight to the axis and enclose nothing: there are none.
    """
    rim = open_rim(facets)
    if isinstance(names.geometry, Axisymmetric) or len(rim) == 0:
        return np.zeros((0, facets.shape[1]), dtype=int)
    if facets.shape[1] == 2:
        following = dict(facets.tolist())
        starts = np.setdiff1d(facets[:, 0], facets[:, 1])
        return np.array([[chain(following, start)[-1], start] for start in starts.tolist()])
    fans = []
    following = dict(rim.tolist())
    while following:
        loop = chain(following, next(iter(following)))
        for node in loop[:-1]:
            del following[node]
        fans += [[loop[0], a, b] for a, b in pairwise(loop[1:-1])]
    return np.array(fans).reshape(-1, 3)


def chain(following: dict[int, int], start: int) -> list[int]:
    """Nodes from `start` along `following`, to its end or back to the start."""
    nodes = [start]
    while nodes[-1] in following:
        nodes.append(following[nodes[-1]])
        if nodes[-1] == start:
            break
    return nodes
