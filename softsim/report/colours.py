"""Fields by which bodies are coloured, and the colour scale common to all pictures of a run."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize, to_hex

from softsim.errors import OutputError
from softsim.output.fields import Frames
from softsim.report.diagram import Scale
from softsim.report.style import COLOUR_MAP, COLOURS

MILLI = 1e3


@dataclass(frozen=True)
class ColourField:
    """Field to colour by: its label with unit, and the factor from SI to that unit."""

    label: str
    factor: float


FIELDS = {
    "stretch": ColourField("largest principal stretch [-]", 1.0),
    "von_mises": ColourField("von Mises stress [kPa]", 1e-3),
    "pressure": ColourField("pressure in the material [kPa]", 1e-3),
    "displacement": ColourField("displacement [mm]", MILLI),
}

MIXED = 16
"""Number of colours between which plotly.js interpolates."""

OUTLIERS = 0.005
"""Fraction of the cells at each end of the scale whose values may exceed it.

It keeps a single spike tip in a corner from determining the whole scale.
"""


def refuse_missing_field(frames: Frames, field: str) -> None:
    """Raise OutputError unless `field` is one of FIELDS that the frames have."""
    there = sorted(FIELDS.keys() & {**frames.point_data, **frames.cell_data}.keys())
    if field not in there:
        raise OutputError(
            f"cannot colour the snapshots by {field!r}",
            hint=f"available fields: {', '.join(there)}",
        )


def shown_values(
    frames: Frames,
    indices: Iterable[int],
    field: str,
    faces: np.ndarray,
    owners: np.ndarray | slice,
) -> np.ndarray:
    """Return the field on each face in some frames (f, k), in the unit of its label.

    The magnitude of a vector is returned. faces: (k, 2 to 4) nodes, over which point data is
    averaged. owners: the cell of each face.
    """
    of_cells = field in frames.cell_data
    values = np.array((frames.cell_data if of_cells else frames.point_data)[field].at(indices))
    if values.ndim == 3:
        values = np.linalg.norm(values, axis=2)
    values = values[:, owners] if of_cells else values[:, faces].mean(axis=2)
    return values * FIELDS[field].factor


def places_at(frames: Frames, index: int) -> np.ndarray:
    """Return the positions (n, d) [mm] of the nodes in a frame."""
    d = frames.points.shape[1]
    return (frames.points + frames.point_data["displacement"][index][:, :d]) * MILLI


def shared_scale(values: np.ndarray) -> tuple[ScalarMappable, str]:
    """Return the colour map of all values (n,) of a run, and the ends at which values exceed it."""
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return ScalarMappable(Normalize(0.0, 1.0), COLOUR_MAP), "neither"
    low, high = np.quantile(values, [OUTLIERS, 1 - OUTLIERS])
    below, above = values.min() < low, values.max() > high
    extend = {(False, False): "neither", (True, False): "min", (False, True): "max"}
    scale = ScalarMappable(Normalize(low, high), COLOUR_MAP)
    return scale, extend.get((bool(below), bool(above)), "both")


def colours_of(scale: Scale, places: np.ndarray) -> ScalarMappable:
    """Return the colour map for values (n,) of a diagram.

    Labels have one colour each; numbers a map of increasing lightness.
    """
    if scale.labels is not None:
        count = max(len(scale.labels), 1)
        listed = ListedColormap(COLOURS[:count] if count <= len(COLOURS) else shades(count))
        return ScalarMappable(BoundaryNorm(np.arange(count + 1) - 0.5, count), listed)
    norm = (LogNorm if scale.logarithmic else Normalize)(*scale.limits(places))
    return ScalarMappable(norm, COLOUR_MAP)


def shades(count: int) -> list[str]:
    """Return `count` colours of the map, from its lower to its upper end."""
    return [to_hex(colour) for colour in colormaps[COLOUR_MAP](np.linspace(0.0, 1.0, count))]


def colour_scale() -> list[tuple[float, str]]:
    """Return the colour map as positions from 0 to 1 with their colours, as in plotly.js."""
    colours = shades(MIXED)
    return [(k / (MIXED - 1), colour) for k, colour in enumerate(colours)]
