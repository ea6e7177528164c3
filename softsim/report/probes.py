"""Curves of the quantities that the probes of a scene recorded."""

from collections.abc import Mapping

import numpy as np

from softsim.output.travel import History, has
from softsim.report.curves import single_pressure
from softsim.report.diagram import Series
from softsim.report.style import COLOURS
from softsim.report.thinning import thinned
from softsim.scene.columns import is_probe

QUANTITIES = {
    "m": ("length", 1e3, "mm"),
    "N": ("force", 1.0, "N"),
    "m^3": ("volume", 1e6, "ml"),
}
"""Quantity, factor and drawn unit by unit in the history."""

UNSEEN = 1e-3
"""Fraction of the largest curve of a panel below which another one looks like zero."""

LINES = {"": "-", "x": "-", "y": "--", "z": ":"}


def curves_of(history: History, units: Mapping[str, str]) -> dict[str, list[Series]]:
    """Return the curves of all probes over time, by unit in the history.

    Each probe has a colour, each axis a line style. Curves that are zero compared with others
    of their unit are omitted. units: column -> unit.
    """
    columns: dict[str, list[str]] = {}
    for column, unit in units.items():
        if is_probe(column) and has(history, column):
            columns.setdefault(unit, []).append(column)
    return {unit: _curves(history, names, unit) for unit, names in columns.items()}


def _curves(history: History, columns: list[str], unit: str) -> list[Series]:
    factor = QUANTITIES.get(unit, ("", 1.0, unit))[1]
    sizes = {column: float(np.nanmax(np.abs(history[column]))) for column in columns}
    colours: dict[str, str] = {}
    curves = []
    for column in columns:
        name, axis = name_and_axis(column, unit)
        if sizes[column] >= UNSEEN * max(sizes.values()):
            colour = colours.setdefault(name, COLOURS[len(colours) % len(COLOURS)])
            label = f"{name} {axis}".rstrip()
            values = history[column] * factor
            curves.append(Series(label, history["time"], values, colour, LINES[axis]))
    return curves


def name_and_axis(column: str, unit: str) -> tuple[str, str]:
    """Return the probe name of a column and the axis of a vector, otherwise ""."""
    name, _, axis = column.rpartition("_")
    is_vector = unit != "m^3" and axis in ("x", "y", "z")
    return (name, axis) if is_vector else (column, "")


def inflation_curves(history: History, units: Mapping[str, str]) -> list[Series]:
    """Return curves of the air pressure [kPa] over displacement or radius probes [mm].

    Of each probe the component that moves most is taken, without vibration; probes at rest are
    omitted. The result is empty unless there is one chamber whose pressure changes.
    """
    air = single_pressure(history)
    if air is None or _range(air) == 0.0:
        return []
    most: dict[str, Series] = {}
    for curve in curves_of(history, units).get("m", []):
        probe = curve.name.rpartition(" ")[0] or curve.name  # a radius has no components
        if probe not in most or _range(curve.y) > _range(most[probe].y):
            most[probe] = curve
    pressure = thinned(history["time"], air / 1e3).mean
    return [
        Series(c.name, thinned(c.x, c.y).mean, pressure, c.colour, c.kind)
        for c in most.values()
        if _range(c.y) > 0.0
    ]


def _range(values: np.ndarray) -> float:
    return float(np.nanmax(values) - np.nanmin(values))
