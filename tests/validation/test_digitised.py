"""Digitised points: what is read, what is refused, and how far off is too far."""

import numpy as np
import pytest

from validation.digitised import DigitisedError, deviation, points_of, read_points
from validation.verdicts import AGREES, DISAGREES, UNKNOWN

COLUMNS = ("frequency_Hz", "speed_mm_s")


def written(folder, text):
    path = folder / "mode1_speed.csv"
    path.write_text(text)
    return path


def test_columns_in_any_order_with_a_spread(tmp_path):
    written(tmp_path, "speed_mm_s, spread, frequency_Hz\n3.5, 0.5, 64\n\n1, 0.2, 192\n")
    points = points_of(tmp_path, "mode1_speed", COLUMNS)
    assert points["frequency_Hz"].tolist() == [64.0, 192.0]
    assert points["spread"].tolist() == [0.5, 0.2]


def test_without_a_spread_it_is_zero(tmp_path):
    points = read_points(written(tmp_path, "frequency_Hz,speed_mm_s\n64,3.5\n"), COLUMNS)
    assert points["spread"].tolist() == [0.0]


def test_no_file_is_no_points(tmp_path):
    assert points_of(tmp_path, "mode1_speed", COLUMNS) is None
    assert points_of(None, "mode1_speed", COLUMNS) is None


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("frequency_Hz\n64\n", ":1: "),
        ("frequency_Hz,speed_mm_s,colour\n64,1,2\n", ":1: "),
        ("", ":1: "),
        ("frequency_Hz,speed_mm_s\n", "no points"),
        ("frequency_Hz,speed_mm_s\n64,1\n137,fast\n", ":3: "),
        ("frequency_Hz,speed_mm_s\n64\n", ":2: "),
        ("frequency_Hz,speed_mm_s\n64,nan\n", ":2: "),
    ],
)
def test_what_is_no_table_is_refused(tmp_path, text, where):
    with pytest.raises(DigitisedError, match=where) as caught:
        read_points(written(tmp_path, text), COLUMNS)
    assert caught.value.exit_code == 2


def test_deviation_is_held_against_spread_or_a_fifth():
    points, none = np.array([3.0, 4.0]), np.zeros(2)
    # rms of the points is sqrt(12.5) = 3.54, a fifth of it 0.707.
    assert deviation(points + 0.7, points, none).verdict == AGREES
    assert deviation(points + 0.71, points, none).verdict == DISAGREES
    assert deviation(points + 0.71, points, np.full(2, 0.8)).verdict == AGREES


def test_points_without_a_computed_number_are_counted():
    points, none = np.array([3.0, 4.0]), np.zeros(2)
    finding = deviation(np.array([3.0, np.nan]), points, none, "mm")
    assert finding.verdict == AGREES and "1 of 2 points" in finding.computed
    assert deviation(np.full(2, np.nan), points, none).verdict == UNKNOWN
