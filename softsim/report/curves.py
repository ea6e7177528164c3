"""What the columns of a history say: where the robot is, which energies and contacts there were."""

from collections.abc import Mapping

import numpy as np

from softsim.errors import OutputError
from softsim.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, SKY
from softsim.scene.columns import CHAMBER_PRESSURE

History = Mapping[str, np.ndarray]

ENERGIES = {
    "internal_energy": ("internal", BLUE, "-"),
    "hourglass_energy": ("hourglass, part of internal", BLUE, ":"),
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

BACK = 0.1
"""Share of a body's largest swing below which it counts as back where it started."""

STANDSTILL = 1e-7
"""Displacement [m] that is none: what round-off does to a body that is in balance."""


def has(history: History, column: str) -> bool:
    """Whether the history has the column, and a number in it."""
    return column in history and bool(np.isfinite(history[column]).any())


def pressurised(history: History) -> bool:
    """Whether a chamber had air pressure at any time."""
    return any(np.nanmax(np.abs(air)) > 0.0 for air in chamber_pressures(history).values())


def chamber_pressures(history: History) -> dict[str, np.ndarray]:
    """The pressure of each chamber [Pa], (rows,), by its name; of a single one, "air pressure"."""
    several = {
        name.removeprefix(CHAMBER_PRESSURE): history[name]
        for name in history
        if name.startswith(CHAMBER_PRESSURE) and has(history, name)
    }
    if several or not has(history, "pressure"):
        return several
    return {"air pressure": history["pressure"]}


def single_pressure(history: History) -> np.ndarray | None:
    """The air pressure [Pa], (rows,), of a robot with one chamber, if it had any; else None."""
    is_single = len(chamber_pressures(history)) == 1
    return history["pressure"] if is_single and pressurised(history) else None


def travelling_column(history: History) -> str:
    """The column that says where the robot is: its frame's place, or its body's without a frame.

    A frame travels along x, if it can; a body along the axis of its largest displacement at the
    end, or of its largest swing if it is back by then. Raises OutputError if the history has
    neither.
    """
    for name in ("frame", "body"):
        paths = {
            column: history[column][np.isfinite(history[column])]
            for column in (f"{name}_{axis}" for axis in "xyz")
            if has(history, column)
        }
        if not paths:
            continue
        swings = {column: float(np.ptp(path)) for column, path in paths.items()}
        furthest = max(swings.values())
        if name == "frame":
            return next(c for c, swing in swings.items() if swing >= ROUND_OFF * furthest)
        ways = {column: float(abs(path[-1] - path[0])) for column, path in paths.items()}
        is_back = max(ways.values()) < BACK * furthest
        told = swings if is_back else ways
        return max(told, key=told.__getitem__)
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


def energies_drawn(history: History) -> dict[str, tuple[str, str, str]]:
    """The energies that the run has: column -> label, colour, line."""
    largest = {c: float(np.nanmax(np.abs(history[c]))) for c in ENERGIES if has(history, c)}
    limit = ROUND_OFF * max(largest.values(), default=0.0)
    return {column: ENERGIES[column] for column, size in largest.items() if size > limit}


def contacts_drawn(history: History) -> dict[str, tuple[str, str]]:
    """What there was of contact with walls: column -> label, colour."""
    return {
        column: style
        for column, style in CONTACTS.items()
        if has(history, column) and np.nanmax(history[column]) > 0.0
    }


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
