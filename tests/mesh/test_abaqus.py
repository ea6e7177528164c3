import logging

import numpy as np
import pytest
from abaqus_decks import CAE, FRAME, OTHERS, SQUARE, TETRAHEDRON
from hypothesis import given, settings
from hypothesis import strategies as st

from softsim.errors import MeshError
from softsim.mesh.abaqus import FACES
from softsim.mesh.mesh import boundary_facets, signed_volumes
from softsim.mesh.reading import read_mesh


# A square of 10 mm in two triangles, with labels that have gaps.
@pytest.fixture
def read(tmp_path):
    def read_text(text: str, **options):
        path = tmp_path / "body.inp"
        path.write_text(text)
        return read_mesh(path, **options)

    return read_text


def test_a_flat_file(read):
    file = read(SQUARE)
    assert (file.element_type, file.turned_cells, file.dropped_nodes) == ("CPE3", 0, 0)
    assert file.mesh.points.tolist() == [[0, 0], [0.01, 0], [0.01, 0.01], [0, 0.01]]
    assert file.mesh.cells.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert set(file.mesh.node_sets) == {"surface"}


def test_a_byte_order_mark_is_no_data(read):
    assert len(read("\ufeff" + SQUARE.partition("\n")[2]).mesh.cells) == 2


def test_constraints_that_are_not_read_are_warned_of(read, caplog):
    file = read(SQUARE + "*EQUATION\n2\n10, 1, 1., 20, 1, -1.\n*TIE, NAME=glue\na, b\n")
    assert file.not_read == ("*EQUATION (2 lines)", "*TIE glue")
    for said in (
        "body.inp:12: *EQUATION is not read, its nodes move without it: there is no equivalent",
        "body.inp:15: *TIE is not read, its nodes move without it: join the bodies in the scene",
    ):
        assert said in caplog.text


def test_one_of_several_instances_stands_where_the_assembly_has_it(read):
    """The first is where it was drawn; the second is shifted by (0, 20) and then turned by 90
    degrees about (5, 25). Sets hold what they take from the chosen instance.
    """
    text = CAE.replace("*Assembly, name", FRAME + "*Assembly, name").replace(
        "*End Instance\n", "*End Instance\n" + OTHERS
    )
    corners = np.array([[0, 0], [10, 0], [10, 10], [0, 10.0]])
    first, second = (
        read(text, instance=name, length_unit=1.0).mesh for name in ("SKIN-1", "Skin-2")
    )
    np.testing.assert_array_equal(first.points, corners)
    np.testing.assert_allclose(
        second.points, np.roll(corners, -1, axis=0) + np.array([0, 20]), atol=1e-14
    )
    of_first = {name: nodes.tolist() for name, nodes in first.node_sets.items()}
    assert of_first["Set-1"] == [1, 2] and of_first["Both"] == [0, 1, 2]
    assert not {"Shared", "OfFrame", "OfRim", "Rim"} & {*of_first, *first.facet_sets}
    of_second = {name: nodes.tolist() for name, nodes in second.node_sets.items()}
    assert of_second["Set-1"] == [0] and of_second["Shared"] == of_second["OfRim"] == [3]
    assert "Cavity" in first.facet_sets and "Cavity" not in second.facet_sets
    with pytest.raises(MeshError, match="there is no instance 'Skin-3'") as caught:
        read(text, instance="Skin-3")
    assert caught.value.hint == "instances: Skin-1, Skin-2, Frame-1"


def test_two_instances_of_one_file_are_two_bodies(tmp_path, build):
    text = CAE.replace("*Assembly, name", FRAME + "*Assembly, name").replace(
        "*End Instance\n", "*End Instance\n" + OTHERS
    )
    (tmp_path / "assembly.inp").write_text(text)
    body = "mesh: {file: assembly.inp, instance: %s}, formulation: axisymmetric, material: %s"
    first, second = body % ("Skin-1", "ecoflex_00_30"), body % ("Skin-2", "dragon_skin_30")
    model = build(
        f"bodies:\n  lower: {{{first}, fixed: [Left_end]}}\n"
        f"  upper: {{{second}, fixed: [Shared]}}\ntime: {{end: 1 s}}\n"
    )
    lower, upper = model.bodies
    assert (lower.points.min(axis=0).tolist(), lower.points[:, 1].max()) == ([0, 0], 0.01)
    np.testing.assert_allclose(upper.points.min(axis=0), [0, 0.02], atol=1e-15)
    assert "Cavity" in lower.facet_sets and "Cavity" not in upper.facet_sets
    stiffness = [b.regions[0].material.law.initial_shear_modulus for b in model.bodies]
    assert stiffness[1] > 2.0 * stiffness[0]


def test_mid_side_nodes_of_second_order_elements_are_left_out(read):
    """A node set keeps its corners; one of mid-side nodes alone is dropped."""
    text = TETRAHEDRON.replace("C3D4", "C3D10M").replace(
        "*ELEMENT",
        "5, .5, 0, 0\n6, .5, .5, 0\n7, 0, .5, 0\n8, 0, 0, .5\n9, .5, 0, .5\n10, 0, .5, .5\n"
        "*ELEMENT",
    ).replace("1, 2, 3, 4\n", "1, 2, 3, 4, 5, 6, 7, 8, 9, 10\n")  # fmt: skip
    text += "*NSET, NSET=edge\n1, 5, 2\n*NSET, NSET=middle\n5\n*SURFACE, NAME=base\nbody, S1\n"
    file = read(text, length_unit=1.0, reduce_order=True)
    linear = read(TETRAHEDRON, length_unit=1.0).mesh
    np.testing.assert_array_equal(file.mesh.points, linear.points)
    np.testing.assert_array_equal(file.mesh.cells, linear.cells)
    assert file.element_type == "C3D4" and file.changes == ("6 mid-side nodes dropped",)
    assert file.mesh.node_sets["edge"].tolist() == [0, 1] and "middle" not in file.mesh.node_sets
    assert file.mesh.facet_sets["base"].tolist() == [[0, 2, 1]]
    with pytest.raises(MeshError, match="has 10 nodes; C3D4 has 4"):
        read(text.replace("C3D10M", "C3D4"), reduce_order=True)


def test_keywords_that_are_not_read_are_listed(read):
    file = read(
        "*HEADING\nan actuator\n" + SQUARE + "*MATERIAL, NAME=DragonSkin30\n*DENSITY\n1.08e-9\n"
        "*MATERIAL, NAME=steel\n*STEP\n*BOUNDARY\n1, 1, 2\n2, 1, 2\n*END STEP\n"
    )
    listed = ("*MATERIAL DragonSkin30, steel", "*DENSITY (1 line)", "*STEP", "*BOUNDARY (2 lines)")
    assert file.not_read == listed


@pytest.mark.parametrize("kind", ["CPE3", "CPS3", "CAX3"])
def test_an_element_type_and_its_hybrid_are_one_formulation(read, kind):
    text = SQUARE.replace("CPE3\n", f"{kind.lower()}\n").replace(
        "7, 10", f"*ELEMENT, TYPE={kind}H\n7, 10"
    )
    file = read(text)
    assert file.element_type == kind
    assert len(file.mesh.cells) == 2


def test_tetrahedra_with_sets_on_their_cards(read):
    file = read(TETRAHEDRON + "*SURFACE, NAME=base\nbody, S1\n", length_unit=1.0)
    assert file.element_type == "C3D4"
    assert file.mesh.node_sets["all"].tolist() == [0, 1, 2, 3]
    assert file.mesh.cell_sets["body"].tolist() == [0]
    assert file.mesh.facet_sets["base"].tolist() == [[0, 2, 1]]


@pytest.mark.parametrize(
    ("face", "nodes"), [("S1", {0, 1, 2}), ("S2", {0, 3, 1}), ("S3", {1, 3, 2}), ("S4", {2, 3, 0})]
)
def test_faces_of_a_tetrahedron_are_counted_as_abaqus_does(read, face, nodes):
    mesh = read(TETRAHEDRON + f"*SURFACE, NAME=side\n1, {face}\n").mesh
    assert [set(facet) for facet in mesh.facet_sets["side"].tolist()] == [nodes]


# A unit cube, and a wedge, a pyramid and a tetrahedron on it.
BRICKS = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
9, 2, 0, 0
10, 2, 0, 1
11, 0.5, 0.5, 2
12, 0.5, 2, 1.5
*ELEMENT, TYPE=C3D8R, ELSET=cube
101, 1, 2, 3, 4, 5, 6, 7, 8
*ELEMENT, TYPE=C3D6, ELSET=wedge
102, 2, 9, 3, 6, 10, 7
*ELEMENT, TYPE=C3D5
103, 5, 6, 7, 8, 11
*ELEMENT, TYPE=C3D4H
104, 7, 8, 11, 12
"""


def test_elements_of_several_shapes_are_one_body(read):
    mesh = read(BRICKS + "*SURFACE, NAME=all\n,\n*SURFACE, NAME=floor\n101, S1\nwedge, S1\n",
                length_unit=1.0).mesh  # fmt: skip
    volumes = signed_volumes(mesh.points, mesh.cells)
    np.testing.assert_allclose(volumes[:3], [1.0, 1 / 2, 1 / 3])
    assert mesh.cell_sets["wedge"].tolist() == [1]
    assert len(mesh.facet_sets["all"]) == len(mesh.facet_sets["surface"]) == 4 + 4 + 3 + 3
    assert [set(f) for f in mesh.facet_sets["floor"].tolist()] == [{0, 1, 2, 3}, {1, 8, 2}]


@pytest.mark.parametrize(
    ("element", "faces"),
    [
        # ABAQUS Analysis User's Guide, Three-dimensional solid element library: faces.
        (101, {"S1": "1 2 3 4", "S3": "1 5 6 2", "S5": "3 7 8 4", "S6": "4 8 5 1"}),
        (102, {"S1": "2 9 3", "S2": "6 7 10", "S3": "2 6 10 9", "S4": "9 10 7 3"}),
        (103, {"S2": "5 11 6", "S5": "8 11 5"}),
    ],
)
def test_faces_of_solids_are_counted_as_abaqus_does(read, element, faces):
    for face, nodes in faces.items():
        mesh = read(BRICKS + f"*SURFACE, NAME=side\n{element}, {face}\n").mesh
        assert [{n + 1 for n in f} for f in mesh.facet_sets["side"].tolist()] == [
            {int(n) for n in nodes.split()}
        ]


@pytest.mark.parametrize("kind", ["CPE4", "CPE4R", "CAX4RH", "CPE4I"])
def test_quadrilaterals_beside_triangles_with_their_faces(read, kind):
    text = SQUARE.replace("CPE3\n5, 10, 20, 30\n7, 10, 30, 40\n", f"{kind}\n5, 10, 20, 30, 40\n")
    text = text.replace("*Element", "50, 20., 5.\n60, 0., 20.\n70, 10., 20.\n*Element")
    text += f"*ELEMENT, TYPE={kind[:3]}3\n7, 20, 50, 30\n*ELEMENT, TYPE={kind}\n"
    text += "8, 40, 30, 70, 70\n9, 40, 60, 70, 70\n"
    text += "*SURFACE, NAME=left\n5, S4\n*SURFACE, NAME=right\n7, S2\n*SURFACE, NAME=rest\n,\n"
    file = read(text)
    assert file.element_type == kind.removesuffix("H")
    assert file.turned_cells == 1
    np.testing.assert_allclose(
        signed_volumes(file.mesh.points, file.mesh.cells), [1e-4, 5e-5, 5e-5, 5e-5]
    )
    assert file.mesh.facet_sets["left"].tolist() == [[3, 0]]
    assert file.mesh.facet_sets["right"].tolist() == [[4, 2]]
    assert len(file.mesh.facet_sets["rest"]) == 7


def test_an_inverted_hexahedron_is_turned(read):
    text = BRICKS.replace("101, 1, 2, 3, 4, 5, 6, 7, 8", "101, 5, 6, 7, 8, 1, 2, 3, 4")
    file = read(text, length_unit=1.0)
    assert file.turned_cells == 1
    assert signed_volumes(file.mesh.points, file.mesh.cells)[0] == pytest.approx(1.0)


def test_what_abaqus_cae_writes(read, caplog):
    file = read(CAE)
    mesh = file.mesh
    assert file.element_type == "CAX3"
    assert mesh.node_sets["Set-1"].tolist() == [1, 2]
    assert mesh.node_sets["Skin-1_Set-1"].tolist() == [0, 1, 2, 3]
    assert mesh.node_sets["Both"].tolist() == [0, 1, 2]
    assert mesh.node_sets["Left_end"].tolist() == [0, 3]
    assert mesh.node_sets["Tip"].tolist() == [2]
    assert "Set-1_CNS_" not in mesh.node_sets
    assert mesh.cell_sets["Skin-1_Set-1"].tolist() == [0, 1]
    assert mesh.facet_sets["Cavity"].tolist() == [[0, 1], [1, 2], [2, 3]]
    assert not [name for name in mesh.cell_sets if name.startswith("_")]
    assert file.dropped_nodes == 1
    assert "node set 'Frame' is ignored: no cell has its nodes" in caplog.text


def test_a_mesh_may_stand_in_its_instance(read):
    text = SQUARE.replace("*Node", "*PART, NAME=P\n*END PART\n*INSTANCE, NAME=I, PART=P\n*Node")
    assert len(read(text + "*END INSTANCE\n").mesh.cells) == 2


def test_an_unmoved_instance_may_say_so(read):
    text = CAE.replace("part=Skin\n*End", "part=Skin\n 0., 0., 0.\n*End")
    assert len(read(text).mesh.cells) == 2


def test_keywords_rows_and_names_in_all_their_spellings(read):
    text = SQUARE.replace("5, 10, 20, 30", "5, 10,\n** between\n20, 30,").replace("\n", "\r\n")
    mesh = read(
        text + "*NSet,\n  NSET = one\n10, 20,\n*nset, nset=ONE\n40\n*NSET, NSET=two\noNe, 30\n"
        '*ELSET, ELSET="a, b"\n5\n*SURFACE, NAME=s\n"a, b",S1\n*NSET, NSET=of, ELSET="A, B"\n'
    ).mesh
    assert mesh.cells[0].tolist() == [0, 1, 2]
    assert mesh.node_sets["one"].tolist() == [0, 1, 3]
    assert mesh.node_sets["two"].tolist() == [0, 1, 2, 3]
    assert mesh.node_sets["of"].tolist() == [0, 1, 2]
    assert mesh.cell_sets["a__b"].tolist() == [0]
    assert mesh.facet_sets["s"].tolist() == [[0, 1]]


def test_surfaces_without_a_face_are_the_free_boundary(read):
    rows = "*ELSET, ELSET=half\n7\n*SURFACE, NAME=part\nhalf\n*SURFACE, NAME=everything\n,\n"
    mesh = read(SQUARE + rows).mesh
    assert mesh.facet_sets["part"].tolist() == [[2, 3], [3, 0]]
    assert len(mesh.facet_sets["everything"]) == 4


def test_a_surface_inside_the_body_is_a_node_set_only(read, caplog):
    mesh = read(SQUARE + "*SURFACE, NAME=cut\n5, S3\n").mesh
    assert "cut" not in mesh.facet_sets
    assert mesh.node_sets["cut"].tolist() == [0, 2]
    assert "'cut' is not on the boundary" in caplog.text


def test_a_surface_decides_over_the_elements_of_its_name(read):
    mesh = read(SQUARE + "*ELSET, ELSET=tip\n5\n*SURFACE, NAME=tip\ntip, S1\n").mesh
    assert mesh.node_sets["tip"].tolist() == [0, 1]
    assert mesh.cell_sets["tip"].tolist() == [0]


def test_gaps_in_a_generated_set_are_told(read, caplog):
    mesh = read(SQUARE + "*NSET, NSET=some, GENERATE\n10, 30, 5\n").mesh
    assert mesh.node_sets["some"].tolist() == [0, 1, 2]
    assert "2 of these 5 nodes do not exist" in caplog.text


def test_inverted_elements_are_turned_and_named(read, caplog):
    with caplog.at_level(logging.WARNING):
        file = read(SQUARE.replace("7, 10, 30, 40", "7, 10, 40, 30"))
    assert (file.turned_cells, file.dropped_nodes) == (1, 0)
    assert "turned 1 inverted cells of 2, the first one is element 7" in caplog.text


def test_a_loose_node_is_refused_by_its_label(read):
    with pytest.raises(MeshError, match=r"node 99 at \(1, 1, 0\) .* belongs to no cell") as caught:
        read(SQUARE + "*NODE\n99, 1, 1\n")
    assert "*ASSEMBLY" in caught.value.hint


def grid_of_simplices(dimension: int, counts: list[int], rng: np.random.Generator):
    """A jittered grid of squares or cubes, each cut into simplices along its diagonal."""
    shape = [count + 1 for count in counts[:dimension]]
    points = np.stack(
        np.meshgrid(*[np.arange(n, dtype=float) for n in shape], indexing="ij"), axis=-1
    ).reshape(-1, dimension)
    corner = np.arange(len(points)).reshape(shape)[(slice(-1),) * dimension].reshape(-1, 1)
    strides = np.array([int(np.prod(shape[axis + 1 :])) for axis in range(dimension)])
    orders = [[0, 1], [1, 0]] if dimension == 2 else [[0, 1, 2], [1, 2, 0], [2, 0, 1]]
    orders += [] if dimension == 2 else [[1, 0, 2], [0, 2, 1], [2, 1, 0]]
    steps = [np.concatenate([[0], np.cumsum(strides[order])]) for order in orders]
    cells = np.concatenate([corner + step for step in steps])
    inverted = signed_volumes(points, cells) < 0
    cells[inverted, :2] = cells[inverted, 1::-1]
    return points + rng.uniform(-0.05, 0.05, points.shape), cells


def as_text(label: int, values) -> str:
    return f"{label}, " + ", ".join(repr(v) for v in values)


@settings(max_examples=40)
@given(
    dimension=st.sampled_from([2, 3]),
    counts=st.lists(st.integers(1, 3), min_size=3, max_size=3),
    seed=st.integers(0, 2**32 - 1),
)
def test_a_written_body_comes_back(tmp_path_factory, dimension, counts, seed):
    rng = np.random.default_rng(seed)
    points, cells = grid_of_simplices(dimension, counts, rng)
    turned = rng.random(len(cells)) < 0.3
    node_label = 7 + 10 * rng.permutation(len(points))
    cell_label = 3 + 4 * rng.permutation(len(cells))
    written = cells.copy()
    written[turned, :2] = written[turned, 1::-1]
    boundary = boundary_facets(cells, dimension)
    chosen = boundary[rng.permutation(len(boundary))[: rng.integers(1, len(boundary) + 1)]]
    faces = FACES[dimension, dimension + 1]
    place = {
        frozenset(cell[face]): f"{cell_label[number]}, S{side + 1}"
        for number, cell in enumerate(written)
        for side, face in enumerate(faces)
    }
    nodes = rng.permutation(len(points))[: rng.integers(1, len(points) + 1)]
    last = int(node_label.max())
    text = [
        "*NODE",
        *(as_text(label, row) for label, row in zip(node_label, points.tolist(), strict=True)),
        f"*ELEMENT, TYPE={'CPE3' if dimension == 2 else 'C3D4'}",
        *(
            as_text(label, row)
            for label, row in zip(cell_label, node_label[written].tolist(), strict=True)
        ),
        "*NSET, NSET=picked",
        *(f"{label}," for label in node_label[nodes]),
        "*NSET, NSET=every second, GENERATE",
        f"7, {last}, 20",
        "*SURFACE, NAME=walls",
        *(place[frozenset(facet)] for facet in chosen),
        "*END STEP",
    ]
    path = tmp_path_factory.mktemp("abaqus") / "body.INP"
    path.write_text("\n".join(text))
    file = read_mesh(path, length_unit=0.5)

    assert file.turned_cells == turned.sum()
    np.testing.assert_array_equal(file.mesh.points, 0.5 * points)
    np.testing.assert_array_equal(np.sort(file.mesh.cells, axis=1), np.sort(cells, axis=1))
    assert file.mesh.node_sets["picked"].tolist() == sorted(nodes)
    expected = np.flatnonzero((node_label - 7) % 20 == 0)
    assert file.mesh.node_sets["every_second"].tolist() == expected.tolist()
    walls = {frozenset(facet) for facet in file.mesh.facet_sets["walls"].tolist()}
    assert walls == {frozenset(facet) for facet in chosen.tolist()}
