"""The way of a robot through a layout, segment by segment."""

from collections.abc import Mapping
from typing import Any

from softsim.report.table import Table, cell

COLUMNS = {
    "from [mm]": ("start", 1e3, ".0f"),
    "to [mm]": ("end", 1e3, ".0f"),
    "entered [s]": ("entered", 1.0, ".2f"),
    "left [s]": ("left", 1.0, ".2f"),
    "speed [mm/s]": ("mean_speed", 1e3, ".1f"),
    "rows": ("most_rows_in_contact", 1.0, ".0f"),
    "gap [mm]": ("least_clearance", 1e3, ".2f"),
}
"""Heading -> name in the report, factor to the heading's unit, how it is written. gap: the least
clearance of the frame."""


def segments(report: Mapping[str, Any]) -> Table:
    """A row a segment, of `layout` as the summary keeps it; what was not reached stays empty."""
    rows = []
    for segment in report["segments"]:
        numbers = [
            cell(None if segment[name] is None else segment[name] * factor, written)
            for name, factor, written in COLUMNS.values()
        ]
        rows.append([cell(f"{segment['segment']}  {segment['what']}"), *numbers])
    return Table("The way through the layout", ["segment", *COLUMNS], rows)
