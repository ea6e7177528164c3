"""Content of a diagram, independent of its output: `png.py` or `page/charts.py` draws it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize, to_hex

from softsim.errors import OutputError
from softsim.output.fields import Frames
from softsim.report.style import BLUE, COLOUR_MAP, COLOURS, INK

EMPTY = np.zeros(0)

LONGEST_LABEL = 24
"""Largest number of characters of a label in a diagram."""

MOST_TICKS = 20
"""Largest number of labels along an axis."""

MOST_MARKERS = 60
"""Largest number of points with markers on a line whose points are cases."""

MOST_NUMBERS = 80
"""Largest number of cells that have their value written in them."""

POINTS, STEPS = "points", "steps"
"""Kinds of series other than lines."""

FLAT, TALL = 0.62, 1.5
"""Relative heights of a low and a high panel."""


@dataclass(frozen=True)
class Scale:
    """Scale of an axis or of a colour range.

    labels: of the positions 0, 1 ..., None if values are numbers. whole: all values are
    integers. from_zero: the scale includes zero.
    """

    title: str
    labels: tuple[str, ...] | None = None
    logarithmic: bool = False
    whole: bool = False
    from_zero: bool = False

    def text(self, place: float) -> str:
        """Return the value or shortened label at a position; empty if it is not finite."""
        if not np.isfinite(place):
            return ""
        return f"{place:.3g}" if self.labels is None else shortened(self.labels[int(place)])

    def ticks(self) -> tuple[list[int], list[str]]:
        """Return the positions and texts of the labels."""
        labels = self.labels or ()
        places = list(range(0, len(labels), -(-len(labels) // MOST_TICKS) or 1))
        return places, [shortened(labels[place]) for place in places]

    def limits(self, places: np.ndarray = EMPTY) -> tuple[float, float]:
        """Return distinct lower and upper limits of a scale that shows the values `places` (n,)."""
        if self.labels is not None:
            return -0.5, max(len(self.labels), 1) - 0.5
        known = places[np.isfinite(places)]
        low, high = (float(known.min()), float(known.max())) if len(known) else (1.0, 2.0)
        if low < high:
            return low, high
        return (low / 2, low * 2) if self.logarithmic else (low - 0.5, high + 0.5)


def shortened(label: str) -> str:
    """Return a label cut to LONGEST_LABEL characters."""
    return label if len(label) <= LONGEST_LABEL else label[: LONGEST_LABEL - 1] + "…"


NEIGHBOURS = np.array([1.0, 2.0, 1.0])
"""Weights of a bin and its neighbours in its mean.

A bin does not hold whole periods of a vibration; without this smoothing the remainder would appear
as ripples that the signal does not have.
"""


def thinned(
    time: np.ndarray, values: np.ndarray, bins: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Return time, mean, and lowest and highest values (2, bins) in bins of equally many rows.

    Signals (rows,) of up to twice as many rows are returned unchanged, without a band. Samples that
    are not finite are omitted; a bin without finite samples is NaN, a gap in the line.
    """
    rows = len(time)
    if rows <= 2 * bins:
        return time, values, None
    starts = np.linspace(0, rows, bins, endpoint=False).astype(int)
    finite = np.isfinite(values)
    count = np.add.reduceat(finite.astype(float), starts)
    total = np.add.reduceat(np.where(finite, values, 0.0), starts)
    low = np.minimum.reduceat(np.where(finite, values, np.inf), starts)
    high = np.maximum.reduceat(np.where(finite, values, -np.inf), starts)
    # "same" of two short arrays would have the length of the longer one, whichever that is.
    weight = np.convolve(count, NEIGHBOURS)[1:-1]
    mean = np.convolve(total, NEIGHBOURS)[1:-1] / np.where(count == 0, 1.0, weight)
    low, mean, high = np.where(count == 0, np.nan, [low, mean, high])
    return np.add.reduceat(time, starts) / np.diff([*starts, rows]), mean, np.stack([low, high])


@dataclass(frozen=True)
class PlotSeries:
    """Points x and y (n,), joined by a line "-", "--" or ":", by STEPS, or drawn as single POINTS.

    band: lowest and highest values (2, n), NaN where there is none; a line without a band gets
    one where many points are replaced by their mean. shades: values (n,) shown by the colours
    of the panel instead of `colour`. cases: the case of each point (n,), if any. mean: a point
    represents several cases.
    """

    name: str
    x: np.ndarray
    y: np.ndarray
    colour: str = BLUE
    kind: str = "-"
    band: np.ndarray | None = None
    shades: np.ndarray | None = None
    cases: np.ndarray = field(default_factory=lambda: EMPTY)
    mean: bool = False

    @property
    def has_markers(self) -> bool:
        """True if each point of a line is marked: the points are cases, and there are few."""
        return self.kind != STEPS and 0 < len(self.cases) <= MOST_MARKERS

    def thinned(self, bins: int) -> "PlotSeries":
        """Return the line of at most twice as many points as bins, with a band if it vibrates."""
        if self.band is not None or self.kind == STEPS:
            return self
        x, y, band = thinned(self.x, self.y, bins)
        return replace(self, x=x, y=y, band=band)


@dataclass(frozen=True)
class EdgeMarks:
    """Marks, "x" or "|", along the lower edge for cases without a result: x (n,), cases (n,)."""

    name: str
    marker: str
    colour: str
    x: np.ndarray
    cases: np.ndarray


@dataclass(frozen=True)
class Cells:
    """Cells in rows and columns.

    The levels are at columns (c,) and rows (r,); at_x (c + 1,) and at_y (r + 1,) are the edges
    between them. Each cell (r, c) has a value, NaN if no case is done; its first case, 0 if
    there is none; and whether cases failed and none is done.
    """

    columns: np.ndarray
    rows: np.ndarray
    at_x: np.ndarray
    at_y: np.ndarray
    values: np.ndarray
    cases: np.ndarray
    failed: np.ndarray
    mean: bool

    def around(self, x: float, y: float) -> tuple[float, float, float, float]:
        """Return left, bottom, width and height of the cell at a point."""
        i, j = np.argmin(np.abs(self.columns - x)), np.argmin(np.abs(self.rows - y))
        left, bottom = self.at_x[i : i + 2], self.at_y[j : j + 2]
        return float(left[0]), float(bottom[0]), float(np.ptp(left)), float(np.ptp(bottom))


@dataclass(frozen=True)
class Stripe:
    """Stripe across a panel between two values of its axis, with a label."""

    low: float
    high: float
    name: str
    shaded: bool


@dataclass(frozen=True)
class PlotAxis:
    """Axis with the series of one quantity."""

    scale: Scale
    series: Sequence[PlotSeries] = ()

    @property
    def colour(self) -> str:
        """Colour of the axis title: that of the series if all have the same."""
        colours = {one.colour for one in self.series if one.shades is None and not len(one.cases)}
        return colours.pop() if len(colours) == 1 else INK


@dataclass(frozen=True)
class Panel:
    """Panel of a diagram.

    It has an axis on the left and optionally one on the right, or cells in place of series;
    marks along the lower edge; the best point, if any; and stripes behind them. colours: the
    scale of cells and shades, and the values (n,) that it must include. height: relative to an
    ordinary panel.
    """

    left: PlotAxis
    right: PlotAxis | None = None
    cells: Cells | None = None
    edges: Sequence[EdgeMarks] = ()
    best: Sequence[PlotSeries] = ()
    colours: tuple[Scale, np.ndarray] | None = None
    height: float = 1.0
    stripes: Sequence[Stripe] = ()

    @property
    def axes(self) -> list[PlotAxis]:
        """Left axis and, if there is one, right axis."""
        return [self.left] if self.right is None else [self.left, self.right]

    @property
    def has_legend(self) -> bool:
        """True if several names need a legend, or a name that is not in the axis title."""
        series = [one for axis in self.axes for one in axis.series]
        names = [one.name for one in (*series, *self.best) if one.name]
        names += [edge.name for edge in self.edges]
        names += ["failed"] * (self.cells is not None and bool(self.cells.failed.any()))
        return len(names) > 1 or any(name not in self.left.scale.title for name in names)

    @property
    def is_empty(self) -> bool:
        """True if there are no finite points to show."""
        places = [one.x + one.y for axis in self.axes for one in axis.series]
        return self.cells is None and not np.isfinite(np.concatenate([EMPTY, *places])).any()


@dataclass(frozen=True)
class Diagram:
    """Panels stacked above one another over one quantity x.

    remark: a note for the reader. over_time: x is the time of the run [s]. bounds: values of x
    that are marked in all panels.
    """

    title: str
    x: Scale
    panels: Sequence[Panel]
    remark: str = ""
    over_time: bool = False
    bounds: Sequence[float] = ()

    @property
    def span(self) -> tuple[float, float]:
        """First and last x of the first series; equal for a run of one sample."""
        x = self.panels[0].left.series[0].x
        return float(x[0]), float(x[-1])


# -------------------------------------------------------------------------------------------------
# Fields by which bodies are coloured, and the colour scale common to all pictures of a run.

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
