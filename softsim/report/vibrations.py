"""Figures of small vibrations about an equilibrium: frequencies over a load."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from softsim.report.style import COLOURS, INK, QUIET, RED, drawing
from softsim.statics.modes import LoadedModes


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
