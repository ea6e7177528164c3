"""What the curves are drawn from."""

import numpy as np
import pytest

from softsim.report.curves import energies_drawn, joules, pressurised


def test_energies_that_a_run_does_not_have_are_left_out() -> None:
    columns = {"internal_energy": 1.0, "kinetic_energy": 1e-3, "friction_dissipation": 0.0}
    history = {name: np.full(3, size) for name, size in columns.items()}
    assert list(energies_drawn(history)) == ["internal_energy", "kinetic_energy"]
    assert not energies_drawn({"internal_energy": np.zeros(3)})


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
