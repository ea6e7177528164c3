"""Factors of a study: their values, in one unit, and the settings of the scene for each value."""

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
from softsim.scene.loading import flow_text, keys_at
from softsim.scene.quantities import Quantity
from softsim.scene.reporting import did_you_mean
from softsim.scene.text import (
    Origin,
    SchemaLocation,
    Tree,
    child,
    entries,
    is_file,
    listed,
    place_in,
)
from softsim.study.cases import Setting, Value, setting
from softsim.study.schema import KeyFactor, StudyAxis, VariantsFactor


@dataclass(frozen=True)
class Reading:
    """Conversion of the numbers of a key from and to text.

    unit: of the numbers, empty if `quantity` is None. is_whole: True for whole numbers.
    """

    quantity: Quantity | None = None
    unit: str = ""
    is_whole: bool = False

    def number(self, written: Tree) -> float:
        """Return the number of a value, in `unit`. Raises SceneError if it is none of this kind."""
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
        """Return a number as written in a scene: "3 mm"."""
        return f"{number:.15g} {self.unit}".rstrip()


def quantity_of(written: Tree, quantity: Quantity) -> float | str:
    """Return the value of a quantity, SI.

    Raises SceneError if it is no such quantity or out of bounds.
    """
    try:
        return quantity.read(written.value)
    except PydanticCustomError as error:
        context = error.context or {}
        raise SceneError(context["problem"], context["hint"], written.origin) from None


def reading_of(place: SchemaLocation | None, written: Sequence[Tree]) -> Reading | None:
    """Return the reading of the values of a key at `place`; None if they are labels.

    Labels are texts, or quantities with "auto" among them. The first value gives the unit. Raises
    SceneError if that is no such quantity.
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
    """Interval of numbers from `low` to `high`, both included; logarithmic: in equal ratios."""

    low: float
    high: float
    logarithmic: bool = False
    is_whole: bool = False

    def at(self, share: float) -> float:
        """Return the number at a fraction of the interval, from 0 to below 1."""
        if self.is_whole:
            return self.low + int(share * (self.high - self.low + 1))
        return rounded(self.number(share))

    def number(self, share: float) -> float:
        """Return the number at a fraction of the interval, as if numbers were continuous."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** share
        return self.low + share * (self.high - self.low)

    def share(self, number: float) -> float:
        """Return the fraction at which a number is, as if numbers were continuous."""
        if self.logarithmic:
            return math.log(number / self.low) / math.log(self.high / self.low)
        return (number - self.low) / (self.high - self.low)

    def slope(self, share: float) -> float:
        """Return the derivative of `number` over the fraction."""
        if self.logarithmic:
            return self.number(share) * math.log(self.high / self.low)
        return self.high - self.low

    def levels(self, count: int) -> tuple[float, ...]:
        """Return `count` evenly spaced numbers, including both ends."""
        space = np.geomspace if self.logarithmic else np.linspace
        inner = [rounded(float(number)) for number in space(self.low, self.high, count)[1:-1]]
        return (self.low, *inner, self.high)


Space = tuple[Value, ...] | Interval


def at(space: Space, share: float) -> Value:
    """Return the value at a fraction from 0 to below 1; listed values have equal parts of it."""
    return space.at(share) if isinstance(space, Interval) else space[int(share * len(space))]


def rounded(number: float) -> float:
    """Return a number rounded to six digits: the points within a range are free to choose."""
    return float(f"{number:.6g}") if math.isfinite(number) else number


@dataclass(frozen=True)
class LabelFactor:
    """Factor whose values are labels: scenes, variants, texts.

    choices: label -> scene file, or settings of the scene.
    """

    axis: StudyAxis
    choices: Mapping[str, Path | tuple[Setting, ...]]

    @property
    def space(self) -> Space:
        """Possible values."""
        return tuple(self.choices)

    @property
    def tried(self) -> tuple[Value, ...]:
        """Values with which the scene is checked: all."""
        return tuple(self.choices)

    def read(self, written: Tree) -> str:
        """Return the label that a case of a list names. Raises SceneError if it is unknown."""
        if written.text not in self.choices:
            raise SceneError(
                f"{self.axis.name} has no value {written.text!r}",
                did_you_mean(written.text, list(self.choices)),
                written.origin,
            )
        return written.text

    def scene(self, value: Value) -> Path | None:
        """Return the scene file of a value; None if it does not choose one."""
        choice = self.choices[str(value)]
        return choice if isinstance(choice, Path) else None

    def settings(self, value: Value) -> tuple[Setting, ...]:
        """Return the settings of a value."""
        choice = self.choices[str(value)]
        return () if isinstance(choice, Path) else choice


@dataclass(frozen=True)
class NumberFactor:
    """Factor whose values are the numbers of a key, in the unit of its column.

    space: possible values. origins: number -> its location, for numbers written in the study.
    """

    axis: StudyAxis
    path: str
    path_origin: Origin
    reading: Reading
    space: Space
    origins: Mapping[float, Origin]

    @property
    def tried(self) -> tuple[Value, ...]:
        """Values with which the scene is checked: the lowest and the highest.

        They suffice, as the limits of a key are intervals.
        """
        return tuple(dict.fromkeys((min(self.origins), max(self.origins))))

    def read(self, written: Tree) -> float:
        """Return the number that a case of a list gives. Raises SceneError if it is invalid."""
        return self.reading.number(written)

    def scene(self, value: Value) -> Path | None:
        """Return None: a number chooses no scene."""
        return None

    @property
    def size(self) -> float:
        """Size of the unit of its column in the SI unit of the key."""
        quantity = self.reading.quantity
        return 1.0 if quantity is None else units.size_of(self.reading.unit, quantity.unit)

    def settings(self, value: Value) -> tuple[Setting, ...]:
        """Return the settings of a value."""
        number = float(value)
        origin = self.origins.get(number, self.path_origin)
        return (Setting(self.path, self.reading.text(number), self.path_origin, origin),)


Factor = LabelFactor | NumberFactor

SPACINGS = ("values", "range", "log_range")


def scene_file(named: Tree, folder: Path) -> Path:
    """Return the scene file that a study in `folder` names. Raises SceneError if it is missing."""
    path = Path(os.path.normpath(folder / named.text))
    if not is_file(path):
        raise SceneError(f"there is no file {path}", location=named.origin)
    return path


def scenes_factor(name: str, about: str, tree: Tree, folder: Path) -> LabelFactor:
    """Return a factor that chooses the scene file. Raises SceneError if a file is missing."""
    files = entries(tree, "scenes")
    choices = {label: scene_file(file, folder) for label, file in files.items()}
    return LabelFactor(StudyAxis(name, is_label=True, about=about), choices)


def factor_in(
    name: str,
    part: KeyFactor | VariantsFactor,
    tree: Tree,
    root: type[BaseModel],
    base: Tree,
    in_list: Sequence[Tree] | None,
) -> Factor:
    """Return a factor that sets keys of the scene.

    tree: its entry in the study. root: class of the scene's file. base: tree of the scene, with the
    settings before this factor. in_list: its values in the cases of a list, None in other designs.

    Raises
    ------
    SceneError: no such key, no values, values that are no numbers of one kind.
    """
    if isinstance(part, VariantsFactor):
        choices = {
            label: tuple(setting(*entry) for entry in entries(held).items())
            for label, held in entries(tree, "variants").items()
        }
        return LabelFactor(StudyAxis(name, is_label=True, about=part.about), choices)
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
    """Return the values written in the study: all of them, or the ends of a range.

    Raises SceneError if there are none, or they are given twice.
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
    """Return the factor of a key whose values are texts. Raises SceneError for a range."""
    if part.range or part.log_range:
        raise SceneError("a range needs two numbers", "give values", written[0].origin)
    if part.values is not None:
        _refuse_twice([one.text for one in written], written)
    choices = {
        one.text: (Setting(part.key, flow_text(one), path.origin, one.origin),) for one in written
    }
    return LabelFactor(StudyAxis(name, is_label=True, about=part.about), choices)


def numbers_of_key(
    name: str, part: KeyFactor, path: Tree, reading: Reading, written: Sequence[Tree]
) -> NumberFactor:
    """Return the factor of a key whose values are numbers. Raises SceneError for a bad interval."""
    numbers = [reading.number(one) for one in written]
    axis = StudyAxis(name, reading.unit, logarithmic=part.log_range is not None, about=part.about)
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
    """Return the interval of a range, or its levels if it has a count."""
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
    """Raise SceneError at a value that is written twice."""
    seen: set[Value] = set()
    for value, one in zip(values, written, strict=True):
        if value in seen:
            raise SceneError(f"{one.text} is given twice", location=one.origin)
        seen.add(value)
