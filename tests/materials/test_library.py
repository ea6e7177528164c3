"""Library of silicones: its sources, their spread, and entries that no scene may lose."""

import numpy as np
import pytest
from pydantic import ValidationError

from softsim.materials.law import UNIAXIAL
from softsim.materials.laws import LAWS
from softsim.materials.library import (
    ModulusSpread,
    SourceSpec,
    library_material,
    library_names,
    silicone_of,
    silicones,
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
