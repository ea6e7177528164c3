"""Which nodes links join: those of one line, or of two lines side by side.

A set of links is its incidence matrix (links, nodes): 1 at the node in front, -1 at that behind, so
that `incidence @ p` are the links, and `incidence.T @ f` the forces on the nodes of links that pull
with f.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from softsim.chain.vectors import level, size


@dataclass(frozen=True, eq=False)
class Lattice:
    """Nodes at rest, in the plane or in space, and what joins them.

    places: (n, d) [m]. along: incidence of the links from head to rear, (a, n). joints: pairs of
    such links that follow each other, (j, 2). bars: incidence of all links of which lengths are
    kept, (b, n). kept: which combinations of the bars' lengths are, (c, b); lengths: what they are
    (c,) [m]. chords: (n, n), for each node from the one behind it to the one in front.
    """

    places: np.ndarray
    along: np.ndarray
    joints: np.ndarray
    bars: np.ndarray
    kept: np.ndarray
    lengths: np.ndarray
    chords: np.ndarray

    def headings(self, p: np.ndarray) -> np.ndarray:
        """Unit vectors along the ground (..., n, d), with the nodes at p (..., n, d) [m]: from the
        node behind each to the one in front, on its side; in the plane always x.
        """
        ahead = level(self.chords @ p)
        return ahead / size(ahead)[..., None]


def line(gaps: np.ndarray) -> Lattice:
    """Nodes in the plane, (x, z), at gaps (n - 1,) [m] from each other, the first at x = 0."""
    count = len(gaps) + 1
    places = np.zeros((count, 2))
    places[1:, 0] = -np.cumsum(gaps)
    along = np.eye(count - 1, count) - np.eye(count - 1, count, k=1)
    joints = np.column_stack([np.arange(count - 2), np.arange(1, count - 1)])
    return Lattice(places, along, joints, along, np.eye(count - 1), gaps, _chords(along))


def ladder(gaps: np.ndarray, distance: float) -> Lattice:
    """Two such lines in space, (x, y, z), left and right at a distance [m]; the left one first.

    Links across keep the distance. In each field between two of them the diagonals stay as long as
    each other: it keeps its right angles, yet can be twisted, and no side is preferred, as it would
    be by one diagonal of constant length; two of those would leave no twist, and tensions open.
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
    """The sum of the links that end at each node."""
    return np.abs(along).T @ along
