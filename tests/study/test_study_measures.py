"""Columns that are read from a summary."""

import numpy as np
import pytest

from softsim.study.measures import HistoryColumn, MeasureColumn, taken

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
    assert column.value(SUMMARY, {}) == pytest.approx(value)


@pytest.mark.parametrize(
    ("take", "value"),
    [("first", 3.0), ("last", None), ("mean", 2.0), ("min", 1.0), ("max", 3.0)],
)
def test_what_is_taken_of_a_list(take, value):
    assert taken([3.0, 1.0, None], take) == value
    assert taken([None, None], take) is taken([], take) is None


TIME = np.linspace(0.0, 1.0, 11)
HISTORY = {"time": TIME, "body_x": np.where(TIME < 0.3, 0.0, 2e-3 * (TIME - 0.3))}


@pytest.mark.parametrize(
    ("take", "window", "value"),
    [
        ("slope", {"begin": 0.3}, 2.0),
        ("slope", {"end": 0.2}, 0.0),
        ("slope", {"begin": 0.95}, None),
        ("last", {"end": 0.8}, 1.0),
        ("max", {}, 1.4),
        ("mean", {"begin": 0.55, "end": 0.85}, 0.8),
    ],
)
def test_what_is_taken_of_a_window_of_the_history(take, window, value):
    column = HistoryColumn("a", "mm", of="body_x", take=take, size=1e-3, **window)
    assert column.reads_history and column.value(SUMMARY, {}) is None
    assert column.value(SUMMARY, HISTORY) == pytest.approx(value)
