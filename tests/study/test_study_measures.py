"""Columns that are read from a summary."""

import pytest

from softsim.study.measures import MeasureColumn, taken

SUMMARY = {
    "frame_displacement": 0.0123,
    "end_pressure": [12.5e3, None, 11e3],
    "slip_share": None,
    "layout": {"verdict": "stuck", "where": {"segment": 2}},
}


@pytest.mark.parametrize(
    ("column", "value"),
    [
        (MeasureColumn("a", "mm", of="frame_displacement", size=1e-3), 12.3),
        (MeasureColumn("a", "kPa", of="end_pressure", take="last", size=1e3), 11.0),
        (MeasureColumn("a", is_label=True, of="layout.verdict"), "stuck"),
        (MeasureColumn("a", of="layout.where.segment"), 2.0),
        (MeasureColumn("a", of="slip_share"), None),
        (MeasureColumn("a", of="layout.blocked_by"), None),
        (MeasureColumn("a", of="none.of.these"), None),
        (MeasureColumn("a", of="frame_displacement.x"), None),
    ],
)
def test_a_value_in_the_unit_of_its_column(column, value):
    assert column.value(SUMMARY) == pytest.approx(value)


@pytest.mark.parametrize(
    ("take", "value"),
    [("first", 3.0), ("last", None), ("mean", 2.0), ("min", 1.0), ("max", 3.0)],
)
def test_what_is_taken_of_a_list(take, value):
    assert taken([3.0, 1.0, None], take) == value
    assert taken([None, None], take) is taken([], take) is None
