"""Flat walls: half spaces, solid behind."""

from dataclasses import dataclass

import numpy as np

from softsim.sharing import Own


@dataclass(frozen=True)
class HalfSpaces:
    """Half spaces, in a section half planes: names, points (w, d) [m] and unit normals (w, d) into
    the free side.
    """

    names: tuple[str, ...]
    points: Own[np.ndarray]
    normals: Own[np.ndarray]

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Signed gap (n,) [m] of places x (n, d) to each half space, by its name."""
        return {
            name: (x - point) @ normal
            for name, point, normal in zip(self.names, self.points, self.normals, strict=True)
        }

    @property
    def stored_numbers(self) -> int:
        """None in a table."""
        return 0

    def touched_at_once(self) -> tuple[float, float]:
        """Walls that face each other are not touched together."""
        normals = facing_one_way(self.normals)
        return len(normals), float(np.linalg.eigvalsh(normals.T @ normals)[-1])

    def drawn(self) -> dict[str, np.ndarray]:
        """A point and the normal of each."""
        return {"walls": np.concatenate([self.points, self.normals], axis=1)}


def facing_one_way(normals: np.ndarray) -> np.ndarray:
    """Of the unit normals (w, d) of half spaces those that one node can touch: walls that face
    each other are far apart, so of two opposite sides only the one with more walls counts.
    """
    cosines = normals @ normals.T
    alike, opposite = (cosines > 1.0 - 1e-9).sum(axis=1), (cosines < 1e-9 - 1.0).sum(axis=1)
    first = np.array([tuple(n) > tuple(-n) for n in normals], dtype=bool)
    return normals[(alike > opposite) | ((alike == opposite) & first)]
