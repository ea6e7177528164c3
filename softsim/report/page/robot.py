"""Robot and its walls as plotly.js traces, without the positions of its nodes.

In the plane these are its cells; in space its surface, which a reader can turn.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from softsim.output.fields import Frames
from softsim.report.cables import (
    FIBRE_OPACITY,
    cables_at,
    crosses_at,
    fibres_at,
    layers_at,
    rigid_faces_at,
)
from softsim.report.colours import shades
from softsim.report.page.charts import BAR
from softsim.report.section import Section, mirrored, outlines_at
from softsim.report.snapshots import is_axisymmetric, pictures
from softsim.report.style import FRAME, GRID, INK, ORANGE, PALE, QUIET, RED, SHADOW, WALL
from softsim.report.surface import CAMERA, corners_of_box, rim, seen_walls

SHADES = 16
"""Number of colours of cells in the plane, one trace each; more would slow down the animation."""

NO_VALUE = "#bbbbbb"
"""Colour of a cell whose value is not finite."""

SEE_THROUGH = 0.3
"""Opacity of walls in space, which surround the body. In QUIET they are 15 % grey."""

CABLE = 2.0
"""Width of a cable [px]."""

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
class Part:
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
) -> Iterator[Part]:
    """Yield the traces of a plane run, from back to front.

    These are walls, the lines that bodies follow, cables, rigid outlines and the colour bar;
    then the body: the cells of each of the SHADES, those without a value, and the boundary;
    then layers, fibres and the crosses of rigid bodies. everywhere: lowest and highest
    coordinates (2, d) [mm] of the body in the chosen frames.
    """
    picture = plane_picture(frames, list(chosen) if walls_move(frames, chosen) else [0], field)
    solids = [picture.solids(everywhere.T.ravel(), n) for n in range(len(picture.shots))]
    yield Part(filled(WALL, QUIET), [path(part.outline for part in parts) for parts in solids])
    yield Part(line(INK), [path(part.face for part in parts) for parts in solids])
    yield Part(line(QUIET), [path(picture.centre_lines)])
    if "cables" in frames.extra:
        yield Part(line(INK, CABLE), [path(cables_at(frames, index)) for index in chosen])
    outlines = [outlines_at(frames, index) for index in chosen]
    both_sides = is_axisymmetric(frames)
    if both_sides:
        outlines = [[*shown, *(mirrored(o) for o in shown)] for shown in outlines]
    closed = [[np.concatenate([o, o[:1]]) for o in shown] for shown in outlines]
    yield Part(filled(FRAME, INK), [path(shown) for shown in closed])
    yield Part(BAR)
    for shade in (*shades(SHADES), NO_VALUE):
        yield Part(filled(shade, shade))
    yield Part(line(INK))
    if "layers" in frames.described:
        layers = [layers_at(frames, index) for index in chosen]
        yield Part(
            line(ORANGE, CABLE),
            [path([*edges, *(mirrored(edges) if both_sides else ())]) for edges in layers],
        )
    if "fibres" in frames.extra:
        yield Part(line(INK), [path(fibres_at(frames, index)) for index in chosen])
    yield from crosses(frames, chosen)


def crosses(frames: Frames, chosen: np.ndarray) -> Iterator[Part]:
    """Yield the crosses of rigid bodies without a drawn outline, if any."""
    arms = [crosses_at(frames, index) for index in chosen]
    if len(arms[0]):
        d = frames.points.shape[1]
        kind, width = ("scatter", CABLE) if d == 2 else ("scatter3d", 2.0 * CABLE)
        yield Part(line(INK, width) | {"type": kind}, [path(shown, d) for shown in arms], d == 3)


def plane_layout(frames: Frames, field: str) -> Trace:
    """Return the axes of a plane picture, and the axis of symmetry of a half section."""
    labels = plane_picture(frames, [0], field).labels
    return {
        "xaxis": {"title": {"text": labels[0]}},
        "yaxis": {"title": {"text": labels[1]}, "scaleanchor": "x"},
        "shapes": MIRROR if is_axisymmetric(frames) else (),
        "dragmode": "pan",
    }


def plane_picture(frames: Frames, indices: list[int], field: str) -> Section:
    """Return the picture of frames of a plane run."""
    picture = pictures(frames, indices, field)
    assert isinstance(picture, Section)
    return picture


def walls_move(frames: Frames, chosen: np.ndarray) -> bool:
    """Return True if a wall is displaced in one of the chosen frames."""
    if "wall_offset" not in frames.extra:
        return False
    return any(bool(frames.extra["wall_offset"][index].any()) for index in chosen)


def space_parts(
    frames: Frames, chosen: np.ndarray, everywhere: np.ndarray, shadows: int
) -> Iterator[Part]:
    """Yield the traces of a run in space.

    These are walls at their initial positions and their edges, cables, fibres, layers, surfaces
    and crosses of rigid bodies; then the body: the faces of its surface, those without a value,
    and its shadows.
    """
    flat, curved = seen_walls(frames, corners_of_box(everywhere), 0)
    corners = np.concatenate([triangles(flat), triangles(curved)]).reshape(-1, 3).round(3)
    look = {
        "type": "mesh3d", "flatshading": True, "hoverinfo": "skip",
        "lighting": LIGHT, "lightposition": xyz(FAR * ABOVE),
    }  # fmt: skip
    first = np.arange(0, len(corners), 3)
    walls = {"i": first, "j": first + 1, "k": first + 2, "color": QUIET, "opacity": SEE_THROUGH}
    yield Part(look | walls, [xyz(corners.T)])
    in_space = {"type": "scatter3d"}
    yield Part(line(QUIET, CABLE) | in_space, [path(rim(flat), 3)])
    if "cables" in frames.extra:
        cables = [path(cables_at(frames, index), 3) for index in chosen]
        yield Part(line(INK, 2.0 * CABLE) | in_space, cables)
    if "fibres" in frames.extra:
        fibres = [path(fibres_at(frames, index), 3) for index in chosen]
        yield Part(line(INK, CABLE) | in_space | {"opacity": FIBRE_OPACITY}, fibres, in_front=True)
    if "layers" in frames.described:
        layers = [path(layers_at(frames, index), 3) for index in chosen]
        yield Part(line(ORANGE, 2.0 * CABLE) | in_space, layers, in_front=True)
    rigid = [rigid_faces_at(frames, index) for index in chosen]
    if len(rigid[0][1]):
        corners = dict(zip("ijk", rigid[0][1].T, strict=True))
        yield Part(look | corners | {"color": FRAME}, [xyz(v.T.round(3)) for v, _ in rigid])
    yield from crosses(frames, chosen)
    yield Part(look | {"intensitymode": "cell", "coloraxis": "coloraxis"})
    yield Part(look | {"color": NO_VALUE})
    dark = {"color": SHADOW, "opacity": 1.0, "lighting": {"ambient": 1.0, "diffuse": 0.0}}
    yield from [Part(look | dark)] * shadows


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


def ring(element: int, middles: np.ndarray) -> Part:
    """Return a ring around a failed element, given its centre (f, d) [mm] in each frame."""
    look = {
        "type": "scatter" if middles.shape[1] == 2 else "scatter3d", "mode": "markers",
        "marker": {"symbol": "circle-open", "size": RING, "color": RED, "line": {"width": 3}},
        "hovertemplate": f"element {element}<extra></extra>", "showlegend": False,
    }  # fmt: skip
    return Part(look, [xyz(middle[:, None].round(3)) for middle in middles])


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
