"""Wall that is a closed surface of triangles in space, with exact signed distances.

The sign of the distance is that of the vector from the nearest point of the surface, projected on
the pseudonormal there: a triangle's normal inside it, the sum of both on an edge, at a corner the
sum of those around it, each weighted by its angle there. It is right whichever triangle is taken as
the nearest (Baerentzen and Aanaes, IEEE Trans. Vis. Comput. Graph. 11 (2005) 243).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from softsim.contact.grid import DistanceGrid, tabulated

# A triangle whose height is below this share of its longest edge has no normal of its own.
FLAT = 1e-9


@dataclass(frozen=True, eq=False)
class TriangleSurface:
    """Closed surface of triangles (m, 3) with points (n, 3) [m].

    Normals follow the right-hand rule into the free side. Each edge has two triangles, which pass
    it in opposite directions.
    """

    points: np.ndarray
    triangles: np.ndarray

    @cached_property
    def corners(self) -> np.ndarray:
        """Positions of the triangles' corners (m, 3, 3) [m]."""
        return self.points[self.triangles]

    @cached_property
    def ways(self) -> np.ndarray:
        """Vectors from each corner of the triangles to the next (m, 3, 3) [m]."""
        return np.roll(self.corners, -1, axis=1) - self.corners

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals (m, 3); zero for a degenerate triangle."""
        across = np.cross(self.ways[:, 0], self.ways[:, 1])
        size = np.linalg.norm(across, axis=1)
        is_flat = size <= FLAT * (self.ways**2).sum(axis=2).max(axis=1)
        return np.where(is_flat[:, None], 0.0, across / np.where(is_flat, 1.0, size)[:, None])

    @cached_property
    def edge_normals(self) -> np.ndarray:
        """Sum of the normals on both sides (m, 3, 3) of the edge after each corner."""
        begin, end = self.triangles, np.roll(self.triangles, -1, axis=1)
        keys = (np.minimum(begin, end) * len(self.points) + np.maximum(begin, end)).ravel()
        edge = np.unique(keys, return_inverse=True)[1].reshape(-1)
        return _sums(np.repeat(self.normals, 3, axis=0), edge)[edge].reshape(-1, 3, 3)

    @cached_property
    def corner_normals(self) -> np.ndarray:
        """Sum of the normals around each corner (m, 3, 3), weighted by their angles."""
        before = -np.roll(self.ways, 1, axis=1)
        across = np.linalg.norm(np.cross(self.ways, before), axis=2)
        angle = np.arctan2(across, (self.ways * before).sum(axis=2))
        weighted = (angle[..., None] * self.normals[:, None]).reshape(-1, 3)
        return _sums(weighted, self.triangles.ravel(), len(self.points))[self.triangles]

    def boxes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and highest coordinates (m, 3) [m] of each triangle."""
        return self.corners.min(axis=1), self.corners.max(axis=1)

    def spheres(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the centre (m, 3) [m] and radius (m,) [m] of a sphere around each triangle."""
        centres = self.corners.mean(axis=1)
        return centres, np.linalg.norm(self.corners - centres[:, None], axis=2).max(axis=1)

    def plane_distances(self, x: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """Return the distances (k,) [m] of points x (k, 3) to the planes of triangles (k,)."""
        arm = x - self.corners[triangle, 0]
        return np.abs((arm * self.normals[triangle]).sum(axis=1))

    def signed_distances(self, x: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """Return the signed distances (k,) [m] of points x (k, 3) to triangles (k,).

        The sign is right where no other triangle is nearer.
        """
        normal, ways = self.normals[triangle], self.ways[triangle]
        arms = x[:, None] - self.corners[triangle]
        # Nearest point of each edge, then of the nearest edge.
        length_squared = (ways**2).sum(axis=2)
        share = np.clip((arms * ways).sum(axis=2) / length_squared, 0.0, 1.0)
        from_edges = arms - share[..., None] * ways
        squared = (from_edges**2).sum(axis=2)
        edge, one = squared.argmin(axis=1), np.arange(len(x))
        arm, share, distance = from_edges[one, edge], share[one, edge], squared[one, edge] ** 0.5
        side = np.where(
            (share == 0.0)[:, None],
            self.corner_normals[triangle, edge],
            np.where(
                (share == 1.0)[:, None],
                self.corner_normals[triangle, (edge + 1) % 3],
                self.edge_normals[triangle, edge],
            ),
        )
        result = distance * np.where((arm * side).sum(axis=1) < 0.0, -1.0, 1.0)
        # Beside the triangle's inside, where it has one, the plane is nearer than the edges.
        left_of = (np.cross(ways, arms) * normal[:, None]).sum(axis=2)
        is_beside = (left_of > 0.0).all(axis=1)
        return np.where(is_beside, (arms[:, 0] * normal).sum(axis=1), result)


def gridded(name: str, surface: TriangleSurface, spacing: float) -> DistanceGrid:
    """Return the wall `name` on a grid of the spacing [m] that holds the whole surface.

    Raises SpacingError if the grid is too large or the wall too thin for it, and MeshError if the
    wall has no clear inside.
    """
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    origin, values = tabulated(surface, low, high, spacing)
    # Faces of four corners, as those of other walls: the third one twice.
    picture = {"wall_faces": surface.corners[:, [0, 1, 2, 2]]}
    return DistanceGrid(name, origin, spacing, values, picture)


def _sums(vectors: np.ndarray, group: np.ndarray, groups: int = 0) -> np.ndarray:
    """Return the sums (groups, 3) of the vectors (k, 3) of each group (k,)."""
    sums = [np.bincount(group, weights=column, minlength=groups) for column in vectors.T]
    return np.stack(sums, axis=1)
