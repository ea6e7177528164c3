"""Where the values of a factor or a measure lie in a diagram: numbers as they are, labels one after
another.
"""

import re
from dataclasses import dataclass

import numpy as np
import polars

from softsim.report.diagram import Scale
from softsim.study.axes import Axis

NUMBER = re.compile(r"[-+]?\d+(\.\d*)?")
"""What a label may begin with."""


@dataclass(frozen=True, kw_only=True)
class AxisScale(Scale):
    """The scale of a factor or a measure."""

    axis: Axis

    @classmethod
    def of(cls, axis: Axis, values: polars.Series) -> "AxisScale":
        """For all values that the axis has in the table; labels in the order of the table or of the
        numbers that they begin with.
        """
        if not axis.is_label:
            known = values.drop_nulls()
            whole = bool((known == known.round()).all())
            return cls(
                title=title_of(axis), logarithmic=axis.logarithmic, whole=whole, axis=axis
            )  # fmt: skip
        labels = values.drop_nulls().cast(polars.String).unique(maintain_order=True).to_list()
        numbers = [float(found[0]) for found in map(NUMBER.match, labels) if found]
        if len(numbers) == len(labels):
            labels = [labels[at] for at in np.argsort(numbers, kind="stable")]
        return cls(title=title_of(axis), labels=tuple(labels), axis=axis)

    def places(self, values: polars.Series) -> np.ndarray:
        """Where values lie (n,); NaN where there is none."""
        if self.labels is not None:
            at = {label: float(place) for place, label in enumerate(self.labels)}
            return np.array([at.get(value, np.nan) for value in values], dtype=float)
        return values.cast(polars.Float64).to_numpy(writable=True)

    def place(self, value: float | str | None) -> float:
        """Where a single value lies."""
        return float(self.places(polars.Series([value]))[0])


def title_of(axis: Axis) -> str:
    """Of an axis of a diagram: "deflation rate [kPa/s]"."""
    words = axis.about or axis.name.replace("_", " ")
    return f"{words} [{axis.unit}]" if axis.unit else words
