"""Straight pipes of circular section in space."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.contact.wall import Obstacle, Wall
from softsim.fields import real_field, vector_field
from softsim.sharing import Own


@dataclass(frozen=True)
class RoundPipes(Wall):
    """Round pipes, free inside.

    surfaces: names. points (p, 3) [m]: points on the axes. axes (p, 3): unit vectors. radii (p,)
    [m].
    """

    surfaces: tuple[str, ...]
    points: Own[np.ndarray]
    axes: Own[np.ndarray]
    radii: Own[np.ndarray]

    @property
    def names(self) -> tuple[str, ...]:
        return self.surfaces

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        found = {}
        for name, point, axis, radius in zip(
            self.names, self.points, self.axes, self.radii, strict=True
        ):
            across = (x - point) - np.outer((x - point) @ axis, axis)
            found[name] = radius - np.linalg.norm(across, axis=1)
        return found

    def obstacle(self, alike: Sequence["RoundPipes"], places: np.ndarray) -> "RoundObstacle":
        return RoundObstacle(alike)

    def drawn(self) -> dict[str, np.ndarray]:
        """Return a point on the axis, its direction and the radius of each pipe."""
        return {"pipes": np.concatenate([self.points, self.axes, self.radii[:, None]], axis=1)}


class RoundObstacle(Obstacle):
    """Straight pipes of circular section in space, free inside; one entry of `walls` a scenario."""

    def __init__(self, walls: Sequence[RoundPipes]) -> None:
        self.count = len(walls[0].names)
        self.point = vector_field(np.stack([w.points for w in walls]))
        self.axis = vector_field(np.stack([w.axes for w in walls]))
        self.radius = real_field(np.stack([w.radii for w in walls]))

    @ti.func
    def gap_and_normal(self, s, i, w, x):
        """Return the signed gap [m] of contact node i at x to pipe w, negative in the wall.

        Also return the unit normal, towards the axis.
        """
        d = x - self.point[s, w]
        d -= d.dot(self.axis[s, w]) * self.axis[s, w]
        distance = d.norm()
        return self.radius[s, w] - distance, -d / ti.max(distance, 1e-12)
