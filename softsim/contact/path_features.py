"""Features of a pipe's path: joints, steps and narrow places. Geometry in numpy."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from softsim.contact.pipe_path import PipePath
from softsim.contact.pipe_segment import BEND, STRAIGHT, Segment


class Edge(Enum):
    """Position of a feature relative to the list item that it belongs to."""

    BEGINNING = "beginning of"
    END = "end of"
    STEP = ""


@dataclass(frozen=True)
class Feature:
    """Position `place` [m] along a path where the pipe changes.

    item: the item of the user's list that begins or ends there, or that is a step there.
    """

    place: float
    item: int
    edge: Edge


def features(path: PipePath) -> list[Feature]:
    """Return the joints at which something changes, and steps; the path's ends are not included."""
    found = []
    for before, after in zip(path.segments[:-1], path.segments[1:], strict=True):
        if before.radii[1] != after.radii[0]:
            # The step stands between them in the list; the last one decides, should there be two.
            found.append(Feature(after.start, after.item - 1, Edge.STEP))
        elif after.kind != STRAIGHT and not _goes_on(before, after):
            found.append(Feature(after.start, after.item, Edge.BEGINNING))
        elif before.kind != after.kind:
            found.append(Feature(after.start, before.item, Edge.END))
    return found


def _goes_on(before: Segment, after: Segment) -> bool:
    """Return True if the same bend continues in the next segment."""
    return (
        before.kind == after.kind == BEND
        and before.bend_radius == after.bend_radius
        and bool(np.allclose(before.centre, after.centre))
    )


def nearest_feature(path: PipePath, place: float) -> Feature | None:
    """Return the feature nearest to a position [m] along the path, or None if it has none."""
    return min(features(path), key=lambda f: abs(f.place - place), default=None)


def narrowings(path: PipePath) -> np.ndarray:
    """Return the intervals (k, 2) [m] along the path in which the pipe narrows.

    They are counted from its start to its end: tapers, and steps, which have no length.
    """
    found = [(s.start, s.end) for s in path.segments if s.radii[1] < s.radii[0]]
    found += [
        (after.start, after.start)
        for before, after in zip(path.segments[:-1], path.segments[1:], strict=True)
        if after.radii[0] < before.radii[1]
    ]
    return np.array(sorted(found)).reshape(-1, 2)
