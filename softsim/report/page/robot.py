"""Robot and its walls as plotly.js traces, without the positions of its nodes.

In the plane these are its cells; in space its surface, which a reader can turn.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from softsim.errors import OutputError
from softsim.output.fields import Frames
from softsim.report.body import (
    CAMERA,
    LINES,
    around,
    corners_of_box,
    flat_walls,
    is_axisymmetric,
    lines_at,
    outlines_at,
    places_at,
    plane_picture,
    rigid_faces_at,
    rim,
    seen_walls,
    skin_of,
)
from softsim.report.diagram import (
    FIELDS,
    MILLI,
    colour_scale,
    refuse_missing_field,
    shades,
    shared_scale,
)
from softsim.report.page.charts import BAR, Chart
from softsim.report.style import FRAME, GRID, INK, PALE, QUIET, RED, SHADOW, WALL

SHADES = 16
"""Number of colours of cells in the plane, one trace each; more would slow down the animation."""

NO_VALUE = "#bbbbbb"
"""Colour of a cell whose value is not finite."""

SEE_THROUGH = 0.3
"""Opacity of walls in space, which surround the body. In QUIET they are 15 % grey."""

RIM = 2.0
"""Width of the edge of a wall in space [px]."""

RING = 24
"""Diameter of the ring about an element that failed [px]."""

FAR = 1e5
"""Length [mm] beyond everything that is shown."""

EYE = 2.5
"""Distance of the eye from the centre of the axes, relative to their size.

The lighting of plotly.js needs this distance and fails in the parallel projection of the figures.
"""

FROM_ASIDE = 3.0
"""Weight of a side that must be visible in the direction of the eye.

It is relative to the default direction, so that the eye is never exactly above or below, where "up"
is undefined.
"""

LIGHT = {
    "ambient": 0.7, "diffuse": 0.8, "specular": 0.1, "roughness": 0.9, "fresnel": 0.05,
    "facenormalsepsilon": 0, "vertexnormalsepsilon": 0,  # else faces below a millimetre have none
}  # fmt: skip
ABOVE = np.array([0.1, 1.0, 0.0])
"""Direction towards the light."""

UPRIGHT = {"yref": "paper", "y0": 0.0, "y1": 1.0}

MIRROR = (
    {"type": "rect", "x0": -FAR, "x1": 0.0, "fillcolor": "white", "opacity": PALE,
     "line": {"width": 0}, **UPRIGHT},
    {"type": "line", "x0": 0.0, "x1": 0.0, "line": {"color": INK, "width": 1, "dash": "dashdot"},
     **UPRIGHT},
)  # fmt: skip
"""Shapes over the mirror image of a half section: a pale area that ends at the axis."""

Trace = dict[str, Any]


@dataclass(frozen=True)
class AnimatedTrace:
    """Trace of plotly.js with its positions in each frame.

    One position for a trace that does not move; none if the player makes them from those of the
    nodes. in_front: the player moves it towards the eye, so that the body does not hide it, as
    in the figures.
    """

    trace: Trace
    places: Sequence[Trace] = ()
    in_front: bool = False

    @property
    def first(self) -> Trace:
        """Trace before the player shows a frame."""
        return self.trace if len(self.places) == 0 else self.trace | self.places[0]


def plane_parts(
    frames: Frames, chosen: np.ndarray, field: str, everywhere: np.ndarray
) -> Iterator[AnimatedTrace]:
    """Yield the traces of a plane run, from back to front.

    These are walls, the lines that bodies follow, cables, rigid outlines and the colour bar;
    then the body: the cells of each of the SHADES, those without a value, and the boundary;
    then the lines in front. everywhere: lowest and highest
    coordinates (2, d) [mm] of the body in the chosen frames.
    """
    picture = plane_picture(frames, list(chosen) if walls_move(frames, chosen) else [0], field)
    solids = [picture.solids(everywhere.T.ravel(), n) for n in range(len(picture.shots))]
    yield AnimatedTrace(
        filled(WALL, QUIET), [path(part.outline for part in parts) for parts in solids]
    )
    yield AnimatedTrace(line(INK), [path(part.face for part in parts) for parts in solids])
    yield AnimatedTrace(line(QUIET), [path(picture.centre_lines)])
    lines = line_traces(frames, chosen)
    yield from lines.pop("cables")
    outlines = [path(outlines_at(frames, index)) for index in chosen]
    yield AnimatedTrace(filled(FRAME, INK), outlines)
    yield AnimatedTrace(BAR)
    for shade in (*shades(SHADES), NO_VALUE):
        yield AnimatedTrace(filled(shade, shade))
    yield AnimatedTrace(line(INK))
    yield from chain(*lines.values())


def line_traces(frames: Frames, chosen: np.ndarray) -> dict[str, list[AnimatedTrace]]:
    """Return the trace of each kind of LINES, none if the run has no such lines."""
    shown, d = [lines_at(frames, index) for index in chosen], frames.points.shape[1]
    found: dict[str, list[AnimatedTrace]] = {kind: [] for kind in LINES}
    for kind, look in LINES.items():
        if shown[0][kind]:
            trace = line(look.colour, look.pixels * (d - 1)) | {"opacity": look.opacity}
            places = [path(lines[kind], d) for lines in shown]
            in_space = {"type": "scatter3d"} if d == 3 else {}
            in_front = d == 3 and kind != "cables"
            found[kind].append(AnimatedTrace(trace | in_space, places, in_front))
    return found


def walls_move(frames: Frames, chosen: np.ndarray) -> bool:
    """Return True if a wall is displaced in one of the chosen frames."""
    if "wall_offset" not in frames.extra:
        return False
    return any(bool(frames.extra["wall_offset"][index].any()) for index in chosen)


def space_parts(
    frames: Frames, chosen: np.ndarray, everywhere: np.ndarray, shadows: int
) -> Iterator[AnimatedTrace]:
    """Yield the traces of a run in space.

    These are walls at their initial positions and their edges, lines, and surfaces of rigid bodies;
    then the body: the faces of its surface, those without a value, and its shadows.
    """
    flat, curved = seen_walls(frames, corners_of_box(everywhere), 0)
    corners = np.concatenate([triangles(flat), triangles(curved)]).reshape(-1, 3).round(3)
    look = {
        "type": "mesh3d", "flatshading": True, "hoverinfo": "skip",
        "lighting": LIGHT, "lightposition": xyz(FAR * ABOVE),
    }  # fmt: skip
    first = np.arange(0, len(corners), 3)
    walls = {"i": first, "j": first + 1, "k": first + 2, "color": QUIET, "opacity": SEE_THROUGH}
    yield AnimatedTrace(look | walls, [xyz(corners.T)])
    yield AnimatedTrace(line(QUIET, RIM) | {"type": "scatter3d"}, [path(rim(flat), 3)])
    yield from chain(*line_traces(frames, chosen).values())
    rigid = [rigid_faces_at(frames, index) for index in chosen]
    if len(rigid[0][1]):
        corners = dict(zip("ijk", rigid[0][1].T, strict=True))
        yield AnimatedTrace(
            look | corners | {"color": FRAME}, [xyz(v.T.round(3)) for v, _ in rigid]
        )
    yield AnimatedTrace(look | {"intensitymode": "cell", "coloraxis": "coloraxis"})
    yield AnimatedTrace(look | {"color": NO_VALUE})
    dark = {"color": SHADOW, "opacity": 1.0, "lighting": {"ambient": 1.0, "diffuse": 0.0}}
    yield from [AnimatedTrace(look | dark)] * shadows


def space_layout(outward: np.ndarray) -> Trace:
    """Return the axes in space, seen from the camera of the figures or from a given side.

    outward (3,): vector from the centre of the body to what must not be hidden behind it; zero
    if there is nothing.
    """
    side = outward / (np.linalg.norm(outward) or 1.0)
    towards = CAMERA.towards + FROM_ASIDE * side
    eye = EYE * towards / np.linalg.norm(towards)
    scene = {
        "camera": {"up": xyz(np.array([0.0, 1.0, 0.0])), "eye": xyz(eye)},
        "aspectmode": "manual",
        "dragmode": "orbit",
    }
    axes = {
        f"{name}axis": {"title": {"text": f"{name} [mm]"}, "showspikes": False, "gridcolor": GRID}
        for name in "xyz"
    }
    return {"scene": scene | axes, "margin": dict.fromkeys("lrtb", 0)}


def ring(element: int, middles: np.ndarray) -> AnimatedTrace:
    """Return a ring around a failed element, given its centre (f, d) [mm] in each frame."""
    look = {
        "type": "scatter" if middles.shape[1] == 2 else "scatter3d", "mode": "markers",
        "marker": {"symbol": "circle-open", "size": RING, "color": RED, "line": {"width": 3}},
        "hovertemplate": f"element {element}<extra></extra>", "showlegend": False,
    }  # fmt: skip
    return AnimatedTrace(look, [xyz(middle[:, None].round(3)) for middle in middles])


def path(parts: Iterable[np.ndarray], d: int = 2) -> Trace:
    """Return polylines (n, d) [mm], separated by gaps, as the positions of a trace."""
    gap = np.full((1, d), np.nan)
    joined = np.concatenate([gap, *(piece for part in parts for piece in (part, gap))])
    return xyz(joined.T.round(3))


def line(colour: str, width: float = 1.0) -> Trace:
    """Return a line without hover text and legend entry."""
    return {
        "mode": "lines", "line": {"color": colour, "width": width}, "hoverinfo": "skip",
        "showlegend": False,
    }  # fmt: skip


def filled(colour: str, rim: str) -> Trace:
    """Return a filled area with an edge, without which seams between cells would be visible."""
    return line(rim) | {"fill": "toself", "fillcolor": colour}


def xyz(coordinates: np.ndarray) -> Trace:
    """Return coordinates (d, ...) by name."""
    return dict(zip("xyz", coordinates, strict=False))


def triangles(faces: np.ndarray) -> np.ndarray:
    """Return faces (k, 3|4, 3) divided into triangles (n, 3, 3)."""
    fans = [faces[:, [0, k, k + 1]] for k in range(1, faces.shape[1] - 1)]
    return np.concatenate(fans)


# -------------------------------------------------------------------------------------------------
# Animation of the deformed robot, compact enough to be embedded in a page.

MOST_FRAMES = 200
"""Largest number of frames, about the number of positions of a slider."""

ROOM = 6 * 2**20
"""Capacity for all frames [bytes]: two bytes per coordinate, one per face; compressed half of it.
"""

FINENESS, LEVELS = 4000, 254
"""Number of steps that resolve the size of the body at rest, and the range of the colour scale."""


ASPECTS = {2: (0.7, 16 / 9), 3: (1.0, 4 / 3)}
"""Smallest and largest ratio of width to height of the picture, in the plane and in space."""


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
    d, mirrored = frames.points.shape[1], is_axisymmetric(frames)
    skin = skin_of(frames).in_triangles() if d == 3 else skin_of(frames)
    coordinates = skin.nodes.size * d + frames.described.get("rigid_vertices", np.zeros(0)).size
    chosen = chosen_frames(len(frames), coordinates, len(skin.faces))
    every = np.stack([places_at(frames, index) for index in chosen])
    places = every[:, skin.nodes]
    kept = np.isfinite(places).all(axis=2).any(axis=1)
    if not kept.any():
        raise OutputError("the results contain no frame with valid node positions")
    chosen, places, every = chosen[kept], places[kept], every[kept]
    origins = np.nanmean(places, axis=1) * ([0.0, 1.0] if mirrored else 1.0)
    values = skin.values(frames, chosen, field)
    low, high = shared_scale(values.ravel())[0].get_clim()
    everywhere = box(places, mirrored)
    size = float(np.ptp(frames.points, axis=0).max()) * MILLI
    around_it = box(places - origins[:, None], mirrored)
    near = with_surroundings(frames, field, around_it, origins[0])
    outward = np.zeros(d)
    if failed is not None:
        middles = every[:, frames.cells[failed]].mean(axis=1)
        known = np.isfinite(middles).all(axis=1)  # else the centre is that of the frame before
        middles = middles[np.maximum.accumulate(np.where(known, np.arange(len(middles)), 0))]
        outward = middles[-1] - origins[-1]
    if d == 2:
        walls = np.zeros((0, 6))
        parts = list(plane_parts(frames, chosen, field, everywhere))
        labels = plane_picture(frames, [0], field).labels
        layout = {
            "xaxis": {"title": {"text": labels[0]}},
            "yaxis": {"title": {"text": labels[1]}, "scaleanchor": "x"},
            "shapes": MIRROR if mirrored else (),
            "dragmode": "pan",
        }
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
        view = plane_picture(frames, [0], field).view.reshape(2, 2).T - origin
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
