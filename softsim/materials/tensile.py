"""Tests of materials from text tables: engineering strain and engineering stress.

A test is in uniaxial, equibiaxial or planar tension, or in uniaxial compression.

The defaults read the files of the Soft Robotics Materials Database (Marechal et al., Soft
Robotics, doi 10.1089/soro.2019.0115) as they are.
"""

import difflib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from softsim import units
from softsim.errors import Location, MaterialError
from softsim.materials.laws import EQUIBIAXIAL, PLANAR, UNIAXIAL, Law, Mode

STRAIN_COLUMN, STRESS_COLUMN = "Engineering Strain", "Engineering Stress"
DELIMITERS = (";", ",", "\t")

COMPRESSION = "compression"
TEST_MODES: Mapping[str, Mode] = {
    **{mode.name: mode for mode in (UNIAXIAL, EQUIBIAXIAL, PLANAR)}, COMPRESSION: UNIAXIAL,
}  # fmt: skip
"""Name of the mode of a test -> its deformation; compression is uniaxial with a stretch below 1."""

# A heading such as "Engineering Stress (MPa)" or "strain [%]".
HEADING = re.compile(r"(?P<name>.*?)\s*[(\[](?P<unit>[^()\[\]]+)[)\]]")


@dataclass(frozen=True, eq=False)
class TensileTest:
    """Test of a material in one mode of deformation.

    strain: engineering strain [-], (points,); stress: engineering stress, force over undeformed
    area [Pa], (points,); both are positive in compression, too. title: name of the specimen;
    source: the file; mode: a name of TEST_MODES.
    """

    strain: np.ndarray
    stress: np.ndarray
    title: str
    source: str = ""
    mode: str = UNIAXIAL.name

    def stress_of(self, law: Law, strain: np.ndarray) -> np.ndarray:
        """Return the engineering stress [Pa] of `law` in the mode of the test, at `strain`."""
        sign = -1.0 if self.mode == COMPRESSION else 1.0
        return sign * TEST_MODES[self.mode].nominal_stress(law, 1.0 + sign * strain)

    def first_loading(self) -> "TensileTest":
        """Return the part up to the largest stress, without points below the largest strain so far.

        It excludes failure, unloading, reloading and the jitter of a strain gauge.
        """
        end = int(np.argmax(self.stress)) + 1
        strain, stress = self.strain[:end], self.stress[:end]
        is_new = np.r_[True, strain[1:] > np.maximum.accumulate(strain)[:-1]]
        return replace(self, strain=strain[is_new], stress=stress[is_new])


@dataclass(frozen=True)
class _Text:
    """Lines of a file, and errors that quote one of them."""

    path: Path
    lines: list[str]

    def refusal(self, line: int, column: int, message: str, hint: str = "") -> MaterialError:
        """Return an error with its location: `line` from 0, `column` from 1."""
        place = Location(self.path, line + 1, column, self.lines[line])
        return MaterialError("\n".join([f"{place}: {message}", *place.excerpt()]), hint)


@dataclass(frozen=True)
class _Header:
    """Heading line: its index, the delimiter, and the indices and units of the two columns."""

    line: int
    delimiter: str
    strain: int
    stress: int
    strain_unit: str | None
    stress_unit: str | None

    def column_of(self, text: str, cell: int) -> int:
        """Return the column (from 1) at which a cell (from 0) of a line begins."""
        return 1 + sum(len(before) + 1 for before in text.split(self.delimiter)[:cell])


def read_tensile_test(
    path: Path,
    strain_column: str = STRAIN_COLUMN,
    stress_column: str = STRESS_COLUMN,
    stress_unit: str | None = None,
    delimiter: str | None = None,
    mode: str = UNIAXIAL.name,
) -> TensileTest:
    """Return the test in the text table `path` (UTF-8 or latin-1).

    Lines above the one that names both columns are skipped. A heading may have a unit in brackets:
    strain in % is converted to a ratio, and stress to Pa. `stress_unit` takes precedence over the
    heading. Without `delimiter` the first of ; , tab with which both columns are found is used. If
    the delimiter is not a comma, a comma in a number is a decimal sign. Strain and stress in
    `mode` "compression" may be negative in the table, and sorted by the stretch.

    Raises
    ------
    MaterialError: no such mode or file, a compressive strain of 1 or more, no line with both
    columns, no or a wrong unit of stress, a cell that is not a number, no rows; the error quotes
    the line if there is one.
    """
    if delimiter == "":
        raise MaterialError("the delimiter is empty", hint="give the character between two cells")
    if mode not in TEST_MODES:
        raise MaterialError(
            f"there is no mode '{mode}' of a test", hint=f"one of {', '.join(TEST_MODES)}"
        )
    text = _read(path)
    header = _find_header(text, strain_column, stress_column, delimiter)
    strain_factor = 0.01 if header.strain_unit == "%" else 1.0
    stress_factor = _pascals(text, header, stress_unit)
    rows = [
        (_number(text, header, line, header.strain), _number(text, header, line, header.stress))
        for line in range(header.line + 1, len(text.lines))
        if text.lines[line].strip(f" {header.delimiter}\t")
    ]
    if not rows:
        raise text.refusal(header.line, 1, "no rows follow below the column headings")
    strain, stress = np.array(rows).T * np.array([[strain_factor], [stress_factor]])
    if mode == COMPRESSION:
        strain, stress = (x * (-1.0 if x[np.argmax(np.abs(x))] < 0.0 else 1.0)
                          for x in (strain, stress))  # fmt: skip
        if (np.diff(strain) < 0.0).all():  # sorted by the stretch, not recorded in time
            strain, stress = strain[::-1], stress[::-1]
        if strain.max() >= 1.0:
            raise MaterialError(
                f"{path}: a compressive strain of {strain.max():.3g} is not below 1",
                hint="a strain without a unit is a ratio; write the unit after the heading, "
                "such as 'Engineering Strain [%]'",
            )
    return TensileTest(strain, stress, path.stem.replace("_", " "), str(path), mode)


def _read(path: Path) -> _Text:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise MaterialError(f"cannot read the test {path}: {error.strerror or error}") from error
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    return _Text(path, text.splitlines())


def _cells(line: str, delimiter: str) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(delimiter)]


def _name_and_unit(heading: str) -> tuple[str, str | None]:
    match = HEADING.fullmatch(heading)
    return (match["name"], match["unit"].strip()) if match else (heading, None)


def _find_column(cells: list[str], name: str) -> int | None:
    """Return the index of the column with this heading, with or without its unit, or None."""
    for index, cell in enumerate(cells):
        if name in (cell, _name_and_unit(cell)[0]):
            return index
    return None


def _find_header(
    text: _Text, strain_column: str, stress_column: str, delimiter: str | None
) -> _Header:
    refusal = MaterialError(
        f"{text.path}: no line contains the column headings '{strain_column}' and "
        f"'{stress_column}'",
        hint="the table needs a line of headings, such as 'Engineering Strain,Engineering Stress "
        "[MPa]', and one row per point below it; set other headings with --strain-column and "
        "--stress-column, and a delimiter other than ; , or tab with --delimiter",
    )
    names_one = False
    for line, content in enumerate(text.lines):
        for one in DELIMITERS if delimiter is None else (delimiter,):
            cells = _cells(content, one)
            strain, stress = _find_column(cells, strain_column), _find_column(cells, stress_column)
            if strain is not None and stress is not None:
                found = [_name_and_unit(cells[column])[1] for column in (strain, stress)]
                return _Header(line, one, strain, stress, *found)
            if not names_one and (strain is None) != (stress is None):
                names_one = True
                missing = strain_column if strain is None else stress_column
                refusal = _missing_column(text, line, cells, missing)
    raise refusal


def _missing_column(text: _Text, line: int, cells: list[str], missing: str) -> MaterialError:
    close = difflib.get_close_matches(missing, cells, n=1)
    known = ", ".join(f"'{cell}'" for cell in cells if cell)
    return text.refusal(
        line, 1, f"there is no column '{missing}'",
        f"did you mean '{close[0]}'?" if close else f"the columns are {known}",
    )  # fmt: skip


def _pascals(text: _Text, header: _Header, given: str | None) -> float:
    """Return the size of the unit of the stress column [Pa]."""
    unit = header.stress_unit if given is None else given
    problem = "the stress has no unit"
    if unit is not None:
        try:
            return units.parse(f"1 {unit}", "Pa")
        except ValueError as error:
            problem = str(error)
    if given is not None:
        raise MaterialError(f"--stress-unit {given}: {problem}")
    raise text.refusal(
        header.line, header.column_of(text.lines[header.line], header.stress), problem,
        "give it with --stress-unit, such as --stress-unit MPa",
    )  # fmt: skip


def _number(text: _Text, header: _Header, line: int, cell: int) -> float:
    content = text.lines[line]
    cells = _cells(content, header.delimiter)
    if cell >= len(cells):
        raise text.refusal(
            line, 1, f"the row has {len(cells)} cells; cell {cell + 1} must be a number"
        )
    number = cells[cell] if header.delimiter == "," else cells[cell].replace(",", ".")
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise text.refusal(
            line, header.column_of(content, cell), f"'{cells[cell]}' is not a number",
            "correct the row or delete it",
        )  # fmt: skip
    return value
