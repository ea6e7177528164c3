"""Regions of several bodies that kernels meet as one."""

import numpy as np

from softsim.elements.geometry import joined_regions

BEAM = """
    mesh: {generator: block, length: 8 mm, height: 2 mm, element_size: 1 mm}
    formulation: plane_strain
    thickness: 5 mm
    fixed: [left]"""
THREE = f"""
bodies:
  first:{BEAM}
    material: soft
  other:{BEAM}
    material: dragon_skin_30
    position: [0 mm, 5 mm]
  last:{BEAM}
    material: soft
    mirror: x
    position: [0 mm, 10 mm]
materials:
  soft: &soft {{law: neo_hooke, C10: 40 kPa, density: 1070 kg/m^3,
          prony: [{{g: 0.3, relaxation_time: 5 ms}}]}}
  same: *soft
time: {{end: 1 s}}
"""
APART = "bodies.last.material=same"


def test_bodies_of_one_material_are_one(build):
    model = build(THREE)
    both, other = joined_regions(model.regions, model.points)
    assert (both.body, other.body) == ("first + last", "other")
    np.testing.assert_allclose(
        both.volumes, np.concatenate([model.regions[k].volumes for k in (0, 2)]), rtol=1e-12
    )
    assert len(joined_regions(build(THREE, APART).regions, model.points)) == 3


def test_bodies_joined_and_apart_move_alike(build, start):
    places = []
    for overrides in ([], [APART]):
        solver = start(build(THREE, *overrides))
        solver.advance(2000)
        places.append(solver.positions()[0])
    np.testing.assert_allclose(*places, rtol=0, atol=1e-14)
    fallen = places[0] - build(THREE).points
    assert np.abs(fallen).max() > 1e-5
