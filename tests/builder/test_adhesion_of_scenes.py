"""Adhesion of surfaces to walls, as scenes describe it."""

import numpy as np
import pytest

from softsim.contact.adhesion import MEASURED_AT
from softsim.errors import SceneError
from softsim.solver.plausibility import adhesion_warnings

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 2 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10,
      sets: {foot: {box: [[-1 mm, -1 um], [5 mm, 1 um]]}}}
environment:
  walls: {floor: {kind: plane}, pipe: {kind: pipe, diameter: 30 mm}}
contact:
  adhesion: {glue: {work_of_adhesion: 0.1 J/m^2, pull_off_stress: 2 kPa}}
time: {end: 1 s}
"""
FOOT = "contact.adhesion.glue.surfaces=[b.foot]"
ON_FLOOR = "contact.adhesion.glue.walls=[floor]"


def adhesion(model):
    """The one adhesion of the wall that holds floor and pipe, and the names of its surfaces."""
    [found], [wall] = model.adhesions, model.walls
    return found, wall.names


def test_all_surfaces_adhere_to_all_walls(build):
    """The attraction of all nodes is the stress times the surface of the block, 24 mm by 5 mm."""
    found, names = adhesion(build(SCENE))
    assert found.attraction.sum(axis=0) == pytest.approx(np.full(len(names), 2e3 * 24e-3 * 5e-3))


def test_named_surfaces_adhere_to_named_walls(build):
    """Half an edge on either side of two of 2 mm, or the whole edges: the foot is 4 mm long."""
    model = build(SCENE, FOOT, ON_FLOOR)
    found, names = adhesion(model)
    floor = names.index("floor")
    assert found.attraction.sum(axis=0)[floor] == pytest.approx(2e3 * 4e-3 * 5e-3)
    assert not np.delete(found.attraction, floor, axis=1).any()
    adhering = model.points[model.contact.nodes][found.attraction[:, floor] > 0.0]
    assert adhering[:, 1] == pytest.approx(0.0)


@pytest.mark.parametrize("law", [{"pull_off_stress": "2 kPa"}, {"range": "80 um"}])
def test_the_work_of_adhesion_does_not_depend_on_the_penalty_stiffness(build, law):
    """w A = F h / 2 + F^2 / (2 k_n), of stress or range, with any stiffness."""
    [(key, value)] = law.items()
    scene = SCENE.replace("pull_off_stress: 2 kPa", f"{key}: {value}")
    for stiffness in ("auto", "20 N/mm"):
        model = build(scene, FOOT, f"contact.penalty_stiffness={stiffness}")
        found, _ = adhesion(model)
        attraction, reach = found.attraction[:, 0], found.reach[:, 0]
        work = 0.5 * attraction * (reach + attraction / model.contact.penalty.k_n)
        assert work.sum() == pytest.approx(0.1 * 4e-3 * 5e-3)
        if key == "range":
            assert reach[attraction > 0.0] == pytest.approx(80e-6)


def test_adjoining_surfaces_add_up_at_their_common_node(build):
    """Each facet has the work of the last entry that names it."""
    sets = (
        "bodies.b.sets={here: {box: [[-5 mm, -1 um], [1 um, 1 um]]}, "
        "there: {box: [[-1 um, -1 um], [5 mm, 1 um]]}}"
    )
    entries = (
        "contact.adhesion={all: {work_of_adhesion: 1 J/m^2, range: 1 mm}, "
        "here: {work_of_adhesion: 0.1 J/m^2, pull_off_stress: 2 kPa, surfaces: [b.here]}, "
        "there: {work_of_adhesion: 0.3 J/m^2, pull_off_stress: 4 kPa, surfaces: [b.there]}}"
    )
    model = build(SCENE.replace("sets: {foot", "sets: {floor_side"), sets, entries)
    found, _ = adhesion(model)
    force, reach = found.attraction[:, 0], found.reach[:, 0]
    low = model.points[model.contact.nodes][:, 1] < 1e-6
    work = 0.5 * force * (reach + force / model.contact.penalty.k_n)
    [middle] = np.flatnonzero(low & (np.abs(model.points[model.contact.nodes][:, 0]) < 1e-6))
    assert force[middle] == pytest.approx((2e3 + 4e3) * 1e-3 * 5e-3)
    assert work[middle] == pytest.approx((0.1 + 0.3) * 1e-3 * 5e-3)


def test_parts_with_one_law_are_as_the_whole(build):
    """Two entries that meet at a node attract it as one does, where the penalty contact is soft."""
    law = "{work_of_adhesion: 0.1 J/m^2, range: 80 um, surfaces: [b.%s]}"
    sets = (
        "bodies.b.sets={foot: {box: [[-5 mm, -1 um], [5 mm, 1 um]]}, "
        "here: {box: [[-5 mm, -1 um], [1 um, 1 um]]}, there: {box: [[-1 um, -1 um], [5 mm, 1 um]]}}"
    )
    soft = "contact.penalty_stiffness=0.5 N/mm"
    whole, parts = (
        adhesion(build(SCENE, sets, soft, "contact.adhesion={" + entries + "}"))[0]
        for entries in (f"all: {law % 'foot'}", f"one: {law % 'here'}, two: {law % 'there'}")
    )
    adheres = whole.attraction > 0.0
    assert (whole.attraction / 500.0).max() > 0.4 * 80e-6  # F / k_n counts
    np.testing.assert_allclose(parts.attraction, whole.attraction, rtol=1e-12)
    assert parts.reach[adheres] == pytest.approx(80e-6)


RATE = "contact.adhesion.glue.rate={speed: 1 mm/s, exponent: 0.6%s}"


@pytest.mark.parametrize(
    ("fastest", "ratio"), [("", 1000.0), (", fastest: 20 mm/s", 20.0), (", fastest: 0.1 mm/s", 0.1)]
)
def test_the_longest_range_is_that_of_the_fastest_separation(build, fastest, ratio):
    """The rest of the softening, from half of the attraction on, takes w0 A (v / v0)^n more."""
    model = build(SCENE, FOOT, ON_FLOOR, RATE % fastest)
    found, _ = adhesion(model)
    extension = found.longest_reach - found.reach
    more = 0.5 * (1.0 - MEASURED_AT) * found.attraction * extension
    assert more.sum() == pytest.approx(0.1 * 4e-3 * 5e-3 * ratio**0.6)
    assert found.longest_reach[found.attraction > 0.0].max() <= found.farthest


def test_a_scene_without_a_rate_has_none(build):
    found, _ = adhesion(build(SCENE))
    assert found.rate is None and found.longest_reach is found.reach


MEETING = (
    "bodies.b.sets={here: {box: [[-5 mm, -1 um], [1 um, 1 um]]}, "
    "there: {box: [[-1 um, -1 um], [5 mm, 1 um]]}}"
)


def meeting_entries(here, there):
    """Override with two entries, the ends of which are given, that meet at a node."""
    law = "work_of_adhesion: 0.1 J/m^2, pull_off_stress: 2 kPa"
    return (
        f"contact.adhesion={{here: {{{law}, surfaces: [b.here]{here}}}, "
        f"there: {{{law}, surfaces: [b.there]{there}}}}}"
    )


def test_entries_with_and_without_a_rate_may_meet(build):
    """At their common node half of the area depends on the rate."""
    scene = SCENE.replace("sets: {foot", "sets: {floor_side")
    rate = ", rate: {speed: 1 mm/s, exponent: 0.6}"
    found, _ = adhesion(build(scene, MEETING, meeting_entries(rate, "")))
    of_floor = found.longest_reach[:, 0] - found.reach[:, 0]
    both, _ = adhesion(build(scene, MEETING, meeting_entries(rate, rate)))
    of_both = both.longest_reach[:, 0] - both.reach[:, 0]
    shares = of_floor[of_both > 0.0] / of_both[of_both > 0.0]
    assert sorted(set(np.round(shares, 9))) == [0.0, 0.5, 1.0]


def test_different_rates_at_a_node_are_refused(build):
    rates = (", rate: {speed: 1 mm/s, exponent: 0.6}", ", rate: {speed: 2 mm/s, exponent: 0.6}")
    scene = SCENE.replace("sets: {foot", "sets: {floor_side")
    with pytest.raises(SceneError, match="differs from that of 'here'"):
        build(scene, MEETING, meeting_entries(*rates))


def test_a_scene_without_adhesion_has_none(build):
    assert build(SCENE, "contact.adhesion={}").adhesions == (None,)


def test_a_cohesive_zone_that_the_mesh_does_not_resolve_gives_a_warning(build):
    """E* w / s^2 is 7 mm at 2 kPa and 0.4 mm at 8 kPa; the elements are 2 mm."""
    assert adhesion_warnings(build(SCENE)) == {}
    model = build(SCENE, "contact.adhesion.glue.pull_off_stress=8 kPa")
    [(kind, text)] = adhesion_warnings(model).items()
    assert kind == "adhesion to floor"
    assert "elements are 2 mm" in text and "contact.adhesion by 0.33 or less" in text


def test_surfaces_in_a_plane_of_symmetry_are_refused(build):
    symmetry = "conditions={half: {kind: symmetry, nodes: b.foot, normal: y}}"
    with pytest.raises(SceneError, match="planes of symmetry"):
        build(SCENE, FOOT, symmetry)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (", pull_off_stress: 2 kPa", "", "give either pull_off_stress or range"),
        ("2 kPa}", "2 kPa, range: 80 um}", "give either pull_off_stress or range"),
        ("2 kPa}", "2 kPa, walls: [flor]}", "there is no wall 'flor'"),
        ("2 kPa}", "2 kPa, surfaces: [b.feet]}", "there is no facet set 'b.feet'"),
        ("2 kPa", "2 MPa", "shorter than the depth"),
        ("pull_off_stress: 2 kPa", "range: 1 nm", "shorter than the depth"),
        ("{floor: {kind: plane}, pipe: {kind: pipe, diameter: 30 mm}}", "{}", "there is no wall"),
        ("0.1 J/m^2", "0.1 J", "an energy per area"),
        ("2 kPa}", "2 kPa, rate: {exponent: 0.6}}", r"scene\.yaml:9:\d+.*speed"),
        ("2 kPa}", "2 kPa, rate: {speed: 0 m/s, exponent: 0.6}}", r"scene\.yaml:9:\d+"),
        ("2 kPa}", "2 kPa, rate: {speed: 1 mm/s, exponent: 0}}", r"scene\.yaml:9:\d+"),
        ("2 kPa}", "2 kPa, rate: {speed: 1 mm/s, exponent: 3}}", r"scene\.yaml:9:\d+"),
        ("2 kPa}", "2 kPa, rate: {speed: 1, exponent: 0.6}}", r"scene\.yaml:9:\d+"),
    ],
)
def test_a_wrong_adhesion_is_refused(build, old, new, problem):
    with pytest.raises(SceneError, match=problem):
        build(SCENE.replace(old, new))


BODIES = """
bodies:
  b: {mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 2 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
  c: {mesh: {generator: block, length: 4 mm, height: 4 mm, element_size: 2 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_30, position: [0 mm, 5 mm]}
contact:
  pairs: [{between: [b.top, c.bottom]}]
  adhesion: {glue: {work_of_adhesion: 0.1 J/m^2, pull_off_stress: 2 kPa,
                    between: [b.top, c.bottom]}}
time: {end: 1 s}
"""


def test_named_surfaces_of_bodies_adhere_to_each_other(build):
    """Their groups adhere in both directions, and to nothing else; walls do not matter."""
    data = build(BODIES).self_contact
    adhering = data.adhesion.work > 0.0
    np.testing.assert_array_equal(adhering, data.may_touch)
    assert data.adhesion.stress[adhering] == pytest.approx(2e3)
    assert 2.0 * 0.1 / 2e3 <= data.adhesion.farthest < 4.0 * 0.1 / 2e3
    everything = build(BODIES, "contact.self_contact=[b, c]").self_contact
    assert (everything.adhesion.work > 0.0).sum() < everything.may_touch.sum()


def test_the_cohesive_zone_between_bodies_is_of_both_materials(build):
    """1/E* is the sum of both; a zone of 5 mm is resolved, one of 0.3 mm is not."""
    model = build(BODIES)
    moduli = []
    for body in model.bodies:
        law, kappa = body.regions[0].material.law, body.regions[0].material.bulk_modulus
        mu = law.initial_shear_modulus
        moduli.append(4.0 * mu * (3.0 * kappa + mu) / (3.0 * kappa + 4.0 * mu))
    joint = 1.0 / (1.0 / moduli[0] + 1.0 / moduli[1])
    assert model.self_contact.adhesion.zone == pytest.approx(joint * 0.1 / 2e3**2)
    assert adhesion_warnings(model) == {}
    warned = adhesion_warnings(build(BODIES, "contact.adhesion.glue.pull_off_stress=8 kPa"))
    assert list(warned) == ["adhesion between bodies"]


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("2 kPa,", "2 kPa, walls: [floor],", "give either between, or surfaces and walls"),
        ("2 kPa,", "2 kPa, rate: {speed: 1 mm/s, exponent: 0.6},", "does not depend on the rate"),
        ("between: [b.top, c.bottom]}}", "between: [b.top, c.botom]}}", "no facet set 'c.botom'"),
        ("between: [b.top, c.bottom]}}", "between: [b.top, c.top]}}", "not in contact with each"),
        ("2 kPa", "2 MPa", "shorter than the depth"),
        ("2 kPa", "150 Pa", "over at most 0.5 of a facet"),
    ],
)
def test_a_wrong_adhesion_of_bodies_is_refused(build, old, new, problem):
    with pytest.raises(SceneError, match=problem):
        build(BODIES.replace(old, new))


def test_the_finer_surface_contributes_the_area(build):
    """Half each of alike facets of 2 mm; all from facets of 1 mm opposite facets of 2 mm."""
    for size, expected in (("2 mm", {0.5}), ("1 mm", {0.0, 1.0})):
        model = build(BODIES, f"bodies.c.mesh.element_size={size}")
        data = model.self_contact
        adhering = data.adhesion.work > 0.0
        assert set(data.adhesion.portion[adhering]) == expected


def test_an_entry_without_effect_is_refused(build):
    law = "{work_of_adhesion: 0.1 J/m^2, pull_off_stress: 2 kPa, between: [b.top, c.bottom]}"
    with pytest.raises(SceneError, match="has no effect"):
        build(BODIES, f"contact.adhesion={{one: {law}, two: {law}}}")
