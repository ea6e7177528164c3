"""The folder of a study: its files, its table, and the data for its report.

    study.json               description of the study: `StudyRecord`
    table.parquet, table.csv one row for each case
    cases/KEY/               results of a run, thinned; KEY is the digest of all its inputs

Columns of the table, in this order: `case`, one a factor, one a measure, `verdict` (of layouts
only), `status`, `reason`, `warnings` (how many, if any case has some), `wall_time [s]`, `key`. A
column of numbers with a unit is called "name [unit]".
"""

import io
import re
from dataclasses import asdict, dataclass
from pathlib import Path

import polars

from softsim.errors import OutputError
from softsim.output.folder import RunFolder, read_json, replacing
from softsim.study.axes import Axis, Goal, Plot
from softsim.study.bisection import Bisection

STUDY, TABLE, TABLE_TEXT, CASES = "study.json", "table.parquet", "table.csv", "cases"

FORMULA_STARTS = r"^[=+\-@\t\r\n]"
"""Pattern of the texts that a spreadsheet may take for a formula (OWASP, CSV injection)."""

WARNINGS = "warnings"
"""Column of the number of warnings of each case."""

BEGIN_AGAIN = "remove it and start the study again: completed cases are not run again"


@dataclass(frozen=True)
class StudyRecord:
    """Content of study.json.

    status: running, done or interrupted. wall_time: of all sessions [s]. settings: title -> text,
    shown in the report. case_count: number of cases; the largest possible one for a bisection.
    sampled: True if cases are drawn from the ranges of the factors, so that a fraction of them
    estimates a probability.
    """

    title: str
    source: str
    factors: tuple[Axis, ...]
    measures: tuple[Axis, ...]
    plots: tuple[Plot, ...] = ()
    goal: Goal | None = None
    repeats: int = 1
    case_count: int = 0
    status: str = "running"
    wall_time: float = 0.0
    version: str = ""
    settings: dict[str, str] | None = None
    bisection: Bisection | None = None
    sampled: bool = False


def write_study(folder: Path, record: StudyRecord) -> None:
    """Write study.json. Raises OutputError."""
    RunFolder(folder).write_json_atomic(STUDY, asdict(record))


def read_study(folder: Path) -> StudyRecord:
    """Read study.json. Raises OutputError where there is none, or it is damaged."""
    file = folder / STUDY
    if not file.is_file():
        raise OutputError(f"{folder} is not the folder of a study: it has no {STUDY}")
    found = read_json(file, BEGIN_AGAIN)
    try:
        found["factors"] = tuple(Axis(**axis) for axis in found["factors"])
        found["measures"] = tuple(Axis(**axis) for axis in found["measures"])
        found["plots"] = tuple(Plot(**plot) for plot in found["plots"])
        found["goal"] = Goal(**found["goal"]) if found["goal"] else None
        found["bisection"] = Bisection.read(found.get("bisection"))
        return StudyRecord(**found)
    except (KeyError, TypeError) as error:
        raise OutputError(
            f"{file} is not a file written by softsim: {error}", BEGIN_AGAIN
        ) from error


def write_table(folder: Path, table: polars.DataFrame) -> None:
    """Write the table as Parquet and as text. Raises OutputError."""
    content = io.BytesIO()
    table.write_parquet(content)
    with replacing(folder / TABLE) as partial:
        partial.write_bytes(content.getvalue())
    with replacing(folder / TABLE_TEXT) as partial:
        partial.write_text(inert(table).write_csv(), encoding="utf-8")


def inert(table: polars.DataFrame) -> polars.DataFrame:
    """Return the table with an apostrophe before every text that a spreadsheet would compute.

    Spreadsheets take a text that begins with one of FORMULA_STARTS for a formula and run it.
    Columns of numbers, negative ones among them, stay as they are.
    """
    texts = polars.col(polars.String)
    escaped = table.with_columns(texts.str.replace(FORMULA_STARTS, "'${0}"))
    names = {name: f"'{name}" for name in table.columns if re.match(FORMULA_STARTS, name)}
    return escaped.rename(names)


def read_table(folder: Path) -> polars.DataFrame:
    """Read the table. Raises OutputError where there is none, or it is damaged."""
    file = folder / TABLE
    if not file.is_file():
        raise OutputError(f"{folder} has no {TABLE}: the study has not started")
    try:
        return polars.read_parquet(file)
    except (OSError, polars.exceptions.PolarsError) as error:
        raise OutputError(f"{file} is damaged: {error}", BEGIN_AGAIN) from error


def is_study(folder: Path) -> bool:
    """Return True if `folder` holds a study."""
    return (folder / STUDY).is_file()
