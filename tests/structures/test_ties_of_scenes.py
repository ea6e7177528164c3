"""Ties of scenes: where nodes are put, what they hand over, what is refused and where."""

import numpy as np
import pytest

from softsim.errors import SceneError

SCENE = """\
bodies:
  lower: {mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 2 mm},
          formulation: plane_strain, thickness: 3 mm, material: dragon_skin_10}
  upper: {mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 1.3 mm},
          formulation: plane_strain, thickness: 3 mm, material: dragon_skin_10,
          position: [0 mm, 4.05 mm]}
time: {end: 1 s}
ties:
  glue: {nodes: upper.bottom, facets: lower.top}
"""


def test_nodes_are_moved_onto_the_facets(build):
    model = build(SCENE)
    lower, upper = model.bodies
    nodes = upper.node_sets["bottom"]
    np.testing.assert_array_equal(model.ties.nodes, np.sort(nodes))
    np.testing.assert_allclose(model.points[nodes, 1], 4e-3, rtol=0.0, atol=1e-17)
    np.testing.assert_array_equal(upper.points[nodes - upper.first_node], model.points[nodes])
    assert np.isin(model.ties.corners, lower.node_sets["top"]).all()
    np.testing.assert_allclose(model.ties.weights.sum(axis=1), 1.0, rtol=1e-15)
    assert not model.is_free[nodes].any()
    assert upper.remarks == (f"{len(nodes)} tied nodes moved onto facets, by at most 0.05 mm",)
    assert lower.remarks == ()


def test_velocity_of_tied_nodes_is_that_of_the_facets(build):
    model = build(SCENE, "bodies.lower.initial_velocity=['1 m/s', '0 m/s']")
    tied = model.ties.nodes
    np.testing.assert_allclose(model.velocity[tied], np.broadcast_to([1.0, 0.0], (len(tied), 2)))


def test_both_sides_may_lie_on_a_plane_of_symmetry(build):
    """There the tied nodes and the corners that they follow are held alike."""
    conditions = "conditions:\n  left: {kind: symmetry, nodes: %s.left, normal: x}\n"
    model = build(SCENE + conditions % "lower" + "  up: {kind: symmetry, nodes: upper.left, "
                  "normal: x}\n")  # fmt: skip
    assert len(model.ties.nodes)
    with pytest.raises(SceneError, match=r"at \(-4\.00, 4\.00\) mm is fixed, prescribed or tied"):
        build(SCENE + conditions % "upper")


def test_a_half_section_is_tied_on_its_axis(build):
    revolved = SCENE.replace("plane_strain, thickness: 3 mm", "axisymmetric")
    model = build(revolved, *(f"bodies.{b}.position=['4 mm', '{y} mm']"
                              for b, y in (("lower", 0), ("upper", 4))))  # fmt: skip
    on_axis = model.points[:, 0] < 1e-12
    assert on_axis[model.ties.nodes].any()
    assert not model.is_free[on_axis, 0].any()


TWICE = "  more: {nodes: upper.bottom, facets: lower.bottom, tolerance: 1 m}\n"
CHAIN = "  more: {nodes: lower.top, facets: upper.bottom}\n"
LINE = 9


@pytest.mark.parametrize(
    ("old", "new", "told", "line"),
    [
        ("4.05", "4.5", "at (-4.00, 4.50) mm is 0.5 mm away from the facets of 'lower.top'; 8 of 8 "
         "nodes are more than 0.1 mm away, 5 % of the mean side of the facets", LINE),
        ("lower.top}", "lower.top, tolerance: 0.01 mm}", "is 0.05 mm away", LINE),
        ("upper.bottom,", "lower.top,", "belongs to an element that shares a node with the facet",
         LINE),
        ("upper.bottom,", "upper.base,", "there is no node set 'upper.base'", LINE),
        ("lower.top}", "middle.top}", "'middle.top' does not name a set of a body", LINE),
        ("lower.top}\n", "lower.top}\n" + TWICE, "is already tied by 'glue'", LINE + 1),
        ("lower.top}\n", "lower.top}\n" + CHAIN, "is itself tied", LINE),
        ("4.05 mm]", "4.05 mm], fixed: [bottom]", "is fixed, prescribed or tied", LINE),
    ],
)  # fmt: skip
def test_what_cannot_be_tied_is_refused(build, old, new, told, line):
    with pytest.raises(SceneError) as raised:
        build(SCENE.replace(old, new))
    assert told in raised.value.message
    assert raised.value.location.line == line


def test_cells_that_are_flattened_are_refused(build):
    """The lower side of the upper block is pulled up through its other nodes."""
    flat = SCENE.replace("4.05 mm]", "0 mm]").replace("top}", "top, tolerance: 4 mm}")
    with pytest.raises(
        SceneError, match="with its tied nodes on the facets, the mesh of 'upper' is not valid"
    ):
        build(flat)


def test_tied_bodies_are_one_part_for_contact(build):
    """What lies side by side at rest, at the rim of a tie, does not touch."""
    model = build(SCENE, "contact.self_contact=['lower', 'upper']")
    assert len(np.unique(model.self_contact.point_part)) == 1


def test_the_reaction_of_tied_nodes_is_refused(build):
    probe = "output: {probes: {held: {kind: reaction, nodes: upper.bottom}}}\n"
    with pytest.raises(
        SceneError, match="is tied to a facet, so its force acts on the nodes"
    ) as told:
        build(SCENE + probe)
    assert (told.value.location.line, told.value.location.column) == (10, 49)
