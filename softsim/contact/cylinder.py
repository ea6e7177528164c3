"""Capped cylinders, free outside; in a section rectangles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim import backend
from softsim.contact.wall import Obstacle, Wall
from softsim.fields import real_field, vector_field
from softsim.sharing import Own

MERIDIANS = 48
"""Number of faces around the axis in the drawing of a cylinder."""


@dataclass(frozen=True)
class Cylinder(Wall):
    """Cylinder `name` about `centre` (d,) [m] along coordinate number `axis`.

    `half_length` and `radius` in [m]; in a half section the axis is y.
    """

    name: Own[str]
    centre: Own[np.ndarray]
    axis: int
    half_length: Own[float]
    radius: Own[float]

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name,)

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the signed gap (n,) [m] of points x (n, d) to the nearer of side and caps."""
        arms = x - self.centre
        side = np.linalg.norm(np.delete(arms, self.axis, axis=1), axis=1) - self.radius
        return {self.name: np.maximum(side, np.abs(arms[:, self.axis]) - self.half_length)}

    def thickness(self) -> float:
        """Return the smaller of diameter and length [m]."""
        return 2.0 * min(self.radius, self.half_length)

    def obstacle(self, alike: Sequence["Cylinder"], places: np.ndarray) -> "CylinderObstacle":
        return CylinderObstacle(alike)

    def drawn(self) -> dict[str, np.ndarray]:
        """Return a rectangle of lines in the plane, or the faces of side and caps in space."""
        if len(self.centre) == 2:  # clockwise: the free side is on the left
            half = np.full(2, self.radius)
            half[self.axis] = self.half_length
            corners = self.centre + half * np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]])
            return {"wall_lines": np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)}
        angles = np.linspace(0.0, 2.0 * np.pi, MERIDIANS + 1)
        across = self.radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        along = np.repeat(self.half_length * np.array([-1.0, -1.0, 1.0, 1.0]), MERIDIANS + 1)
        places = np.zeros((4, MERIDIANS + 1, 3))
        places[1:3, :, [(self.axis + 1) % 3, (self.axis + 2) % 3]] = across
        places[..., self.axis] = along.reshape(4, -1)
        places += self.centre
        sides = [places[:-1, :-1], places[:-1, 1:], places[1:, 1:], places[1:, :-1]]
        return {"wall_faces": np.stack(sides, axis=2).reshape(-1, 4, 3)}


class CylinderObstacle(Obstacle):
    """A capped cylinder, solid inside; one entry of `walls` a scenario."""

    count = 1

    def __init__(self, walls: Sequence[Cylinder]) -> None:
        self.axis = walls[0].axis
        self.centre = vector_field(np.stack([w.centre for w in walls]))
        self.half_length = real_field(np.array([w.half_length for w in walls]))
        self.radius = real_field(np.array([w.radius for w in walls]))

    @ti.func
    def gap_and_normal(self, s, i, w, x):
        """Return the signed gap [m] of contact node i at x, negative inside, and the normal.

        The gap is that to the nearer of side and caps. The edge between them is not treated
        separately: outside a cap the gap is at most the distance.
        """
        d = x - self.centre[s]
        along = d[self.axis]
        d[self.axis] = 0.0
        distance = d.norm()
        gap = distance - self.radius[s]
        normal = d / ti.max(distance, 1e-12)
        if ti.abs(along) - self.half_length[s] > gap:
            gap = ti.abs(along) - self.half_length[s]
            normal = ti.Vector.zero(backend.real, d.n)
            normal[self.axis] = ti.math.sign(along)
        return gap, normal
