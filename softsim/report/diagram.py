"""What a diagram shows, whoever draws it: `png.py` for a file, `page/charts.py` for a page."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from softsim.report.style import BLUE, INK

EMPTY = np.zeros(0)

LONGEST_LABEL = 24
"""Characters of a label in a diagram."""

MOST_TICKS = 20
"""Labels written along an axis."""

MOST_MARKERS = 60
"""Points on a line that each have a marker, where each stands for a case."""

MOST_NUMBERS = 80
"""Cells that have their value written in them."""

POINTS, STEPS = "points", "steps"
"""Kinds of a series beside lines."""

FLAT, TALL = 0.62, 1.5
"""Heights of panels that need less room than others, and more."""


@dataclass(frozen=True)
class Scale:
    """How values lie along an axis, or in a range of colours. labels: of the places 0, 1 ..., None
    where values are numbers. whole: all of these are; from_zero: it shows zero too.
    """

    title: str
    labels: tuple[str, ...] | None = None
    logarithmic: bool = False
    whole: bool = False
    from_zero: bool = False

    def text(self, place: float) -> str:
        """What a place stands for, in brief; empty for none."""
        if not np.isfinite(place):
            return ""
        return f"{place:.3g}" if self.labels is None else shortened(self.labels[int(place)])

    def ticks(self) -> tuple[list[int], list[str]]:
        """The labels that are written, and where."""
        labels = self.labels or ()
        places = list(range(0, len(labels), -(-len(labels) // MOST_TICKS) or 1))
        return places, [shortened(labels[place]) for place in places]

    def limits(self, places: np.ndarray = EMPTY) -> tuple[float, float]:
        """Ends of a scale that shows places (n,); apart, whatever the places are."""
        if self.labels is not None:
            return -0.5, max(len(self.labels), 1) - 0.5
        known = places[np.isfinite(places)]
        low, high = (float(known.min()), float(known.max())) if len(known) else (1.0, 2.0)
        if low < high:
            return low, high
        return (low / 2, low * 2) if self.logarithmic else (low - 0.5, high + 0.5)


def shortened(label: str) -> str:
    """A label as it fits in a diagram."""
    return label if len(label) <= LONGEST_LABEL else label[: LONGEST_LABEL - 1] + "…"


@dataclass(frozen=True)
class Series:
    """Places x and y (n,), joined by a line, "-", "--" or ":", or by STEPS, or single POINTS.

    band: its lowest and highest values (2, n), NaN where there is none; of a line without one it is
    drawn where many places make way for their mean. shades: (n,) that the colours of the panel
    tell apart in place of `colour`. cases: the case of each place (n,), if there is one; mean: a
    place stands for several.
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
        """Whether each place on a line is marked: where it is a case, and these are few."""
        return self.kind != STEPS and 0 < len(self.cases) <= MOST_MARKERS


@dataclass(frozen=True)
class Edge:
    """Marks, "x" or "|", along the lower edge for cases that have no place above: x (n,), cases
    (n,).
    """

    name: str
    marker: str
    colour: str
    x: np.ndarray
    cases: np.ndarray


@dataclass(frozen=True)
class Cells:
    """Cells in rows and columns: places of their levels, columns (c,) and rows (r,); edges between
    them, at_x (c + 1,) and at_y (r + 1,). In each cell (r, c): the value, NaN where no case is
    done; its first case, 0 where there is none; whether cases failed and none is done.
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
        """Left, bottom, width and height of the cell at a place."""
        i, j = np.argmin(np.abs(self.columns - x)), np.argmin(np.abs(self.rows - y))
        left, bottom = self.at_x[i : i + 2], self.at_y[j : j + 2]
        return float(left[0]), float(bottom[0]), float(np.ptp(left)), float(np.ptp(bottom))


@dataclass(frozen=True)
class Stripe:
    """A stripe across a panel between two values of its axis, and what is said of it."""

    low: float
    high: float
    name: str
    shaded: bool


@dataclass(frozen=True)
class Axis:
    """Series of one quantity."""

    scale: Scale
    series: Sequence[Series] = ()

    @property
    def colour(self) -> str:
        """Of its title: that of the series, where all have the same."""
        colours = {one.colour for one in self.series if one.shades is None and not len(one.cases)}
        return colours.pop() if len(colours) == 1 else INK


@dataclass(frozen=True)
class Panel:
    """What is drawn upon one another: an axis on the left, maybe another one on the right, or cells
    in place of series; marks at the lower edge; the best place, or none; stripes behind all.

    colours: the scale of cells and shades, and the places (n,) that it must show. height: of that
    of an ordinary panel.
    """

    left: Axis
    right: Axis | None = None
    cells: Cells | None = None
    edges: Sequence[Edge] = ()
    best: Sequence[Series] = ()
    colours: tuple[Scale, np.ndarray] | None = None
    height: float = 1.0
    stripes: Sequence[Stripe] = ()

    @property
    def axes(self) -> list[Axis]:
        """Its axes."""
        return [self.left] if self.right is None else [self.left, self.right]

    @property
    def has_legend(self) -> bool:
        """Whether there are names to tell apart, or one that its axis does not say."""
        series = [one for axis in self.axes for one in axis.series]
        names = [one.name for one in (*series, *self.best) if one.name]
        names += [edge.name for edge in self.edges]
        names += ["failed"] * (self.cells is not None and bool(self.cells.failed.any()))
        return len(names) > 1 or any(name not in self.left.scale.title for name in names)

    @property
    def is_empty(self) -> bool:
        """Whether there is no place to show."""
        places = [one.x + one.y for axis in self.axes for one in axis.series]
        return self.cells is None and not np.isfinite(np.concatenate([EMPTY, *places])).any()


@dataclass(frozen=True)
class Diagram:
    """Panels upon one another over one quantity x. remark: what a reader must know of them.
    over_time: x is the time of the run [s]. bounds: places of x that are marked in all panels.
    """

    title: str
    x: Scale
    panels: Sequence[Panel]
    remark: str = ""
    over_time: bool = False
    bounds: Sequence[float] = ()

    @property
    def span(self) -> tuple[float, float]:
        """From the first to the last place of the first series; equal for a run of one sample."""
        x = self.panels[0].left.series[0].x
        return float(x[0]), float(x[-1])
