"""What varies in a study: the values that each factor takes, in one unit, and what they set in the
scene.
"""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import BaseModel
from pydantic_core import PydanticCustomError

from softsim import units
from softsim.errors import SceneError
from softsim.scene.loading import keys_at
from softsim.scene.quantities import Quantity
from softsim.scene.reporting import did_you_mean
from softsim.scene.resolved import flow_text
from softsim.scene.structure import Place, place_in
from softsim.scene.tree import Origin, Tree, child, entries, listed
from softsim.scene.yaml_reading import is_file
from softsim.study.axes import Axis
from softsim.study.cases import Setting, Value, setting
from softsim.study.schema import KeyFactor, VariantsFactor


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


@dataclass(frozen=True)
class LabelFactor:
    """A factor whose values are labels: scenes, variants, texts. choices: what each stands for,
    another scene or values in it.
    """

    axis: Axis
    choices: Mapping[str, Path | tuple[Setting, ...]]

    @property
    def space(self) -> Space:
        """All that it can be."""
        return tuple(self.choices)

    @property
    def tried(self) -> tuple[Value, ...]:
        """The values with which the scene is checked: all."""
        return tuple(self.choices)

    def read(self, written: Tree) -> str:
        """The label that a case of a list names. SceneError: there is none of this name."""
        if written.text not in self.choices:
            raise SceneError(
                f"{self.axis.name} has no value {written.text!r}",
                did_you_mean(written.text, list(self.choices)),
                written.origin,
            )
        return written.text

    def scene(self, value: Value) -> Path | None:
        """The scene file that a value stands for; None where it does not choose one."""
        choice = self.choices[str(value)]
        return choice if isinstance(choice, Path) else None

    def settings(self, value: Value) -> tuple[Setting, ...]:
        """What a value sets."""
        choice = self.choices[str(value)]
        return () if isinstance(choice, Path) else choice


@dataclass(frozen=True)
class NumberFactor:
    """A factor whose values are the numbers of a key, in the unit of its column.

    space: all that it can be. origins: where the study writes those of its numbers that it does.
    """

    axis: Axis
    path: str
    path_origin: Origin
    reading: Reading
    space: Space
    origins: Mapping[float, Origin]

    @property
    def tried(self) -> tuple[Value, ...]:
        """The values with which the scene is checked: the lowest and the highest, as the limits of
        a key are intervals.
        """
        return tuple(dict.fromkeys((min(self.origins), max(self.origins))))

    def read(self, written: Tree) -> float:
        """The number that a case of a list gives. SceneError: it is none of this key."""
        return self.reading.number(written)

    def scene(self, value: Value) -> Path | None:
        """None: it chooses no scene."""
        return None

    def settings(self, value: Value) -> tuple[Setting, ...]:
        """What a value sets."""
        number = float(value)
        origin = self.origins.get(number, self.path_origin)
        return (Setting(self.path, self.reading.text(number), self.path_origin, origin),)


Factor = LabelFactor | NumberFactor

SPACINGS = ("values", "range", "log_range")


def scene_file(named: Tree, folder: Path) -> Path:
    """The scene file that a study in `folder` names. SceneError: there is none."""
    path = Path(os.path.normpath(folder / named.text))
    if not is_file(path):
        raise SceneError(f"there is no file {path}", location=named.origin)
    return path


def scenes_factor(name: str, about: str, tree: Tree, folder: Path) -> LabelFactor:
    """A factor that chooses the scene file. SceneError: there is none."""
    files = entries(tree, "scenes")
    choices = {label: scene_file(file, folder) for label, file in files.items()}
    return LabelFactor(Axis(name, is_label=True, about=about), choices)


def factor_in(
    name: str,
    part: KeyFactor | VariantsFactor,
    tree: Tree,
    root: type[BaseModel],
    base: Tree,
    in_list: Sequence[Tree] | None,
) -> Factor:
    """A factor that sets keys of the scene.

    tree: what the study says of it; root: the class of the scene's file; base: of the scene, with
    what comes before it; in_list: what the cases of a list give it, None in other designs.

    Raises
    ------
    SceneError: no such key, no values, values that are no numbers of one kind.
    """
    if isinstance(part, VariantsFactor):
        choices = {
            label: tuple(setting(*entry) for entry in entries(held).items())
            for label, held in entries(tree, "variants").items()
        }
        return LabelFactor(Axis(name, is_label=True, about=part.about), choices)
    path = child(tree, "key")
    assert path is not None  # pydantic has seen to it
    place = place_in(root, base, keys_at(base, part.key, path.origin, root))
    written = written_values(name, part, tree, in_list)
    reading = reading_of(place, written)
    if reading is None:
        return labels_of_key(name, part, path, written)
    return numbers_of_key(name, part, path, reading, written)


def written_values(
    name: str, part: KeyFactor, tree: Tree, in_list: Sequence[Tree] | None
) -> Sequence[Tree]:
    """The values that the study writes: all of them, or the ends of a range. SceneError: none, or
    too many.
    """
    given = {key: held for key in SPACINGS if (held := child(tree, key)) is not None}
    count = child(tree, "count")
    if in_list is not None:
        for key, held in [*given.items(), ("count", count)]:
            if held is not None:
                message = f"{key}: the cases of the list already give its values"
                raise SceneError(message, "leave it out", held.key_origin)
        return in_list
    if not given:
        hint = f"give one of {', '.join(SPACINGS)}"
        raise SceneError(f"{name} has no values", hint, tree.key_origin)
    (first, _), *others = given.items()
    for key, held in others:
        raise SceneError(
            f"{key}: the values are already given by {first}", "give one", held.key_origin
        )
    if count is not None and part.values is not None:
        raise SceneError("count: has no effect with values", "leave it out", count.key_origin)
    return listed(tree, first)


def labels_of_key(name: str, part: KeyFactor, path: Tree, written: Sequence[Tree]) -> LabelFactor:
    """A key whose values are texts. SceneError: a range of them."""
    if part.range or part.log_range:
        raise SceneError("a range needs two numbers", "give values", written[0].origin)
    if part.values is not None:
        _refuse_twice([one.text for one in written], written)
    choices = {
        one.text: (Setting(part.key, flow_text(one), path.origin, one.origin),) for one in written
    }
    return LabelFactor(Axis(name, is_label=True, about=part.about), choices)


def numbers_of_key(
    name: str, part: KeyFactor, path: Tree, reading: Reading, written: Sequence[Tree]
) -> NumberFactor:
    """A key whose values are numbers. SceneError: an interval that is none."""
    numbers = [reading.number(one) for one in written]
    axis = Axis(name, reading.unit, logarithmic=part.log_range is not None, about=part.about)
    if part.values is not None:
        _refuse_twice(numbers, written)
    space: Space = tuple(numbers)
    if part.range or part.log_range:
        space = _between(part, reading, numbers, written)
    origins = {number: one.origin for number, one in zip(numbers, written, strict=True)}
    return NumberFactor(axis, part.key, path.origin, reading, space, origins)


def _between(
    part: KeyFactor, reading: Reading, ends: Sequence[float], written: Sequence[Tree]
) -> Space:
    """The interval of a range, or its levels where it has a count."""
    low, high = ends
    if not low < high:
        raise SceneError(
            "a range must rise: its second end must be above its first", "", written[1].origin
        )
    if part.log_range is not None and not (low > 0.0 and not reading.is_whole):
        hint = "a log_range must start above 0, and is not possible for whole numbers"
        raise SceneError("no value for log_range", hint, written[0].origin)
    interval = Interval(low, high, part.log_range is not None, reading.is_whole)
    if part.count is None:
        return interval
    levels = interval.levels(part.count)
    broken = [level for level in levels if reading.is_whole and not float(level).is_integer()]
    if broken:
        message = f"{part.count} of its values are not whole numbers: {broken[0]:g}"
        raise SceneError(message, "give values, or another count", written[1].origin)
    return levels


def _refuse_twice(values: Sequence[Value], written: Sequence[Tree]) -> None:
    """Each value once. SceneError where it is written again."""
    seen: set[Value] = set()
    for value, one in zip(values, written, strict=True):
        if value in seen:
            raise SceneError(f"{one.text} is given twice", location=one.origin)
        seen.add(value)
