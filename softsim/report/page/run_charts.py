"""The charts of a run: what the figures over time show, to look into."""

from collections.abc import Iterator

import numpy as np

from softsim.report.colours import MILLI
from softsim.report.curves import (
    contacts_drawn,
    displacement,
    energies_drawn,
    has,
    joules,
    pressurised,
    time_label,
    travelling_column,
    travels,
)
from softsim.report.page.charts import Chart
from softsim.report.page.over_time import DASHES, Axis, Line, Panel, over_time, rounded
from softsim.report.probes import QUANTITIES, curves_of, inflation_curves
from softsim.report.recorded import Recorded
from softsim.report.style import BLUE, GREEN, ORANGE, RED
from softsim.report.thinning import thinned


def run_charts(run: Recorded) -> list[Chart]:
    """Those of which the history has something to show."""
    time, label = run.history["time"], time_label(run.history)
    panels = {
        "Displacement and pressure": motion(run),
        "Way through the layout": way(run),
        "Contact with walls": contact(run),
        "Energies": energies(run),
        "Pull": pull(run),
        "Probes": probes(run),
    }
    charts = [
        over_time(title, time, found, label)
        for title, found in ((title, list(panel)) for title, panel in panels.items())
        if found
    ]
    return [*charts, *inflation(run)]


def pressure(run: Recorded) -> Axis | None:
    """The air pressure, if there is any."""
    if not pressurised(run.history):
        return None
    line = Line("air pressure", run.history["pressure"] / 1e3, ORANGE, ":")
    return Axis("air pressure [kPa]", [line], from_zero=True)


def motion(run: Recorded) -> Iterator[Panel]:
    """Displacement on the left and pressure on the right, or one of them alone."""
    air = pressure(run)
    if travels(run.history):
        body, axis = travelling_column(run.history).split("_")
        line = Line(f"{body} displacement", displacement(run.history) * MILLI, BLUE)
        yield Panel(Axis(f"{body} displacement in {axis} [mm]", [line]), air)
    elif air is not None:
        yield Panel(air)


def way(run: Recorded) -> Iterator[Panel]:
    """Of a run along a pipe: how far the robot is, up to its goal."""
    if run.layout is None:
        return
    s = run.history["arc_length"] * MILLI
    goal = Line("goal", 0.0 * s + run.layout["goal"] * MILLI, GREEN, "--")
    yield Panel(Axis("centre along the pipe [mm]", [Line("centre", s, BLUE), goal]))


def contact(run: Recorded) -> Iterator[Panel]:
    """Rows of spikes that touch, and the force they press with."""
    for column, (label, colour) in contacts_drawn(run.history).items():
        yield Panel(Axis(label, [Line(label, run.history[column], colour)], from_zero=True))


def energies(run: Recorded) -> Iterator[Panel]:
    """The energies, and by how much their balance is off."""
    present = energies_drawn(run.history)
    if not present:
        return
    factor, unit = joules(max(float(np.nanmax(np.abs(run.history[name]))) for name in present))
    lines = [
        Line(label, run.history[column] * factor, colour, kind)
        for column, (label, colour, kind) in present.items()
    ]
    yield Panel(Axis(f"energy [{unit}]", lines))
    if has(run.history, "energy_error"):
        error = Line("energy error", run.history["energy_error"] * 100.0, RED)
        yield Panel(Axis("energy error [%]", [error], from_zero=True))


def pull(run: Recorded) -> Iterator[Panel]:
    """Tension of the tendon that holds the robot, and the pressure."""
    if has(run.history, "pull"):
        line = Line("pull", run.history["pull"], BLUE)
        yield Panel(Axis("pull on the force gauge [N]", [line], from_zero=True), pressure(run))


def probes(run: Recorded) -> Iterator[Panel]:
    """What the probes recorded, a panel for each unit."""
    for unit, curves in curves_of(run.history, run.units).items():
        quantity, _, drawn = QUANTITIES.get(unit, ("probe", 1.0, unit))
        lines = [Line(c.label, c.values, c.colour, c.line) for c in curves]
        yield Panel(Axis(f"{quantity} [{drawn}]", lines))


def inflation(run: Recorded) -> Iterator[Chart]:
    """The air pressure over what the probes say of displacements and radii."""
    curves = inflation_curves(run.history, run.units)
    if not curves:
        return
    time = run.history["time"]
    traces = [
        {
            "x": rounded(thinned(time, c.values).mean),
            "y": rounded(thinned(time, run.history["pressure"] / 1e3).mean),
            "name": c.label,
            "mode": "lines",
            "line": {"color": c.colour, "dash": DASHES[c.line]},
        }
        for c in curves
    ]
    layout = {
        "xaxis": {"title": {"text": "displacement or radius [mm]"}},
        "yaxis": {"title": {"text": "air pressure [kPa]"}, "rangemode": "tozero"},
    }
    yield Chart("Pressure over the probes", traces, layout)
