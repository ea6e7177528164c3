"""Library of silicones: its sources, their spread, and entries that no scene may lose."""

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import stats

from softsim.materials.laws import LAWS, UNIAXIAL
from softsim.materials.library import (
    ModulusSpread,
    SourceSpec,
    drawn_material,
    library_material,
    library_names,
    silicone_of,
    silicones,
    spread_of,
)


def test_the_thesis_keeps_its_constants():
    """Runs of the thesis's robots name this material: its constants must not change."""
    assert library_material("dragon_skin_10").constants == (36e3, 250.0, 23.0)
    assert library_material("dragon_skin_30").constants == (96e3, 9500.0, 0.0)


def test_each_material_is_a_source_of_one_silicone():
    found = [s.name for each in silicones().values() for s in each.sources if s.is_material]
    assert sorted(found) == sorted(library_names())
    for name in library_names():
        assert silicone_of(name) is not None


@pytest.mark.parametrize("silicone", silicones().values(), ids=lambda each: each.name)
def test_each_source_states_where_it_is_from(silicone):
    assert silicone.typical in [source.name for source in silicone.sources]
    for source in silicone.sources:
        assert source.spec.test and source.spec.citation
        assert source.spec.url.startswith("https://") or "thesis" in source.spec.citation
        if source.spec.strains is not None and source.is_material:
            assert source.spec.strains[1] == pytest.approx(source.strain_range, rel=0.01)


def test_the_typical_ecoflex_is_the_long_strip():
    ecoflex = silicone_of("ecoflex_00_30_typical")
    assert ecoflex is silicones()["ecoflex_00_30"]
    spread = ecoflex.spread
    assert 21e3 <= spread.typical <= 23e3
    assert spread.low == library_material("ecoflex_00_30").C10 * 2.0
    assert not spread.agrees
    assert [source.name for source in ecoflex.sources if source.spec.points] == [ecoflex.typical]


def test_the_constants_of_the_strip_are_the_least_squares_of_its_points():
    source = next(s for s in silicones()["ecoflex_00_30"].sources if s.spec.points)
    stretch, stress = np.array(source.spec.points).T
    units = [LAWS["yeoh"](*unit) for unit in ((1.0,), (0.0, 1.0))]
    columns = [UNIAXIAL.nominal_stress(unit, stretch) / stress for unit in units]
    fitted, *_ = np.linalg.lstsq(np.stack(columns, axis=1), np.ones(len(stress)), rcond=None)
    data = library_material(source.name)
    assert [float(f"{c:.3g}") for c in fitted] == pytest.approx([data.C10, data.C20], rel=2e-3)
    error = UNIAXIAL.nominal_stress(source.law, stretch) / stress - 1.0
    assert np.abs(error).max() < 0.06


def test_one_source_has_no_spread():
    assert silicones()["dragon_skin_20"].spread is None
    assert silicones()["dragon_skin_30"].spread.agrees
    assert ModulusSpread(10.0, 11.0, 13.0).agrees and not ModulusSpread(10.0, 11.0, 13.1).agrees
    assert silicone_of("granite") is None


def test_a_source_gives_one_modulus():
    with pytest.raises(ValidationError, match="give one of them"):
        SourceSpec(citation="a", test="b", shear_modulus="1 kPa", youngs_modulus="3 kPa")


def test_draws_of_a_spread_have_a_triangular_logarithm():
    """Quantiles of the draw become those of a triangular distribution (SciPy)."""
    spread = ModulusSpread(10e3, 15e3, 40e3)
    low, peak, high = np.log([spread.low, spread.typical, spread.high])
    triangle = stats.triang((peak - low) / (high - low), low, high - low)
    draws = np.linspace(-6.0, 6.0, 25)
    found = [spread.modulus(draw) for draw in draws]
    assert found == pytest.approx(np.exp(triangle.ppf(stats.norm.cdf(draws))), rel=1e-9)
    assert [ModulusSpread(1.0, 1.0, 2.0).modulus(d) for d in (-40, 40)] == pytest.approx([1.0, 2.0])
    assert ModulusSpread(3.0, 3.0, 3.0).modulus(0.7) == pytest.approx(3.0)


def test_a_drawn_material_keeps_its_spectrum_relative_to_its_modulus():
    points = [["1 Hz", "25 kPa", 0.1], ["10 Hz", "30 kPa", 0.1]]
    own = {"law": "ogden", "mu": ["15 kPa", "5 kPa"], "alpha": [2, -2], "density": "1 g/cm^3",
           "spectrum": {"kind": "table", "points": points}}  # fmt: skip
    entry = drawn_material("own", own, ModulusSpread(40e3, 40e3, 40e3), 0.0)
    assert [float(mu.split()[0]) for mu in entry["mu"]] == pytest.approx([30e3, 10e3])
    assert entry["alpha"] == [2, -2]
    assert entry["spectrum"]["long_term_modulus"] == "20000.0 Pa"
    assert "long_term_modulus" not in own["spectrum"]


def test_a_spread_of_a_scene_rises():
    own = {"law": "neo_hooke", "C10": "10 kPa", "density": "1 g/cm^3"}
    assert spread_of("own", own) is None
    given = {**own, "spread": ["15 kPa", "20 kPa", "30 kPa"]}
    assert spread_of("own", given) == ModulusSpread(15e3, 20e3, 30e3)
    with pytest.raises(ValidationError, match="must rise"):
        spread_of("own", {**own, "spread": ["20 kPa", "15 kPa", "30 kPa"]})
