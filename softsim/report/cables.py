"""Cables and fibres in figures: lines, as wide as they are drawn anywhere."""

import numpy as np
from matplotlib.axes import Axes

from softsim.output.fields import Frames
from softsim.report.colours import MILLI
from softsim.report.style import INK

WIDTH = 1.6
"""Of a line [points]."""


def cables_at(frames: Frames, index: int) -> list[np.ndarray]:
    """Nodes (k, d) [mm] of each cable, and places of each fibre, in a frame."""
    if "cables" not in frames.extra:
        return []
    starts = frames.described["cable_starts"].astype(int)
    return np.split(frames.extra["cables"][index] * MILLI, starts[1:])


def draw_cables(axes: Axes, lines: list[np.ndarray], zorder: float) -> None:
    """Cables, by their nodes (k, 2) [mm] in the picture."""
    for line in lines:
        axes.plot(*line.T, color=INK, linewidth=WIDTH, zorder=zorder)
