"""The deformed robot frame by frame, small enough to travel inside a page."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from softsim.errors import OutputError
from softsim.mesh.mesh import boundary_facets, facet_owners, simplex_facets
from softsim.output.fields import Frames
from softsim.report.cables import rigid_faces_at
from softsim.report.colours import (
    FIELDS,
    MILLI,
    colour_scale,
    places_at,
    refuse_missing_field,
    shared_scale,
    shown_values,
)
from softsim.report.page.charts import Chart
from softsim.report.page.robot import (
    SHADES,
    plane_layout,
    plane_parts,
    ring,
    space_layout,
    space_parts,
)
from softsim.report.snapshots import is_axisymmetric, pictures
from softsim.report.surface import CAMERA, around, corners_of_box, flat_walls, seen_walls

MOST_FRAMES = 200
"""A slider has about as many places that a hand can find."""

ROOM = 6 * 2**20
"""For all frames [bytes], two a coordinate and one a face; compressed they take half of it."""

FINENESS, LEVELS = 4000, 254
"""Steps of places in the size of the body at rest, and of values from end to end of the scale."""


ASPECTS = {2: (0.7, 16 / 9), 3: (1.0, 4 / 3)}
"""Least and largest width of the picture over its height, in the plane and in space."""


@dataclass(frozen=True)
class Skin:
    """What is drawn of a mesh: faces (m, 3|4), the cell of each, and the rim's edges (e, 2); in
    space the surface only, in triangles, and no rim. nodes (n,): those that are needed, rising.
    """

    nodes: np.ndarray
    faces: np.ndarray
    owners: np.ndarray | slice
    rim: np.ndarray


def animation(frames: Frames, field: str, failed: int | None = None) -> dict[str, Any]:
    """The frames coloured by `field`, as player.js takes them; lengths in mm, times in s.

    figure: the robot between its walls, without places. origins: the middle of the robot in each
    frame (f, d); near: lowest and highest coordinates (2, d), from there, of what is shown around
    it; everywhere: of all that it comes to. aspect: width of the picture over its height.
    most_deformed: the frame in which the mean of the shown field is largest. walls: flat ones near
    the body in space (w, 6), a point and the normal, on which it has shadows. signs: 1, and -1 for
    a mirror image. moving: of traces that are not made from the body's nodes their places in each
    frame; in_front: which of them the body does not hide. failed: an element that a ring is about,
    where it was last, where it is lost.
    Frames are left out evenly where there are more than MOST_FRAMES or than fit in ROOM.
    Raises OutputError for a field that the frames do not have, or if no node has a place.
    """
    refuse_missing_field(frames, field)
    d, mirrored, skin = frames.points.shape[1], is_axisymmetric(frames), skin_of(frames)
    coordinates = skin.nodes.size * d + frames.described.get("rigid_vertices", np.zeros(0)).size
    chosen = chosen_frames(len(frames), coordinates, len(skin.faces))
    every = np.stack([places_at(frames, index) for index in chosen])
    places = every[:, skin.nodes]
    kept = np.isfinite(places).all(axis=2).any(axis=1)
    if not kept.any():
        raise OutputError("the results contain no frame with valid node positions")
    chosen, places, every = chosen[kept], places[kept], every[kept]
    origins = np.nanmean(places, axis=1) * ([0.0, 1.0] if mirrored else 1.0)
    values = shown_values(frames, chosen, field, skin.faces, skin.owners)
    low, high = shared_scale(values.ravel())[0].get_clim()
    everywhere = box(places, mirrored)
    size = float(np.ptp(frames.points, axis=0).max()) * MILLI
    around_it = box(places - origins[:, None], mirrored)
    near = with_surroundings(frames, field, around_it, origins[0])
    outward = np.zeros(d)
    if failed is not None:
        middles = last_known(every, frames.cells[failed])
        outward = middles[-1] - origins[-1]
    if d == 2:
        walls = np.zeros((0, 6))
        parts = list(plane_parts(frames, chosen, field, everywhere))
        layout = plane_layout(frames, field)
    else:
        walls = flat_walls(frames, corners_of_box(everywhere), 0)
        parts = list(space_parts(frames, chosen, everywhere, len(walls)))
        layout = space_layout(outward)
    if failed is not None:
        parts.append(ring(failed, middles))
    layout["coloraxis"] = {
        "cmin": low, "cmax": high,
        "colorscale": colour_scale(),
        "colorbar": {"title": {"text": FIELDS[field].label, "side": "right"}, "thickness": 14},
    }  # fmt: skip
    return {
        "times": frames.times[chosen],
        "frame_count": len(frames),
        "figure": Chart("", [part.first for part in parts], layout).figure,
        "in_front": [k for k, part in enumerate(parts) if part.in_front],
        "moving": {
            k: part.places for k, part in enumerate(parts) if len(part.places) > 1 or part.in_front
        },
        "signs": [1, -1] if mirrored else [1],
        "faces": np.searchsorted(skin.nodes, skin.faces),
        "rim": np.searchsorted(skin.nodes, skin.rim),
        "places": in_steps(places.reshape(len(places), -1), size / FINENESS),
        "values": in_steps(values.clip(low, high), (high - low) / LEVELS or 1.0),
        "scale": [low, high],
        "shades": SHADES,
        "origins": origins.round(4),
        "near": near,
        "aspect": aspect(near),
        "most_deformed": most_deformed(values),
        "walls": walls,
        "everywhere": near + np.array([origins.min(axis=0), origins.max(axis=0)]),
    }


def skin_of(frames: Frames) -> Skin:
    """What is drawn of the mesh of a run."""
    if frames.points.shape[1] == 2:
        nodes = np.unique(frames.cells)
        return Skin(nodes, frames.cells, slice(None), boundary_facets(frames.cells, 2))
    facets = boundary_facets(frames.cells, 3)
    faces, numbers = simplex_facets(facets)
    owners = facet_owners(facets, frames.cells)[numbers]
    return Skin(np.unique(faces), faces, owners, np.zeros((0, 2), dtype=int))


def chosen_frames(count: int, coordinates: int, faces: int) -> np.ndarray:
    """Which of `count` frames go into the page, the first and the last among them; each has so many
    coordinates, of two bytes, and faces, of one.
    """
    most = min(MOST_FRAMES, max(ROOM // (2 * coordinates + faces), 2))
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


def in_steps(values: np.ndarray, step: float) -> dict[str, Any]:
    """Values of frames (f, n) as whole numbers of steps from the lowest one: those of the first
    frame, and of each further one its changes, which are small and take little room compressed.
    None stands for what is not finite; the next change is from the frame before.
    """
    low, known = float(np.nanmin(values, initial=np.inf)), np.isfinite(values)
    if not known.any():
        low = 0.0
    last = np.maximum.accumulate(np.where(known, np.arange(len(values))[:, None], -1), axis=0)
    filled = np.where(last < 0, low, np.take_along_axis(values, last.clip(0), axis=0))
    numbers = np.rint((filled - low) / step).astype(int)
    changes = np.diff(numbers, axis=0, prepend=0).astype(object)
    changes[~known] = None
    return {"low": low, "step": step, "changes": changes.tolist()}


def box(places: np.ndarray, mirrored: bool) -> np.ndarray:
    """Lowest and highest coordinates (2, d) of finite places (..., d); of a half section with its
    mirror image.
    """
    every = places.reshape(-1, places.shape[-1])
    low, high = np.nanmin(every, axis=0), np.nanmax(every, axis=0)
    if mirrored:
        low[0] = -high[0]
    return np.stack([low, high])


def with_surroundings(
    frames: Frames, field: str, near: np.ndarray, origin: np.ndarray
) -> np.ndarray:
    """The box (2, d) around a body at `origin`, with the walls and rigid outlines that the figures
    show around its first frame; in space with what walls have within a quarter of its size.
    """
    if len(origin) == 2:
        view = pictures(frames, [0], field).view.reshape(2, 2).T - origin
        return np.stack([np.minimum(near[0], view[0]), np.maximum(near[1], view[1])])
    rigid = rigid_faces_at(frames, 0)[0] - origin
    corners = corners_of_box(np.concatenate([near, rigid]))
    walls = (
        np.concatenate([f.reshape(-1, 3) for f in seen_walls(frames, corners + origin, 0)]) - origin
    )
    low, high = box(around(corners), False)
    return box(np.concatenate([corners, walls.clip(low, high)]), False)


def aspect(near: np.ndarray) -> float:
    """Width over height of a picture of a box (2, d), not too flat and not too tall for a page."""
    corners = near if near.shape[1] == 2 else CAMERA.project(corners_of_box(near))
    width, height = np.ptp(corners, axis=0)
    least, most = ASPECTS[near.shape[1]]
    return round(float(np.clip(width / height, least, most)), 3)


def most_deformed(values: np.ndarray) -> int:
    """The frame with the largest mean of the absolute values (f, n), the last of several."""
    known = np.isfinite(values)
    means = np.abs(np.where(known, values, 0.0)).sum(axis=1) / known.sum(axis=1).clip(1)
    return int(np.flatnonzero(means == means.max())[-1])


def last_known(places: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """The middle (f, d) of a cell in frames that show places (f, n, d); of one without a place that
    of the frame before.
    """
    middles = places[:, cell].mean(axis=1)
    known = np.isfinite(middles).all(axis=1)
    return middles[np.maximum.accumulate(np.where(known, np.arange(len(middles)), 0))]
