"""The deformed robot frame by frame, small enough to travel inside a page.

Places are kept relative to the middle of the robot in their frame. player.js paints them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.colors import to_hex

from softsim.errors import OutputError
from softsim.mesh.mesh import boundary_facets, facet_owners
from softsim.output.fields import Frames
from softsim.report.colours import FIELDS, MILLI, refuse_missing_field, shared_scale, shown_values
from softsim.report.page.packing import SHADES, STEPS, packed, shades, steps
from softsim.report.page.scenery import scenery
from softsim.report.section import boundary_edges, outlines_at
from softsim.report.snapshots import is_axisymmetric, pictures

MOST_FRAMES = 200
"""A slider has about as many places that a hand can find."""

ROOM = 6 * 2**20
"""For all frames [bytes], so that the page with its scripts stays below 15 MB."""

NO_VALUE = "#bbbbbb"
"""Colour of a cell whose value is not finite."""


@dataclass(frozen=True)
class Skin:
    """What is painted of a mesh: faces (m, 3|4), the cell of each, and the rim's edges (e, 2); in
    space the surface only, and no rim. nodes (n,): those that are needed, rising.
    """

    nodes: np.ndarray
    faces: np.ndarray
    owners: np.ndarray | slice
    rim: np.ndarray


def animation(frames: Frames, field: str) -> dict[str, Any]:
    """The frames coloured by `field`, as player.js takes them; lengths in mm, times in s.

    Frames are left out evenly where there are more than MOST_FRAMES or than fit in ROOM.
    Raises OutputError for a field that the frames do not have, or if no node has a place.
    """
    refuse_missing_field(frames, field)
    d, mirrored, skin = frames.points.shape[1], is_axisymmetric(frames), skin_of(frames)
    chosen = chosen_frames(len(frames), len(skin.nodes) * d, len(skin.faces))
    places = np.array([_places(frames, index)[skin.nodes] for index in chosen])
    kept = np.isfinite(places).all(axis=2).any(axis=1)
    if not kept.any():
        raise OutputError("the results hold no frame in which a node still has a place")
    chosen, places = chosen[kept], places[kept]
    origins = np.nanmean(places, axis=1) * ([0.0, 1.0] if mirrored else 1.0)
    local = places - origins[:, None]
    size = float(np.nanmax(np.abs(local)))
    values = np.array([shown_values(frames, k, field, skin.faces, skin.owners) for k in chosen])
    scale, _ = shared_scale(values.ravel())
    limits = scale.get_clim()
    everywhere = box(places, mirrored)
    near = with_surroundings(frames, field, box(local, mirrored), origins[0])
    return {
        "times": frames.times[chosen],
        "frame_count": len(frames),
        "mirrored": mirrored,
        "node_count": len(skin.nodes),
        "corners": skin.faces.shape[1],
        "faces": packed(np.searchsorted(skin.nodes, skin.faces), np.int32),
        "rim": packed(np.searchsorted(skin.nodes, skin.rim), np.int32),
        "origins": origins.round(4),
        "step": size / STEPS,
        "places": packed(steps(local, size), np.int16),
        "outlines": [outlines_of(frames, index).round(3) for index in chosen],
        "near": near,
        "everywhere": everywhere,
        "label": FIELDS[field].label,
        "limits": limits,
        "palette": [*(to_hex(scale.cmap(k / (SHADES - 1))) for k in range(SHADES)), NO_VALUE],
        "shades": packed(shades(values, *limits), np.uint8),
        "scenery": scenery(frames, field, everywhere),
    }


def skin_of(frames: Frames) -> Skin:
    """What is painted of the mesh of a run."""
    if frames.points.shape[1] == 2:
        nodes = np.unique(frames.cells)
        return Skin(nodes, frames.cells, slice(None), boundary_edges(frames.cells))
    faces = boundary_facets(frames.cells)
    owners = facet_owners(faces, frames.cells)
    return Skin(np.unique(faces), faces, owners, np.zeros((0, 2), dtype=int))


def chosen_frames(count: int, coordinates: int, faces: int) -> np.ndarray:
    """Which of `count` frames go into the page, the first and the last among them; each has so many
    coordinates, of two bytes, and faces, of one.
    """
    most = min(MOST_FRAMES, max(ROOM // (2 * coordinates + faces), 2))
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


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
    """The box (2, d) around a plane body at `origin`, with the walls and rigid outlines that the
    figures show around its first frame; that of a body in space as it is.
    """
    if len(origin) == 3:
        return near
    view = pictures(frames, [0], field).view.reshape(2, 2).T - origin
    return np.stack([np.minimum(near[0], view[0]), np.maximum(near[1], view[1])])


def outlines_of(frames: Frames, index: int) -> np.ndarray:
    """Corners (k, 4, 2) [mm] of the rigid outlines; none in space, where nothing shows them."""
    return outlines_at(frames, index) if frames.points.shape[1] == 2 else np.zeros((0, 4, 2))


def _places(frames: Frames, index: int) -> np.ndarray:
    d = frames.points.shape[1]
    return (frames.points + frames.point_data["displacement"][index][:, :d]) * MILLI
