"""Animation of the deformed robot, compact enough to be embedded in a page."""

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
"""Largest number of frames, about the number of positions of a slider."""

ROOM = 6 * 2**20
"""Capacity for all frames [bytes]: two bytes per coordinate, one per face; compressed half of it.
"""

FINENESS, LEVELS = 4000, 254
"""Number of steps that resolve the size of the body at rest, and the range of the colour scale."""


ASPECTS = {2: (0.7, 16 / 9), 3: (1.0, 4 / 3)}
"""Smallest and largest ratio of width to height of the picture, in the plane and in space."""


@dataclass(frozen=True)
class Skin:
    """Drawn part of a mesh.

    faces (m, 3|4), the cell of each as owners, and edges of the boundary (e, 2); in space only
    the surface, in triangles, without edges. nodes (n,): the nodes in use, in increasing order.
    """

    nodes: np.ndarray
    faces: np.ndarray
    owners: np.ndarray | slice
    rim: np.ndarray


def animation(frames: Frames, field: str, failed: int | None = None) -> dict[str, Any]:
    """Return the frames coloured by `field`, in the format of player.js; lengths in mm, times in s.

    figure: the robot between its walls, without positions. origins: the centre of the robot in
    each frame (f, d). near: lowest and highest coordinates (2, d), relative to it, of what is
    shown around it; everywhere: those of the whole motion. aspect: ratio of width to height of
    the picture. most_deformed: the frame with the largest mean of the shown field. walls: flat
    walls near the body in space (w, 6), a point and the normal, on which it casts shadows.
    signs: 1, and -1 for a mirror image. moving: the positions in each frame of traces that are
    not made from the nodes of the body; in_front: which of them the body does not hide. failed:
    an element to be marked by a ring, at its last known position.

    Frames are omitted evenly if there are more than MOST_FRAMES or than fit in ROOM. Raises
    OutputError for a field that the frames do not have, or if no node has a finite position.
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
    """Return the drawn part of the mesh of a run."""
    if frames.points.shape[1] == 2:
        nodes = np.unique(frames.cells)
        return Skin(nodes, frames.cells, slice(None), boundary_facets(frames.cells, 2))
    facets = boundary_facets(frames.cells, 3)
    faces, numbers = simplex_facets(facets)
    owners = facet_owners(facets, frames.cells)[numbers]
    return Skin(np.unique(faces), faces, owners, np.zeros((0, 2), dtype=int))


def chosen_frames(count: int, coordinates: int, faces: int) -> np.ndarray:
    """Return the indices of the frames of `count` that the page has, including first and last.

    Each frame has `coordinates` of two bytes and `faces` of one byte.
    """
    most = min(MOST_FRAMES, max(ROOM // (2 * coordinates + faces), 2))
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


def in_steps(values: np.ndarray, step: float) -> dict[str, Any]:
    """Return values of frames (f, n) as integer steps above the lowest value.

    The first frame has its values, each further one the changes, which are small and compress
    well. None represents a value that is not finite; the next change is relative to the last
    finite value.
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
    """Return lowest and highest coordinates (2, d) of finite points (..., d).

    mirrored: for a half section, together with its mirror image.
    """
    every = places.reshape(-1, places.shape[-1])
    low, high = np.nanmin(every, axis=0), np.nanmax(every, axis=0)
    if mirrored:
        low[0] = -high[0]
    return np.stack([low, high])


def with_surroundings(
    frames: Frames, field: str, near: np.ndarray, origin: np.ndarray
) -> np.ndarray:
    """Return the box (2, d) around a body at `origin`, extended by its surroundings.

    These are the walls and rigid outlines that the figures show around its first frame; in
    space the parts of walls within a quarter of its size.
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
    """Return the ratio of width to height of a picture of a box (2, d), limited by ASPECTS."""
    corners = near if near.shape[1] == 2 else CAMERA.project(corners_of_box(near))
    width, height = np.ptp(corners, axis=0)
    least, most = ASPECTS[near.shape[1]]
    return round(float(np.clip(width / height, least, most)), 3)


def most_deformed(values: np.ndarray) -> int:
    """Return the last frame with the largest mean of the absolute values (f, n)."""
    known = np.isfinite(values)
    means = np.abs(np.where(known, values, 0.0)).sum(axis=1) / known.sum(axis=1).clip(1)
    return int(np.flatnonzero(means == means.max())[-1])


def last_known(places: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """Return the centre (f, d) of a cell in frames with node positions (f, n, d).

    A centre that is not finite is replaced by that of the frame before.
    """
    middles = places[:, cell].mean(axis=1)
    known = np.isfinite(middles).all(axis=1)
    return middles[np.maximum.accumulate(np.where(known, np.arange(len(middles)), 0))]
