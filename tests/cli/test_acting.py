"""What acts on the bodies of a scene, in words."""

from softsim.builder import build_model
from softsim.cli.run_tables import acting, not_read
from softsim.scene.loading import load_scene

SCENE = """
bodies:
  block:
    mesh: {generator: block, length: 10 mm, height: 6 mm, element_size: 2 mm}
    formulation: plane_strain
    thickness: 10 mm
    material: dragon_skin_30
    fixed: [left]
loads:
  air: {kind: follower_pressure, facets: [block.bottom], profile: {kind: constant, value: 3 kPa}}
  weight: {kind: nodal_force, nodes: block.right, force: [0 N, -2 N]}
environment:
  walls: {floor: {kind: plane}}
contact: {friction_coefficient: 0.7}
time: {end: 10 ms}
"""


def test_loads_gravity_walls_and_friction_are_told_with_their_defaults(write_scene):
    loaded = load_scene(write_scene(SCENE))
    model = build_model(loaded)
    told = dict(acting(loaded, model))
    assert told["load 'air'"] == (
        "follower_pressure, facets [block.bottom], profile (constant, value 3 kPa); "
        "up to 3 kPa, on 100 mm^2 at rest"
    )
    assert told["load 'weight'"].endswith("; resultant of at most 2 N, on 4 nodes")
    assert told["gravity"] == "9.81 m/s^2 (default); as a vector (0, -9.81) m/s^2"
    assert told["held"] == "block.left, in all directions"
    assert told["wall 'floor'"] == "plane"
    assert told["contact"].startswith("bodies with walls; no self_contact")
    assert told["friction"] == (
        "mu 0.7, the friction limit follows the normal force with a memory of 10 ms (default) "
        "and a slip "
        "length of 30 um (default)"
    )
    assert not_read(model) == []


BOXES = """
bodies:
  l: {mesh: {generator: box, length: 2 mm, height: 1 mm, width: 2 mm, element_size: 1 mm},
      formulation: solid, material: dragon_skin_10}
  u: {mesh: {generator: box, length: 2 mm, height: 1 mm, width: 2 mm, element_size: 1 mm},
      formulation: solid, material: dragon_skin_10, position: [0 mm, 2 mm, 0 mm]}
contact: {self_contact: [l, u]}
time: {end: 10 ms}
"""


def test_sharp_edges_of_two_bodies_that_may_cross_are_named(write_scene):
    """Not those of flat open surfaces: these have none."""
    loaded = load_scene(write_scene(BOXES))
    assert dict(acting(loaded, build_model(loaded)))["sharp edges"].startswith(
        "of 'l', 'u': contact between two edges"
    )
    flat = load_scene(write_scene(BOXES.replace("[l, u]", "[l.top, u]")))
    assert "sharp edges" not in dict(acting(flat, build_model(flat)))
