"""What the curves are drawn from."""

from pathlib import Path

import numpy as np
import pytest

from softsim.errors import OutputError
from softsim.report.curves import (
    displacement,
    draw_contact_rows,
    draw_energies,
    joules,
    pressurised,
    travelling_column,
)


def test_the_frame_is_followed_and_without_one_the_body() -> None:
    nothing, moving = np.full(3, np.nan), np.arange(3.0)
    assert travelling_column({"frame_x": moving, "body_x": moving}) == "frame_x"
    assert travelling_column({"frame_x": nothing, "body_x": moving}) == "body_x"
    with pytest.raises(OutputError, match="neither frame_x nor body_x"):
        travelling_column({"frame_x": nothing})


def test_displacement_starts_at_zero_with_the_first_number() -> None:
    moved = displacement({"frame_x": np.array([np.nan, 2.0, 2.5])})
    np.testing.assert_array_equal(moved, [np.nan, 0.0, 0.5])


@pytest.mark.parametrize("pressure", [np.zeros(3), np.full(3, np.nan)])
def test_no_pressure_is_no_pressure(pressure: np.ndarray) -> None:
    assert not pressurised({"pressure": pressure})
    assert not pressurised({})
    assert pressurised({"pressure": np.array([0.0, 1.0, np.nan])})


@pytest.mark.parametrize(
    ("largest", "unit"), [(20.0, "J"), (1.0, "J"), (3e-3, "mJ"), (2e-6, "µJ"), (0.0, "nJ")]
)
def test_energies_read_as_numbers_of_a_few_digits(largest: float, unit: str) -> None:
    assert joules(largest)[1] == unit
    assert largest * joules(largest)[0] < 1000.0


@pytest.mark.parametrize("draw", [draw_energies, draw_contact_rows])
def test_a_figure_without_data_says_which_columns_it_needs(draw, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="none of"):
        draw({"time": np.arange(3.0), "internal_energy": np.full(3, np.nan)}, tmp_path / "a.png")
    assert not list(tmp_path.iterdir())
