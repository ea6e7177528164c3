"""The curved spike, on the PufferFace Robot as on Leafbot: a fin between two circular arcs.

It stands on a skin along x, its root centred on the origin. Both arcs bulge forward (+x), so that
the front edge is convex and the rear edge concave; its tip face is parallel to the skin.
"""

from dataclasses import dataclass

import numpy as np

from softsim.errors import MeshError

SHARPEST_TIP = np.radians(15)
"""Smallest angle [rad] between rear edge and tip face: the blade below it has no cell to fit in."""

EQUILATERAL = np.radians(60)


@dataclass(frozen=True)
class Arc:
    """A circular arc around `center` (2,) [m], counter-clockwise, angles [rad] from the x axis."""

    center: np.ndarray
    radius: float
    start: float
    end: float

    def at(self, fraction: float) -> np.ndarray:
        """Point (2,) at a fraction of the arc's length."""
        angle = self.start + fraction * (self.end - self.start)
        return self.center + self.radius * np.array([np.cos(angle), np.sin(angle)])

    def x_at(self, y: np.ndarray) -> np.ndarray:
        """Where the half of the circle that faces +x stands at the heights y."""
        rise = np.clip((y - self.center[1]) / self.radius, -1, 1)
        return self.center[0] + self.radius * np.sqrt(1 - rise**2)

    @property
    def length(self) -> float:
        """Length [m] along the arc."""
        return self.radius * (self.end - self.start)


@dataclass(frozen=True)
class Spike:
    """Front and rear edge, each from root to tip."""

    front: Arc
    rear: Arc


def spike(
    height: float,
    root_thickness: float,
    tip_thickness: float,
    lean: float,
    front_radius: float,
    rear_radius: float,
) -> Spike:
    """The spike of these dimensions [m]; its tip lies `lean` behind (-x) its root.

    Raises MeshError, naming the radius, if an arc cannot span its edge or bulges past its ends.
    """
    root, tip = root_thickness / 2, tip_thickness / 2
    return Spike(
        front=_edge("front_radius", front_radius, (root, 0), (tip - lean, height), 0.0),
        rear=_edge("rear_radius", rear_radius, (-root, 0), (-tip - lean, height), SHARPEST_TIP),
    )


def thickness(shape: Spike, heights: np.ndarray) -> np.ndarray:
    """Thickness [m] of the spike, measured along the skin, at heights [m] above it."""
    return shape.front.x_at(heights) - shape.rear.x_at(heights)


def cross_lines(shape: Spike, edge: float, root_segments: int) -> list[np.ndarray]:
    """Lines of points, each (k, 2) from rear to front, stacked from root to tip.

    edge: length [m] aimed at for the sides of triangles between the lines; root_segments: number
    of segments of the first line, where the spike stands on the skin. A tip with a sharp rear
    corner is capped by lines that shrink to that corner, which keeps its triangles in shape.
    """
    tip_rear, tip_front = shape.rear.at(1.0), shape.front.at(1.0)
    tip_length = float(np.linalg.norm(tip_front - tip_rear))
    neck = 1.0
    if np.pi / 2 - shape.rear.end < EQUILATERAL:
        neck -= tip_length / shape.rear.length
    side = (shape.front.length + neck * shape.rear.length) / 2
    bands = max(2, round(side / (edge * np.sin(EQUILATERAL))))
    lines = [_line(shape.rear.at(0.0), shape.front.at(0.0), root_segments)]
    for fraction in np.arange(1, bands + 1) / bands:
        rear, front = shape.rear.at(neck * fraction), shape.front.at(fraction)
        segments = max(1, round(float(np.linalg.norm(front - rear)) / edge))
        lines.append(_line(rear, front, segments))
    if neck < 1:
        for left in reversed(range(segments)):
            fraction = left / segments
            rear = shape.rear.at(1 - fraction * (1 - neck))
            lines.append(_line(rear, tip_rear + fraction * (tip_front - tip_rear), left))
    return lines


def _line(rear: np.ndarray, front: np.ndarray, segments: int) -> np.ndarray:
    return np.linspace(rear, front, segments + 1)


def _edge(
    name: str,
    radius: float,
    root: tuple[float, float],
    tip: tuple[float, float],
    sharpest: float,
) -> Arc:
    """The arc from root to tip that bulges towards +x.

    sharpest: smallest angle [rad] that it may make with the skin's direction at its ends.
    """
    span = np.subtract(tip, root)
    chord = float(np.linalg.norm(span))
    bulge = np.array([span[1], -span[0]]) / chord
    tilt = float(np.arctan2(bulge[1], bulge[0]))
    room = np.pi / 2 - sharpest - abs(tilt)
    if room <= 0:
        raise MeshError(
            f"lean: the spike's edge of {name} leans {np.degrees(abs(tilt)):.3g} degrees; "
            f"less than {90 - np.degrees(sharpest):.3g} degrees is needed",
            hint="reduce lean or increase spike_height",
        )
    smallest = chord / (2 * np.sin(room))
    if radius < smallest:
        raise MeshError(
            f"{name} is {1e3 * radius:.4g} mm; an edge whose ends are {1e3 * chord:.4g} mm apart "
            f"needs at least {1e3 * smallest:.4g} mm, or it bulges past them"
        )
    half = float(np.arcsin(chord / (2 * radius)))
    center = np.add(root, tip) / 2 - bulge * radius * np.cos(half)
    return Arc(center=center, radius=radius, start=tilt - half, end=tilt + half)
