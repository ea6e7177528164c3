"""Readable tables, for a page or a console."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Cell:
    """Cell of a table: its text, and the number that it is sorted by; None to sort by the text."""

    text: str
    value: float | None = None


EMPTY = Cell("")
"""Empty cell, which is last in every sort order."""


@dataclass(frozen=True)
class Table:
    """Table with a caption, headings, and rows of as many cells each."""

    caption: str
    headings: Sequence[str]
    rows: Sequence[Sequence[Cell]]


def cell(value: float | str | None, written: str = ".4g") -> Cell:
    """Return the cell of a number in the format `written`, or of a text; empty for None."""
    if isinstance(value, str):
        return Cell(value)
    if value is None or not math.isfinite(value):
        return EMPTY
    text = f"{value:{written}}"
    return Cell(text.lstrip("-") if float(text) == 0.0 else text, float(value))


COLUMNS = {
    "from [mm]": ("start", 1e3, ".0f"),
    "to [mm]": ("end", 1e3, ".0f"),
    "centre enters [s]": ("entered", 1.0, ".2f"),
    "centre leaves [s]": ("left", 1.0, ".2f"),
    "mean speed [mm/s]": ("mean_speed", 1e3, ".1f"),
    "most rows": ("most_rows_in_contact", 1.0, ".0f"),
    "least gap [mm]": ("least_clearance", 1e3, ".2f"),
}
"""Name in the report, factor to the unit and format, by heading.

from, to: arc lengths of the centre line; speed: mean; rows: of spikes; gap: between frame and wall.
"""

CAPTION = (
    "Path of the centre of the robot through the layout. Most rows: largest number of rows "
    "of spikes in contact at once. Least gap: smallest distance between frame and wall"
)


def segments(report: Mapping[str, Any]) -> Table:
    """Return the table of a robot's path through a layout, one row per segment.

    report: `layout` of the summary. Cells of segments that were not reached are empty.
    """
    rows = []
    for segment in report["segments"]:
        numbers = [
            cell(None if segment[name] is None else segment[name] * factor, written)
            for name, factor, written in COLUMNS.values()
        ]
        branch = f" ({segment['branch']})" if len(report["exits"]) > 1 else ""
        rows.append([cell(f"{segment['segment']}{branch}  {segment['what']}"), *numbers])
    return Table(CAPTION, ["segment", *COLUMNS], rows)
