"""Self-contact from a scene: which facets, how stiff, what is refused."""

import numpy as np
import pytest

from softsim.builder.contact import depth_inside, plane_strain_modulus
from softsim.errors import SceneError
from softsim.robots.block import block, box
from softsim.solver.contact_bound import SurfaceStiffness

TWO = """\
bodies:
  a: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10,
      position: [0 mm, 3 mm]}
contact: {self_contact: [a, b.bottom], friction_coefficient: 0.7}
time: {end: 1 s}
"""


def test_bodies_and_facet_sets_are_named(build):
    model = build(TWO)
    data = model.self_contact
    assert len(data.facets) == 12 + 4
    assert len(data.point_areas) == len(data.nodes) + len(data.facets)
    assert data.point_areas.sum() == pytest.approx((12 + 4) * 5e-6)
    assert len(set(data.facet_part)) == 2
    np.testing.assert_allclose(data.facet_size, 1e-3, rtol=1e-9)
    np.testing.assert_array_equal(data.friction_coefficient, [[0.7]])
    given = build(TWO, "contact.self_friction_coefficient=0.2").self_contact
    np.testing.assert_array_equal(given.friction_coefficient, [[0.2]])


@pytest.mark.parametrize("mesh", [block(4.0, 3.0, 1.0, "quad"), box(4.0, 2.0, 3.0, 1.0, "quad")])
def test_a_place_in_quadrilaterals_or_hexahedra_is_inside(mesh):
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    rng = np.random.default_rng(3)
    places = rng.uniform(low - 0.5, high + 0.5, (200, mesh.dimension))
    depth = depth_inside(places, mesh.points, mesh.cells)
    to_sides = np.minimum(places - low, high - places).min(axis=1)
    assert ((depth > 0) == (to_sides > 0)).all()
    assert (depth <= np.maximum(to_sides, 0) + 1e-12).all()


def test_nothing_touches_itself_unless_asked(build):
    assert build(TWO, "contact.self_contact=[]").self_contact is None


def test_a_node_bears_both_half_passes(build):
    """Nodes of equal facets, without dashpots: twice the springs of one pass and the other, of a
    tenth of the modulus over the allowed penetration; at a corner those of one side, which has half
    the length, or of the mean of both.
    """
    model = build(
        TWO, "contact.self_contact=[a, b]", "contact.damping_ratio=0",
        "contact.allowed_penetration=0.02",
    )  # fmt: skip
    data = model.self_contact
    modulus = plane_strain_modulus(model.bodies[0].regions[0].material)
    whole = 0.1 * modulus / (0.02 * 1e-3) * 5e-6
    of_sides = data.summed_at_nodes(data.penalty.k_n)
    np.testing.assert_allclose(of_sides, 0.5 * whole)
    bound = SurfaceStiffness(data, model.points).of_nodes(model.points, 1e-6)
    assert set(np.round(bound / whole, 6)) == {2.0, round(0.5**0.5 + 1.0, 6)}


def test_a_stiffness_of_nodes_is_that_of_both_half_passes(build):
    model = build(TWO, "contact.self_contact=[a, b]", "contact.penalty_stiffness=700 N/m")
    data = model.self_contact
    np.testing.assert_allclose(data.summed_at_nodes(data.penalty.k_n), 350.0)


def test_faces_in_a_plane_of_symmetry_do_not_touch(build):
    """Nor does a side that is held across itself by a fixed direction."""
    half = """
conditions:
  a: {kind: symmetry, nodes: a.left, normal: x}
  b: {kind: fixed, nodes: b.left, directions: [x]}
  base: {kind: fixed, nodes: a.bottom}
"""
    data = build(TWO + half, "contact.self_contact=[a, b]").self_contact
    assert len(data.facets) == 2 * 12 - 2 * 2
    with pytest.raises(SceneError, match="planes of symmetry"):
        build(TWO + half, "contact.self_contact=[a.left]")


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["contact.self_contact=[c]"], "there is no body 'c'"),
        (["contact.self_contact=[a.tip]"], "no facet set 'a.tip'"),
        (["bodies.b.position=[0.3 mm, 1.7 mm]"], "inside body"),
        (["bodies.b.position=[0 mm, 1 mm]"], "inside body"),
    ],
)
def test_what_is_refused(build, overrides, message):
    with pytest.raises(SceneError) as caught:
        build(TWO.replace("b.bottom", "b"), *overrides)
    assert message in caught.value.message


def test_bodies_that_lie_on_each_other_may_start(build):
    assert build(TWO, "bodies.b.position=[0.3 mm, 2 mm]").self_contact is not None
