"""Nodes and links of a chain with one line of nodes, or two lines side by side.

A set of links is given by its incidence matrix (links, nodes): 1 at the node in front, -1 at that
behind. `incidence @ p` are the link vectors, and `incidence.T @ f` the nodal forces of link
forces f.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

# -------------------------------------------------------------------------------------------------
# Functions of vectors (..., d) in the plane (x, z) or in space (x, y, z), last component up.


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar products (...) of vectors."""
    return (a * b).sum(axis=-1)


def size(a: np.ndarray) -> np.ndarray:
    """Return the lengths (...) of vectors."""
    return np.sqrt(dot(a, a))


def level(a: np.ndarray) -> np.ndarray:
    """Return the vectors without their upward component (..., d)."""
    along = a.copy()
    along[..., -1] = 0.0
    return along


def upwards(sizes: np.ndarray, like: np.ndarray) -> np.ndarray:
    """Return upward vectors of these sizes (...), with as many components as `like`."""
    vectors = np.zeros(like.shape)
    vectors[..., -1] = sizes
    return vectors


@dataclass(frozen=True, eq=False)
class Lattice:
    """Nodes at rest, in the plane or in space, and the links between them.

    places: (n, d) [m]. along: incidence of the links from head to rear, (a, n). joints: pairs of
    consecutive links of these, (j, 2). bars: incidence of all links with constrained lengths,
    (b, n). kept: constrained combinations of the bars' lengths, (c, b); lengths: their values (c,)
    [m]. chords: (n, n), for each node the vector from the node behind it to the one in front.
    """

    places: np.ndarray
    along: np.ndarray
    joints: np.ndarray
    bars: np.ndarray
    kept: np.ndarray
    lengths: np.ndarray
    chords: np.ndarray

    def headings(self, p: np.ndarray) -> np.ndarray:
        """Return the forward unit vector along the ground of each node at p (..., n, d) [m].

        It points from the node behind to the one in front on the same side (..., n, d); in the
        plane it is always x.
        """
        ahead = level(self.chords @ p)
        return ahead / size(ahead)[..., None]


def line(gaps: np.ndarray) -> Lattice:
    """Return nodes in the plane (x, z) with gaps (n - 1,) [m] between them, the first at x = 0."""
    count = len(gaps) + 1
    places = np.zeros((count, 2))
    places[1:, 0] = -np.cumsum(gaps)
    along = np.eye(count - 1, count) - np.eye(count - 1, count, k=1)
    joints = np.column_stack([np.arange(count - 2), np.arange(1, count - 1)])
    return Lattice(places, along, joints, along, np.eye(count - 1), gaps, _chords(along))


def ladder(gaps: np.ndarray, distance: float) -> Lattice:
    """Return two lines of nodes in space (x, y, z) at a distance [m], the left one first.

    Cross links keep the distance. In each field between two of them the diagonals stay equally
    long: the field keeps its right angles but can twist, and neither side is preferred. One
    diagonal of constant length would prefer a side; two would prevent twist and leave the tensions
    undetermined.
    """
    one = line(gaps)
    count = len(one.places)
    left, right = np.eye(count), -np.eye(count)
    across = np.hstack([left, right])
    leftwards = np.hstack([left[:-1], right[1:]])  # from behind on the right
    rightwards = np.hstack([left[1:], right[:-1]])
    along = block_diag(one.along, one.along)
    sides = [
        np.column_stack([one.places[:, 0], np.full(count, y), one.places[:, 1]])
        for y in (0.5 * distance, -0.5 * distance)
    ]
    equal = np.eye(count - 1)
    return Lattice(
        places=np.concatenate(sides),
        along=along,
        joints=np.concatenate([one.joints, one.joints + count - 1]),
        bars=np.concatenate([along, across, leftwards, rightwards]),
        kept=block_diag(np.eye(len(along) + count), np.hstack([equal, -equal])),
        lengths=np.concatenate([gaps, gaps, np.full(count, distance), np.zeros(count - 1)]),
        chords=block_diag(one.chords, one.chords),
    )


def _chords(along: np.ndarray) -> np.ndarray:
    """Return the sum of the links that end at each node (n, n)."""
    return np.abs(along).T @ along
