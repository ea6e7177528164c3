"""What the curves are drawn from."""

import numpy as np
import pytest

from softsim.errors import OutputError
from softsim.report.curves import (
    displacement,
    energies_drawn,
    joules,
    pressurised,
    travelling_column,
    travels,
)


def test_the_frame_is_followed_and_without_one_the_body() -> None:
    nothing, moving = np.full(3, np.nan), np.arange(3.0)
    assert travelling_column({"frame_x": moving, "body_x": moving}) == "frame_x"
    assert travelling_column({"frame_x": nothing, "body_x": moving}) == "body_x"
    with pytest.raises(OutputError, match="neither frame_x nor body_x"):
        travelling_column({"frame_x": nothing})


def test_a_frame_is_followed_along_x_if_it_can_move_there() -> None:
    creeping, swinging, held = np.linspace(0, 1e-5, 9), np.linspace(0, 1e-3, 9), np.full(9, 2.0)
    assert travelling_column({"frame_x": creeping, "frame_y": swinging}) == "frame_x"
    assert travelling_column({"frame_x": held, "frame_y": swinging}) == "frame_y"
    assert travelling_column({"frame_x": held}) == "frame_x"


def test_a_body_is_followed_where_it_comes_to_or_swings_furthest() -> None:
    little, far = np.linspace(0, 1e-4, 9), np.linspace(0, -1e-3, 9)
    assert travelling_column({"body_x": little, "body_y": far, "body_z": little}) == "body_y"
    bobbing = 1e-3 * np.sin(np.linspace(0.0, 2.0 * np.pi, 9))
    assert travelling_column({"body_x": -4.0 * little, "body_y": bobbing}) == "body_x"  # a crawler
    assert travelling_column({"body_x": little, "body_y": bobbing}) == "body_y"  # a beam


@pytest.mark.parametrize(("far", "seen"), [(1e-3, True), (-1e-3, True), (1e-10, False)])
def test_round_off_is_no_travel(far: float, seen: bool) -> None:
    assert travels({"body_y": 0.01 + np.linspace(0.0, far, 9)}) is seen
    assert not travels({"pressure": np.ones(9)})


def test_energies_that_a_run_does_not_have_are_left_out() -> None:
    columns = {"internal_energy": 1.0, "kinetic_energy": 1e-3, "friction_dissipation": 0.0}
    history = {name: np.full(3, size) for name, size in columns.items()}
    assert list(energies_drawn(history)) == ["internal_energy", "kinetic_energy"]
    assert not energies_drawn({"internal_energy": np.zeros(3)})


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
