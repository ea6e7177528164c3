"""Tables of numbers and texts, for terminals, pages and CSV files."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rich.table import Table as Grid
from rich.text import Text


@dataclass(frozen=True)
class Cell:
    """Cell of a table: its text, and the number that it is sorted by; None to sort by the text."""

    text: str
    value: float | None = None


def cell(value: float | str | None, written: str = ".4g", unit: str = "") -> Cell:
    """Return the cell of a text, or of a number in the format `written`, followed by `unit`.

    The cell of None and of a number that is not finite is empty.
    """
    if isinstance(value, str):
        return Cell(value)
    if value is None or not math.isfinite(value):
        return Cell("")
    text = f"{value:{written}}"
    is_zero = not text.strip("-+0.")
    return Cell((text.lstrip("-") if is_zero else text) + unit, float(value))


Row = Sequence[Cell | str]
"""Row of a table."""


@dataclass(frozen=True)
class Table:
    """Table of rows with as many cells or texts each.

    headings: of the columns, each with its unit, such as "speed [mm/s]"; none for a list of names
    and texts.
    """

    rows: Sequence[Row]
    headings: Sequence[str] = ()
    caption: str = ""
    title: str = ""

    @property
    def cells(self) -> list[list[Cell]]:
        """Cells of all rows."""
        return [[Cell(one) if isinstance(one, str) else one for one in row] for row in self.rows]

    def __rich__(self) -> Grid:
        """Return the table for a terminal, with numbers aligned at the right.

        Numbers and the first column below headings are not wrapped.
        """
        grid = Grid(
            box=None, show_header=bool(self.headings),
            title=Text(self.title, "table.title") if self.title else None,
            caption=Text(self.caption, "table.caption") if self.caption else None,
            title_justify="left", caption_justify="left",
        )  # fmt: skip
        columns = list(zip(*self.cells, strict=True))
        for k, heading in enumerate(self.headings or [""] * len(columns)):
            column = columns[k] if columns else ()
            has_numbers = all(one.value is not None or not one.text for one in column)
            grid.add_column(
                Text(heading_lines(heading) if has_numbers else heading),
                justify="right" if has_numbers else "left",
                no_wrap=has_numbers or (k == 0 and bool(self.headings)),
                overflow="fold",
            )
        for row in self.cells:
            grid.add_row(*(Text(one.text) for one in row))
        return grid

    def csv(self) -> str:
        """Return the table as CSV; its texts must have no commas."""
        lines = [self.headings, *([one.text for one in row] for row in self.cells)]
        return "".join(f"{','.join(line)}\n" for line in lines)


def heading_lines(heading: str) -> str:
    """Return a heading of numbers with a word a line and its unit last, unless it has lines."""
    if "\n" in heading:
        return heading
    name, _, unit = heading.removesuffix("]").partition(" [")
    return "\n".join([*name.split(), *([unit] if unit else [])])
