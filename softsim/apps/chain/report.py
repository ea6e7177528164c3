"""Figure and numbers of the motion of a chain of masses and springs."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from softsim.analysis.travel import centre_of_circle
from softsim.apps.chain.running import MODEL
from softsim.output.folder import HISTORY, read_summary
from softsim.output.history import read_history
from softsim.report.diagram import MILLI
from softsim.report.style import BLUE, COLOURS, GREEN, INK, ORANGE, QUIET, WALL, drawing

FIGURE = "chain.png"
STRAIGHT = 1e-3
"""Curvature [1/m] below which a track counts as straight: a circle of radius 1 km."""

SIDES = ("left", "right")
SHOWN_TURNS = 6
"""Number of motor revolutions at the end of the run that are plotted in detail."""


def draw_chain(folder: Path) -> Path | None:
    """Draw the figure of a folder of `softsim chain` and return it; None for other folders.

    It shows the displacement of the head and its mean speed, or the tracks of two sides; the
    last steps in x and in z; and the fraction of time that each node touches the ground. Raises
    OutputError if the file cannot be written.
    """
    summary = read_summary(folder)
    if summary.get("model") != MODEL:
        return None
    history = read_history(folder / HISTORY)
    t, heads = history["time"], summary["heads"]
    last = t >= t[-1] - SHOWN_TURNS / summary["motor_frequency"]
    is_plane = "curvature" not in summary
    names: Sequence[str] = SIDES
    nodes: Sequence[int] = heads
    heights = [3.0, 3.0, 3.0, 1.8] if is_plane else [5.0, 2.2, 2.6]
    with drawing(folder / FIGURE, 7.2 if is_plane else 8.6) as figure:
        *upper, lines, contact = figure.subplots(len(heights), height_ratios=heights)
        if is_plane:
            names, nodes = node_names(summary), range(1, summary["node_count"] + 1)
            _draw_way(upper[0], t, history[f"x{heads[0]}"] * MILLI, summary["speed"])
            _draw_steps(upper[1], heads[0], {name: of[last] for name, of in history.items()})
        else:
            _draw_tracks(upper[0], summary, history)
        z = _columns(history, "z", nodes)
        _draw_heights(lines, t[last] * MILLI, z[last] * MILLI, names)
        _draw_contact(contact, summary)
        if is_plane:
            figure.align_ylabels()
    return folder / FIGURE


def _columns(history: Mapping[str, np.ndarray], axis: str, nodes: Sequence[int]) -> np.ndarray:
    """Return the coordinates (rows, nodes) [m] of some nodes along an axis."""
    return np.column_stack([history[f"{axis}{node}"] for node in nodes])


def _draw_tracks(axes: Axes, summary: Mapping[str, Any], history: Mapping[str, np.ndarray]) -> None:
    """Draw the tracks of both motors and of the middle seen from above, and the fitted circle.

    The robot is drawn at its start and its end; the circle is fitted to the second half.
    """
    count = summary["node_count"]
    x, y = (_columns(history, axis, range(1, count + 1)) * MILLI for axis in "xy")
    for head, name, colour in zip(summary["heads"], SIDES, (BLUE, ORANGE), strict=True):
        axes.plot(x[:, head - 1], y[:, head - 1], color=colour, linewidth=0.9,
                  label=f"{name} motor")  # fmt: skip
    centre = np.column_stack([history["centre_x"], history["centre_y"]])
    axes.plot(*(centre * MILLI).T, color=INK, label="centre")
    outline = [*range(count // 2), *range(count - 1, count // 2 - 1, -1), 0]
    for row, style in ((0, ":"), (-1, "-")):
        axes.plot(x[row, outline], y[row, outline], style, color=QUIET, linewidth=1.1)
    arc = _arc(centre[len(centre) // 2 :], summary["curvature"])
    axes.plot(*(arc * MILLI).T, "--", color=GREEN, label=_turning(summary["curvature"]))
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm], positive to the left")
    axes.legend(loc="lower left", ncols=4, bbox_to_anchor=(0.0, 1.0), columnspacing=1.0)


def _draw_way(axes: Axes, t: np.ndarray, x: np.ndarray, speed: float | None) -> None:
    axes.plot(t, x, color=BLUE, label="head")
    if speed is not None:
        late = t[len(t) // 2 :]
        line = x[len(t) // 2] + speed * MILLI * (late - late[0])
        axes.plot(late, line, "--", color=INK, linewidth=0.9,
                  label=f"{speed * MILLI:.4g} mm/s in the second half")  # fmt: skip
    axes.set_xlim(0.0, t[-1])
    axes.set_xlabel("time [s]")
    axes.set_ylabel("x [mm]")
    axes.legend(loc="lower right" if x[-1] >= 0.0 else "upper right")


def _arc(path: np.ndarray, curvature: float | None) -> np.ndarray:
    """Return points (n, 2) [m] of the circle fitted to a path, from its start to its end.

    The result is empty if the path is straight or too short.
    """
    if curvature is None or abs(curvature) < STRAIGHT:
        return np.empty((0, 2))
    middle = centre_of_circle(path)
    angles = np.unwrap(np.arctan2(*(path - middle).T[::-1]))
    shown = np.linspace(angles[0], angles[-1], 181)
    return middle + np.column_stack([np.cos(shown), np.sin(shown)]) / abs(curvature)


def _draw_steps(axes: Axes, head: int, shown: Mapping[str, np.ndarray]) -> None:
    t = shown["time"] * MILLI
    axes.plot(t, shown[f"x{head}"] * MILLI, color=BLUE)
    axes.set_xlim(t[0], t[-1])
    axes.set_ylabel("x of the head [mm]", color=BLUE)
    axes.tick_params(labelbottom=False)
    speeds = axes.twinx()
    speeds.plot(t, shown["head_velocity_x"] * MILLI, color=ORANGE, linewidth=0.9)
    speeds.set_ylabel("speed of the head [mm/s]", color=ORANGE)
    speeds.grid(visible=False)


def _draw_heights(axes: Axes, t: np.ndarray, z: np.ndarray, names: Sequence[str]) -> None:
    axes.axhspan(min(float(z.min()), 0.0) * 1.1, 0.0, color=WALL, alpha=0.5, lw=0)
    for node, name in enumerate(names):
        axes.plot(t, z[:, node], color=COLOURS[node % len(COLOURS)], label=name,
                  linestyle="-" if node < len(COLOURS) else "--")  # fmt: skip
    axes.set_xlim(t[0], t[-1])
    axes.margins(y=0.02)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel("z [mm]\nbelow 0: limbs pressed")
    axes.legend(loc="upper left", ncols=z.shape[1], bbox_to_anchor=(0.0, 1.22),
                columnspacing=1.0)  # fmt: skip


def _draw_contact(axes: Axes, summary: Mapping[str, Any]) -> None:
    names = node_names(summary)
    shares = summary["contact_shares"] or [0.0] * len(names)
    count = len(names) // len(summary["heads"])
    colours = [COLOURS[node % count % len(COLOURS)] for node in range(len(names))]
    axes.barh(names, [100.0 * share for share in shares], color=colours, height=0.6)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("fraction of the second half on the ground [%]")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", labelcolor=QUIET)


def node_names(summary: Mapping[str, Any]) -> list[str]:
    """Return the names of the nodes, line by line from the front."""
    heads = summary["heads"]
    count = summary["node_count"] // len(heads)
    sides = [""] if len(heads) == 1 else [f"{side} " for side in SIDES]
    return [
        f"{side}head" if line * count + number in heads else f"{side}node {number}"
        for line, side in enumerate(sides)
        for number in range(1, count + 1)
    ]


def _turning(curvature: float | None) -> str:
    if curvature is None:
        return "run too short to fit a circle"
    if abs(curvature) < STRAIGHT:
        return "straight"
    side = "left" if curvature > 0.0 else "right"
    return f"{abs(curvature) / MILLI:.3g} 1/mm to the {side}"


def chain_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the numbers of a chain's summary as (name, text)."""

    def listed(values: np.ndarray, form: str) -> str:
        return ", ".join(format(value, form) for value in values)

    def mm(name: str) -> str:
        return f"{summary[name] * MILLI:.4g} mm"

    if math.isnan(summary["speed"]):
        steady = [("speed", "not available: the run is too short")]
    else:
        settled = summary["settling_time"]
        steady = [
            ("speed", f"{mm('speed')}/s, from {mm('least_speed')}/s to {mm('greatest_speed')}/s"),
            ("settled", "never" if math.isnan(settled) else f"after {settled:.3g} s"),
            ("ground contact", f"{listed(100.0 * summary['contact_shares'], '.3g')} % of the time"),
            ("dominant frequency in z", f"{listed(summary['dominant_frequencies'], '.4g')} Hz"),
        ]
    return [
        ("motor", f"{summary['motor_force']:.4g} N"),
        *steady,
        *_track_rows(summary),
        ("head", f"up to {mm('head_height')}, down to -{mm('head_depth')}"),
        ("energy error", f"{summary['energy_error']:.2g}"),
        ("increments", f"{summary['increments']:,} of {summary['time_increment'] * MILLI:.3g} ms"),
        ("wall time", f"{summary['wall_time']:.3g} s"),
    ]


def _track_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the turning rate and displacement of two sides as (name, text).

    The result is empty for a chain in the plane or too short a run.
    """
    if math.isnan(summary.get("curvature", math.nan)):
        return []
    forward, sideways = (summary[f"{way}_displacement"] * MILLI for way in ("forward", "sideways"))
    return [
        ("turns", f"{_turning(summary['curvature'])}, {summary['turning_rate']:.3g} rad/s"),
        ("displacement", f"{forward:.4g} mm forward, {sideways:.4g} mm to the left"),
    ]
