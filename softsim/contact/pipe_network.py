"""Branching pipes as one wall; the free space is the union of their bores.

In the wall the gap is the largest of the signed depths in the bores, because the nearest of their
walls is that of the nearest bore; each depth is exact (contact/pipe_path.py). Where two bores meet,
the edge between them is rounded (contact/junction.py). Open ends continue straight, except that of
a path alone (a network of one), which ends in a flat face.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from softsim.contact import pipe_drawing
from softsim.contact.junction import Junction
from softsim.contact.network_obstacle import NetworkObstacle
from softsim.contact.pipe_path import PipePath
from softsim.contact.wall import Wall
from softsim.sharing import Own


@dataclass(frozen=True, eq=False)
class Branch:
    """Pipe of a network and its bore, which reaches back through the junction where it begins.

    Arc lengths continue those of the pipe `parent` (None for the first pipe) from the point where
    it leaves it [m]. span: interval of arc lengths [m] in which its path belongs to it, infinite
    beyond a free end. exit: name of its end; None where that is closed or another pipe. A path
    alone always has one.
    """

    path: PipePath
    bore: PipePath
    parent: int | None
    span: tuple[float, float]
    exit: str | None


@dataclass(frozen=True, eq=False)
class PipeNetwork(Wall):
    """Wall `name` of branching pipes.

    branches: pipes, the first of which is that of the start. junctions: their junctions.
    """

    name: Own[str]
    branches: Own[tuple[Branch, ...]]
    junctions: Own[tuple[Junction, ...]]

    @classmethod
    def of_one(cls, path: PipePath) -> "PipeNetwork":
        """Return the network of a pipe without branches."""
        return cls(path.name, (Branch(path, path, None, (-np.inf, np.inf), "end"),), ())

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name,)

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Return the signed gap (n,) [m] of points x (n, d), negative in the wall.

        In free space near a junction, outside the space between run and branch, it may be less than
        the distance.
        """
        gap = np.max([branch.bore.gap(x) for branch in self.branches], axis=0)
        for junction in self.junctions:
            held = junction.holds(x)
            gap[held] = junction.gap(x[held])
        return np.asarray(gap)

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        return {self.name: self.gap(x)}

    def obstacle(self, alike: Sequence["PipeNetwork"], places: np.ndarray) -> NetworkObstacle:
        return NetworkObstacle(alike, places)

    def touched_at_once(self) -> tuple[float, float]:
        """Return 1 for both bounds: in a corner only the nearest piece pushes."""
        return 1, 1.0

    def drawn(self) -> dict[str, np.ndarray]:
        """Return the wall, in the plane as lines and in space as faces, and the centre lines."""
        return pipe_drawing.drawn_network(self)

    def locate(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the branch (n,) nearest to points x (n, d), and the arc length (n,) [m].

        The nearest is that of the centre line; arc lengths are below 0 before the start.
        """
        along = np.array([np.clip(b.path.arc_length(x), *b.span) for b in self.branches])
        feet = [b.path.axis_place(s)[0] for b, s in zip(self.branches, along, strict=True)]
        nearest = np.array([np.linalg.norm(x - foot, axis=1) for foot in feet]).argmin(axis=0)
        return nearest, along[nearest, np.arange(len(x))]

    def tangents(self, branch: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return unit tangents (n, d) of branches `branch` (n,) at arc lengths s (n,) [m]."""
        found = np.zeros((len(s), len(self.branches[0].path.segments[0].point)))
        for number, one in enumerate(self.branches):
            here = branch == number
            found[here] = one.path.axis_place(s[here])[1]
        return found

    def ways_to(self, branch: int) -> dict[int, float]:
        """Return the branches on the path to a branch -> arc length [m] where the path leaves them.

        The branch itself is included, with infinity.
        """
        found = {branch: np.inf}
        parent = self.branches[branch].parent
        while parent is not None:
            found[parent] = self.branches[branch].span[0]
            branch, parent = parent, self.branches[parent].parent
        return found

    @property
    def exits(self) -> dict[str, int]:
        """Open ends except the start -> number of the branch."""
        return {b.exit: number for number, b in enumerate(self.branches) if b.exit is not None}
