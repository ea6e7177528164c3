"""Wall along a polyline, in the plane or extruded along z: exact, corners included.

At a convex corner the normal points from the corner to the node; inside a concave one the corner is
nearest too, and pushes a node that is depths a and b behind both edges by k (a n_a + b n_b), as two
walls would. The penalty energy k g^2 / 2 is that of a distance: continuous everywhere. Its gradient
jumps where two edges are equally near inside the wall, behind a convex corner: a node that passes
the corner at the depth g meets the other edge there, which takes or gives k g^2 / 2 over a path of
g.
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
"""Turning angle [rad] below which a corner counts as straight."""


@dataclass(frozen=True, eq=False)
class PolylineWall(Wall):
    """Wall `name` along a polyline of the x-y plane.

    across: in space, where the wall is the same at every z, the interval of z [m] in which it is
    drawn; None in the plane.
    """

    name: Own[str]
    polyline: Polyline
    across: Own[tuple[float, float] | None]

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name,)

    @property
    def dimension(self) -> int:
        """Dimension of the space of the wall, 2 or 3."""
        return 2 if self.across is None else 3

    @cached_property
    def cells(self) -> EdgeCells:
        """Grid of cells in which kernels look up edges."""
        return cells_of(self.polyline)

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        return {self.name: self.polyline.gaps(x[:, :2])}

    def thickness(self) -> float:
        """Return the shortest path [m] through the wall, normal to the middle of an edge."""
        return self.polyline.thickness

    def obstacle(self, alike: Sequence["PolylineWall"], places: np.ndarray) -> PolylineObstacle:
        return PolylineObstacle(alike, len(places))

    def touched_at_once(self) -> tuple[float, float]:
        """Return the bounds for one edge, or two where there is a concave corner.

        The two edges of a concave corner act as one spring in all directions.
        """
        return (2.0 if (self.polyline.turns > 0.0).any() else 1.0), 1.0

    def corners(self) -> np.ndarray:
        """Return the convex corners of the solid, in the plane."""
        line = self.polyline
        return line.starts[(line.turns < -STRAIGHT) & (self.dimension == 2)]

    def drawn(self) -> dict[str, np.ndarray]:
        """Return the edges, in space as strips along z.

        Those at the ends are longer by the polyline's own size.
        """
        longer = self.polyline.prolonged(float(np.ptp(self.polyline.points, axis=0).max()))
        edges = np.stack([longer.starts, longer.starts + longer.ways], axis=1)
        if self.across is None:
            return {"wall_lines": edges}
        corners = edges[:, [0, 0, 1, 1]]
        depth = np.broadcast_to(np.array(self.across)[[0, 1, 1, 0]], corners.shape[:2])
        return {"wall_faces": np.concatenate([corners, depth[..., None]], axis=2)}
