"""Curves of a history: pressures of chambers, energies, contact."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np

from softsim.analysis.travel import (
    ROUND_OFF,
    History,
    displacement,
    has,
    travelling_column,
    travels,
)
from softsim.materials.material import MaxwellFit, MaxwellSeries
from softsim.report.diagram import (
    FLAT,
    MILLI,
    POINTS,
    Diagram,
    Panel,
    PlotAxis,
    PlotSeries,
    Scale,
    thinned,
)
from softsim.report.style import BLUE, COLOURS, GREEN, INK, ORANGE, PURPLE, RED, SKY
from softsim.scene.quantities import CHAMBER_PRESSURE, ROW_FORCE, SIDE_FORCE, is_probe
from softsim.units import format_quantity

ENERGIES = {
    "internal_energy": ("internal", BLUE, "-"),
    "hourglass_energy": ("hourglass (part of internal)", BLUE, ":"),
    "kinetic_energy": ("kinetic", SKY, "-"),
    "external_work": ("external work", INK, "--"),  # where nothing is lost, upon the internal one
    "friction_dissipation": ("friction", ORANGE, "-"),
    "viscous_dissipation": ("viscous", PURPLE, "-"),
    "damage_dissipation": ("softening", RED, "-"),
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


# -------------------------------------------------------------------------------------------------
# Curves of the quantities that the probes of a scene recorded.

QUANTITIES = {
    "m": ("length", 1e3, "mm"),
    "rad": ("angle", np.degrees(1.0), "deg"),
    "N": ("force", 1.0, "N"),
    "m^3": ("volume", 1e6, "ml"),
    "m^3/s": ("flow", 1e6, "ml/s"),
    "Pa": ("pressure", 1e-3, "kPa"),
}
"""Quantity, factor and drawn unit by unit in the history."""

UNSEEN = 1e-3
"""Fraction of the largest curve of a panel below which another one looks like zero."""

COMPARABLE = 0.6
"""Range of a component of a probe over that of its largest from which both are inflation curves."""

PATH_BINS = 400
"""Number of bins of a vibrating pressure that is drawn over a probe."""

LINES = {"": "-", "x": "-", "y": "--", "z": ":"}


def curves_of(history: History, units: Mapping[str, str]) -> dict[str, list[PlotSeries]]:
    """Return the curves of all probes over time, by unit in the history.

    Each probe has a colour, each axis a line style. Curves that are zero compared with others
    of their unit are omitted. units: column -> unit.
    """
    columns: dict[str, list[str]] = {}
    for column, unit in units.items():
        if is_probe(column) and has(history, column):
            columns.setdefault(unit, []).append(column)
    curves: dict[str, list[PlotSeries]] = {}
    for unit, names in columns.items():
        factor = QUANTITIES.get(unit, ("", 1.0, unit))[1]
        sizes = {column: float(np.nanmax(np.abs(history[column]))) for column in names}
        colours: dict[str, str] = {}
        curves[unit] = []
        for column in names:
            name, axis = name_and_axis(column, unit)
            if sizes[column] >= UNSEEN * max(sizes.values()):
                colour = colours.setdefault(name, COLOURS[len(colours) % len(COLOURS)])
                label, values = f"{name} {axis}".rstrip(), history[column] * factor
                series = PlotSeries(label, history["time"], values, colour, LINES[axis])
                curves[unit].append(series)
    return curves


def name_and_axis(column: str, unit: str) -> tuple[str, str]:
    """Return the probe name of a column and the axis of a vector, otherwise ""."""
    name, _, axis = column.rpartition("_")
    is_vector = unit != "m^3" and axis in ("x", "y", "z")
    return (name, axis) if is_vector else (column, "")


def inflation_curves(
    history: History, units: Mapping[str, str], unit: str = "m"
) -> list[PlotSeries]:
    """Return curves of the air pressure [kPa] over the probes of a unit of the history, as drawn.

    Of each probe the component that moves most is taken, and others that move at least COMPARABLE
    times as much, without vibration; probes at rest are omitted. The part of a path of equilibria
    that is unstable is dashed. The result is empty unless there is one chamber whose pressure
    changes.
    """
    air = single_pressure(history)
    if air is None or _range(air) == 0.0:
        return []
    of_probe: dict[str, list[PlotSeries]] = {}
    for curve in curves_of(history, units).get(unit, []):
        # A radius has no components.
        of_probe.setdefault(curve.name.rpartition(" ")[0] or curve.name, []).append(curve)
    shown = [
        curve
        for components in of_probe.values()
        for curve in components
        if _range(curve.y) >= COMPARABLE * max(_range(each.y) for each in components)
    ]
    if "unstable_modes" in history:
        is_unstable = history["unstable_modes"] > 0.0
        return [part for c in shown for part in branches(c, air / 1e3, is_unstable)]
    _, pressure, _ = thinned(history["time"], air / 1e3, PATH_BINS)
    return [
        PlotSeries(c.name, thinned(c.x, c.y, PATH_BINS)[1], pressure, c.colour, c.kind)
        for c in shown
        if _range(c.y) > 0.0
    ]


def branches(curve: PlotSeries, over: np.ndarray, is_unstable: np.ndarray) -> list[PlotSeries]:
    """Return a path as its stable parts, and its unstable ones dashed up to the next stable point.

    over, is_unstable (n,): ordinate and stability of the points of the curve.
    """
    near = is_unstable.copy()
    near[:-1] |= is_unstable[1:]
    near[1:] |= is_unstable[:-1]
    parts = [PlotSeries(curve.name, curve.y, np.where(is_unstable, np.nan, over), curve.colour)]
    if is_unstable.any():
        dashed = np.where(near, over, np.nan)
        parts.append(PlotSeries(f"{curve.name}, unstable", curve.y, dashed, curve.colour, "--"))
    return parts


def _range(values: np.ndarray) -> float:
    return float(np.nanmax(values) - np.nanmin(values))


# -------------------------------------------------------------------------------------------------
# Figures over time of a run: those for which its history has data.

TITLES = {
    "displacement_pressure": "Displacement and pressure",
    "energies": "Energies",
    "contact_rows": "Contact with walls",
    "deflation": "Last deflation",
    "gait": "Gait",
    "pull": "Pull",
    "probes": "Probes",
    "pressure_probe": "Pressure versus probes",
    "pressure_angle": "Pressure versus rotations",
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


def pressure(history: History) -> PlotAxis | None:
    """Return the axis of the air pressure of each chamber, or None without pressure."""
    if not pressurised(history):
        return None
    lines = [
        PlotSeries(name, history["time"], air / 1e3, colour, ":")
        for (name, air), colour in zip(
            chamber_pressures(history).items(), itertools.cycle(OF_CHAMBERS), strict=False
        )
    ]
    return PlotAxis(Scale("air pressure [kPa]", from_zero=True), lines)


def motion(history: History) -> Iterator[Panel]:
    """Yield the panel of displacement (left) and pressure (right), or of the one that exists."""
    air = pressure(history)
    if travels(history):
        body, axis = travelling_column(history).split("_")
        moved = displacement(history) * MILLI
        line = PlotSeries(f"{body} displacement", history["time"], moved, BLUE)
        yield Panel(PlotAxis(Scale(f"{body} displacement in {axis} [mm]"), [line]), air)
    elif air is not None:
        yield Panel(air)


def contact(history: History) -> Iterator[Panel]:
    """Yield panels of the rows of spikes in contact and of the contact force."""
    for column, (label, colour) in CONTACTS.items():
        if has(history, column) and np.nanmax(history[column]) > 0.0:
            line = PlotSeries(label, history["time"], history[column], colour)
            scale = Scale(label, whole=column == "rows_in_contact", from_zero=True)
            yield Panel(PlotAxis(scale, [line]))


def deflation(history: History) -> dict[str, Diagram]:
    """Return the figure of wall forces and speed over the air pressure in the last deflation.

    It shows the forces on each row of spikes and on each side of the robot, and the speed
    (along the pipe), all without vibration. The result is empty if there is no such data.
    """
    pressed = [name for name in history if name.startswith((ROW_FORCE, SIDE_FORCE))]
    if not pressed or not pressurised(history):
        return {}
    pressure = history["pressure"]
    highest = len(pressure) - 1 - int(np.argmax(pressure[::-1]))  # the last one
    fall = slice(highest, highest + 1 + int(np.argmin(pressure[highest:])))
    time = history["time"][fall]
    if len(time) < FEWEST_OF_A_FALL:
        return {}

    def smooth(values: np.ndarray) -> np.ndarray:
        return thinned(time, values[fall], SAMPLES_OF_A_FALL)[1]

    kilo = smooth(pressure) / 1e3
    panels = []
    for prefix, title in ((ROW_FORCE, "force per row [N]"), (SIDE_FORCE, "force per side [N]")):
        names = [name for name in pressed if name.startswith(prefix)]
        lines = [
            PlotSeries(name.removeprefix(prefix), kilo, smooth(history[name]), colour)
            for name, colour in zip(names, itertools.cycle(COLOURS), strict=False)
        ]
        panels.append(Panel(PlotAxis(Scale(title, from_zero=True), lines)))
    if travels(history):
        along = history["arc_length"] if has(history, "arc_length") else displacement(history)
        speed = np.gradient(smooth(along) * MILLI, smooth(history["time"]))
        drawn = [PlotSeries("speed", kilo, speed, BLUE)]
        panels.append(Panel(PlotAxis(Scale("speed [mm/s]", from_zero=True), drawn)))
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
            heights.append(PlotSeries(row, time * MILLI, height, colour))
        touched = history[name][-ROWS_OF_A_GAIT:] > 0.0
        bar = np.where(touched, float(number), np.nan)
        touching.append(PlotSeries(row, time * MILLI, bar, colour))
    panels = [Panel(PlotAxis(Scale("height of row [mm]"), heights))] if heights else []
    panels.append(Panel(PlotAxis(Scale("rows in contact", whole=True), touching)))
    return {"gait": Diagram(TITLES["gait"], Scale("time [ms]"), panels)}


def energies(history: History) -> Iterator[Panel]:
    """Yield panels of the energies and of the error of the energy balance."""
    present = energies_drawn(history)
    if not present:
        return
    time = history["time"]
    factor, unit = joules(max(float(np.nanmax(np.abs(history[name]))) for name in present))
    lines = [
        PlotSeries(label, time, history[column] * factor, colour, kind)
        for column, (label, colour, kind) in present.items()
    ]
    yield Panel(PlotAxis(Scale(f"energy [{unit}]"), lines))
    if has(history, "energy_error"):
        error = PlotSeries("energy error", time, history["energy_error"] * 100.0, RED)
        yield Panel(PlotAxis(Scale("energy error [%]", from_zero=True), [error]), height=FLAT)


def pull(history: History) -> Iterator[Panel]:
    """Yield the panel of the tension of the tendon that holds the robot, and of the pressure."""
    if has(history, "pull"):
        line = PlotSeries("pull", history["time"], history["pull"], BLUE)
        scale = Scale("tendon tension [N]", from_zero=True)
        yield Panel(PlotAxis(scale, [line]), pressure(history))


def probes(history: History, units: Mapping[str, str]) -> Iterator[Panel]:
    """Yield the panels of the probes, one for each unit."""
    for unit, curves in curves_of(history, units).items():
        quantity, _, drawn = QUANTITIES.get(unit, ("probe", 1.0, unit))
        yield Panel(PlotAxis(Scale(f"{quantity} [{drawn}]"), curves))


def inflation(history: History, units: Mapping[str, str]) -> dict[str, Diagram]:
    """Return the figures of the air pressure over the places and over the rotations of probes."""
    found = {}
    for name, unit, across in (
        ("pressure_probe", "m", "displacement or radius [mm]"),
        ("pressure_angle", "rad", "rotation [deg]"),
    ):
        if curves := inflation_curves(history, units, unit):
            panel = Panel(PlotAxis(Scale("air pressure [kPa]", from_zero=True), curves))
            found[name] = Diagram(TITLES[name], Scale(across), [panel])
    return found


# -------------------------------------------------------------------------------------------------
# Spectra of materials and the Maxwell branches fitted to them: curves and numbers.

SHOWN_BEYOND = 4.0
"""Ratio of the plotted frequency range to the band on each side; there branches are extrapolated.
"""


@dataclass(frozen=True, eq=False)
class DrawnSpectrum:
    """Material with its branches as drawn.

    name, long-term shear modulus [Pa], branches, and their fit to a spectrum, if they are
    fitted.
    """

    name: str
    long_term_modulus: float
    series: MaxwellSeries
    fit: MaxwellFit | None

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz] of the band of the fit, or of the given branches."""
        if self.fit is not None:
            return self.fit.spectrum.band
        turning = 1.0 / (2.0 * np.pi * self.series.relaxation_times)
        return float(turning.min()), float(turning.max())


def spectra_diagram(materials: Sequence[DrawnSpectrum]) -> Diagram:
    """Return the diagram of storage modulus, loss factor and fit error over frequency.

    Points are the spectrum, lines the branches, dashed beyond the band.
    """
    storage, loss, errors = [], [], []
    for material, colour in zip(materials, cycle(COLOURS), strict=False):
        low, high = material.band
        inside = np.geomspace(low, high, 300)
        beyond = np.geomspace(low / SHOWN_BEYOND, high * SHOWN_BEYOND, 300)
        modulus = material.series.modulus
        shown = [("", beyond, modulus(beyond), "--"), (material.name, inside, modulus(inside), "-")]
        if material.fit is not None:
            f, target = material.fit.spectrum.frequency, material.fit.spectrum.modulus
            shown.append((f"{material.name}, spectrum", f, target, POINTS))
            misses = 100.0 * np.abs(modulus(f) / target - 1.0)
            largest = np.full(len(f), 100.0 * material.fit.largest_error)
            errors += [PlotSeries("", f, misses, colour), PlotSeries("", f, largest, colour, ":")]
        for name, f, complex_modulus, kind in shown:
            kilo = material.long_term_modulus * complex_modulus.real / 1e3
            storage.append(PlotSeries(name, f, kilo, colour, kind))
            loss.append(
                PlotSeries("", f, complex_modulus.imag / complex_modulus.real, colour, kind)
            )
    panels = [
        Panel(PlotAxis(Scale("storage modulus, shear [kPa]", logarithmic=True), storage)),
        Panel(PlotAxis(Scale("loss factor", from_zero=True), loss)),
    ]
    if errors:
        panels.append(Panel(PlotAxis(Scale("error [%]", from_zero=True), errors), height=FLAT))
    return Diagram("Spectra", Scale("frequency [Hz]", logarithmic=True), panels)


def spectra_rows(material: DrawnSpectrum) -> list[tuple[str, str]]:
    """Return the numbers of a material as (name, text): modulus, band, error, branches."""
    series = material.series
    low, high = (format_quantity(float(f"{f:.3g}"), "Hz") for f in material.band)
    ends = series.modulus(np.array(material.band)).real
    rows = [
        ("long-term", f"{material.long_term_modulus / 1e3:.4g} kPa, shear"),
        (
            "band",
            f"{low} to {high}: storage modulus {ends[0]:.3g} to {ends[1]:.3g} times the "
            "long-term modulus",
        ),
    ]
    if material.fit is not None:
        error = 100.0 * material.fit.largest_error
        rows.append(("error", f"at most {error:.2g} % of the complex modulus"))
    for time, modulus, share in zip(
        series.relaxation_times, series.moduli, series.shares, strict=True
    ):
        shown = format_quantity(float(f"{time:.4g}"), "s")
        rows.append(
            ("branch", f"{shown}, {modulus:.4g} times the long-term modulus, g = {share:.4g}")
        )
    return rows
