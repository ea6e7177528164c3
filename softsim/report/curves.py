"""Curves of a history: pressures of chambers, energies, contact."""

import numpy as np

from softsim.output.travel import ROUND_OFF, History, has
from softsim.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, SKY
from softsim.scene.columns import CHAMBER_PRESSURE

ENERGIES = {
    "internal_energy": ("internal", BLUE, "-"),
    "hourglass_energy": ("hourglass (part of internal)", BLUE, ":"),
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


def pressurised(history: History) -> bool:
    """Return True if a chamber had air pressure at any time."""
    return any(np.nanmax(np.abs(air)) > 0.0 for air in chamber_pressures(history).values())


def chamber_pressures(history: History) -> dict[str, np.ndarray]:
    """Return the pressure (rows,) [Pa] of each chamber by name; "air pressure" for a single one."""
    several = {
        name.removeprefix(CHAMBER_PRESSURE): history[name]
        for name in history
        if name.startswith(CHAMBER_PRESSURE) and has(history, name)
    }
    if several or not has(history, "pressure"):
        return several
    return {"air pressure": history["pressure"]}


def single_pressure(history: History) -> np.ndarray | None:
    """Return the air pressure (rows,) [Pa] of a robot with one chamber, or None if it had none."""
    is_single = len(chamber_pressures(history)) == 1
    return history["pressure"] if is_single and pressurised(history) else None


def energies_drawn(history: History) -> dict[str, tuple[str, str, str]]:
    """Return the energies that the run has: column -> label, colour, line style."""
    largest = {c: float(np.nanmax(np.abs(history[c]))) for c in ENERGIES if has(history, c)}
    limit = ROUND_OFF * max(largest.values(), default=0.0)
    return {column: ENERGIES[column] for column, size in largest.items() if size > limit}


def contacts_drawn(history: History) -> dict[str, tuple[str, str]]:
    """Return the columns of wall contact that are not zero: column -> label, colour."""
    return {
        column: style
        for column, style in CONTACTS.items()
        if has(history, column) and np.nanmax(history[column]) > 0.0
    }


def time_label(history: History) -> str:
    """Return the title of the time axis; in a static run it includes the settling after loading."""
    static = "unbalanced_share" in history
    return "time (loads, then settling) [s]" if static else "time [s]"


def joules(largest: float) -> tuple[float, str]:
    """Return factor and unit that express an energy [J] as a number of 1 to 1000."""
    for factor, unit in ((1.0, "J"), (1e3, "mJ"), (1e6, "µJ")):
        if largest * factor >= 1.0:
            return factor, unit
    return 1e9, "nJ"
