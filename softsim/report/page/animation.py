"""The deformed robot frame by frame, small enough to travel inside a page."""

from base64 import b64encode
from dataclasses import dataclass
from typing import Any

import numpy as np

from softsim.errors import OutputError
from softsim.mesh.mesh import boundary_facets, facet_owners, simplex_facets
from softsim.output.fields import Frames
from softsim.report.colours import (
    FIELDS,
    MILLI,
    colour_scale,
    refuse_missing_field,
    shared_scale,
    shown_values,
)
from softsim.report.page.robot import moving_walls, plane_chart, space_chart
from softsim.report.section import outlines_at
from softsim.report.snapshots import is_axisymmetric, pictures
from softsim.report.surface import around, corners_of_box, seen_walls

MOST_FRAMES = 200
"""A slider has about as many places that a hand can find."""

ROOM = 6 * 2**20
"""For all frames [bytes], so that the page with its scripts stays below 15 MB."""


@dataclass(frozen=True)
class Skin:
    """What is drawn of a mesh: faces (m, 3|4), the cell of each, and the rim's edges (e, 2); in
    space the surface only, in triangles, and no rim. nodes (n,): those that are needed, rising.
    """

    nodes: np.ndarray
    faces: np.ndarray
    owners: np.ndarray | slice
    rim: np.ndarray


def animation(frames: Frames, field: str) -> dict[str, Any]:
    """The frames coloured by `field`, as player.js takes them; lengths in mm, times in s.

    figure: the robot between its walls, without places. origins: the middle of the robot in each
    frame (f, d); near: lowest and highest coordinates (2, d), from there, of what is shown around
    it; everywhere: of all that it comes to. signs: 1, and -1 for a mirror image. walls: None, or in
    each frame the outlines and faces of walls of which one moves.
    Frames are left out evenly where there are more than MOST_FRAMES or than fit in ROOM.
    Raises OutputError for a field that the frames do not have, or if no node has a place.
    """
    refuse_missing_field(frames, field)
    d, mirrored, skin = frames.points.shape[1], is_axisymmetric(frames), skin_of(frames)
    chosen = chosen_frames(len(frames), len(skin.nodes) * d, len(skin.faces))
    places = _places(frames, chosen)[:, skin.nodes]
    kept = np.isfinite(places).all(axis=2).any(axis=1)
    if not kept.any():
        raise OutputError("the results hold no frame in which a node still has a place")
    chosen, places = chosen[kept], places[kept]
    origins = np.nanmean(places, axis=1) * ([0.0, 1.0] if mirrored else 1.0)
    values = shown_values(frames, chosen, field, skin.faces, skin.owners)
    low, high = shared_scale(values.ravel())[0].get_clim()
    everywhere = box(places, mirrored)
    around_it = box(places - origins[:, None], mirrored)
    near = with_surroundings(frames, field, around_it, origins[0])
    colours = {
        "cmin": low, "cmax": high,
        "colorscale": colour_scale(),
        "colorbar": {"title": {"text": FIELDS[field].label, "side": "right"}, "thickness": 14},
    }  # fmt: skip
    if d == 2:
        chart = plane_chart(frames, field, everywhere, colours)
        walls = moving_walls(frames, chosen, field, everywhere)
    else:
        chart, walls = space_chart(frames, everywhere, colours), None
    return {
        "times": frames.times[chosen],
        "frame_count": len(frames),
        "figure": chart.figure,
        "signs": [1, -1] if mirrored else [1],
        "faces": np.searchsorted(skin.nodes, skin.faces),
        "rim": np.searchsorted(skin.nodes, skin.rim),
        "places": packed(places, np.nanmin(places), np.nanmax(places), np.uint16),
        "values": packed(values, low, high, np.uint8),
        "outlines": [outlines_of(frames, index).round(3) for index in chosen],
        "walls": walls,
        "origins": origins.round(4),
        "near": near,
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


def packed(values: np.ndarray, low: float, high: float, kind: type[np.integer]) -> dict[str, Any]:
    """Values as whole numbers of this kind in base64, row by row: from 0, which stands for `low`,
    to the last but one of the kind for `high`; the last one stands for what is not finite.
    """
    most, finite = np.iinfo(kind).max - 1, np.isfinite(values)
    share = (np.where(finite, values, low) - low) / ((high - low) or 1.0)
    codes = np.where(finite, np.rint(share.clip(0.0, 1.0) * most), most + 1)
    little_endian = codes.astype(np.dtype(kind).newbyteorder("<")).tobytes()
    return {"low": low, "high": high, "codes": b64encode(little_endian).decode("ascii")}


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
    corners = corners_of_box(near)
    walls = (
        np.concatenate([f.reshape(-1, 3) for f in seen_walls(frames, corners + origin, 0)]) - origin
    )
    low, high = box(around(corners), False)
    return box(np.concatenate([corners, walls.clip(low, high)]), False)


def outlines_of(frames: Frames, index: int) -> np.ndarray:
    """Corners (k, 4, 2) [mm] of the rigid outlines; none in space, where nothing shows them."""
    return outlines_at(frames, index) if frames.points.shape[1] == 2 else np.zeros((0, 4, 2))


def _places(frames: Frames, indices: np.ndarray) -> np.ndarray:
    d = frames.points.shape[1]
    displacements = np.array(frames.point_data["displacement"].at(indices))[..., :d]
    return (frames.points + displacements) * MILLI
