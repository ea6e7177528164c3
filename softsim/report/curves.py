"""Figures over time, from the columns of a history."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from softsim.errors import OutputError
from softsim.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, RED, SKY, drawing
from softsim.report.thinning import thinned

History = Mapping[str, np.ndarray]

ENERGIES = {
    "internal_energy": ("internal", BLUE, "-"),
    "kinetic_energy": ("kinetic", SKY, "-"),
    "external_work": ("external work", INK, "--"),  # where nothing is lost, upon the internal one
    "friction_dissipation": ("friction", ORANGE, "-"),
    "viscous_dissipation": ("viscous", PURPLE, "-"),
    "contact_energy": ("contact", GREEN, "-"),
}

CONTACTS = {
    "rows_in_contact": ("rows in contact", BLUE),
    "wall_force_normal": ("normal wall force [N]", ORANGE),
}

ROUND_OFF = 1e-6
"""Part of the largest curve of its kind below which another one stands for nothing."""

STANDSTILL = 1e-7
"""Displacement [m] that is none: what round-off does to a body that is in balance."""


def has(history: History, column: str) -> bool:
    """Whether the history has the column, and a number in it."""
    return column in history and bool(np.isfinite(history[column]).any())


def pressurised(history: History) -> bool:
    """Whether the run had air pressure at any time."""
    return has(history, "pressure") and bool(np.nanmax(np.abs(history["pressure"])) > 0.0)


def travelling_column(history: History) -> str:
    """The column that says where the robot is: its frame's place, or its body's without a frame.

    A robot's frame travels along x, if it can; a body goes where it goes furthest.
    Raises OutputError if the history has neither.
    """
    for body in ("frame", "body"):
        columns = [f"{body}_{axis}" for axis in "xyz" if has(history, f"{body}_{axis}")]
        if columns:
            ranges = [float(np.nanmax(history[c]) - np.nanmin(history[c])) for c in columns]
            enough = (ROUND_OFF if body == "frame" else 1.0) * max(ranges)
            return next(c for c, r in zip(columns, ranges, strict=True) if r >= enough)
    raise OutputError(
        "the history has neither frame_x nor body_x, so there is no displacement to draw"
    )


def displacement(history: History) -> np.ndarray:
    """How far the robot is from where it started, along `travelling_column` [m], (rows,)."""
    x = history[travelling_column(history)]
    return x - x[np.isfinite(x)][0]


def travels(history: History) -> bool:
    """Whether the robot is ever elsewhere than where it started."""
    if not any(has(history, f"{body}_{axis}") for body in ("frame", "body") for axis in "xyz"):
        return False
    return bool(np.nanmax(np.abs(displacement(history))) > STANDSTILL)


def draw_displacement_pressure(history: History, path: Path) -> None:
    """Displacement (solid, left) and pressure (dotted, right) over time, or one of them alone.

    Raises OutputError if the history has neither or the disk refuses.
    """
    if not travels(history) and not pressurised(history):
        raise OutputError("the history has neither displacement nor pressure to draw")
    with drawing(path, height=3.0) as figure:
        axes = figure.add_subplot()
        label_time(axes, history)
        if travels(history):
            body, axis = travelling_column(history).split("_")
            draw_signal(
                axes, history["time"], displacement(history) * 1e3, BLUE, f"{body} displacement"
            )
            axes.set_ylabel(f"{body} displacement in {axis} [mm]", color=BLUE)
        if pressurised(history):
            draw_pressure(beside(axes) if travels(history) else axes, history)
        figure.legend(loc="outside upper center", ncols=2)


def energies_drawn(history: History) -> dict[str, tuple[str, str, str]]:
    """The energies that the run has: column -> label, colour, line."""
    largest = {c: float(np.nanmax(np.abs(history[c]))) for c in ENERGIES if has(history, c)}
    limit = ROUND_OFF * max(largest.values(), default=0.0)
    return {column: ENERGIES[column] for column, size in largest.items() if size > limit}


def draw_energies(history: History, path: Path) -> None:
    """The energies over time, and below them by how much their balance is off.

    Raises OutputError if the history has no energies or the disk refuses.
    """
    present = energies_drawn(history)
    if not present:
        raise OutputError(f"the history has no energies to draw, none of {', '.join(ENERGIES)}")
    largest = max(float(np.nanmax(np.abs(history[name]))) for name in present)
    factor, unit = joules(largest)
    with_error = has(history, "energy_error")
    with drawing(path, height=4.2 if with_error else 3.2) as figure:
        panels = figure.subplots(
            1 + with_error, sharex=True, squeeze=False, height_ratios=[3, 1][: 1 + with_error]
        )[:, 0]
        for name, (label, colour, line) in present.items():
            draw_signal(panels[0], history["time"], history[name] * factor, colour, label, line)
        panels[0].set_ylabel(f"energy [{unit}]")
        if with_error:
            draw_signal(panels[1], history["time"], history["energy_error"] * 100, RED, None)
            panels[1].axhline(0.0, color=INK, linewidth=0.6)
            panels[1].set_ylabel("energy\nerror [%]")
        label_time(panels[-1], history)
        figure.align_ylabels()
        figure.legend(loc="outside upper center", ncols=len(present), columnspacing=1.4)


def contacts_drawn(history: History) -> dict[str, tuple[str, str]]:
    """What there was of contact with walls: column -> label, colour."""
    return {
        column: style
        for column, style in CONTACTS.items()
        if has(history, column) and np.nanmax(history[column]) > 0.0
    }


def draw_contact_rows(history: History, path: Path) -> None:
    """Spike rows in contact with the walls over time, and the force they press with.

    Raises OutputError if the history has neither or the disk refuses.
    """
    present = contacts_drawn(history)
    if not present:
        raise OutputError(f"the history has no contact to draw, none of {', '.join(CONTACTS)}")
    with drawing(path, height=1.0 + 1.5 * len(present)) as figure:
        panels = figure.subplots(len(present), sharex=True, squeeze=False)[:, 0]
        for axes, (name, (label, colour)) in zip(panels, present.items(), strict=True):
            draw_signal(axes, history["time"], history[name], colour, None)
            axes.set_ylabel(label)
            axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
            axes.yaxis.get_major_locator().set_params(integer=name == "rows_in_contact")
        label_time(panels[-1], history)
        figure.align_ylabels()


def draw_pull(history: History, path: Path) -> None:
    """Tension of the tendon that holds the robot over time, and the pressure (dotted, right).

    Raises OutputError if the history has no tendon or the disk refuses.
    """
    if not has(history, "pull"):
        raise OutputError("the history has no pull to draw: no tendon holds the robot")
    with drawing(path, height=3.0) as figure:
        axes = figure.add_subplot()
        label_time(axes, history)
        draw_signal(axes, history["time"], history["pull"], BLUE, "pull")
        axes.set_ylabel("pull on the force gauge [N]", color=BLUE)
        axes.set_ylim(bottom=0.0)
        if pressurised(history):
            draw_pressure(beside(axes), history)
        figure.legend(loc="outside upper center", ncols=2)


def beside(axes: Axes) -> Axes:
    """A second vertical axis, to the right."""
    right: Axes = axes.twinx()
    right.spines["right"].set_visible(True)
    right.grid(False)
    return right


def draw_pressure(axes: Axes, history: History) -> None:
    """The air pressure over time, dotted."""
    draw_signal(axes, history["time"], history["pressure"] / 1e3, ORANGE, "air pressure", ":")
    axes.set_ylabel("air pressure [kPa]", color=ORANGE)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))


def draw_signal(
    axes: Axes,
    time: np.ndarray,
    values: np.ndarray,
    colour: str,
    label: str | None,
    line: str = "-",
) -> None:
    """A line through the signal, in the band between which it vibrates."""
    band = thinned(time, values)
    axes.fill_between(band.time, band.low, band.high, color=colour, alpha=0.25, linewidth=0)
    axes.plot(band.time, band.mean, line, color=colour, label=label)


def label_time(axes: Axes, history: History) -> None:
    """Let the axis run from the first to the last sample; a run of one sample has no span."""
    axes.set_xlabel(time_label(history))
    time = history["time"]
    if time[-1] > time[0]:
        axes.set_xlim(time[0], time[-1])


def time_label(history: History) -> str:
    """What the time of a run is called: a static one goes on settling when its loads stand."""
    static = "unbalanced_share" in history
    return "time of the loads, then of settling [s]" if static else "time [s]"


def joules(largest: float) -> tuple[float, str]:
    """Factor and unit in which an energy of `largest` joules reads as a number of 1 to 1000."""
    for factor, unit in ((1.0, "J"), (1e3, "mJ"), (1e6, "µJ")):
        if largest * factor >= 1.0:
            return factor, unit
    return 1e9, "nJ"
