"""Clamped membrane of Fig 4.9: closed forms, an earlier solution, and the verdicts with it."""

import numpy as np
import pytest

from validation.cases import NOT_IN_SUBSET, Outcome
from validation.inflation_radius import SCRIPT, SKIN, SMOOTH, STIFF, membrane, scaled
from validation.membrane import Tube, inflate
from validation.verdicts import AGREES, DISAGREES, UNKNOWN


def test_slopes_are_the_derivatives_of_the_strain_energy():
    """Central differences of W(I1) in lambda_s and lambda_theta."""
    constants = np.array(SKIN.constants)

    def energy(along, hoop):
        above = along**2 + hoop**2 + (along * hoop) ** -2 - 3.0
        return float(constants @ [above, above**2, above**3])

    along, hoop, h = 1.3, 1.9, 1e-3
    found = [float(part) for part in SKIN.slopes(np.array(along), np.array(hoop))]
    ahead, behind = energy(along + h, hoop), energy(along - h, hoop)
    expected = [
        (ahead - behind) / (2 * h),
        (energy(along, hoop + h) - energy(along, hoop - h)) / (2 * h),
        (ahead - 2.0 * energy(along, hoop) + behind) / h**2,
        (
            energy(along + h, hoop + h)
            - energy(along + h, hoop - h)
            - energy(along - h, hoop + h)
            + energy(along - h, hoop - h)
        )
        / (4 * h**2),
    ]
    assert found == pytest.approx(expected, rel=1e-5)


def test_small_pressure_is_that_of_linear_theory():
    """P = E / (1 - nu^2) H / R eps with E = 6 C10 and nu = 1/2: no axial strain between clamps."""
    strain = 2e-3
    tube = Tube(8e-3, 1e-3, 30e-3, (36e3, 0.0, 0.0))
    found = inflate(tube, [tube.radius * (1.0 + strain)])
    linear = 8.0 * 36e3 * tube.thickness / tube.radius * strain
    assert found.pressure[0] == pytest.approx(linear, rel=5.0 * strain)


def test_long_tube_is_a_cylinder():
    """P = 2 W' (H / R) (1 - lambda_theta^-4): far from the clamps there is no axial stretch."""
    tube = Tube(8e-3, 1e-3, 800e-3, SKIN.constants)
    hoop = 1.25
    found = inflate(tube, tube.radius * np.linspace(1.05, hoop, 5))
    above = hoop**2 + hoop**-2 - 2.0
    slope = SKIN.constants[0] + 2.0 * SKIN.constants[1] * above + 3.0 * SKIN.constants[2] * above**2
    cylinder = 2.0 * slope * tube.thickness / tube.radius * (1.0 - hoop**-4)
    assert found.along[-1] == pytest.approx(1.0, abs=5e-3)
    assert found.pressure[-1] == pytest.approx(cylinder, rel=5e-3)


@pytest.mark.parametrize(
    ("outer_radius", "pressure"),
    [(10.3952, 5.4596), (12.7884, 7.9581), (16.4191, 8.6739), (20.1050, 8.5950), (25.0661, 8.9431)],
)
def test_skin_is_that_of_an_earlier_solution(outer_radius, pressure):
    """Values [mm, kPa] found with another program, for the stated constants and 30 mm."""
    assert membrane().pressure_at(outer_radius) == pytest.approx(pressure, rel=2e-4)


def test_rows_and_remarks_of_a_skin_that_is_the_membrane():
    """The verification agrees, the thesis's pressures do not, and the factor is given."""
    curve = membrane()
    history = {"outer_radius": 1e-3 * curve.outer_radius, "pressure": 1e3 * curve.pressure}
    outcomes = {case.name: Outcome(case.name, failure=NOT_IN_SUBSET) for case in SCRIPT.cases()}
    outcomes |= {name: Outcome(name, history=history) for name in (STIFF, SMOOTH)}
    rows = list(SCRIPT.rows(outcomes, None))
    assert [row.verdict for row in rows[:8]] == [AGREES] * 8
    assert all(row.claim.startswith("verification") for row in rows[:8])
    assert [row.verdict for row in rows[8:13]] == [DISAGREES] * 4 + [AGREES]
    assert "thesis: 2.66 times that" in rows[11].computed
    assert {row.verdict for row in rows[13:]} == {UNKNOWN}
    agreement, difference = SCRIPT.remarks(outcomes)
    assert "within 0.0 %" in agreement and "8.67 kPa" in difference
    assert scaled(curve).limit_pressure() == pytest.approx(23.0)
