"""A wall along a polyline, in the plane or as far as that goes across it: exact, corners included.

At a convex corner the normal points from the corner to the node; inside of a concave one the corner
is nearest too, and pushes a node that is depths a and b behind both edges by k (a n_a + b n_b), as
two walls would. Penalty energy k g^2 / 2 is that of a distance: continuous everywhere. Its gradient
jumps where two edges are equally near inside the wall, behind a convex corner: a node that gets
past the corner g deep meets the other edge there, which takes or gives k g^2 / 2 over a way of g.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from softsim.contact.edge_cells import EdgeCells, cells_of
from softsim.contact.polyline import Polyline
from softsim.contact.polyline_obstacle import PolylineObstacle
from softsim.contact.wall import Wall
from softsim.sharing import Own

STRAIGHT = 1e-9
"""Turn of a corner that is none [rad]."""


@dataclass(frozen=True, eq=False)
class PolylineWall(Wall):
    """The wall `name` along a polyline of the x-y plane.

    across: in space, where the wall is the same at every z, from where to where it is drawn [m];
    None in the plane.
    """

    name: Own[str]
    polyline: Polyline
    across: Own[tuple[float, float] | None]

    @property
    def names(self) -> tuple[str, ...]:
        """Of its one surface."""
        return (self.name,)

    @property
    def dimension(self) -> int:
        """Of the space it stands in."""
        return 2 if self.across is None else 3

    @cached_property
    def cells(self) -> EdgeCells:
        """Where kernels look edges up."""
        return cells_of(self.polyline)

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Signed gap (n,) [m] of places x (n, d), negative in the wall, by the wall's name."""
        return {self.name: self.polyline.gaps(x[:, :2])}

    def thickness(self) -> float:
        """Return the shortest way [m] through the wall from the middle of an edge, along the normal
        there.
        """
        return self.polyline.thickness

    def obstacle(self, alike: Sequence["PolylineWall"], places: np.ndarray) -> PolylineObstacle:
        """In kernels."""
        return PolylineObstacle(alike, len(places))

    def touched_at_once(self) -> tuple[float, float]:
        """One edge; in a concave corner both, which push like one spring in all directions."""
        return (2.0 if (self.polyline.turns > 0.0).any() else 1.0), 1.0

    def corners(self) -> np.ndarray:
        """Those of what is solid, in the plane."""
        line = self.polyline
        return line.starts[(line.turns < -STRAIGHT) & (self.dimension == 2)]

    def drawn(self) -> dict[str, np.ndarray]:
        """The edges, the ends' longer by the polyline's own size; in space strips along z."""
        longer = self.polyline.prolonged(float(np.ptp(self.polyline.points, axis=0).max()))
        edges = np.stack([longer.starts, longer.starts + longer.ways], axis=1)
        if self.across is None:
            return {"wall_lines": edges}
        corners = edges[:, [0, 0, 1, 1]]
        depth = np.broadcast_to(np.array(self.across)[[0, 1, 1, 0]], corners.shape[:2])
        return {"wall_faces": np.concatenate([corners, depth[..., None]], axis=2)}
