"""The verdict of a layout, as a table for people."""

from collections.abc import Mapping
from typing import Any

from rich.table import Table

from softsim.report.table import segments


def segments_table(report: Mapping[str, Any]) -> Table:
    """A row a segment, of `layout` as the summary keeps it, with units below the headings."""
    content = segments(report)
    first, *others = content.headings
    table = Table(first, box=None)
    for heading in others:
        name, _, unit = heading.rstrip("]").partition(" [")
        table.add_column(f"{name}\n{unit}", justify="right")
    for row in content.rows:
        table.add_row(*(cell.text for cell in row))
    return table
