"""Curved spike of the PufferFace Robot and of Leafbot: a fin between two circular arcs.

It stands on a skin along x, its root centred on the origin. Both arcs bulge forward (+x), so that
the front edge is convex and the rear edge concave; its tip face is parallel to the skin.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.surface import CellKind
from softsim.robots.limits import check_cell_count

SHARPEST_TIP = np.radians(15)
"""Smallest angle [rad] between rear edge and tip face.

No cell fits into a sharper tip.
"""

EQUILATERAL = np.radians(60)

FLATTEST_MEETING = np.radians(30)
"""Smallest angle [rad] at which the line of the tip face may meet the front edge.

Below it the cells beside the tip's front corner are slivers.
"""


@dataclass(frozen=True)
class Arc:
    """Circular arc about `center` (2,) [m], counter-clockwise, angles [rad] from the x axis."""

    center: np.ndarray
    radius: float
    start: float
    end: float

    def at(self, fraction: float) -> np.ndarray:
        """Return the point (2,) at a fraction of the arc's length."""
        angle = self.start + fraction * (self.end - self.start)
        return self.center + self.radius * np.array([np.cos(angle), np.sin(angle)])

    def x_at(self, y: np.ndarray) -> np.ndarray:
        """Return x [m] on the half of the circle that faces +x, at the heights y."""
        rise = np.clip((y - self.center[1]) / self.radius, -1, 1)
        return self.center[0] + self.radius * np.sqrt(1 - rise**2)

    @property
    def length(self) -> float:
        """Length [m] along the arc."""
        return self.radius * (self.end - self.start)


@dataclass(frozen=True)
class Spike:
    """Front and rear edge of a spike, each from root to tip."""

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
    """Return the spike of these dimensions [m]; its tip lies `lean` behind (-x) its root.

    Raises MeshError, naming the radius, if an arc cannot span its edge or bulges past its ends.
    """
    root, tip = root_thickness / 2, tip_thickness / 2
    return Spike(
        front=_edge("front_radius", front_radius, (root, 0), (tip - lean, height), 0.0),
        rear=_edge("rear_radius", rear_radius, (-root, 0), (-tip - lean, height), SHARPEST_TIP),
    )


def thickness(shape: Spike, heights: np.ndarray) -> np.ndarray:
    """Return the thickness [m] of the spike along the skin, at heights [m] above it."""
    return shape.front.x_at(heights) - shape.rear.x_at(heights)


def check_thickness(what: str, shape: Spike, height: float, least: float) -> None:
    """Raise MeshError if a spike or limb of this height is thinner than `least` [m] anywhere."""
    heights = np.linspace(0, height, 101)
    across = thickness(shape, heights)
    thinnest = int(np.argmin(across))
    if across[thinnest] < least * (1 - 1e-9):
        raise MeshError(
            f"the {what} is {1e3 * across[thinnest]:.4g} mm thick {1e3 * heights[thinnest]:.4g} mm "
            f"from its root; at least {1e3 * least:.4g} mm is needed for its cells",
            hint="increase root_thickness, tip_thickness or rear_radius, or reduce element_size",
        )


def cross_lines(shape: Spike, edge: float, root_segments: int) -> list[np.ndarray]:
    """Return lines of points, (k, 2) from rear to front, stacked from root to tip, for triangles.

    edge: target length [m] of the sides of triangles between the lines; root_segments: number of
    segments of the first line, where the spike stands on the skin.
    """
    check_cell_count(_side(shape) / edge * root_segments, edge)
    bands = max(2, round(_side(shape) / (edge * np.sin(EQUILATERAL))))
    segments = [root_segments]
    for fraction in np.arange(1, bands + 1) / bands:
        rear, front = shape.rear.at(_neck(shape) * fraction), shape.front.at(fraction)
        segments.append(max(1, round(float(np.linalg.norm(front - rear)) / edge)))
    return _stacked_lines(shape, segments)


def grid_lines(shape: Spike, edge: float, root_segments: int) -> list[np.ndarray]:
    """Return lines as `cross_lines` does, all with as many segments, for quadrilaterals.

    edge: target length [m] of the sides of the quadrilaterals from root to tip.
    """
    check_cell_count(_side(shape) / edge * root_segments, edge)
    bands = max(1, round(_side(shape) / edge))
    return _stacked_lines(shape, [root_segments] * (bands + 1))


def _neck(shape: Spike) -> float:
    """Return the fraction of the rear edge up to which lines reach the front edge.

    A tip with a sharp rear corner, or with a front edge that meets its face at a small angle, is
    capped by lines that shrink to the rear corner, which keeps its cells in shape.
    """
    sharp = np.pi / 2 - shape.rear.end < EQUILATERAL
    flat = np.pi / 2 - shape.front.end < FLATTEST_MEETING
    if not (sharp or flat):
        return 1.0
    tip_length = float(np.linalg.norm(shape.front.at(1.0) - shape.rear.at(1.0)))
    return 1.0 - tip_length / shape.rear.length


def _side(shape: Spike) -> float:
    """Return the length [m] from the root to the last line that reaches the front edge."""
    return (shape.front.length + _neck(shape) * shape.rear.length) / 2


def _stacked_lines(shape: Spike, segments: list[int]) -> list[np.ndarray]:
    """Return lines of these numbers of segments up to the tip's front corner, and the cap."""
    neck, tip_rear, tip_front = _neck(shape), shape.rear.at(1.0), shape.front.at(1.0)
    fractions = np.arange(len(segments)) / (len(segments) - 1)
    lines = [
        _line(shape.rear.at(neck * fraction), shape.front.at(fraction), count)
        for fraction, count in zip(fractions, segments, strict=True)
    ]
    if neck < 1:
        for left in reversed(range(segments[-1])):
            fraction = left / segments[-1]
            rear = shape.rear.at(1 - fraction * (1 - neck))
            lines.append(_line(rear, tip_rear + fraction * (tip_front - tip_rear), left))
    return lines


CROSSINGS: dict[CellKind, Callable[[Spike, float, int], list[np.ndarray]]] = {
    "simplex": cross_lines,
    "quad": grid_lines,
}


def _line(rear: np.ndarray, front: np.ndarray, segments: int) -> np.ndarray:
    return np.linspace(rear, front, segments + 1)


def _edge(
    name: str,
    radius: float,
    root: tuple[float, float],
    tip: tuple[float, float],
    sharpest: float,
) -> Arc:
    """Return the arc from root to tip that bulges towards +x.

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
