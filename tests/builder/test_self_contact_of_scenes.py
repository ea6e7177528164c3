"""Self-contact from a scene: which facets, how stiff, what is refused."""

import numpy as np
import pytest

from softsim.builder.self_contact import LARGEST_SHARE, LEAST_SHARE, depth_inside
from softsim.errors import SceneError
from softsim.robots.block import block
from softsim.robots.box import box
from softsim.stability.contact_stiffness import self_stiffness

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
    assert set(data.node_part) == set(data.facet_part)
    assert len(set(data.facet_part)) == 2
    np.testing.assert_allclose(data.facet_size, 1e-3, rtol=1e-9)
    assert data.contact.friction_coefficient == 0.7
    given = build(TWO, "contact.self_friction_coefficient=0.2").self_contact
    assert given.contact.friction_coefficient == 0.2


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


def test_all_contact_at_a_node_is_no_stiffer_than_a_wall(build):
    """Nodes of equal facets, without dashpots: a quarter of a wall's stiffness each way."""
    model = build(TWO, "contact.self_contact=[a, b]", "contact.damping_ratio=0")
    data = model.self_contact
    walls = model.contact.penalty_stiffness[np.isin(model.contact.nodes, data.contact.nodes)]
    np.testing.assert_allclose(data.contact.penalty_stiffness, LARGEST_SHARE * walls)
    np.testing.assert_allclose(self_stiffness(data, model.points, 1e-6), walls)


def test_uneven_facets_soften_it_to_a_limit(build):
    model = build(TWO, "contact.self_contact=[a, b]", "bodies.b.mesh.element_size=0.1 mm")
    share = model.self_contact.contact.penalty_stiffness.max() / model.contact.penalty_stiffness[0]
    assert share == pytest.approx(LEAST_SHARE)


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
