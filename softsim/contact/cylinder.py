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
"""Faces that a cylinder is drawn with around."""


@dataclass(frozen=True)
class Cylinder(Wall):
    """One cylinder, `name`, along coordinate number `axis`, about `centre` (d,) [m], with its half
    length and radius [m]; in a half section along y.
    """

    name: Own[str]
    centre: Own[np.ndarray]
    axis: int
    half_length: Own[float]
    radius: Own[float]

    @property
    def names(self) -> tuple[str, ...]:
        """Of its one surface."""
        return (self.name,)

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Signed gap (n,) [m] of places x (n, d) to the nearer of side and caps, by its name."""
        arms = x - self.centre
        side = np.linalg.norm(np.delete(arms, self.axis, axis=1), axis=1) - self.radius
        return {self.name: np.maximum(side, np.abs(arms[:, self.axis]) - self.half_length)}

    def thickness(self) -> float:
        """Return the shortest way [m] through it."""
        return 2.0 * min(self.radius, self.half_length)

    def obstacle(self, alike: Sequence["Cylinder"], places: np.ndarray) -> "CylinderObstacle":
        """In kernels."""
        return CylinderObstacle(alike)

    def drawn(self) -> dict[str, np.ndarray]:
        """In the plane a rectangle of lines, in space the faces of side and caps."""
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
        """Signed gap [m] of contact node number i at x, negative inside, to the nearer of side and
        caps, and its outward normal. The edge between them is no case of its own: outside a cap
        the gap is at most the distance.
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
