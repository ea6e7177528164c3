"""From a spectrum in a scene to the branches of a body."""

import numpy as np
import pytest

from softsim.errors import SceneError

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 1 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10}
materials:
  own: {law: neo_hooke, C10: 20 kPa, density: 1000 kg/m^3,
        spectrum: {kind: loss_factor, loss_factor: 0.2, band: [10 Hz, 1 kHz]}}
time: {end: 1 s}
"""
TABLE = (
    "materials.own.spectrum={kind: table, points: [[1 Hz, 46 kPa, 0.07], [10 Hz, 52 kPa, 0.11], "
    "[100 Hz, 63 kPa, 0.19]]}"
)


def complex_modulus(material, frequency):
    """Of the built branches, over the law's shear modulus."""
    mu0 = material.law.initial_shear_modulus
    turned = [2j * np.pi * frequency * b.relaxation_time for b in material.branches]
    moduli = [b.shear_modulus / mu0 for b in material.branches]
    return 1.0 + sum(m * z / (1.0 + z) for m, z in zip(moduli, turned, strict=True))


def test_a_silicone_of_the_library(build):
    """Loss factor 0.10 at 8 Hz and 0.217 at 192 Hz, there 1.65 times as stiff as at rest: all
    within the stated error of the complex modulus. At rest it is the law.
    """
    material = build(SCENE).regions[0].material
    assert material.law.initial_shear_modulus == pytest.approx(72e3)
    assert len(material.branches) == 4
    assert material.spectrum_error < 0.035
    for frequency, storage, loss_factor in ((8.0, 1.236, 0.105), (192.0, 1.653, 0.217)):
        target = storage * (1.0 + 1j * loss_factor)
        error = abs(complex_modulus(material, frequency) / target - 1.0)
        assert error < material.spectrum_error
    says = "4 Maxwell branches of 21.8 us to 119 ms, fitted to the spectrum within 3.4 %"
    assert material.describe() == f"dragon_skin_10, {says}"


def test_a_loss_factor_and_a_table(build):
    own = "bodies.b.material=own"
    lossy = build(SCENE, own).regions[0].material
    modulus = complex_modulus(lossy, 100.0)
    assert modulus.imag / modulus.real == pytest.approx(0.2, abs=lossy.spectrum_error * 1.1)
    assert lossy.spectrum_error <= 0.05
    table = build(SCENE, own, TABLE).regions[0].material
    assert complex_modulus(table, 10.0).real == pytest.approx(52.0 / 40.0, rel=0.05)


def test_a_static_procedure_has_none(build):
    material = build(SCENE, "time.procedure=static").regions[0].material
    assert material.describe() == "dragon_skin_10, elastic"


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("materials.own.spectrum.band=[1 mHz, 1 MHz]", "is allowed"),
        (
            f"{TABLE[:-1]}, long_term_modulus: 50 kPa}}",
            "46 kPa, is not greater than the long-term modulus",
        ),
    ],
)
def test_what_branches_do_not_meet_is_refused(build, override, says):
    with pytest.raises(SceneError) as refusal:
        build(SCENE, "bodies.b.material=own", override, "materials.own.spectrum.largest_error=0.01")
    assert says in str(refusal.value)
    assert refusal.value.location is not None and refusal.value.exit_code == 2
