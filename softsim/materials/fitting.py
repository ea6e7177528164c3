"""Tests of materials from tables, and constants of a law that are fitted to them."""

import difflib
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from softsim import units
from softsim.errors import Location, MaterialError
from softsim.materials.laws import EQUIBIAXIAL, PLANAR, UNIAXIAL, Law, Mode, NeoHooke

# -------------------------------------------------------------------------------------------------
# Tests of materials from text tables: engineering strain and engineering stress.
#
# A test is in uniaxial, equibiaxial or planar tension, or in uniaxial compression.
#
# The defaults read the files of the Soft Robotics Materials Database (Marechal et al., Soft
# Robotics, doi 10.1089/soro.2019.0115) as they are.


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


# -------------------------------------------------------------------------------------------------
# Constants of a law from one or several tests in different modes, by least squares.
#
# The fit is to the nominal stress of the incompressible solid (materials/laws.py) at l = 1 +
# strain, l = 1 - strain in compression. Where it is linear in the constants of a law, no start
# values are needed; otherwise the best result of several starts is taken.
#
# Toe region: a strain from the crosshead displacement includes 1 to 2 % of slack, visible as a
# curve that starts late. It is not corrected: the initial tangent of the reference curves (Dragon
# Skin, Ecoflex) meets the axis at a strain of 0 to 5 %, depending on the window it is drawn
# through, so it does not determine the slack. Instead, points below `min_strain` are left out,
# since their relative error is that of the toe. For each 1 % of slack C10 is 1 to 3 % too small.


MIN_STRAIN = 0.1
"""Strain below which a test from crosshead travel shows its slack rather than its material."""

SPAN = (1e-6, 1e2)
"""Bounds of the fitted constants as multiples of the start values."""

PREDICTED_WITHIN = 0.1
"""Relative rms error up to which a fit to one test counts as a prediction of another one.

It is a multiple of the 1 to 2 % by which a law misses a single test of a silicone, and below the
tens of per cent by which sources of a silicone differ.
"""

FEWEST_POINTS = 8
"""Minimum number of points of a fit, so that the residual is meaningful."""


@dataclass(frozen=True)
class Fit:
    """Law fitted to a test, with the quality of the fit.

    law: with its constants [Pa]; mode: of the test; min_strain, max_strain: engineering strains [-]
    of the range, and points: measured in it; residual: root mean square [Pa] over the strain;
    relative_residual: that over the root mean square of the stress [-]; worst_error: largest
    |fitted - measured| / measured stress [-], at worst_strain; r_squared: coefficient of
    determination [-].
    """

    law: Law
    mode: str
    min_strain: float
    max_strain: float
    points: int
    residual: float
    relative_residual: float
    worst_error: float
    worst_strain: float
    r_squared: float


def fit_law(
    test: TensileTest,
    law: type[Law],
    max_strain: float,
    min_strain: float = MIN_STRAIN,
    terms: int | None = None,
) -> Fit:
    """Fit `law` to the first loading of `test` between two engineering strains: see `fit_tests`."""
    return fit_tests([test], law, max_strain, min_strain, terms)[0]


def fit_tests(
    tests: Sequence[TensileTest],
    law: type[Law],
    max_strain: float,
    min_strain: float = MIN_STRAIN,
    terms: int | None = None,
    weights: Sequence[float] | None = None,
) -> list[Fit]:
    """Fit one set of constants of `law` to the first loading of several tests.

    Each point is weighted by the strain interval it represents, so that the density of the samples
    has no effect. The sum of squares of a test is divided by that of its stress and multiplied by
    its weight, so that tests of equal weight count with their relative errors.

    Parameters
    ----------
    tests:
        Tests in any modes, at least one.
    law:
        Value of `LAWS`.
    max_strain, min_strain:
        Engineering strains [-] between which the tests are fitted; magnitudes in compression.
    terms:
        Number of fitted terms of the law, the later ones stay 0; None for all. A Yeoh law of two
        terms is often the better choice: the third one of a silicone tends to be negative, and
        makes the stress fall beyond the range.
    weights:
        Positive weight of each test; None for 1 each.

    Returns
    -------
    list[Fit]
        One fit per test, all with the same law.

    Raises
    ------
    MaterialError
        An empty range or one with too few points, a stress in it that is not positive, a wrong
        number of terms or weights, an initial shear modulus <= 0.
    """
    terms = _checked_terms(law, terms)
    weights = [1.0] * len(tests) if weights is None else weights
    if len(weights) != len(tests) or not all(0.0 < w < math.inf for w in weights):
        raise MaterialError(
            f"{len(tests)} tests have the weights {', '.join(f'{w:g}' for w in weights)}",
            hint="give each test one positive weight",
        )
    chosen = [_in_range(test, min_strain, max_strain) for test in tests]
    shares = [_strain_shares(test.strain) for test in chosen]
    squares = [float(share @ t.stress**2) for share, t in zip(shares, chosen, strict=True)]
    # Relative to the first test, so that the weight of a single test is exactly its shares.
    point_weights = np.concatenate([
        share * (w / weights[0] * squares[0] / square)
        for share, w, square in zip(shares, weights, squares, strict=True)
    ])  # fmt: skip
    first = chosen[0]
    unit_slope = TEST_MODES[first.mode].stress_slope(NeoHooke(0.5), np.ones(1))[0]
    starts = law.starts(terms, float(first.stress[0] / (unit_slope * first.strain[0])))
    if starts:
        fitted = _fitted_from(law, starts, chosen, point_weights)
    else:
        fitted = _fitted_linearly(law, terms, chosen, point_weights)
    if fitted.initial_shear_modulus <= 0.0:
        constants = ", ".join(f"{name} = {c:.3g} Pa" for name, c in vars(fitted).items())
        low, high = min(t.strain[0] for t in chosen), max(t.strain[-1] for t in chosen)
        raise MaterialError(
            f"the fit between strains of {low:.3g} and {high:.3g} gives {constants}: "
            "a law needs an initial shear modulus > 0",
            hint="fit a smaller range (--max-strain), ignore more of the start of the curve "
            "(--min-strain), or fit fewer constants (--terms)",
        )
    return [
        _fit_of(fitted, test, min_strain, max_strain, float(whole.first_loading().strain[-1]))
        for test, whole in zip(chosen, tests, strict=True)
    ]


def _fit_of(law: Law, test: TensileTest, low: float, high: float, last: float) -> Fit:
    """Return the quality of `law` in the points of `test`, whose loading ends at `last`."""
    share = _strain_shares(test.strain)
    error = test.stress_of(law, test.strain) - test.stress
    relative = np.abs(error) / test.stress
    worst = int(np.argmax(relative))
    square = float(share @ error**2)
    spread = test.stress - share @ test.stress
    return Fit(
        law=law,
        mode=test.mode,
        min_strain=low,
        max_strain=min(high, last),
        points=len(test.strain),
        residual=square**0.5,
        relative_residual=(square / float(share @ test.stress**2)) ** 0.5,
        worst_error=float(relative[worst]),
        worst_strain=float(test.strain[worst]),
        r_squared=1.0 - square / float(share @ spread**2),
    )


def prediction_errors(
    tests: Sequence[TensileTest],
    law: type[Law],
    max_strain: float,
    min_strain: float = MIN_STRAIN,
    terms: int | None = None,
) -> np.ndarray:
    """Return the relative rms errors (n, n) [-] in test j of `law` fitted to test i alone.

    A row is NaN if its test alone gives no stable fit.

    Raises
    ------
    MaterialError
        As `fit_tests`, except for an initial shear modulus <= 0.
    """
    chosen = [_in_range(test, min_strain, max_strain) for test in tests]
    errors = np.full((len(tests), len(tests)), np.nan)
    for i, test in enumerate(tests):
        try:
            alone = fit_law(test, law, max_strain, min_strain, terms).law
        except MaterialError:
            continue
        for j, other in enumerate(chosen):
            share = _strain_shares(other.strain)
            miss = other.stress_of(alone, other.strain) - other.stress
            errors[i, j] = math.sqrt((share @ miss**2) / (share @ other.stress**2))
    return errors


def _fitted_linearly(
    law: type[Law], terms: int, tests: Sequence[TensileTest], weight: np.ndarray
) -> Law:
    """Return the best fit of a law with stress linear in its constants; weight (all points,)."""
    units = [law.of_constants(unit) for unit in np.eye(terms).tolist()]
    columns = np.stack([_stresses(unit, tests) for unit in units], axis=1)
    # The columns differ by powers of I1 - 3: of a common size, none is lost to rounding.
    size = np.linalg.norm(columns, axis=0)
    root = np.sqrt(weight)
    stress = np.concatenate([test.stress for test in tests])
    solution, *_ = np.linalg.lstsq(columns / size * root[:, None], stress * root, rcond=None)
    return law.of_constants([float(c) for c in solution / size])


def _fitted_from(
    law: type[Law],
    starts: list[tuple[float, ...]],
    tests: Sequence[TensileTest],
    weight: np.ndarray,
) -> Law:
    """Return the best fit from these start constants.

    Each constant keeps its sign, and has at most the magnitude `law.largest_constants`.
    """
    from scipy.optimize import least_squares  # slow to import, and seldom needed

    root = np.sqrt(weight)
    stress = np.concatenate([test.stress for test in tests])

    def error(relative: np.ndarray, start: np.ndarray) -> np.ndarray:
        fitted = law.of_constants((relative * start).tolist())
        return (_stresses(fitted, tests) - stress) * root

    results = []
    for start in map(np.array, starts):
        largest = np.resize(law.largest_constants, len(start)) / np.abs(start)
        bounds = SPAN[0], np.minimum(SPAN[1], largest)
        fit = least_squares(error, np.ones(len(start)), bounds=bounds, args=(start,))
        results.append((fit, start))
    best, start = min(results, key=lambda result: result[0].cost)
    return law.of_constants((best.x * start).tolist())


def _stresses(law: Law, tests: Sequence[TensileTest]) -> np.ndarray:
    """Return the stresses of `law` at the strains of all tests (all points,) [Pa]."""
    return np.concatenate([test.stress_of(law, test.strain) for test in tests])


def _checked_terms(law: type[Law], terms: int | None) -> int:
    most = law.most_terms
    if terms is not None and not 1 <= terms <= most:
        raise MaterialError(f"{terms} terms: this law has {most}", hint=f"give 1 to {most}")
    return most if terms is None else terms


def _in_range(test: TensileTest, low: float, high: float) -> TensileTest:
    """Return the points of first loading in the range, or raise MaterialError."""
    loading = test.first_loading()
    last = min(high, float(loading.strain[-1]))
    where = f"{test.source or test.title}: between strains of {low:g} and {last:.3g}"
    inside = (loading.strain > low) & (loading.strain <= high)
    strain, stress = loading.strain[inside], loading.stress[inside]
    if len(strain) < FEWEST_POINTS:
        raise MaterialError(
            f"{where} there are {len(strain)} points to fit; at least {FEWEST_POINTS} are needed",
            hint=f"the loading part has {len(loading.strain)} points, at strains of "
            f"{loading.strain[0]:.3g} to {loading.strain[-1]:.3g} (1 is 100 %)",
        )
    if (stress <= 0.0).any():
        at = strain[stress <= 0.0][0]
        raise MaterialError(
            f"{where} the stress at a strain of {at:.3g} is not positive",
            hint="start above it (--min-strain), or check the sign and the zero of the load cell",
        )
    return replace(loading, strain=strain, stress=stress)


def _strain_shares(strain: np.ndarray) -> np.ndarray:
    """Return the weight of each point, its fraction of the range (trapezoidal rule); sum 1."""
    steps = np.diff(strain)
    shares = 0.5 * (np.r_[steps, 0.0] + np.r_[0.0, steps])
    return shares / (strain[-1] - strain[0])


# -------------------------------------------------------------------------------------------------
# Material stability of a law: the stretch at which its stress stops rising.
#
# The check is of the material point, not of structures: a balloon has a limit pressure although the
# nominal stress of its rubber rises monotonically.

LARGEST_STRETCH, SMALLEST_STRETCH = 10.0, 0.2
"""Range of stretches that `instability_stretch` searches, beyond those of most robots."""

# Points looked at, then looked at again between the last good and the first bad one: an
# instability narrower than 1/2000 of the range is not found, and a found one is exact to 1e-9.
GRID = 2000
REFINEMENTS = 3


def instability_stretch(
    law: Law, largest_stretch: float = LARGEST_STRETCH, smallest_stretch: float = SMALLEST_STRETCH
) -> dict[str, float | None]:
    """Return the first stretch at which the nominal stress stops rising, or None, for each mode.

    The solid is incompressible. The search covers uniaxial, equibiaxial and planar tension from 1
    up to `largest_stretch`, and uniaxial compression from 1 down to `smallest_stretch`: Drucker's
    criterion along these paths. Keys: "uniaxial tension", "equibiaxial tension", "planar tension",
    "compression".
    """
    tension = np.linspace(1.0, largest_stretch, GRID)
    compression = np.linspace(1.0, smallest_stretch, GRID)
    paths = {f"{mode.name} tension": (mode, tension) for mode in (UNIAXIAL, EQUIBIAXIAL, PLANAR)}
    paths["compression"] = (UNIAXIAL, compression)
    return {
        name: _first_not_positive(partial(mode.stress_slope, law), stretches)
        for name, (mode, stretches) in paths.items()
    }


def first_unstable_I1(law: Law, largest_I1: float) -> float | None:
    """Return the first I1_bar in [3, largest_I1] without positive shear stiffness, or None.

    There W1 + W2 b_k <= 0 (`Law.shear_stiffness`; for a law W(I1_bar) that is W' <= 0, in any
    mode): an element that gets there cannot recover. The stress stops rising earlier than this, see
    `instability_stretch`. The search covers uniaxial tension and compression, which have the
    smallest and the largest I2_bar of all deformations of one I1_bar, and planar tension.
    """

    def smallest(I1: np.ndarray) -> np.ndarray:
        # The positive roots of l^3 - I1 l + 2 = 0, and of l^2 + 1 + l^-2 = I1.
        angle = np.arccos(np.maximum(-((3.0 / I1) ** 1.5), -1.0)) / 3.0
        tension, compression = (
            2.0 * np.sqrt(I1 / 3.0) * np.cos(angle - shift) for shift in (0.0, 2.0 * np.pi / 3.0)
        )
        planar = np.sqrt(0.5 * (I1 - 1.0 + np.sqrt((I1 - 3.0) * (I1 + 1.0))))
        paths = ((UNIAXIAL, tension), (UNIAXIAL, compression), (PLANAR, planar))
        return np.min(
            [law.shear_stiffness(mode.squared_stretches(stretch)) for mode, stretch in paths],
            axis=0,
        )

    return _first_not_positive(smallest, np.linspace(3.0, largest_I1, GRID))


def _first_not_positive(
    function: Callable[[np.ndarray], np.ndarray], points: np.ndarray
) -> float | None:
    """Return the first of `points` (in order) with `function` <= 0, refined, or None."""
    first = None
    for _ in range(1 + REFINEMENTS):
        bad = np.flatnonzero(function(points) <= 0.0)
        if len(bad) == 0:
            return first
        first = float(points[bad[0]])
        points = np.linspace(points[max(bad[0] - 1, 0)], first, GRID)
    return first
