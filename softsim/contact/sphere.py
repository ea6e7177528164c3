"""Balls, free outside; in a section discs, in a half section balls on the axis."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.contact.wall import Obstacle, Wall
from softsim.fields import real_field, vector_field
from softsim.sharing import Own

PARALLELS, MERIDIANS = 24, 48
"""Number of faces of the drawing of a ball, from pole to pole and around."""


@dataclass(frozen=True)
class Sphere(Wall):
    """Ball `name` about `centre` (d,) [m] with a radius [m]."""

    name: Own[str]
    centre: Own[np.ndarray]
    radius: Own[float]

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name,)

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        return {self.name: np.linalg.norm(x - self.centre, axis=1) - self.radius}

    def thickness(self) -> float:
        """Return the diameter [m]."""
        return 2.0 * self.radius

    def obstacle(self, alike: Sequence["Sphere"], places: np.ndarray) -> "SphereObstacle":
        return SphereObstacle(alike)

    def drawn(self) -> dict[str, np.ndarray]:
        """Return a circle of lines in the plane, or faces in space."""
        around = np.linspace(0.0, 2.0 * np.pi, MERIDIANS + 1)
        if len(self.centre) == 2:  # clockwise: the free side is on the left
            circle = np.stack([np.cos(around), -np.sin(around)], axis=1)
            places = self.centre + self.radius * circle
            return {"wall_lines": np.stack([places[:-1], places[1:]], axis=1)}
        polar = np.linspace(0.0, np.pi, PARALLELS + 1)[:, None]
        normals = np.stack(
            np.broadcast_arrays(
                np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)
            ),
            axis=2,
        )
        p = self.centre + self.radius * normals
        sides = [p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]]
        return {"wall_faces": np.stack(sides, axis=2).reshape(-1, 4, 3)}


class SphereObstacle(Obstacle):
    """A ball, solid inside; one entry of `walls` a scenario."""

    count = 1

    def __init__(self, walls: Sequence[Sphere]) -> None:
        self.centre = vector_field(np.stack([w.centre for w in walls]))
        self.radius = real_field(np.array([w.radius for w in walls]))

    @ti.func
    def gap_and_normal(self, s, i, w, x):
        """Return the signed gap [m] of contact node i at x, and the outward unit normal."""
        arm = x - self.centre[s]
        distance = arm.norm()
        return distance - self.radius[s], arm / ti.max(distance, 1e-12)
