"""What varies in a study: the values that each factor takes, and what they set in the scene."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from softsim.errors import SceneError
from softsim.scene.reporting import did_you_mean
from softsim.scene.tree import Origin, Tree
from softsim.study.axes import Axis
from softsim.study.case import Value
from softsim.study.numbers import Reading
from softsim.study.settings import Setting
from softsim.study.spacing import Space


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
