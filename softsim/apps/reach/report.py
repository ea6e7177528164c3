"""Figure of the reach of a robot: trials of its pull, and the tension along the layout."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from softsim.output.folder import read_json
from softsim.report.diagram import (
    MILLI,
)
from softsim.report.style import COLOURS, INK, ORANGE, QUIET, drawing

ANSWER, FIGURE = "reach.json", "reach.png"
MARGIN = 1.6  # of the axis of forces over the largest pull

Content = Mapping[str, Any]


def read_reach(folder: Path) -> dict[str, Any]:
    """Return the result in a folder of softsim reach.

    Raises OutputError if the file is damaged.
    """
    return read_json(folder / ANSWER, "repeat the command to write it again")


def draw_reach(folder: Path) -> Path | None:
    """Draw the figure of a folder of `softsim reach` and return it; None for other folders."""
    if not (folder / ANSWER).is_file():
        return None
    found, path = read_reach(folder), folder / FIGURE
    exits = found["exits"]
    with drawing(path, 2.9 + 2.3 * len(exits)) as figure:
        panels = figure.subplots(1 + len(exits), 1, squeeze=False)[:, 0]
        _draw_trials(panels[0], found["pulls"])
        for axes, way in zip(panels[1:], exits, strict=True):
            _draw_way(axes, way, len(exits) > 1)
    return path


def _draw_trials(axes: Axes, pulls: list[Content]) -> None:
    """Draw the displacement per pressure cycle over the drag, and the bracket of each pull."""
    axes.axhline(0.0, color=QUIET, linewidth=0.7)
    for pull, colour in zip(pulls, COLOURS * len(pulls), strict=False):
        trials = sorted(pull["trials"], key=lambda trial: float(trial["drag"]))
        drag = [MILLI * trial["drag"] for trial in trials]
        way = [MILLI * trial["progress"] for trial in trials]
        name = f"{MILLI * pull['diameter']:g} mm, {pull['heading']}"
        axes.plot(drag, way, color=colour, marker="o", markersize=4, label=name)
        if pull["high"] is not None:
            axes.axvspan(MILLI * pull["low"], MILLI * pull["high"], color=colour, alpha=0.2, lw=0)
    axes.set_xscale("symlog", linthresh=10.0)
    axes.set_xlim(left=0.0)
    axes.set_title("Pulling force of the robot (between the shaded bounds)")
    axes.set(xlabel="drag on the robot [mN]", ylabel="displacement per cycle [mm]")
    axes.legend()


def _draw_way(axes: Axes, way: Content, is_one_of_several: bool) -> None:
    """Draw the tension of the tether and the pull of the robot along a path, and the reach."""
    arc = np.array(way["arc_length"])
    pull, tension = (MILLI * np.array(way[name], dtype=float) for name in ("pull", "tension"))
    axes.fill_between(arc, *pull, color=INK, alpha=0.15, lw=0, label="pulling force of the robot")
    axes.plot(arc, pull[0], color=INK, linewidth=0.8)
    axes.fill_between(arc, *tension, color=ORANGE, alpha=0.3, lw=0, label="tension of the tether")
    axes.plot(arc, tension[1], color=ORANGE, linewidth=1.0)
    for at in (way["least"], way["most"]):
        axes.axvline(at, color=QUIET, linewidth=0.9, linestyle="--")
    largest = max(np.nanmax(pull[np.isfinite(pull)], initial=0.0), MILLI * 1e-3)
    axes.set_ylim(0.0, MARGIN * largest)
    to = f" to '{way['exit']}'" if is_one_of_several else ""
    axes.set_title(f"Path{to}: {way['sentence']}")
    axes.set(xlabel="arc length of the layout [m]", ylabel="force [mN]")
    axes.legend(loc="upper left")


def pull_rows(found: Content) -> list[tuple[str, str, str]]:
    """Return, for each pipe of trials, its name, the pulling force, and the reach in this pipe."""
    return [
        (
            pull["pipe"],
            in_words([pull["low"], pull["high"]], MILLI, "mN"),
            in_words(pull["straight_distance"], 1.0, "m"),
        )
        for pull in found["pulls"]
    ]


def in_words(band: list[float | None], factor: float, unit: str) -> str:
    """Return a range of numbers in words; a missing number is infinite."""
    low, high = band
    if low is None:
        return "unlimited"
    if high is None:
        return f"at least {factor * low:.3g} {unit}"
    return f"{factor * low:.3g} to {factor * high:.3g} {unit}"
