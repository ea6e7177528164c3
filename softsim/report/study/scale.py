"""Where the values of a factor or a measure lie in a figure: numbers as they are, perhaps spaced
logarithmically, labels one after another.
"""

import re
from dataclasses import dataclass
from textwrap import fill

import numpy as np
import polars
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.axis import XAxis, YAxis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from softsim.report.style import COLOUR_MAP, COLOURS
from softsim.study.axes import Axis

LONGEST_LABEL = 24
"""Characters of a level in a figure."""

NUMBER = re.compile(r"[-+]?\d+(\.\d*)?")
"""What a label may begin with."""

MOST_TICKS = 20
"""Labels written along an axis."""

WIDE, TALL = 80, 40
"""Characters that fit along the horizontal and the vertical axis of a figure that is one panel."""


@dataclass(frozen=True)
class Scale:
    """An axis of a figure. labels: its levels, in the order of the table or of the numbers that
    they begin with, empty for numbers. whole: all its numbers are.
    """

    axis: Axis
    labels: tuple[str, ...] = ()
    whole: bool = False

    @classmethod
    def of(cls, axis: Axis, values: polars.Series) -> "Scale":
        """For all values that the axis has in the table."""
        if not axis.is_label:
            known = values.drop_nulls()
            return cls(axis, whole=bool((known == known.round()).all()))
        labels = values.drop_nulls().cast(polars.String).unique(maintain_order=True).to_list()
        numbers = [float(found[0]) for found in map(NUMBER.match, labels) if found]
        if len(numbers) == len(labels):
            labels = [labels[at] for at in np.argsort(numbers, kind="stable")]
        return cls(axis, tuple(labels))

    def places(self, values: polars.Series) -> np.ndarray:
        """Where values lie (n,); NaN where there is none."""
        if self.axis.is_label:
            at = {label: float(place) for place, label in enumerate(self.labels)}
            return np.array([at.get(value, np.nan) for value in values], dtype=float)
        return values.cast(polars.Float64).to_numpy(writable=True)

    def text(self, place: float) -> str:
        """What a place stands for, in brief; empty for none."""
        if not np.isfinite(place):
            return ""
        return shortened(self.labels[int(place)]) if self.axis.is_label else f"{place:.3g}"

    def place(self, value: float | str | None) -> float:
        """Where a single value lies."""
        return float(self.places(polars.Series([value]))[0])

    @property
    def logarithmic(self) -> bool:
        """Whether it is spaced by factors."""
        return self.axis.logarithmic and not self.axis.is_label

    def along_x(self, axes: Axes, room: int = WIDE) -> None:
        """Give the horizontal axis, along which `room` characters fit, its title, its spacing and
        its labels; those that do not fit side by side lean, or stand where they are many.
        """
        axes.set_xlabel(fill(title_of(self.axis), room))
        self._space(axes.xaxis)
        if self.axis.is_label:
            axes.set_xlim(-0.5, max(len(self.labels), 1) - 0.5)
            places, texts = self.ticks()
            axes.set_xticks(places, texts)
            if sum(map(len, texts)) > room * 2 // 3:
                if len(texts) > room // 4:
                    axes.tick_params(axis="x", labelrotation=90)
                else:
                    axes.set_xticks(places, texts, rotation=35, ha="right", rotation_mode="anchor")

    def along_y(self, axes: Axes, room: int = TALL) -> None:
        """The same of the vertical axis."""
        axes.set_ylabel(fill(title_of(self.axis), room))
        self._space(axes.yaxis)
        if self.axis.is_label:
            axes.set_ylim(-0.5, max(len(self.labels), 1) - 0.5)
            axes.set_yticks(*self.ticks())

    def colours(self, places: np.ndarray) -> ScalarMappable:
        """Colours for places: one each of labels, a map that rises in lightness of numbers."""
        if self.axis.is_label:
            count = max(len(self.labels), 1)
            few = ListedColormap(COLOURS[:count])
            listed = few if count <= len(COLOURS) else _sampled(count)
            return ScalarMappable(BoundaryNorm(np.arange(count + 1) - 0.5, count), listed)
        norm = (LogNorm if self.logarithmic else Normalize)(*self.limits(places))
        return ScalarMappable(norm, COLOUR_MAP)

    def limits(self, places: np.ndarray) -> tuple[float, float]:
        """Ends of the colours for places; apart, whatever the places are."""
        if self.axis.is_label:
            return -0.5, max(len(self.labels), 1) - 0.5
        known = places[np.isfinite(places)]
        low, high = (float(known.min()), float(known.max())) if len(known) else (1.0, 2.0)
        if low < high:
            return low, high
        return (low / 2, low * 2) if self.logarithmic else (low - 0.5, high + 0.5)

    def beside(self, figure: Figure, axes: Axes | np.ndarray, colours: ScalarMappable) -> None:
        """The bar that says what the colours mean, beside one panel or several."""
        bar = figure.colorbar(colours, ax=axes, label=title_of(self.axis), pad=0.02)
        bar.outline.set_visible(False)
        if self.axis.is_label:
            places, texts = self.ticks()
            bar.set_ticks(places, labels=texts)
            bar.minorticks_off()
        elif self.whole and not self.logarithmic:
            bar.locator = MaxNLocator(integer=True)

    def ticks(self) -> tuple[list[int], list[str]]:
        """The labels that are written, and where."""
        step = -(-len(self.labels) // MOST_TICKS) or 1
        places = list(range(0, len(self.labels), step))
        return places, [shortened(self.labels[place]) for place in places]

    def _space(self, along: XAxis | YAxis) -> None:
        """Logarithmically with plain numbers, or with whole ones."""
        if self.logarithmic:
            along.axes.set(**{f"{along.axis_name}scale": "log"})
            along.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            along.set_major_formatter("{x:g}")
            along.set_minor_formatter(NullFormatter())
        elif self.whole:
            along.set_major_locator(MaxNLocator(integer=True))


def title_of(axis: Axis) -> str:
    """Of an axis of a figure: "deflation rate [kPa/s]"."""
    words = axis.about or axis.name.replace("_", " ")
    return f"{words} [{axis.unit}]" if axis.unit else words


def shortened(label: str) -> str:
    """A level as it fits in a figure."""
    return label if len(label) <= LONGEST_LABEL else label[: LONGEST_LABEL - 1] + "…"


def _sampled(count: int) -> ListedColormap:
    return ListedColormap(colormaps[COLOUR_MAP](np.linspace(0.0, 1.0, count)))
