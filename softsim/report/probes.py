"""Figures of what a scene's probes recorded."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from softsim.errors import OutputError
from softsim.report.curves import (
    History,
    draw_signal,
    has,
    label_time,
    pressurised,
)
from softsim.report.style import BLUE, GREEN, ORANGE, PURPLE, RED, SKY, drawing
from softsim.report.thinning import thinned
from softsim.scene.columns import FIXED_COLUMNS

QUANTITIES = {
    "m": ("length", 1e3, "mm"),
    "N": ("force", 1.0, "N"),
    "m^3": ("volume", 1e6, "ml"),
}
"""Unit in the history -> what it is, and factor and unit in which it is drawn."""

UNSEEN = 1e-3
"""Part of the largest curve of a panel below which another one is a line at zero."""

COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, RED)
LINES = {"": "-", "x": "-", "y": "--", "z": ":"}


@dataclass(frozen=True)
class Curve:
    """A probe's column: its values in the unit drawn, the probe's colour, the axis' line."""

    label: str
    values: np.ndarray
    colour: str
    line: str


def curves_of(history: History, units: Mapping[str, str]) -> dict[str, list[Curve]]:
    """The curves of all probes by the unit in the history; those that are zero beside others of
    their unit are left out. units: column -> unit."""
    columns: dict[str, list[str]] = {}
    for column, unit in units.items():
        if column not in FIXED_COLUMNS and has(history, column):
            columns.setdefault(unit, []).append(column)
    return {unit: _curves(history, names, unit) for unit, names in columns.items()}


def _curves(history: History, columns: list[str], unit: str) -> list[Curve]:
    factor = QUANTITIES.get(unit, ("", 1.0, unit))[1]
    sizes = {column: float(np.nanmax(np.abs(history[column]))) for column in columns}
    colours: dict[str, str] = {}
    curves = []
    for column in columns:
        name, _, axis = column.rpartition("_")
        if unit == "m^3" or axis not in ("x", "y", "z"):  # no vector
            name, axis = column, ""
        if sizes[column] >= UNSEEN * max(sizes.values()):
            colour = colours.setdefault(name, COLOURS[len(colours) % len(COLOURS)])
            label = f"{name} {axis}".rstrip()
            curves.append(Curve(label, history[column] * factor, colour, LINES[axis]))
    return curves


def draw_probes(history: History, units: Mapping[str, str], path: Path) -> None:
    """What the probes recorded over time, a panel for each unit.

    Raises OutputError if there are no probes or the disk refuses.
    """
    panels_of = curves_of(history, units)
    if not panels_of:
        raise OutputError("the history has no probes to draw")
    with drawing(path, height=0.6 + 2.1 * len(panels_of)) as figure:
        panels = figure.subplots(len(panels_of), sharex=True, squeeze=False)[:, 0]
        for axes, (unit, curves) in zip(panels, panels_of.items(), strict=True):
            for c in curves:
                draw_signal(axes, history["time"], c.values, c.colour, c.label, c.line)
            quantity, _, drawn = QUANTITIES.get(unit, ("probe", 1.0, unit))
            axes.set_ylabel(f"{quantity} [{drawn}]")
            axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, columnspacing=1.4)
        label_time(panels[-1], history)
        figure.align_ylabels()


def inflation_curves(history: History, units: Mapping[str, str]) -> list[Curve]:
    """Of each displacement or radius probe the component that moves the most [mm]; none of one at
    rest, and none at all without a pressure that changes.
    """
    if not pressurised(history) or _range(history["pressure"]) == 0.0:
        return []
    most: dict[str, Curve] = {}
    for curve in curves_of(history, units).get("m", []):
        probe = curve.label.rpartition(" ")[0] or curve.label  # a radius has no components
        if probe not in most or _range(curve.values) > _range(most[probe].values):
            most[probe] = curve
    return [curve for curve in most.values() if _range(curve.values) > 0.0]


def draw_pressure_probe(history: History, units: Mapping[str, str], path: Path) -> None:
    """The air pressure over the displacement or radius of the probes: inflation curves.

    Raises OutputError if there is no such probe, the pressure does not change, or the disk refuses.
    """
    curves = inflation_curves(history, units)
    if not curves:
        raise OutputError("the history has no displacement probe with a pressure that changes")
    with drawing(path, height=3.6) as figure:
        axes = figure.add_subplot()
        pressure = thinned(history["time"], history["pressure"] / 1e3).mean
        for c in curves:
            moved = thinned(history["time"], c.values).mean
            axes.plot(moved, pressure, c.line, color=c.colour, label=c.label)
        axes.set_xlabel("displacement or radius [mm]")
        axes.set_ylabel("air pressure [kPa]")
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        figure.legend(loc="outside upper center", ncols=4, columnspacing=1.4)


def _range(values: np.ndarray) -> float:
    return float(np.nanmax(values) - np.nanmin(values))
