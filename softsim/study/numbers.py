"""Numbers of a scene's keys, as a study writes them: quantities in one unit, or bare numbers."""

from collections.abc import Sequence
from dataclasses import dataclass

from pydantic_core import PydanticCustomError

from softsim import units
from softsim.errors import SceneError
from softsim.scene.quantities import Quantity
from softsim.scene.structure import Place
from softsim.scene.tree import Tree


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
