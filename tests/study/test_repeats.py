"""Repeats: what is drawn, how it spreads, what stays the same."""

import numpy as np
import pytest
from scipy import stats

from softsim.study.cases import resolved
from softsim.study.loading import study_from

FRICTION, THICKNESS = "contact.friction_coefficient", "bodies.block.thickness"


def repeated(folder, count, perturb, seed=1, **factors):
    """A study of block.yaml with repeats."""
    given = factors or {"end": {"key": "time.end", "values": ["1 s", "2 s"]}}
    content = {
        "scene": "block.yaml", "factors": given, "measures": {"moved": {"of": "body_displacement"}},
        "repeats": {"count": count, "seed": seed, "perturb": perturb},
    }  # fmt: skip
    return study_from(content, folder)


def drawn(study):
    """Friction and thickness [m] of all cases (cases, 2)."""
    scenes = [resolved(case).scene for case in study.cases()]
    thicknesses = [scene.bodies["block"].thickness for scene in scenes]
    return np.array([[s.contact.friction_coefficient for s in scenes], thicknesses]).T


def test_all_cases_have_the_same_draws(folder):
    study = repeated(folder, 3, {FRICTION: "10 %", THICKNESS: "0.1 mm"})
    assert study.case_count == 6
    assert [case.number for case in study.cases()] == [1, 2, 3, 4, 5, 6]
    assert [case.values for case in study.cases()][:4] == [
        {"end": 1.0, "repeat": 1}, {"end": 1.0, "repeat": 2}, {"end": 1.0, "repeat": 3},
        {"end": 2.0, "repeat": 1},
    ]  # fmt: skip
    values = drawn(study)
    assert (values[:3] == values[3:]).all()
    assert len(set(values[:, 0])) == len(set(values[:, 1])) == 3


def test_more_repeats_keep_the_earlier_ones(folder):
    few, many = (
        drawn(repeated(folder, n, {FRICTION: "10 %", THICKNESS: "0.1 mm"})) for n in (2, 5)
    )
    assert (few[:2] == many[:2]).all()


def test_draws_are_normal_about_the_value_and_independent(folder):
    """Of 200 draws about 0.5 +- 0.05 and 10 +- 0.1 mm: Kolmogorov-Smirnov, and a correlation that
    by chance is below 0.21 in 997 of 1000 seeds.
    """
    one = {"end": {"key": "time.end", "values": ["1 s"]}}
    values = drawn(repeated(folder, 200, {FRICTION: "10 %", THICKNESS: "0.1 mm"}, **one))
    friction, thickness = (values[:, 0] - 0.5) / 0.05, (values[:, 1] - 0.01) / 1e-4
    assert stats.kstest(friction, "norm").pvalue > 0.01
    assert stats.kstest(thickness, "norm").pvalue > 0.01
    assert abs(np.corrcoef(friction, thickness)[0, 1]) < 0.21


def test_a_perturbed_factor_is_drawn_about_each_of_its_values(folder):
    factor = {"friction": {"key": FRICTION, "values": [0.2, 0.4]}}
    study = repeated(folder, 2, {FRICTION: "10 %"}, **factor)
    shares = drawn(study)[:, 0] / [0.2, 0.2, 0.4, 0.4]
    assert shares[:2] == pytest.approx(shares[2:], rel=1e-12)
    assert [case.values["friction"] for case in study.cases()] == [0.2, 0.2, 0.4, 0.4]


def test_the_seed_decides(folder):
    one, other = (drawn(repeated(folder, 2, {FRICTION: "10 %"}, seed)) for seed in (1, 2))
    assert (one != other)[:, 0].all()


def test_a_spectrum_is_drawn_from_its_uncertainty(folder):
    material = (
        "materials:\n  own: {law: neo_hooke, C10: 20 kPa, density: 1000 kg/m^3, spectrum: {kind: "
        "fractional, relaxation_time: 330 us, order: 0.32, band: [2 Hz, 5 kHz]}}\n"
    )
    scene = folder / "block.yaml"
    scene.write_text(material + scene.read_text().replace("dragon_skin_10", "own"))
    spectrum = "materials.own.spectrum"
    study = repeated(folder, 3, {f"{spectrum}.order": 0.03, f"{spectrum}.relaxation_time": "50 us"})
    spectra = [resolved(case).scene.materials["own"].spectrum for case in study.cases()][:3]
    assert len({s.order for s in spectra}) == len({s.relaxation_time for s in spectra}) == 3
    assert all(0.2 < s.order < 0.44 for s in spectra)
