"""Flat walls: half spaces, solid behind."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.contact.wall import Obstacle, Wall
from softsim.fields import vector_field
from softsim.sharing import Own


@dataclass(frozen=True)
class HalfSpaces(Wall):
    """Half spaces, in a section half planes.

    surfaces: names. points (w, d) [m] on the planes. normals (w, d): unit normals into the free
    side.
    """

    surfaces: tuple[str, ...]
    points: Own[np.ndarray]
    normals: Own[np.ndarray]

    @property
    def names(self) -> tuple[str, ...]:
        return self.surfaces

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        return {
            name: (x - point) @ normal
            for name, point, normal in zip(self.names, self.points, self.normals, strict=True)
        }

    def obstacle(self, alike: Sequence["HalfSpaces"], places: np.ndarray) -> "FlatObstacle":
        return FlatObstacle(alike)

    def touched_at_once(self) -> tuple[float, float]:
        """Return the bounds; of walls that face each other only one side is touched at a time."""
        normals = facing_one_way(self.normals)
        return len(normals), float(np.linalg.eigvalsh(normals.T @ normals)[-1])

    def drawn(self) -> dict[str, np.ndarray]:
        """Return a point and the normal of each half space."""
        return {"walls": np.concatenate([self.points, self.normals], axis=1)}


def facing_one_way(normals: np.ndarray) -> np.ndarray:
    """Return those of the unit normals (w, d) of half spaces that one node can touch together.

    Walls that face each other are far apart, so of two opposite sides only the one with more walls
    counts.
    """
    cosines = normals @ normals.T
    alike, opposite = (cosines > 1.0 - 1e-9).sum(axis=1), (cosines < 1e-9 - 1.0).sum(axis=1)
    first = np.array([tuple(n) > tuple(-n) for n in normals], dtype=bool)
    return normals[(alike > opposite) | ((alike == opposite) & first)]


class FlatObstacle(Obstacle):
    """Half spaces (half planes in a section), solid behind; one entry of `walls` a scenario."""

    def __init__(self, walls: Sequence[HalfSpaces]) -> None:
        self.count = len(walls[0].names)
        self.point = vector_field(np.stack([w.points for w in walls]))
        self.normal = vector_field(np.stack([w.normals for w in walls]))

    @ti.func
    def gap_and_normal(self, s, i, w, x):
        """Return the signed gap [m] of contact node i at x to wall w, and the unit normal."""
        n = self.normal[s, w]
        return (x - self.point[s, w]).dot(n), n
