"""One case of a study: the scene it starts from and what it sets there."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

Value = float | str


@dataclass(frozen=True)
class Source:
    """A scene file, with the standard robot that is put into it where it is a bare layout."""

    scene: Path
    robot: str | None = None


@dataclass(frozen=True)
class Case:
    """A row of the table to be.

    number: from 1, in the order of the table. values: factor -> its number, in the unit of its
    column, or its label; with repeats also "repeat" -> 1, 2, ... overrides: "time.end=3 s" each, as
    for `load_scene`; later ones win.
    """

    number: int
    source: Source
    overrides: tuple[str, ...] = ()
    values: Mapping[str, Value] = field(default_factory=dict)
