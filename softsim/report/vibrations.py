"""Figures of small vibrations: mode shapes, frequencies over a load, harmonic response."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import SubFigure

from softsim.output.fields import Frames, SeriesInMemory
from softsim.report.diagram import MILLI
from softsim.report.snapshots import Arrangement, Pictures, arranged, panels_for, pictures
from softsim.report.style import COLOUR_MAP, COLOURS, INK, QUIET, RED, WALL, drawing
from softsim.run.equilibrium import MotorResponse
from softsim.solver.natural_modes import NaturalMode, NaturalModes
from softsim.statics.modes import LoadedModes
from softsim.units import format_quantity, size_of, usual_unit

STEEPEST, FARTHEST = 0.4, 0.12
"""Largest displacement gradient and largest displacement of a drawn mode shape.

The displacement is a fraction of the longest side of the body; the smaller amplitude is taken.
"""

AT_REST = ScalarMappable(Normalize(0.0, 1.0), ListedColormap([WALL]))


def draw_modes(found: Sequence[NaturalModes], path: Path, grey: str = "at rest") -> None:
    """Draw the modes of bodies, coloured by displacement; the body at rest is grey.

    grey: state of the grey body in words.

    Raises OutputError if the file cannot be written.
    """
    shown = [pictures(frames_of(m), list(range(len(m.modes) + 1)), "displacement") for m in found]
    grids = [arranged(len(m.modes), body.view) for m, body in zip(found, shown, strict=True)]
    heights = [grid.rows * (grid.height + 0.45) + 0.7 for grid in grids]
    with drawing(path, sum(heights)) as figure:
        parts = figure.subfigures(len(found), 1, squeeze=False, height_ratios=heights)[:, 0]
        for part, modes, body, grid in zip(parts, found, shown, grids, strict=True):
            _draw_body(part, modes, body, grid, grey)


def frames_of(found: NaturalModes) -> Frames:
    """Return the body at rest, followed by each of its modes, as frames of a run."""
    body = found.body
    shapes = [mode.shape * amplitude(found, mode) for mode in found.modes]
    return Frames(
        body.points, body.cells, np.arange(1.0 + len(shapes)),
        point_data={"displacement": SeriesInMemory([np.zeros_like(body.points), *shapes])},
        cell_data={}, extra={}, described={},
        titles={"formulation": body.regions[0].geometry.name}, sets={},
    )  # fmt: skip


def amplitude(found: NaturalModes, mode: NaturalMode) -> float:
    """Return the drawn displacement [m] of the node that moves most."""
    body = found.body
    length = float(np.ptp(body.points, axis=0).max())
    gradients = [r.deformation(body.points + mode.shape) - np.eye(3) for r in body.regions]
    steepest = max(float(np.linalg.norm(g, axis=(1, 2)).max()) for g in gradients)
    return min(STEEPEST / steepest, FARTHEST * length)


def _draw_body(
    part: SubFigure, found: NaturalModes, body: Pictures, grid: Arrangement, grey: str
) -> None:
    part.suptitle(f"body '{found.body.name}' (grey: {grey})", fontsize=9.0)
    viscoelastic = any(region.material.branches for region in found.body.regions)
    titles = [
        f"{number}: {mode.frequency:.4g} Hz"
        + (f"\ndynamic {mode.dynamic_frequency:.4g} Hz" if viscoelastic else "")
        for number, mode in enumerate(found.modes, start=1)
    ]
    panels = panels_for(part, body, grid, titles)
    for number, (axes, mode) in enumerate(zip(panels.flat, found.modes, strict=False), start=1):
        body.draw(axes, 0, AT_REST)
        largest = amplitude(found, mode) * MILLI
        body.draw(axes, number, ScalarMappable(Normalize(0.0, largest), COLOUR_MAP))


def draw_frequencies(
    values: Sequence[float],
    found: Sequence[LoadedModes],
    lines: Sequence[np.ndarray],
    load: str,
    motors: Mapping[str, float],
    buckling: Sequence[float],
    path: Path,
) -> None:
    """Draw the frequencies of modes over a load, with the frequencies of motors as lines.

    lines: number of the line (modes,) of each mode, for each value of the load. load: title of the
    axis. motors: name -> frequency [Hz]. buckling: values at which a frequency goes through zero.

    Raises OutputError if the file cannot be written.
    """
    points: dict[int, list[tuple[float, float, float]]] = {}
    for value, modes, numbers in zip(values, found, lines, strict=True):
        for mode, line in zip(modes.modes, numbers.tolist(), strict=True):
            points.setdefault(line, []).append((value, mode.dynamic_frequency, mode.frequency))
    viscoelastic = any(r.material.branches for r in found[0].body.regions)
    with drawing(path, 4.2) as figure:
        axes = figure.subplots()
        for line, rows in points.items():
            x, dynamic, static = np.array(rows).T
            colour = COLOURS[line % len(COLOURS)]
            axes.plot(x, dynamic, "o-", color=colour, markersize=3.0)
            if viscoelastic:
                axes.plot(x, static, ":", color=colour, linewidth=0.9)
        for name, frequency in motors.items():
            axes.axhline(frequency, color=INK, linestyle="--", linewidth=1.0)
            axes.annotate(
                f"{name}, {frequency:.4g} Hz", (0.995, frequency), xytext=(0, 2),
                xycoords=("axes fraction", "data"), textcoords="offset points", ha="right",
                color=INK, fontsize=8.0,
            )  # fmt: skip
        for value in buckling:
            axes.axvline(value, color=RED, linestyle="--", linewidth=1.0)
            axes.annotate(
                f"buckles at {value:.4g}", (value, 0.99), xytext=(3, 0),
                xycoords=("data", "axes fraction"), textcoords="offset points", va="top",
                color=RED, fontsize=8.0,
            )  # fmt: skip
        if any(mode.frequency < 0.0 for modes in found for mode in modes.modes):
            axes.axhline(0.0, color=QUIET, linewidth=0.8)
        axes.set_xlabel(load)
        axes.set_ylabel("frequency of modes [Hz]")
        if viscoelastic:
            axes.set_title("solid: with the dynamic modulus, dotted: with the long-term modulus")


def draw_responses(found: Sequence[MotorResponse], path: Path) -> None:
    """Draw amplitude and phase of the responses to motors over frequency, a column a motor.

    Frequencies at which contact opens, closes or begins to slip are shaded.

    Raises OutputError if the file cannot be written.
    """
    units = list(dict.fromkeys(found[0].units[column] for column in found[0].amplitudes))
    with drawing(path, 2.3 * len(units) + 2.1) as figure:
        panels = figure.subplots(len(units) + 1, len(found), sharex="col", squeeze=False)
        for column, response in zip(panels.T, found, strict=True):
            ends = np.interp(
                np.arange(-0.5, len(response.frequencies)),
                np.arange(len(response.frequencies)),
                response.frequencies,
            )
            f, colours = response.frequencies, dict(zip(response.amplitudes, cycle(COLOURS)))
            for axes, unit in zip(column[:-1], units, strict=True):
                for name, values in response.amplitudes.items():
                    if response.units[name] != unit or not values.any():
                        continue
                    size = np.abs(values) / size_of(usual_unit(unit), unit)
                    axes.semilogy(f, size, color=colours[name], label=name)
                    phase = np.degrees(np.angle(values))
                    column[-1].plot(f, phase, ".", markersize=2.5, color=colours[name])
                axes.set_ylabel(f"amplitude [{usual_unit(unit)}]")
                axes.legend(loc="upper right")
            column[-1].set(xlabel="frequency [Hz]", ylabel="phase [deg]", ylim=(-190.0, 190.0))
            column[-1].set_yticks([-180.0, -90.0, 0.0, 90.0, 180.0])
            low, high = (format_quantity(float(response.force[k]), "N") for k in (0, -1))
            force = low if low == high else f"{low} to {high}"
            column[0].set_title(f"{response.motor}: force {force}")
            for axes in column:
                axes.axvline(response.own_frequency, color=INK, linestyle="--", linewidth=1.0)
                for k in np.flatnonzero(response.contact_changes):
                    axes.axvspan(ends[k], ends[k + 1], color=WALL, linewidth=0.0, zorder=0.5)
            if response.contact_changes.any():
                column[-1].set_title(
                    "grey: contact opens, closes or begins to slip, the response is not valid"
                )
