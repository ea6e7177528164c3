"""Tensile tests from tables: formats that are read, and what is refused where."""

import numpy as np
import pytest

from softsim.errors import MaterialError
from softsim.materials.fitting import TensileTest, read_tensile_test

DATABASE = """PARAMETER;INFO;URL;;
Lab;Chambéry;;;
;;;;
Time (s);True Strain;True Stress (MPa);Engineering Strain;Engineering Stress (MPa)
0.1;0.0953;0.0022;0.1;0.002
0.2;0.1823;0.006;0.2;0.005
;;;;
"""


@pytest.fixture
def table(tmp_path):
    def write(text, encoding="utf-8"):
        path = tmp_path / "Some_Silicone.csv"
        path.write_bytes(text.encode(encoding))
        return path

    return write


def refusal(path, **options):
    with pytest.raises(MaterialError) as caught:
        read_tensile_test(path, **options)
    assert caught.value.exit_code == 2
    return str(caught.value)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_a_file_of_the_database(table, encoding):
    test = read_tensile_test(table(DATABASE, encoding))
    assert test.strain.tolist() == [0.1, 0.2]
    assert test.stress == pytest.approx([2e3, 5e3])
    assert test.title == "Some Silicone"


def test_named_columns_commas_and_percent(table):
    path = table("sigma;eps [%]\n1,5;10\n2,5;2,0e1\n")
    test = read_tensile_test(path, "eps", "sigma", stress_unit="kPa")
    assert test.strain == pytest.approx([0.1, 0.2])
    assert test.stress == pytest.approx([1500.0, 2500.0])


@pytest.mark.parametrize("delimiter", [",", "\t", "|"])
def test_delimiters(table, delimiter):
    path = table("e|s [Pa]\n0.1|7\n".replace("|", delimiter))
    assert read_tensile_test(path, "e", "s", None, delimiter).stress.tolist() == [7.0]
    if delimiter != "|":
        assert read_tensile_test(path, "e", "s").stress.tolist() == [7.0]


def test_a_missing_column_is_named_with_its_line(table):
    path = table(DATABASE)
    message = refusal(path, stress_column="Enginering Stress")
    assert f"{path}:4:1: there is no column 'Enginering Stress'" in message
    assert "did you mean 'Engineering Stress (MPa)'?" in message


def test_no_column_at_all(table):
    assert "--strain-column" in refusal(table("a,b\n1,2\n"))


@pytest.mark.parametrize(
    ("unit", "says"), [("mm", "is a length"), ("Mpaa", "unknown unit"), ("", "needs a unit")]
)
def test_a_wrong_unit(table, unit, says):
    message = refusal(table(DATABASE), stress_unit=unit)
    assert says in message
    assert "--stress-unit" in message


def test_a_wrong_unit_in_the_heading_is_shown(table):
    path = table("e,s (mm)\n0.1,1\n")
    assert f"{path}:1:3: " in refusal(path, strain_column="e", stress_column="s")


def test_no_unit(table):
    message = refusal(table("e,s\n0.1,1\n"), strain_column="e", stress_column="s")
    assert "give it with --stress-unit" in message


@pytest.mark.parametrize("cell", ["abc", "nan", "inf", "", "1,2,3"])
def test_a_cell_that_is_no_number_has_its_line(table, cell):
    path = table(DATABASE.replace("0.1823;0.006;0.2;0.005", f"0.1823;0.006;0.2;{cell}"))
    message = refusal(path)
    assert f"{path}:6:22: '{cell}' is not a number" in message
    assert f"    6 | 0.2;0.1823;0.006;0.2;{cell}" in message


def test_a_short_row(table):
    message = refusal(table("e,s [Pa]\n0.1,1\n0.2\n"), strain_column="e", stress_column="s")
    assert "the row has 1 cells" in message


def test_no_rows_no_file_no_delimiter(table, tmp_path):
    heading = table("e,s [Pa]\n")
    assert "no rows" in refusal(heading, strain_column="e", stress_column="s")
    assert "cannot read" in refusal(tmp_path / "none.csv")
    assert "cannot read" in refusal(tmp_path)
    assert "delimiter" in refusal(heading, delimiter="")


def test_first_loading_ends_at_the_largest_stress_and_leaves_out_reloading():
    test = TensileTest(
        np.array([0.0, 0.2, 0.1, 0.2, 0.3, 0.4, 0.5]),
        np.array([0.0, 2.0, 0.5, 1.9, 3.0, 4.0, 0.1]), "two cycles, then it breaks",
    )  # fmt: skip
    assert test.first_loading().strain.tolist() == [0.0, 0.2, 0.3, 0.4]


@pytest.mark.parametrize(
    "rows", ["-0.2,-3\n-0.1,-1\n", "0.1,1\n0.2,3\n", "0.1,-1\n0.2,-3\n", "-0.1,-1\n-0.2,-3\n"]
)
def test_compression_is_stored_positive_from_its_start(table, rows):
    path = table(f"e,s [Pa]\n{rows}")
    test = read_tensile_test(path, "e", "s", mode="compression")
    assert (test.strain.tolist(), test.stress.tolist()) == ([0.1, 0.2], [1.0, 3.0])
    assert test.first_loading().mode == "compression"


def test_a_compressive_strain_without_its_per_cent(table):
    path = table("e,s [Pa]\n-10,-1\n-20,-3\n")
    assert "[%]" in refusal(path, strain_column="e", stress_column="s", mode="compression")


def test_an_unknown_mode(table):
    message = refusal(table(DATABASE), mode="shear")
    assert "no mode 'shear'" in message and "planar" in message
