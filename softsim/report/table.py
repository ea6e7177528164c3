"""Tables for people, on a page or in a console."""

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Cell:
    """What a cell shows, and the number that it is sorted by; None: it is sorted by its text."""

    text: str
    value: float | None = None


EMPTY = Cell("")
"""Stands last, however the column is sorted."""


@dataclass(frozen=True)
class Table:
    """A table: a caption, headings, and rows of as many cells each."""

    caption: str
    headings: Sequence[str]
    rows: Sequence[Sequence[Cell]]


def cell(value: float | str | None, written: str = ".4g") -> Cell:
    """A number as the format `written` shows it, or a text; nothing where there is none."""
    if isinstance(value, str):
        return Cell(value)
    if value is None or not math.isfinite(value):
        return EMPTY
    text = f"{value:{written}}"
    return Cell(text.lstrip("-") if float(text) == 0.0 else text, float(value))
