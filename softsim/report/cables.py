"""Cables and fibres in figures: lines, as wide as they are drawn anywhere."""

import numpy as np
from matplotlib.axes import Axes

from softsim.output.fields import Frames
from softsim.report.colours import MILLI
from softsim.report.style import INK

WIDTH = 1.6
"""Of a line [points]."""

FIBRE_WIDTH, FIBRE_OPACITY = 0.6, 0.6
"""Of fibres, which are seen through the body that they lie in."""


def cables_at(frames: Frames, index: int) -> list[np.ndarray]:
    """Nodes (k, d) [mm] of each cable in a frame."""
    return _lines_at(frames, index, "cable")


def fibres_at(frames: Frames, index: int) -> list[np.ndarray]:
    """Places (k, d) [mm] along each fibre in a frame."""
    return _lines_at(frames, index, "fibre")


def _lines_at(frames: Frames, index: int, kind: str) -> list[np.ndarray]:
    if f"{kind}s" not in frames.extra:
        return []
    starts = frames.described[f"{kind}_starts"].astype(int)
    return np.split(frames.extra[f"{kind}s"][index] * MILLI, starts[1:])


def draw_cables(axes: Axes, lines: list[np.ndarray], zorder: float) -> None:
    """Cables, by their nodes (k, 2) [mm] in the picture."""
    for line in lines:
        axes.plot(*line.T, color=INK, linewidth=WIDTH, zorder=zorder)


def draw_fibres(axes: Axes, lines: list[np.ndarray]) -> None:
    """Fibres, by their places (k, 2) [mm] in the picture, upon all that is drawn before."""
    for line in lines:
        axes.plot(*line.T, color=INK, linewidth=FIBRE_WIDTH, alpha=FIBRE_OPACITY, zorder=3.0)
