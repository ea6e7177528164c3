"""The verdict of a layout, as a table for people."""

from collections.abc import Mapping
from typing import Any

from rich.table import Table


def segments_table(report: Mapping[str, Any]) -> Table:
    """A row a segment, of `layout` as the summary keeps it; what was not reached stays empty. gap:
    the least clearance of the frame.
    """
    table = Table("segment", box=None)
    for heading in ("from\nmm", "to\nmm", "entered\ns", "left\ns", "speed\nmm/s", "rows\n",
                    "gap\nmm"):  # fmt: skip
        table.add_column(heading, justify="right")
    for segment in report["segments"]:
        table.add_row(
            f"{segment['segment']}  {segment['what']}",
            written(segment["start"], 1e3, 0),
            written(segment["end"], 1e3, 0),
            written(segment["entered"], 1.0, 2),
            written(segment["left"], 1.0, 2),
            written(segment["mean_speed"], 1e3, 1),
            written(segment["most_rows_in_contact"], 1.0, 0),
            written(segment["least_clearance"], 1e3, 2),
        )
    return table


def written(value: float | None, factor: float, digits: int) -> str:
    """A number in the column's unit; nothing where there is none."""
    return "" if value is None else f"{value * factor:.{digits}f}"
