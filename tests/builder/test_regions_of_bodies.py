"""Regions of a scene: what they give their cells, and what is refused."""

import numpy as np
import pytest

from softsim.errors import SceneError

PFR = """
bodies:
  skin:
    mesh: {generator: pfr_section, element_size: 1 mm}
    formulation: plane_strain
    thickness: 7 mm
    material: dragon_skin_10
    REGIONS
time: {end: 1 s}
"""
SPIKES = "regions: {spikes: {material: dragon_skin_30, thickness: 3 mm}}"


def scene(regions, *swaps):
    text = PFR.replace("REGIONS", regions)
    for old, new in swaps:
        text = text.replace(old, new)
    return text


def test_cells_of_a_region_have_its_material_and_thickness(build):
    model = build(scene(SPIKES))
    rest, spikes = model.bodies[0].regions
    assert (rest.cell_set, spikes.cell_set) == (None, "spikes")
    assert rest.material.name == "dragon_skin_10" and rest.geometry.thickness == 7e-3
    assert spikes.material.name == "dragon_skin_30" and spikes.geometry.thickness == 3e-3
    numbers = np.concatenate([rest.numbers, spikes.numbers])
    np.testing.assert_array_equal(np.sort(numbers), np.arange(len(model.bodies[0].cells)))
    mass = sum((r.volumes * r.material.density).sum() for r in (rest, spikes))
    assert model.mass.sum() == pytest.approx(mass) == model.bodies[0].mass


def test_what_a_region_leaves_out_is_the_bodys(build):
    _, spikes = build(scene("regions: {spikes: {thickness: 3 mm}}")).regions
    assert spikes.material.name == "dragon_skin_10"
    _, spikes = build(scene("regions: {spikes: {material: dragon_skin_30}}")).regions
    assert spikes.geometry.thickness == 7e-3


def test_a_body_may_be_all_regions(build):
    text = scene("regions: {spikes: {thickness: 3 mm}, skin: {thickness: 4 mm}}")
    assert [r.cell_set for r in build(text).regions] == ["spikes", "skin"]


def test_values_of_regions_are_joined_in_the_order_of_cells(build):
    body = build(scene(SPIKES)).bodies[0]
    joined = body.joined(r.cells for r in body.regions)
    np.testing.assert_array_equal(joined, body.cells)
    ones = body.nodal_mean(np.full(len(body.points), 1.0) for _ in body.regions)
    np.testing.assert_allclose(ones, 1.0, rtol=1e-14)


def test_a_scene_defines_the_cells_of_a_region(build):
    """Of the cells in the box one layer, whose corners are all there."""
    text = scene(
        "sets: {low: {box: [[-1 mm, 0 mm], [1 mm, 1 mm]]}}\n"
        "    regions: {low: {material: ecoflex_00_30}}",
        (
            "pfr_section, element_size: 1 mm",
            "block, length: 2 mm, height: 2 mm, element_size: 1 mm",
        ),
    )
    _, low = build(text).regions
    assert len(low.cells) == 4 and (low.points[low.cells][:, :, 1] <= 1e-3).all()


def test_rings_may_be_regions(build):
    text = scene("sector: 90 deg\n    rings: skin\n    " + SPIKES, ("plane_strain", "ring_section"))
    rings, spikes = build(text).regions
    assert rings.geometry.is_ring.all() and not spikes.geometry.is_ring.any()


AXISYMMETRIC = (
    ("pfr_section, element_size: 1 mm", "pfr_meridian"),
    ("plane_strain\n    thickness: 7 mm", "axisymmetric"),
)
PUSH = """
loads:
  air: {kind: follower_pressure, facets: [skin.surface], profile: {kind: constant, value: 1 kPa}}
"""


PULL = """
loads: {pull: {kind: surface_traction, facets: [skin.surface], traction: [1 Pa, 0 Pa]}}
"""
HALVES = (
    "sets: {half: {plane: {point: [0 mm, 0 mm], normal: [0, 1]}}}\n"
    "    regions: {half: {thickness: 3 mm}, spikes: {thickness: 4 mm}}"
)


@pytest.mark.parametrize(
    ("text", "pointed_at", "message", "hint"),
    [
        (scene("regions: {spiks: {thickness: 3 mm}}"), "{thickness",
         "there is no cell set 'spiks' in 'skin'", "did you mean 'spikes'"),
        (scene(HALVES), "{thickness: 4",
         "is in 'spikes' and in 'half'", "difference: [spikes, half]"),
        (scene("regions: {spikes: {material: dragon_skin_31}}"), "dragon_skin_31",
         "there is no material 'dragon_skin_31'", "did you mean 'dragon_skin_30'"),
        (scene("regions: {skin: {thickness: 3 mm}}", *AXISYMMETRIC), "3 mm",
         "has no meaning in a body that is axisymmetric", "leave it out"),
        (scene("sector: 90 deg\n    rings: skin\n    regions: {skin: {thickness: 3 mm}}",
               ("plane_strain", "ring_section")), "3 mm",
         "all cells of 'skin' are rings around the axis", "are not rings"),
        (scene("regions: {spikes: {}}"), "{}", "needs its own material or thickness", ""),
        (scene(SPIKES) + PUSH, "[skin.surface]", "regions", "a separate load"),
    ],
)  # fmt: skip
def test_refusals_point_at_the_key(build, text, pointed_at, message, hint):
    with pytest.raises(SceneError) as caught:
        build(text)
    place = caught.value.location
    assert place.text == text.splitlines()[place.line - 1]
    assert place.text[place.column - 1 :].startswith(pointed_at)
    assert message in caught.value.message and hint in caught.value.hint


def test_pressure_within_one_thickness(build):
    chamber = PUSH.replace("skin.surface", "skin.chamber_top")
    assert build(scene(SPIKES) + chamber).pressures[0].geometry.thickness == 7e-3


def test_a_traction_takes_the_depth_of_each_edges_cell(build):
    model = build(scene(SPIKES) + PULL)
    body, area = model.bodies[0], 0.0
    for edge in body.facet_sets["surface"]:
        [region] = [r for r in body.regions if (np.isin(r.cells, edge).sum(axis=1) == 2).any()]
        length = np.linalg.norm(np.diff(body.points[edge], axis=0))
        area += region.geometry.thickness * length
    assert model.loads[0].forces.sum(axis=0)[0] == pytest.approx(area, rel=1e-12)
