"""Tables in a terminal and as CSV."""

import io
import math

from rich.console import Console

from softsim.report.table import Cell, Table, cell


def lines(table: Table) -> list[str]:
    console = Console(file=io.StringIO(), width=60)
    console.print(table)
    return console.file.getvalue().splitlines()


def test_nothing_has_no_sign() -> None:
    assert [cell(value, ".2f").text for value in (-0.001, -0.2, 0.0)] == ["0.00", "-0.20", "0.00"]


def test_what_has_no_value_is_empty() -> None:
    assert [cell(value) for value in (None, math.nan, math.inf)] == [Cell("")] * 3
    assert cell(12345, ",", " mm") == Cell("12,345 mm", 12345.0)


def test_numbers_are_at_the_right_below_their_unit() -> None:
    rows = [["[bold] one", cell(1.5), ""], ["two", cell(22.25), "b"]]
    shown = lines(Table(rows, ["name", "mean speed [mm/s]", "set"], title="Speeds"))
    assert [line.rstrip() for line in shown] == [
        "Speeds",
        "              mean",
        "             speed",
        " name         mm/s  set",
        " [bold] one    1.5",
        " two         22.25  b",
    ]


def test_a_list_of_names_and_texts_has_no_headings() -> None:
    assert lines(Table([("mesh", "1 mm"), ("a", "b")])) == [" mesh  1 mm ", " a     b    "]


def test_csv_has_the_headings_first() -> None:
    assert Table([["a", cell(0.1, ".8g")]], ["name", "x [m]"]).csv() == "name,x [m]\na,0.1\n"
