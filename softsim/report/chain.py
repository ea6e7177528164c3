"""The motion of a chain of masses on springs: its figure, and its numbers in words."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from softsim.output.folder import HISTORY, read_summary
from softsim.output.history import read_history
from softsim.report.colours import MILLI
from softsim.report.style import BLUE, COLOURS, INK, ORANGE, QUIET, WALL, drawing

FIGURE = "chain.png"
SHOWN_TURNS = 6
"""Turns of the motor at the end of the run, in which single steps are seen."""


def draw_chain(folder: Path) -> Path:
    """Draw, as PNG, the head's way and its mean speed; some steps at the end, in x and in z; how
    long each node touches the ground. Returns the file.

    Raises OutputError if the folder has no chain's results, or the disk refuses.
    """
    summary, history = read_summary(folder), read_history(folder / HISTORY)
    t, count = history["time"], summary["node_count"]
    last = t >= t[-1] - SHOWN_TURNS / summary["motor_frequency"]
    z = np.column_stack([history[f"z{node + 1}"] for node in range(count)])
    with drawing(folder / FIGURE, height=7.2) as figure:
        way, steps, heights, contact = figure.subplots(4, height_ratios=[3, 3, 3, 1.8])
        _draw_way(way, t, history["x1"] * MILLI, summary["speed"])
        _draw_steps(steps, {name: column[last] for name, column in history.items()})
        _draw_heights(heights, t[last] * MILLI, z[last] * MILLI)
        _draw_contact(contact, summary["contact_shares"] or [0.0] * count)
        figure.align_ylabels()
    return folder / FIGURE


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


def _draw_steps(axes: Axes, shown: Mapping[str, np.ndarray]) -> None:
    t = shown["time"] * MILLI
    axes.plot(t, shown["x1"] * MILLI, color=BLUE)
    axes.set_xlim(t[0], t[-1])
    axes.set_ylabel("x of the head [mm]", color=BLUE)
    axes.tick_params(labelbottom=False)
    speeds = axes.twinx()
    speeds.plot(t, shown["head_velocity_x"] * MILLI, color=ORANGE, linewidth=0.9)
    speeds.set_ylabel("its speed [mm/s]", color=ORANGE)
    speeds.grid(visible=False)


def _draw_heights(axes: Axes, t: np.ndarray, z: np.ndarray) -> None:
    axes.axhspan(min(float(z.min()), 0.0) * 1.1, 0.0, color=WALL, alpha=0.5, lw=0)
    for node, name in enumerate(node_names(z.shape[1])):
        axes.plot(t, z[:, node], color=COLOURS[node % len(COLOURS)], label=name,
                  linestyle="-" if node < len(COLOURS) else "--")  # fmt: skip
    axes.set_xlim(t[0], t[-1])
    axes.margins(y=0.02)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel("z [mm], limbs\npress below 0")
    axes.legend(loc="upper left", ncols=z.shape[1], bbox_to_anchor=(0.0, 1.22),
                columnspacing=1.0)  # fmt: skip


def _draw_contact(axes: Axes, shares: Sequence[float]) -> None:
    names = node_names(len(shares))
    colours = [COLOURS[node % len(COLOURS)] for node in range(len(shares))]
    axes.barh(names, [100.0 * share for share in shares], color=colours, height=0.6)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("share of the second half on the ground [%]")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", labelcolor=QUIET)


def node_names(count: int) -> list[str]:
    """What nodes are called, from the head on."""
    return ["head", *(f"node {number}" for number in range(2, count + 1))]


def _settled(seconds: float) -> str:
    return "never" if math.isnan(seconds) else f"after {seconds:.3g} s"


def chain_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The numbers of a chain's summary as (name, text)."""

    def listed(values: np.ndarray, form: str) -> str:
        return ", ".join(format(value, form) for value in values)

    def mm(name: str) -> str:
        return f"{summary[name] * MILLI:.4g} mm"

    if math.isnan(summary["speed"]):
        steady = [("speed", "not told: the run is too short")]
    else:
        steady = [
            ("speed", f"{mm('speed')}/s, from {mm('least_speed')}/s to {mm('greatest_speed')}/s"),
            ("settled", _settled(summary["settling_time"])),
            ("on the ground", f"{listed(100.0 * summary['contact_shares'], '.3g')} % of the time"),
            ("strongest in z", f"{listed(summary['dominant_frequencies'], '.4g')} Hz"),
        ]
    return [
        ("motor", f"{summary['motor_force']:.4g} N"),
        *steady,
        ("head", f"up to {mm('head_height')}, down to -{mm('head_depth')}"),
        ("energy error", f"{summary['energy_error']:.2g}"),
        ("increments", f"{summary['increments']:,} of {summary['time_increment'] * MILLI:.3g} ms"),
        ("wall time", f"{summary['wall_time']:.3g} s"),
    ]
