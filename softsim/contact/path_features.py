"""What a pipe's path has besides going on: joints, steps, narrow places. Geometry in numpy."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from softsim.contact.pipe_path import PipePath
from softsim.contact.pipe_segment import BEND, STRAIGHT, Segment


class Edge(Enum):
    """What a feature is of the item of the list that it belongs to."""

    BEGINNING = "beginning of"
    END = "end of"
    STEP = ""


@dataclass(frozen=True)
class Feature:
    """A place [m] along a path where the pipe changes, and the item of the user's list that it is
    the beginning or the end of, or that is a step there.
    """

    place: float
    item: int
    edge: Edge


def features(path: PipePath) -> list[Feature]:
    """Joints at which something changes, and steps; the path's ends are none."""
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
    """Whether the same bend goes on in the next segment."""
    return (
        before.kind == after.kind == BEND
        and before.bend_radius == after.bend_radius
        and bool(np.allclose(before.centre, after.centre))
    )


def nearest_feature(path: PipePath, place: float) -> Feature | None:
    """The feature nearest to a place [m] along the path; None where the path has none."""
    return min(features(path), key=lambda f: abs(f.place - place), default=None)


def narrowings(path: PipePath) -> np.ndarray:
    """Stretches (k, 2) [m] along the path in which the pipe narrows on the way from its start to
    its end: tapers, and steps, which have no length.
    """
    found = [(s.start, s.end) for s in path.segments if s.radii[1] < s.radii[0]]
    found += [
        (after.start, after.start)
        for before, after in zip(path.segments[:-1], path.segments[1:], strict=True)
        if after.radii[0] < before.radii[1]
    ]
    return np.array(sorted(found)).reshape(-1, 2)
