"""Segment of a pipe along a path: its centre line and its radius."""

from dataclasses import dataclass

import numpy as np

STRAIGHT, BEND, TAPER = "straight", "bend", "taper"

# How far the flat face reaches in which an open end lies [m]: it has no rim.
FACE = 100.0


@dataclass(frozen=True, eq=False)
class Segment:
    """Segment of a path.

    kind: straight, bend or taper. item: its number in the list that it is from. start: arc length
    at its start [m]; length [m]. point (d,) [m], tangent and side (d,): start, direction there, and
    direction towards which it bends (unit vector normal to the tangent; any such vector if
    straight). bend_radius: of the centre line, infinite unless a bend. radii: of the pipe at both
    ends [m], different only for a taper.
    """

    kind: str
    item: int
    start: float
    length: float
    point: np.ndarray
    tangent: np.ndarray
    side: np.ndarray
    bend_radius: float
    radii: tuple[float, float]

    @property
    def end(self) -> float:
        """Arc length at its end [m]."""
        return self.start + self.length

    @property
    def centre(self) -> np.ndarray:
        """Centre (d,) of a bend [m]."""
        return self.point + self.bend_radius * self.side

    def axis_place(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return points (n, d) [m] and tangents (n, d), s (n,) [m] after `start`.

        Beyond its ends it continues straight.
        """
        if self.kind != BEND:
            return self.point + np.outer(s, self.tangent), np.tile(self.tangent, (len(s), 1))
        within = np.clip(s, 0.0, self.length)
        angle = within / self.bend_radius
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        place = self.centre + self.bend_radius * (sin * self.tangent - cos * self.side)
        tangent = cos * self.tangent + sin * self.side
        return place + (s - within)[:, None] * tangent, tangent

    def along(self, x: np.ndarray) -> np.ndarray:
        """Return the arc length (n,) [m] after `start` of the nearest point of the centre line.

        The line or circle of the segment is extended; on a circle the result is between half a turn
        before and after the middle of the segment.
        """
        if self.kind != BEND:
            return (x - self.point) @ self.tangent
        arm = x - self.centre
        middle = 0.5 * self.length / self.bend_radius
        angle = np.arctan2(arm @ self.tangent, -(arm @ self.side)) - middle
        return self.bend_radius * (np.mod(angle + np.pi, 2.0 * np.pi) - np.pi + middle)

    def radius(self, s: np.ndarray) -> np.ndarray:
        """Return the radius of the pipe (n,) [m], s (n,) [m] after `start`."""
        return self.radii[0] + self.slope * s

    @property
    def slope(self) -> float:
        """Change of the radius with the arc length [-]."""
        return (self.radii[1] - self.radii[0]) / self.length
