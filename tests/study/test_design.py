"""Which values are put together: grids, lists, designs that fill the space; how repeats spread."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from softsim.errors import SceneError
from softsim.study.cases import resolved
from softsim.study.factors import Interval, at
from softsim.study.loading import study_from

FACTORS = {
    "friction": {"key": "contact.friction_coefficient", "range": [0.0, 1.0]},
    "factor": {"key": "solver.safety_factor", "values": [0.5, 0.7, 0.9]},
    "shown": {"key": "output.snapshot_field", "values": ["stretch", "pressure"]},
}
FRICTION, THICKNESS = "contact.friction_coefficient", "bodies.block.thickness"
MEASURES = {"moved": {"of": "body_displacement"}}


def study(folder, factors, **keys):
    """A study of block.yaml."""
    content = {"scene": "block.yaml", "factors": factors, "measures": MEASURES}
    return study_from({**content, **keys}, folder)


def values(found):
    """Of each case, without names."""
    return [tuple(case.values.values()) for case in found.cases()]


def test_the_last_factor_of_a_grid_varies_fastest(folder):
    factors = {**FACTORS, "friction": {**FACTORS["friction"], "count": 2}}
    found = values(study(folder, factors, design={"kind": "grid"}))
    assert len(found) == 12 and found[:3] == [
        (0.0, 0.5, "stretch"), (0.0, 0.5, "pressure"), (0.0, 0.7, "stretch"),
    ]  # fmt: skip
    assert len(set(found)) == 12


def test_variants_may_set_what_others_set_below(folder):
    """What each sets must only not undo what comes before."""
    deep = {"a": {"time.settle": "1 s"}, "b": {"time": {"end": "2 s"}}}
    found = study(folder, {"v": {"variants": deep}})
    assert [case.overrides for case in found.cases()] == [
        ("time.settle=1 s",), ("time={end: 2 s}",),
    ]  # fmt: skip


def test_a_list_may_have_a_label_twice(folder):
    factors = {"shown": {"key": "output.snapshot_field"}, "end": {"key": "time.end"}}
    cases = [{"shown": "pressure", "end": end} for end in ("1 s", "2 s")]
    assert values(study(folder, factors, design={"kind": "list", "cases": cases})) == [
        ("pressure", 1.0), ("pressure", 2.0),
    ]  # fmt: skip


def test_a_list_is_as_it_is_written(folder):
    factors = {
        "end": {"key": "time.end"},
        "shown": {"variants": {"a": {"output.snapshot_field": "pressure"}, "b": {"title": "x"}}},
    }
    cases = [{"shown": "b", "end": "20 ms"}, {"end": "1 s", "shown": "a"}]
    found = study(folder, factors, design={"kind": "list", "cases": cases})
    assert found.case_count == 2
    assert values(found) == [(20.0, "b"), (1000.0, "a")]
    assert found.factors[0].unit == "ms"
    assert found.cases()[1].overrides == ("time.end=1000 ms", "output.snapshot_field=pressure")


@pytest.mark.parametrize("kind", ["latin_hypercube", "sobol"])
def test_designs_that_fill_the_space(folder, kind):
    """In each of 16 equal parts of the range lies one case; levels come equally often, as far as
    16 is a multiple of how many there are; the seed alone decides.
    """
    design = {"kind": kind, "count": 16, "seed": 3}
    one, same, other = (
        study(folder, FACTORS, design={**design, "seed": seed}) for seed in (3, 3, 4)
    )
    assert one.case_count == 16
    friction, factor, shown = zip(*values(one), strict=True)
    assert sorted(int(16 * x) for x in friction) == list(range(16))
    assert {factor.count(level) for level in (0.5, 0.7, 0.9)} <= {5, 6}
    assert shown.count("stretch") == shown.count("pressure") == 8
    assert values(one) == values(same) != values(other)


def test_ten_million_cases_are_counted_not_made(folder):
    """Loading takes the time of a hundred values a factor, no more."""
    names = [f"output.{key}" for key in ("history_interval", "frame_interval")]
    keys = [*names, "time.end", "time.settle", "output.checkpoint_interval"]
    factors = {
        f"f{k}": {"key": key, "range": ["1 s", "2 s"], "count": 25} for k, key in enumerate(keys)
    }
    assert study(folder, factors).case_count == 25**5


def test_ranges_of_whole_numbers_stay_whole(folder):
    scene = folder / "block.yaml"
    mesh = "{generator: block, length: 10 mm, height: 5 mm, element_size: 1 mm}"
    scene.write_text(scene.read_text().replace(mesh, "{generator: pfr_section}"))
    factor = {"key": "bodies.block.mesh.spikes_per_strip", "range": [1, 7]}
    found = study(folder, {"rows": {**factor, "count": 4}})
    assert values(found) == [(1,), (3,), (5,), (7,)]
    assert found.cases()[1].overrides == ("bodies.block.mesh.spikes_per_strip=3",)
    design = {"kind": "latin_hypercube", "count": 7}
    assert sorted(values(study(folder, {"rows": factor}, design=design))) == [
        (n,) for n in range(1, 8)
    ]


ENDS = st.floats(1e-6, 1e6)


@given(low=ENDS, ratio=st.floats(1.001, 1e6), logarithmic=st.booleans(), count=st.integers(2, 40))
def test_levels_rise_from_end_to_end(low, ratio, logarithmic, count):
    interval = Interval(low, low * ratio, logarithmic)
    levels = interval.levels(count)
    assert (levels[0], levels[-1], len(levels)) == (low, low * ratio, count)
    steps = np.diff(np.log(levels)) if logarithmic else np.diff(levels) / low
    # inner levels are rounded to six digits
    assert steps == pytest.approx(steps.mean(), rel=0.0, abs=1.1e-5 * max(1.0, ratio))


@given(low=ENDS, ratio=st.floats(1.001, 1e6), logarithmic=st.booleans(), share=st.floats(0.0, 1.0))
def test_a_share_lies_in_its_interval(low, ratio, logarithmic, share):
    place = Interval(low, low * ratio, logarithmic).at(share)
    assert low * (1 - 1e-5) <= place <= low * ratio * (1 + 1e-5)


@given(low=st.integers(-20, 20), span=st.integers(1, 20), share=st.floats(0, 1, exclude_max=True))
def test_whole_numbers_and_levels_have_equal_parts(low, span, share):
    whole = Interval(low, low + span, is_whole=True).at(share)
    levels = tuple(range(low, low + span + 1))
    assert whole == at(levels, share) and isinstance(whole, int)


def repeated(folder, count, perturb, seed=1, **factors):
    """A study of block.yaml with repeats."""
    given = factors or {"end": {"key": "time.end", "values": ["1 s", "2 s"]}}
    return study(folder, given, repeats={"count": count, "seed": seed, "perturb": perturb})


def drawn(found):
    """Friction and thickness [m] of all cases (cases, 2)."""
    scenes = [resolved(case).scene for case in found.cases()]
    thicknesses = [scene.bodies["block"].thickness for scene in scenes]
    return np.array([[s.contact.friction_coefficient for s in scenes], thicknesses]).T


def test_all_cases_have_the_same_draws(folder):
    found = repeated(folder, 3, {FRICTION: "10 %", THICKNESS: "0.1 mm"})
    assert found.case_count == 6
    assert [case.number for case in found.cases()] == [1, 2, 3, 4, 5, 6]
    assert [case.values for case in found.cases()][:4] == [
        {"end": 1.0, "repeat": 1}, {"end": 1.0, "repeat": 2}, {"end": 1.0, "repeat": 3},
        {"end": 2.0, "repeat": 1},
    ]  # fmt: skip
    values = drawn(found)
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
    found = repeated(folder, 2, {FRICTION: "10 %"}, **factor)
    shares = drawn(found)[:, 0] / [0.2, 0.2, 0.4, 0.4]
    assert shares[:2] == pytest.approx(shares[2:], rel=1e-12)
    assert [case.values["friction"] for case in found.cases()] == [0.2, 0.2, 0.4, 0.4]


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
    found = repeated(folder, 3, {f"{spectrum}.order": 0.03, f"{spectrum}.relaxation_time": "50 us"})
    spectra = [resolved(case).scene.materials["own"].spectrum for case in found.cases()][:3]
    assert len({s.order for s in spectra}) == len({s.relaxation_time for s in spectra}) == 3
    assert all(0.2 < s.order < 0.44 for s in spectra)


def moduli(found, name):
    """Shear modulus at rest of the material of all cases (cases,) [Pa], which is Yeoh's."""
    return np.array([2.0 * resolved(case).scene.materials[name].C10 for case in found.cases()])


def test_the_spread_of_a_material_of_the_library_is_drawn(folder):
    """Dragon Skin 10: between its lowest and highest source, about the typical one."""
    found = repeated(folder, 60, {"materials.dragon_skin_10": "spread"})
    drawn = moduli(found, "dragon_skin_10")
    assert 46e3 < drawn.min() < 52e3 and 82e3 < drawn.max() < 88e3
    assert np.median(drawn) == pytest.approx(69e3, rel=0.06)
    assert (drawn[:60] == drawn[60:]).all()  # the same in both cases
    material = resolved(next(iter(found.cases()))).scene.materials["dragon_skin_10"]
    assert pytest.approx(0.25 / 36) == material.C20 / material.C10
    assert pytest.approx(0.023 / 36) == material.C30 / material.C10
    assert material.density == 1070.0 and material.spectrum.order == 0.32


SKIN = """
materials:
  skin:
    law: yeoh
    C10: 10 kPa
    density: 1070 kg/m^3
    spectrum: {kind: fractional, relaxation_time: 330 us, order: 0.3, band: [2 Hz, 5 kHz]}
"""


def test_a_material_of_the_scene_has_a_spread_of_its_own(folder):
    path = folder / "block.yaml"
    whole = path.read_text().replace("dragon_skin_10", "skin") + SKIN
    path.write_text(f"{whole}    spread: [15 kPa, 20 kPa, 40 kPa]\n")
    perturb = {"materials.skin.spectrum.order": 0.01, "materials.skin": "spread"}
    found = repeated(folder, 30, perturb)
    drawn = moduli(found, "skin")
    assert drawn.min() > 15e3 and drawn.max() < 40e3
    orders = [resolved(case).scene.materials["skin"].spectrum.order for case in found.cases()]
    assert np.std(orders) == pytest.approx(0.01, rel=0.4)


@pytest.mark.parametrize(
    ("key", "says"),
    [
        ("contact.friction_coefficient", "only a material has a spread"),
        ("materials.dragon_skin_10.C10", "only a material has a spread"),
        ("materials.dragon_skin_20", "no spread of the material 'dragon_skin_20' is known"),
        ("materials.granite", "no spread of the material 'granite' is known"),
    ],
)
def test_what_has_no_spread(folder, key, says):
    with pytest.raises(SceneError, match=says):
        repeated(folder, 2, {key: "spread"})
