"""Figures over time of a run: those for which its history has data."""

import itertools
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from softsim.output.travel import History, displacement, has, travelling_column, travels
from softsim.report.colours import MILLI
from softsim.report.curves import (
    chamber_pressures,
    contacts_drawn,
    energies_drawn,
    joules,
    pressurised,
    time_label,
)
from softsim.report.diagram import FLAT, Axis, Diagram, Panel, Scale, Series
from softsim.report.probes import QUANTITIES, curves_of, inflation_curves
from softsim.report.style import BLUE, COLOURS, RED
from softsim.report.thinning import thinned
from softsim.scene.columns import ROW_FORCE, SIDE_FORCE

TITLES = {
    "displacement_pressure": "Displacement and pressure",
    "energies": "Energies",
    "contact_rows": "Contact with walls",
    "deflation": "Last deflation",
    "gait": "Gait",
    "pull": "Pull",
    "probes": "Probes",
    "pressure_probe": "Pressure versus probes",
}
"""Title by name of a figure."""

OF_CHAMBERS = COLOURS[1:]
"""Colours of chamber pressures; the displacement beside them has the first colour."""

ROWS_OF_A_GAIT = 160
"""Number of rows at the end of the history that the gait figure shows."""

COARSEST_OF_A_GAIT = 1e-3
"""Largest interval of the history [s] that resolves the revolutions of a motor."""

FEWEST_OF_A_FALL = 20
"""Smallest number of rows of a deflation that are drawn as a curve."""

SAMPLES_OF_A_FALL = 60
"""Number of points of a deflation curve, each a mean over many periods of the motor."""


def signals(history: History, units: Mapping[str, str]) -> dict[str, Diagram]:
    """Return the figures that have data, by name.

    units: column -> unit.
    """
    found = {
        "displacement_pressure": motion(history),
        "energies": energies(history),
        "contact_rows": contact(history),
        "pull": pull(history),
        "probes": probes(history, units),
    }
    panels = {name: list(shown) for name, shown in found.items()}
    figures = {
        name: over_time(TITLES[name], history, shown) for name, shown in panels.items() if shown
    }
    return figures | deflation(history) | gait(history) | inflation(history, units)


def over_time(title: str, history: History, panels: Sequence[Panel]) -> Diagram:
    """Return a diagram of panels over the time of a run."""
    return Diagram(title, Scale(time_label(history)), panels, over_time=True)


def pressure(history: History) -> Axis | None:
    """Return the axis of the air pressure of each chamber, or None without pressure."""
    if not pressurised(history):
        return None
    lines = [
        Series(name, history["time"], air / 1e3, colour, ":")
        for (name, air), colour in zip(
            chamber_pressures(history).items(), itertools.cycle(OF_CHAMBERS), strict=False
        )
    ]
    return Axis(Scale("air pressure [kPa]", from_zero=True), lines)


def motion(history: History) -> Iterator[Panel]:
    """Yield the panel of displacement (left) and pressure (right), or of the one that exists."""
    air = pressure(history)
    if travels(history):
        body, axis = travelling_column(history).split("_")
        moved = displacement(history) * MILLI
        line = Series(f"{body} displacement", history["time"], moved, BLUE)
        yield Panel(Axis(Scale(f"{body} displacement in {axis} [mm]"), [line]), air)
    elif air is not None:
        yield Panel(air)


def contact(history: History) -> Iterator[Panel]:
    """Yield panels of the rows of spikes in contact and of the contact force."""
    for column, (label, colour) in contacts_drawn(history).items():
        line = Series(label, history["time"], history[column], colour)
        scale = Scale(label, whole=column == "rows_in_contact", from_zero=True)
        yield Panel(Axis(scale, [line]))


def last_fall(pressure: np.ndarray) -> slice:
    """Return the rows from the last highest pressure to the lowest pressure after it."""
    highest = len(pressure) - 1 - int(np.argmax(pressure[::-1]))
    return slice(highest, highest + 1 + int(np.argmin(pressure[highest:])))


def deflation(history: History) -> dict[str, Diagram]:
    """Return the figure of wall forces and speed over the air pressure in the last deflation.

    It shows the forces on each row of spikes and on each side of the robot, and the speed
    (along the pipe), all without vibration. The result is empty if there is no such data.
    """
    pressed = [name for name in history if name.startswith((ROW_FORCE, SIDE_FORCE))]
    if not pressed or not pressurised(history):
        return {}
    fall = last_fall(history["pressure"])
    time = history["time"][fall]
    if len(time) < FEWEST_OF_A_FALL:
        return {}

    def smooth(values: np.ndarray) -> np.ndarray:
        return thinned(time, values[fall], SAMPLES_OF_A_FALL).mean

    kilo = smooth(history["pressure"]) / 1e3
    panels = []
    for prefix, title in ((ROW_FORCE, "force per row [N]"), (SIDE_FORCE, "force per side [N]")):
        names = [name for name in pressed if name.startswith(prefix)]
        lines = [
            Series(name.removeprefix(prefix), kilo, smooth(history[name]), colour)
            for name, colour in zip(names, itertools.cycle(COLOURS), strict=False)
        ]
        panels.append(Panel(Axis(Scale(title, from_zero=True), lines)))
    if travels(history):
        along = history["arc_length"] if has(history, "arc_length") else displacement(history)
        speed = np.gradient(smooth(along) * MILLI, smooth(history["time"]))
        drawn = [Series("speed", kilo, speed, BLUE)]
        panels.append(Panel(Axis(Scale("speed [mm/s]", from_zero=True), drawn)))
    return {"deflation": Diagram(TITLES["deflation"], Scale("air pressure [kPa]"), panels)}


def gait(history: History) -> dict[str, Diagram]:
    """Return the figure of the gait at the end of a run.

    It shows when each row of spikes or limbs is in contact, and the height of rows that have a
    probe of the same name. The result is empty if there is no such data.
    """
    rows = [name for name in history if name.startswith(ROW_FORCE)]
    time = history["time"][-ROWS_OF_A_GAIT:]
    coarse = np.diff(time).max(initial=0.0) > COARSEST_OF_A_GAIT * (1.0 + 1e-6)
    if len(rows) < 2 or len(time) < ROWS_OF_A_GAIT or coarse:
        return {}
    heights, touching = [], []
    for number, (name, colour) in enumerate(zip(rows, itertools.cycle(COLOURS), strict=False), 1):
        row = name.removeprefix(ROW_FORCE).rpartition(".")[2]
        if has(history, f"{row}_y"):
            height = history[f"{row}_y"][-ROWS_OF_A_GAIT:] * MILLI
            heights.append(Series(row, time * MILLI, height, colour))
        touched = history[name][-ROWS_OF_A_GAIT:] > 0.0
        bar = np.where(touched, float(number), np.nan)
        touching.append(Series(row, time * MILLI, bar, colour))
    panels = [Panel(Axis(Scale("height of row [mm]"), heights))] if heights else []
    panels.append(Panel(Axis(Scale("rows in contact", whole=True), touching)))
    return {"gait": Diagram(TITLES["gait"], Scale("time [ms]"), panels)}


def energies(history: History) -> Iterator[Panel]:
    """Yield panels of the energies and of the error of the energy balance."""
    present = energies_drawn(history)
    if not present:
        return
    time = history["time"]
    factor, unit = joules(max(float(np.nanmax(np.abs(history[name]))) for name in present))
    lines = [
        Series(label, time, history[column] * factor, colour, kind)
        for column, (label, colour, kind) in present.items()
    ]
    yield Panel(Axis(Scale(f"energy [{unit}]"), lines))
    if has(history, "energy_error"):
        error = Series("energy error", time, history["energy_error"] * 100.0, RED)
        yield Panel(Axis(Scale("energy error [%]", from_zero=True), [error]), height=FLAT)


def pull(history: History) -> Iterator[Panel]:
    """Yield the panel of the tension of the tendon that holds the robot, and of the pressure."""
    if has(history, "pull"):
        line = Series("pull", history["time"], history["pull"], BLUE)
        scale = Scale("tendon tension [N]", from_zero=True)
        yield Panel(Axis(scale, [line]), pressure(history))


def probes(history: History, units: Mapping[str, str]) -> Iterator[Panel]:
    """Yield the panels of the probes, one for each unit."""
    for unit, curves in curves_of(history, units).items():
        quantity, _, drawn = QUANTITIES.get(unit, ("probe", 1.0, unit))
        yield Panel(Axis(Scale(f"{quantity} [{drawn}]"), curves))


def inflation(history: History, units: Mapping[str, str]) -> dict[str, Diagram]:
    """Return the figure of the air pressure over the displacements and radii of probes, if any."""
    name, curves = "pressure_probe", inflation_curves(history, units)
    if not curves:
        return {}
    panel = Panel(Axis(Scale("air pressure [kPa]", from_zero=True), curves))
    return {name: Diagram(TITLES[name], Scale("displacement or radius [mm]"), [panel])}
