"""The layout of a pipe: what a user says of its segments becomes a path in space."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from softsim.contact.pipe_path import PipePath
from softsim.contact.pipe_segment import BEND, STRAIGHT, TAPER, Segment


@dataclass(frozen=True)
class Straight:
    """Straight on for `length` [m]."""

    length: float


@dataclass(frozen=True)
class Bend:
    """An arc of `angle` [rad] > 0 and `radius` [m] of the centre line. turned: about the direction
    of travel, from the left (+y of a path that begins along +x) to where it bends [rad].
    """

    angle: float
    radius: float
    turned: float


@dataclass(frozen=True)
class Taper:
    """A cone `length` [m] long to another diameter `to` [m]."""

    length: float
    to: float


@dataclass(frozen=True)
class Step:
    """From here on another diameter `to` [m]: a flat ring across the axis."""

    to: float


Item = Straight | Bend | Taper | Step


def path_of_items(
    name: str,
    items: Sequence[Item],
    diameter: float,
    start: np.ndarray,
    closed: tuple[bool, bool],
) -> PipePath:
    """The path of `items`, of which one at least is no step, from `start` (d,) [m] along +x;
    diameter [m]: where it starts.

    Direction and left turn with each bend about its own axis, so that the frame of a path is never
    twisted; in the plane only turned = 0 and pi stay in it.
    """
    place, radius = np.array(start, dtype=float), 0.5 * diameter
    forward, left, up = np.eye(3)
    d, s = len(place), 0.0
    segments = []
    for number, item in enumerate(items):
        if isinstance(item, Step):
            radius = 0.5 * item.to
            continue
        side, bend_radius, kind, end_radius = left, np.inf, STRAIGHT, radius
        if isinstance(item, Bend):
            kind, bend_radius, length = BEND, item.radius, item.radius * item.angle
            side = np.cos(item.turned) * left + np.sin(item.turned) * up
        elif isinstance(item, Taper):
            kind, length, end_radius = TAPER, item.length, 0.5 * item.to
        else:
            length = item.length
        segment = Segment(
            kind=kind, item=number, start=s, length=length, point=place, tangent=forward[:d],
            side=side[:d], bend_radius=bend_radius, radii=(radius, end_radius),
        )  # fmt: skip
        segments.append(segment)
        place = segment.axis_place(np.array([length]))[0][0]
        if isinstance(item, Bend):
            axis = np.cross(forward, side)
            forward, left, up = (turned(v, axis, item.angle) for v in (forward, left, up))
        s, radius = s + length, end_radius
    return PipePath(name, tuple(segments), closed)


def turned(vector: np.ndarray, axis: np.ndarray, angle: float) -> np.ndarray:
    """A vector (3,) turned about a unit axis (3,) by `angle` [rad] (Rodrigues)."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(
        cos * vector + sin * np.cross(axis, vector) + (1.0 - cos) * (axis @ vector) * axis
    )


def crossing(path: PipePath) -> tuple[Segment, Segment] | None:
    """Two segments of a pipe that run into each other, or None.

    Looked for between points a quarter of a radius apart on the centre lines: neighbours touch
    each other at their joint, so they count only where more than half a turn of the tightest bend
    possible, whose radius is the pipe's own, lies between the points.
    """
    spacing = 0.25 * min(min(segment.radii) for segment in path.segments)
    s = np.linspace(0.0, path.length, 2 + int(path.length / spacing))
    x, _ = path.axis_place(s)
    owner = [path.segment_at(one) for one in s]
    r = np.array([g.radius(np.array([one - g.start]))[0] for g, one in zip(owner, s, strict=True)])
    for k in range(len(s)):
        touching = np.linalg.norm(x - x[k], axis=1) < r + r[k] - 1e-9
        apart = s > s[k] + 0.5 * np.pi * (r + r[k])
        for j in np.flatnonzero(touching & apart):
            if owner[j] is not owner[k]:
                return owner[k], owner[j]
    return None
