"""The folder of a study: files that are damaged are told."""

import polars
import pytest

from softsim.errors import OutputError
from softsim.output.folder import (
    STUDY,
    TABLE,
    TABLE_TEXT,
    StudyRecord,
    inert,
    read_study,
    read_table,
    write_study,
    write_table,
)


def cut(file):
    """Leave the first half of a file."""
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])


def test_a_damaged_record_is_told(tmp_path):
    record = StudyRecord("title", "study.yaml", (), ())
    write_study(tmp_path, record)
    assert read_study(tmp_path) == record
    cut(tmp_path / STUDY)
    with pytest.raises(OutputError, match=r"study\.json is damaged") as told:
        read_study(tmp_path)
    assert "start the study again" in told.value.hint


def test_a_record_of_something_else_is_told(tmp_path):
    (tmp_path / STUDY).write_text("{}")
    with pytest.raises(OutputError, match=r"study\.json is not a file written by softsim"):
        read_study(tmp_path)


def test_no_text_of_the_table_is_a_formula_to_a_spreadsheet(tmp_path):
    labels = ['=HYPERLINK("http://x")', "-1+1", "@SUM(A1)", "+1", "soft - or so", None]
    numbers = [-1.5, 2.0, -3e-7, 0.0, 1.0, None]
    table = polars.DataFrame({"=name": labels, "p [kPa]": numbers, "state": ["=1"] * 6})
    write_table(tmp_path, table)
    found = polars.read_csv(tmp_path / TABLE_TEXT)
    assert found.columns == ["'=name", "p [kPa]", "state"]
    assert found["'=name"].to_list() == [*(f"'{label}" for label in labels[:4]), *labels[4:]]
    several = polars.DataFrame({"status": ["=1", "done"], "reason": ["@x", None]})
    assert inert(several).rows() == [("'=1", "'@x"), ("done", None)]
    assert found["p [kPa]"].to_list() == numbers
    assert set(found["state"]) == {"'=1"}
    assert read_table(tmp_path).equals(table)


def test_a_damaged_table_is_told(tmp_path):
    write_table(tmp_path, polars.DataFrame({"case": [1, 2]}))
    cut(tmp_path / TABLE)
    with pytest.raises(OutputError, match=r"table\.parquet is damaged"):
        read_table(tmp_path)
