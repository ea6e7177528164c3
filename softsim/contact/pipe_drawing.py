"""Drawing of pipes along paths: walls as lines or faces, centre lines as polylines."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from softsim.contact.pipe_segment import Segment

if TYPE_CHECKING:  # a wall imports how it is drawn
    from softsim.contact.pipe_network import PipeNetwork
    from softsim.contact.pipe_path import PipePath

# Chord of an arc: at most this angle [rad].
CHORD = np.radians(3.0)
FACES_AROUND = 48
# What is shown of the flat face around an open end: up to this share of the pipe's radius.
FACE_SHARE = 1.25
# Length [m] of the pieces that walls with openings are made of, by the dimension.
BETWEEN_STATIONS = {2: 0.5e-3, 3: 2e-3}
# How far off the rounded edge of two walls at a right angle the sharp one is, in radii.
OFF_THE_EDGE = np.sqrt(2.0) - 1.0
# Round-off of a place [m].
ON_THE_WALL = 1e-9


def drawn_network(network: "PipeNetwork") -> dict[str, np.ndarray]:
    """Return arrays for the figures, by their names in the results (FieldWriter.describe)."""
    if not network.junctions:
        return drawn(network.branches[0].path, np.inf)
    spacing = BETWEEN_STATIONS[len(network.junctions[0].centre)]
    parts = [drawn(branch.path, spacing) for branch in network.branches]
    found = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return {
        name: pieces if name == "centre_lines" else opened(network, pieces, spacing)
        for name, pieces in found.items()
    }


def opened(network: "PipeNetwork", pieces: np.ndarray, spacing: float) -> np.ndarray:
    """Return the pieces of the walls of a network's pipes, open where a pipe leaves another.

    pieces: lines or faces (k, corners, d) [m], `spacing` long. Those in an opening are left out,
    and those beside its edge are moved onto the rounded edge.
    """
    x, middle = pieces.reshape(-1, pieces.shape[2]).copy(), pieces.mean(axis=1)
    opens = np.zeros(len(pieces), dtype=bool)
    for junction in network.junctions:
        held = junction.holds(middle)
        opens[held] = junction.gap(middle[held]) > OFF_THE_EDGE * junction.fillet + 0.5 * spacing
        held = junction.holds(x)
        x[held] -= junction.gap(x[held])[:, None] * junction.gradient(x[held])
    is_wall = (np.abs(network.gap(x)) < ON_THE_WALL).reshape(pieces.shape[:2]).all(axis=1)
    return np.asarray(x.reshape(pieces.shape)[is_wall & ~opens])


def drawn(path: "PipePath", spacing: float) -> dict[str, np.ndarray]:
    """Return the wall of a pipe, in pieces of at most `spacing` [m], and its centre line."""
    _, places, tangents, radii = stations(path.segments, spacing)
    places, tangents = (np.concatenate([a[:1], a, a[-1:]]) for a in (places, tangents))
    share = 1.0 if path.goes_on else FACE_SHARE
    ends = [0.0 if is_closed else share for is_closed in path.closed]
    radii = np.concatenate([[ends[0] * radii[0]], radii, [ends[1] * radii[-1]]])
    keep = np.ones(len(radii), dtype=bool)  # a smooth joint once
    keep[1:] = (np.linalg.norm(np.diff(places, axis=0), axis=1) > 1e-9) | (np.diff(radii) != 0.0)
    places, tangents, radii = places[keep], tangents[keep], radii[keep]
    centre_line = {"centre_lines": np.stack([places[:-1], places[1:]], axis=1)}
    if places.shape[1] == 2:
        return {"wall_lines": wall_lines(places, tangents, radii), **centre_line}
    return {"wall_faces": wall_faces(places, tangents, radii), **centre_line}


def stations(segments: Sequence[Segment], spacing: float = np.inf) -> tuple[np.ndarray, ...]:
    """Return stations along the centre line, no more than `spacing` [m] and a chord apart.

    Arc lengths (n,) [m], positions (n, d) [m], tangents (n, d) and the pipe's radii (n,) [m] there;
    joints appear twice.
    """
    arcs, places, tangents, radii = [], [], [], []
    for segment in segments:
        chord = min(spacing, CHORD * segment.bend_radius)
        s = np.linspace(0.0, segment.length, 2 + int(segment.length / chord))
        place, tangent = segment.axis_place(s)
        arcs.append(segment.start + s)
        places.append(place)
        tangents.append(tangent)
        radii.append(segment.radius(s))
    return tuple(np.concatenate(parts) for parts in (arcs, places, tangents, radii))


def wall_lines(places: np.ndarray, tangents: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return both sides of a pipe in the plane as lines (k, 2, 2) [m], free side on their left."""
    left = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
    right_side, left_side = (places + sign * radii[:, None] * left for sign in (-1.0, 1.0))
    along_right = np.stack([right_side[:-1], right_side[1:]], axis=1)
    along_left = np.stack([left_side[1:], left_side[:-1]], axis=1)[::-1]
    return np.concatenate([along_right, along_left])


def wall_faces(places: np.ndarray, tangents: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return a pipe in space as faces (k, 4, 3) [m], right-hand normals into the free side."""
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
