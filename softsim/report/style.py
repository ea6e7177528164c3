"""Style of every figure: sizes, fonts, colours, and the output to a file."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from softsim.output.folder import replacing

PAGE_WIDTH = 6.9
"""Width of every figure [inch]: the text width of a two-column page."""

RESOLUTION = 220
"""Resolution of a figure [dots per inch]."""

INK, QUIET, WALL, FRAME, GRID = "#222222", "#767676", "#e6e6e6", "#c9ced6", "#e3e3e3"
SHADOW = "#a3a3a3"

BLUE, ORANGE, GREEN, PURPLE, SKY, RED = (
    "#0b5fa5", "#d1610f", "#1b8a5a", "#8a4f9e", "#4fa9d8", "#b3202c",
)  # fmt: skip
"""Colours that colour-blind readers can distinguish, dark enough for thin lines on white."""

COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, RED)
"""Sequence of colours of curves and labels."""

COLOUR_MAP = "viridis"
"""Colour map of monotonic lightness, readable for the colour-blind and in monochrome print."""

PALE = 0.6
"""Fraction of white in the mirror image of a half section."""

AZIMUTH, ELEVATION = 30.0, 22.0
"""Angles of the camera in space [deg]: about y from z towards x, and above the x-z plane."""

SHADE, GLOSS = 0.4, 0.25
"""Largest fraction of black in faces away from the light, and of white in faces towards it.

Black alone would be invisible in the darkest colours of the scale; more of either would make a
colour look like another one.
"""

STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.titlepad": 4.0,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "lines.linewidth": 1.4,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "legend.handlelength": 1.8,
    "legend.borderaxespad": 0.2,
    "hatch.linewidth": 0.5,
    "savefig.dpi": RESOLUTION,
}


@contextmanager
def drawing(path: Path, height: float) -> Iterator[Figure]:
    """Yield a figure of PAGE_WIDTH by `height` [inch] and write it to `path` as PNG at the end.

    Raises OutputError if the file cannot be written.
    """
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(PAGE_WIDTH, height), layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
        with replacing(path) as partial:
            figure.savefig(partial, format="png", bbox_inches="tight")
