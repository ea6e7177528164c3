"""How a pipe along a path is drawn: its wall as lines or faces, its centre line as a polyline."""

from collections.abc import Sequence

import numpy as np

from softsim.contact.pipe_segment import Segment

# Chord of an arc: at most this angle [rad].
CHORD = np.radians(3.0)
FACES_AROUND = 48
# What is shown of the flat face around an open end: up to this share of the pipe's radius.
FACE_SHARE = 1.25


def drawn(segments: Sequence[Segment], closed: tuple[bool, bool]) -> dict[str, np.ndarray]:
    """Arrays for the figures, by their names in the results (FieldWriter.describe)."""
    _, places, tangents, radii = stations(segments)
    places, tangents = (np.concatenate([a[:1], a, a[-1:]]) for a in (places, tangents))
    ends = [0.0 if is_closed else FACE_SHARE for is_closed in closed]
    radii = np.concatenate([[ends[0] * radii[0]], radii, [ends[1] * radii[-1]]])
    keep = np.ones(len(radii), dtype=bool)  # a smooth joint once
    keep[1:] = (np.linalg.norm(np.diff(places, axis=0), axis=1) > 1e-9) | (np.diff(radii) != 0.0)
    places, tangents, radii = places[keep], tangents[keep], radii[keep]
    centre_line = {"centre_lines": np.stack([places[:-1], places[1:]], axis=1)}
    if places.shape[1] == 2:
        return {"wall_lines": wall_lines(places, tangents, radii), **centre_line}
    return {"wall_faces": wall_faces(places, tangents, radii), **centre_line}


def stations(segments: Sequence[Segment]) -> tuple[np.ndarray, ...]:
    """Arc lengths (n,) [m], places (n, d) [m] and tangents (n, d) along the centre line, and the
    pipe's radii (n,) [m] there; joints twice.
    """
    arcs, places, tangents, radii = [], [], [], []
    for segment in segments:
        s = np.linspace(0.0, segment.length, 2 + int(segment.length / segment.bend_radius / CHORD))
        place, tangent = segment.axis_place(s)
        arcs.append(segment.start + s)
        places.append(place)
        tangents.append(tangent)
        radii.append(segment.radius(s))
    return tuple(np.concatenate(parts) for parts in (arcs, places, tangents, radii))


def wall_lines(places: np.ndarray, tangents: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Both sides of a pipe in the plane as lines (k, 2, 2) [m], the free side on their left."""
    left = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
    right_side, left_side = (places + sign * radii[:, None] * left for sign in (-1.0, 1.0))
    along_right = np.stack([right_side[:-1], right_side[1:]], axis=1)
    along_left = np.stack([left_side[1:], left_side[:-1]], axis=1)[::-1]
    return np.concatenate([along_right, along_left])


def wall_faces(places: np.ndarray, tangents: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """A pipe in space as faces (k, 4, 3) [m], towards the free side by the right-hand rule."""
    one = np.cross(np.eye(3)[np.argmin(np.abs(tangents[0]))], tangents[0])
    across = [one / np.linalg.norm(one)]
    for tangent in tangents[1:]:  # carried along without twist
        carried = across[-1] - (across[-1] @ tangent) * tangent
        across.append(carried / np.linalg.norm(carried))
    first = np.array(across)[:, None]
    second = np.cross(tangents[:, None], first)
    angles = np.linspace(0.0, 2.0 * np.pi, FACES_AROUND + 1)[:, None]
    circles = np.cos(angles) * first + np.sin(angles) * second
    rings = places[:, None] + radii[:, None, None] * circles
    sides = [rings[:-1, :-1], rings[1:, :-1], rings[1:, 1:], rings[:-1, 1:]]
    return np.stack(sides, axis=2).reshape(-1, 4, 3)
