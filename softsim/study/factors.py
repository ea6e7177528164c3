"""What varies in a study: the values that each factor takes, and what they set in the scene."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel

from softsim.errors import SceneError
from softsim.scene.loading import keys_at
from softsim.scene.reporting import did_you_mean
from softsim.scene.resolved import flow_text
from softsim.scene.structure import place_in
from softsim.scene.tree import Origin, Tree, child, entries, listed
from softsim.scene.yaml_reading import is_file
from softsim.study.axes import Axis
from softsim.study.cases import Setting, Value, setting
from softsim.study.schema import KeyFactor, VariantsFactor
from softsim.study.values import Interval, Reading, Space, reading_of


@dataclass(frozen=True)
class Choice:
    """What a label stands for: another scene, or values in it."""

    scene: Path | None = None
    settings: tuple[Setting, ...] = ()


@dataclass(frozen=True)
class LabelFactor:
    """A factor whose values are labels: scenes, variants, texts."""

    axis: Axis
    choices: Mapping[str, Choice]

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
        return self.choices[str(value)].scene

    def settings(self, value: Value) -> tuple[Setting, ...]:
        """What a value sets."""
        return self.choices[str(value)].settings


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
    choices = {label: Choice(scene_file(file, folder)) for label, file in files.items()}
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
            label: Choice(settings=tuple(setting(*entry) for entry in entries(held).items()))
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
                message = f"{key}: the cases of the list give its values"
                raise SceneError(message, "leave it out", held.key_origin)
        return in_list
    if not given:
        hint = f"give one of {', '.join(SPACINGS)}"
        raise SceneError(f"{name} has no values", hint, tree.key_origin)
    (first, _), *others = given.items()
    for key, held in others:
        raise SceneError(f"{key}: {first} has its values already", "give one", held.key_origin)
    if count is not None and part.values is not None:
        raise SceneError("count: means nothing beside values", "leave it out", count.key_origin)
    return listed(tree, first)


def labels_of_key(name: str, part: KeyFactor, path: Tree, written: Sequence[Tree]) -> LabelFactor:
    """A key whose values are texts. SceneError: a range of them."""
    if _is_range(part):
        raise SceneError("a range has two numbers", "give values", written[0].origin)
    if part.values is not None:
        _refuse_twice([one.text for one in written], written)
    choices = {
        one.text: Choice(settings=(Setting(part.key, flow_text(one), path.origin, one.origin),))
        for one in written
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
    if _is_range(part):
        space = _between(part, reading, numbers, written)
    origins = {number: one.origin for number, one in zip(numbers, written, strict=True)}
    return NumberFactor(axis, part.key, path.origin, reading, space, origins)


def _is_range(part: KeyFactor) -> bool:
    return part.range is not None or part.log_range is not None


def _between(
    part: KeyFactor, reading: Reading, ends: Sequence[float], written: Sequence[Tree]
) -> Space:
    """The interval of a range, or its levels where it has a count."""
    low, high = ends
    if not low < high:
        raise SceneError("a range rises: its second end is above its first", "", written[1].origin)
    if part.log_range is not None and not (low > 0.0 and not reading.is_whole):
        hint = "equal ratios begin above 0, and whole numbers do not have them"
        raise SceneError("no value for log_range", hint, written[0].origin)
    interval = Interval(low, high, part.log_range is not None, reading.is_whole)
    if part.count is None:
        return interval
    levels = interval.levels(part.count)
    broken = [level for level in levels if reading.is_whole and not float(level).is_integer()]
    if broken:
        message = f"{part.count} values of it are not whole: {broken[0]:g}"
        raise SceneError(message, "give values, or another count", written[1].origin)
    return levels


def _refuse_twice(values: Sequence[Value], written: Sequence[Tree]) -> None:
    """Each value once. SceneError where it is written again."""
    seen: set[Value] = set()
    for value, one in zip(values, written, strict=True):
        if value in seen:
            raise SceneError(f"{one.text} is given twice", location=one.origin)
        seen.add(value)
