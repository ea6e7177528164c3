"""The robot between its walls as a chart of plotly.js, still without the places of its nodes: in
the plane its cells side by side, in space its surface, which a reader can turn.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from softsim.output.fields import Frames
from softsim.report.colours import shades
from softsim.report.page.charts import Chart
from softsim.report.section import Section
from softsim.report.snapshots import is_axisymmetric, pictures
from softsim.report.style import FRAME, GRID, INK, PALE, QUIET, RED, WALL
from softsim.report.surface import CAMERA, corners_of_box, seen_walls

SHADES = 16
"""Colours of cells in the plane, a trace each: more would make playing slow."""

NO_VALUE = "#bbbbbb"
"""Colour of a cell whose value is not finite."""

SEE_THROUGH = 0.25
"""Opacity of walls in space: they stand on all sides of the body."""

RING = 24
"""Diameter of the ring about an element that failed [px]."""

FAR = 1e5
"""Beyond all that is shown [mm]."""

EYE = 2.5
"""How far the eye is from the middle of the axes, in their size. Plotly lights nothing where the
view is parallel, as in the figures: its light asks how far away the eye is."""

LIGHT = {
    "ambient": 0.7, "diffuse": 0.8, "specular": 0.1, "roughness": 0.9, "fresnel": 0.05,
    "facenormalsepsilon": 0, "vertexnormalsepsilon": 0,  # else faces below a millimetre have none
}  # fmt: skip
ABOVE = np.array([0.1, 1.0, 0.0])
"""Where the light comes from."""

UPRIGHT = {"yref": "paper", "y0": 0.0, "y1": 1.0}

MIRROR = (
    {"type": "rect", "x0": -FAR, "x1": 0.0, "fillcolor": "white", "opacity": PALE,
     "line": {"width": 0}, **UPRIGHT},
    {"type": "line", "x0": 0.0, "x1": 0.0, "line": {"color": INK, "width": 1, "dash": "dashdot"},
     **UPRIGHT},
)  # fmt: skip
"""Shapes upon the mirror image of a half section: it is paler, and ends at the axis."""

Trace = dict[str, Any]


def plane_chart(frames: Frames, field: str, everywhere: np.ndarray, colours: Trace) -> Chart:
    """Walls where they are at first, the lines that bodies follow, the colour bar; then the traces
    that move: rigid outlines, the cells of each of the SHADES, those without a value, and the rim.

    everywhere: lowest and highest coordinates (2, d) [mm] of the body in the whole run. colours:
    what the bar shows, in plotly's words.
    """
    picture = pictures(frames, [0], field)
    assert isinstance(picture, Section)
    solids = picture.solids(everywhere.T.ravel(), 0)
    bar = {"x": [None], "y": [None], "mode": "markers", "showlegend": False}
    traces = [
        filled(WALL, QUIET) | path(solid.outline for solid in solids),
        line(INK) | path(solid.face for solid in solids),
        line(QUIET) | path(picture.centre_lines),
        bar | {"marker": {"color": [0.0], "coloraxis": "coloraxis"}},
        filled(FRAME, INK),
        *(filled(shade, shade) for shade in (*shades(SHADES), NO_VALUE)),
        line(INK),
    ]
    layout = {
        "xaxis": {"title": {"text": picture.labels[0]}},
        "yaxis": {"title": {"text": picture.labels[1]}, "scaleanchor": "x"},
        "shapes": MIRROR if is_axisymmetric(frames) else (),
        "coloraxis": colours,
        "dragmode": "pan",
    }
    return Chart("The robot", traces, layout)


def moving_walls(
    frames: Frames, chosen: np.ndarray, field: str, everywhere: np.ndarray
) -> list[list[list[np.ndarray]]] | None:
    """Outlines and faces [mm] of what stands behind the walls of a section in the chosen frames:
    the content of the first two traces of `plane_chart`. None where no wall moves.
    """
    if "wall_offset" not in frames.extra:
        return None
    if not any(frames.extra["wall_offset"][index].any() for index in chosen):
        return None
    picture = pictures(frames, list(chosen), field)
    assert isinstance(picture, Section)
    solids = [picture.solids(everywhere.T.ravel(), number) for number in range(len(chosen))]
    return [
        [[part.outline.round(3) for part in parts], [part.face.round(3) for part in parts]]
        for parts in solids
    ]


def space_chart(frames: Frames, everywhere: np.ndarray, colours: Trace) -> Chart:
    """Walls where they are at first; then the traces that move: the faces of the surface, and those
    without a value. They are seen from where the figures see them.
    """
    flat, curved = seen_walls(frames, corners_of_box(everywhere), 0)
    corners = np.concatenate([triangles(flat), triangles(curved)]).reshape(-1, 3).round(3)
    look = {
        "type": "mesh3d", "flatshading": True, "hoverinfo": "skip",
        "lighting": LIGHT, "lightposition": xyz(FAR * ABOVE),
    }  # fmt: skip
    first = np.arange(0, len(corners), 3)
    walls = look | xyz(corners.T) | {"i": first, "j": first + 1, "k": first + 2}
    body = look | {"intensitymode": "cell", "coloraxis": "coloraxis"}
    traces = [walls | {"color": WALL, "opacity": SEE_THROUGH}, body, look | {"color": NO_VALUE}]
    scene = {
        "camera": {
            "up": xyz(np.array([0.0, 1.0, 0.0])),
            "eye": xyz(EYE * CAMERA.towards),
        },
        "aspectmode": "manual",
        "dragmode": "orbit",
    }
    axes = {
        f"{name}axis": {"title": {"text": f"{name} [mm]"}, "showspikes": False, "gridcolor": GRID}
        for name in "xyz"
    }
    layout = {"scene": scene | axes, "coloraxis": colours, "margin": dict.fromkeys("lrtb", 0)}
    return Chart("The robot", traces, layout)


def with_mark(chart: Chart, element: int, d: int) -> Chart:
    """The chart of a robot in d dimensions, and a ring, which moves, about a failed element."""
    ring = {
        "type": "scatter" if d == 2 else "scatter3d", "mode": "markers", "showlegend": False,
        "marker": {"symbol": "circle-open", "size": RING, "color": RED, "line": {"width": 3}},
        "hovertemplate": f"element {element}<extra></extra>",
    }  # fmt: skip
    return replace(chart, traces=[*chart.traces, ring])


def path(parts: Iterable[np.ndarray]) -> Trace:
    """Polylines (n, 2) [mm] one after another, with gaps between them, as x and y of a trace."""
    gap = np.full((1, 2), np.nan)
    joined = np.concatenate([gap, *(piece for part in parts for piece in (part, gap))])
    return {"x": joined[:, 0].round(3), "y": joined[:, 1].round(3)}


def line(colour: str) -> Trace:
    """A thin line without a word."""
    return {
        "mode": "lines", "line": {"color": colour, "width": 1}, "hoverinfo": "skip",
        "showlegend": False,
    }  # fmt: skip


def filled(colour: str, rim: str) -> Trace:
    """An area in a colour, and its rim, without which there were seams between cells."""
    return line(rim) | {"fill": "toself", "fillcolor": colour}


def xyz(coordinates: np.ndarray) -> Trace:
    """Coordinates (3, ...) by name."""
    return dict(zip("xyz", coordinates, strict=True))


def triangles(faces: np.ndarray) -> np.ndarray:
    """Faces (k, 3|4, 3) cut into triangles (n, 3, 3)."""
    fans = [faces[:, [0, k, k + 1]] for k in range(1, faces.shape[1] - 1)]
    return np.concatenate(fans)
