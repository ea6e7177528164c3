"""Values of a factor: as a study writes them, in one unit, and all that there can be."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydantic_core import PydanticCustomError

from softsim import units
from softsim.errors import SceneError
from softsim.scene.quantities import Quantity
from softsim.scene.structure import Place
from softsim.scene.tree import Tree
from softsim.study.cases import Value


@dataclass(frozen=True)
class Reading:
    """How the numbers of a key are read and written.

    unit: of the numbers, empty where `quantity` is None; is_whole: they are whole numbers.
    """

    quantity: Quantity | None = None
    unit: str = ""
    is_whole: bool = False

    def number(self, written: Tree) -> float:
        """The number of a value, in `unit`. SceneError: it is none, or of another kind."""
        value = written.value
        if self.quantity is not None:
            quantity_of(written, self.quantity)
            return units.number_in(str(value), self.unit, self.quantity.unit)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise SceneError(f"{value!r} must be a number", location=written.origin)
        if self.is_whole and not isinstance(value, int):
            raise SceneError(f"{value!r} must be a whole number", location=written.origin)
        return value

    def text(self, number: float) -> str:
        """A number as the scene has it: "3 mm"."""
        return f"{number:.15g} {self.unit}".rstrip()


def quantity_of(written: Tree, quantity: Quantity) -> float | str:
    """What a quantity says, SI. SceneError: it is none, or of another kind, or out of bounds."""
    try:
        return quantity.read(written.value)
    except PydanticCustomError as error:
        context = error.context or {}
        raise SceneError(context["problem"], context["hint"], written.origin) from None


def reading_of(place: Place | None, written: Sequence[Tree]) -> Reading | None:
    """How the values of a key at `place` are read; None where they are labels: texts, or "auto"
    among quantities. The first value gives the unit. SceneError: that one is no such quantity.
    """
    quantity = place.quantity if place is not None else None
    if quantity is not None:
        if quantity.word in [one.value for one in written]:
            return None
        quantity_of(written[0], quantity)
        return Reading(quantity, units.unit_of(str(written[0].value)))
    if all(isinstance(one.value, int | float) for one in written):
        return Reading(is_whole=place is not None and place.is_whole)
    return None


@dataclass(frozen=True)
class Interval:
    """The numbers from `low` to `high`, both included; logarithmic: in equal ratios."""

    low: float
    high: float
    logarithmic: bool = False
    is_whole: bool = False

    def at(self, share: float) -> float:
        """The number at a share of the way, from 0 to below 1."""
        if self.is_whole:
            return self.low + int(share * (self.high - self.low + 1))
        if self.logarithmic:
            return rounded(self.low * (self.high / self.low) ** share)
        return rounded(self.low + share * (self.high - self.low))

    def levels(self, count: int) -> tuple[float, ...]:
        """`count` numbers, evenly spaced, of which the first and last are the ends."""
        space = np.geomspace if self.logarithmic else np.linspace
        inner = [rounded(float(number)) for number in space(self.low, self.high, count)[1:-1]]
        return (self.low, *inner, self.high)


Space = tuple[Value, ...] | Interval


def at(space: Space, share: float) -> Value:
    """The value at a share from 0 to below 1: values have equal parts of it."""
    return space.at(share) if isinstance(space, Interval) else space[int(share * len(space))]


def rounded(number: float) -> float:
    """To six digits: what is between two ends is a choice, and reads better so."""
    return float(f"{number:.6g}") if math.isfinite(number) else number
