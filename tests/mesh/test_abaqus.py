import logging

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsim.errors import MeshError
from softsim.mesh.abaqus_elements import FACES
from softsim.mesh.mesh import boundary_facets, signed_volumes
from softsim.mesh.reading import read_mesh

# A square of 10 mm in two triangles, with labels that have gaps.
NODES = """*Node
   10, 0., 0.
   20, 10., 0.
   30, 10., 1.D1
   40, 0., 10.
"""
SQUARE = (
    "** a comment\n*Heading\nnothing, to, read\n"
    + NODES
    + "*Element, type=CPE3\n5, 10, 20, 30\n7, 10, 30, 40\n"
)
TETRAHEDRON = """*NODE, NSET=all
1, 0, 0, 0
2, 1, 0, 0
3, 0, 1, 0
4, 0, 0, 1
*ELEMENT, TYPE=C3D4, ELSET=body
1, 1, 2, 3, 4
"""
CAE = """*Heading
** PARTS
*Part, name=Skin
*Node
      1, 0., 0.
      2, 10., 0.
      3, 10., 10.
      4, 0., 10.
*Element, type=CAX3H
1, 1, 2, 3
2, 1, 3, 4
*Nset, nset=Set-1, generate
 1, 4, 1
*Elset, elset=Set-1, generate
 1, 2, 1
*Nset, nset="Left end"
 1, 4
** Section: Section-1
*Solid Section, elset=Set-1, material=Silicone
,
*End Part
**
*Assembly, name=Assembly
**
*Instance, name=Skin-1, part=Skin
*End Instance
**
*Node
      1, 25., 5., 0.
*Nset, nset=Frame
 1,
*Nset, nset=Set-1, instance=Skin-1
 2, 3
*Nset, nset=Both
 Set-1, Skin-1.1
*Elset, elset=_Cavity_S2, internal, instance=Skin-1, generate
 1, 2, 1
*Elset, elset=_Cavity_S1, internal, instance=Skin-1
 1,
*Surface, type=ELEMENT, name=Cavity
_Cavity_S1, S1
_Cavity_S2, S2
*Surface, type=NODE, name=Set-1_CNS_, internal
Set-1, 1.
*Surface, type=NODE, name=Tip
Skin-1.3, 1.
*End Assembly
*Material, name=Silicone
*Hyperelastic, yeoh
 0.119, 0., 0., 0., 0., 0.
*Step, name=Step-1
*Boundary
Set-1, 1, 1
*End Step
"""


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
    assert "node set 'Frame' is left out: no cell has its nodes" in caplog.text


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


def with_type(kind):
    return SQUARE.replace("type=CPE3", f"type={kind}")


REFUSALS = {
    "quadrilateral": (with_type("CPE4R"), 9, "type CPE4R, linear quadrilaterals, are", "CPE3"),
    "plane second order": (
        with_type("CPE6M"),
        9,
        "type CPE6M, second-order triangles, are",
        "linear triangles: CPE3 or CPE3H",
    ),
    "solid second order": (
        with_type("C3D10"),
        9,
        "type C3D10, second-order tetrahedra, are",
        "linear tetrahedra: C3D4 or C3D4H",
    ),
    "hexahedron": (with_type("C3D8R"), 9, "type C3D8R, linear hexahedra, are", "C3D4"),
    "axisymmetric": (with_type("CAX4RH"), 9, "type CAX4RH", "CAX3 or CAX3H"),
    "shell": (with_type("S3"), 9, "type S3 are not", "CPE3, CPS3, CAX3, C3D4"),
    "formulations": (
        SQUARE + "*ELEMENT, TYPE=CAX3\n8, 10, 20, 30\n",
        12,
        r"mixed formulations: elements of type CAX3 beside CPE3 \(line 9\)",
        "all elements of the body the type CPE3",
    ),
    "dimensions": (
        SQUARE + "*ELEMENT, TYPE=C3D4\n8, 10, 20, 30, 40\n",
        12,
        r"mixed dimensions: elements of type C3D4 beside CPE3 \(line 9\)",
        "a file for each",
    ),
    "no type": (SQUARE.replace(", type=CPE3", ""), 9, r"\*ELEMENT needs TYPE=", ""),
    "empty node set": (SQUARE + "*NSET, NSET=tip\n", 12, "the node set 'tip' is empty", ""),
    "empty element set": (SQUARE + "*ELSET, ELSET=e\n,\n", 12, "element set 'e' is empty", ""),
    "empty surface": (SQUARE + "*SURFACE, NAME=s\n", 12, "the surface 's' is empty", ""),
    "buried surface": (
        TETRAHEDRON.replace("1, 1, 2, 3, 4", "1, 1, 2, 3, 4\n2, 1, 2, 3, 4")
        + "*SURFACE, NAME=s\n2\n",
        9,
        "the surface 's' is empty: its elements have no free face",
        "",
    ),
    "empty range": (
        SQUARE + "*NSET, NSET=g, GENERATE\n1, 5\n",
        12,
        "the node set 'g' is empty",
        "",
    ),
    "bad range": (
        SQUARE + "*NSET, NSET=g, GENERATE\n1, 5, 0\n",
        13,
        "the row '1, 5, 0' generates no members",
        "first, last, increment",
    ),
    "no such node": (SQUARE + "*NSET, NSET=a\n10, 11\n", 13, "there is no node 11", ""),
    "no such element": (SQUARE + "*SURFACE, NAME=a\n4, S1\n", 13, "there is no element 4", ""),
    "no such set": (
        SQUARE + "*NSET, NSET=a\n10\n*NSET, NSET=b\nc\n",
        15,
        "there is no node set 'c'",
        "there are: a, b",
    ),
    "circle": (
        SQUARE + "*NSET, NSET=a\nb\n*NSET, NSET=b\na\n",
        12,
        "the node set 'a' contains itself",
        "",
    ),
    "no such face": (
        SQUARE + "*SURFACE, NAME=a\n5, S4\n",
        13,
        "'S4' is no face of an element CPE3",
        "S1, S2, S3",
    ),
    "surface twice": (
        SQUARE + "*SURFACE, NAME=a\n5, S1\n*SURFACE, NAME=A\n7, S2\n",
        14,
        "the surface 'a' is defined twice, first in line 12",
        "",
    ),
    "surface type": (
        SQUARE + "*SURFACE, NAME=a, TYPE=SEGMENTS\n",
        12,
        "the surface 'a' has TYPE=SEGMENTS",
        "",
    ),
    "two node sets": (
        SQUARE + "*NSET, NSET=a\n10\n*SURFACE, NAME=a, TYPE=NODE\n20\n",
        14,
        "'a' is both a node set and a surface of nodes",
        "",
    ),
    "no such corner": (
        SQUARE + "*ELEMENT, TYPE=CPE3\n8, 10, 20, 33\n",
        13,
        "element 8 has the node 33, which does not exist",
        "",
    ),
    "too many corners": (
        SQUARE.replace("5, 10, 20, 30", "5, 10, 20, 30, 40"),
        10,
        "element 5 has 4 nodes; CPE3 has 3",
        "",
    ),
    "too few corners": (
        SQUARE.replace("7, 10, 30, 40", "7, 10, 30,"),
        11,
        "element 7 has 2 nodes",
        "",
    ),
    "element twice": (SQUARE.replace("7, 10", "5, 10"), 11, "element 5 is defined twice", ""),
    "node twice": (SQUARE.replace("20, 10.", "10, 10."), 6, "node 10 is defined twice", ""),
    "one coordinate": (SQUARE.replace("0., 10.\n", "5.\n"), 8, "node 40 has 1 coordinates", ""),
    "no number": (SQUARE.replace("1.D1", "<y>"), 7, "'<y>' is no number", ""),
    "no label": (SQUARE.replace("20, 10.,", "b, 10.,"), 6, "'b' is no node number", ""),
    "include": ("*INCLUDE, INPUT=mesh.inp\n", 1, r"\*INCLUDE is not supported", "in its place"),
    "generated nodes": (SQUARE + "*NGEN\n", 12, r"\*NGEN is not supported", "write the nodes"),
    "node system": (
        SQUARE.replace("*Node", "*Node, system=C"),
        4,
        r"the parameter SYSTEM of \*NODE is not supported",
        "supported: NSET",
    ),
    "moved instance": (
        CAE.replace("part=Skin\n*End", "part=Skin\n 0., 5., 0.\n*End"),
        26,
        "the instance 'Skin-1' is moved",
        "remove this line",
    ),
    "two instances": (
        CAE.replace("*End Instance\n", "*End Instance\n*Instance, name=Skin-2, part=Skin\n"),
        27,
        "a second instance, 'Skin-2', beside 'Skin-1'",
        "one body",
    ),
    "two parts": (
        CAE.replace("*End Part\n", "*End Part\n*Part, name=Frame\n"),
        22,
        "a second part, 'Frame', beside 'Skin'",
        "one body",
    ),
    "element of the assembly": (
        CAE.replace("*End Assembly", "*Element, type=CAX3\n3, 1, 2, 3\n*End Assembly"),
        None,
        "elements of the assembly itself",
        "",
    ),
    "data first": ("1, 2, 3\n", 1, "data before the first keyword", ""),
}


@pytest.mark.parametrize(("text", "line", "said", "hint"), REFUSALS.values(), ids=REFUSALS)
def test_refusals_name_the_line_and_a_way_out(read, text, line, said, hint):
    with pytest.raises(MeshError, match=said) as caught:
        read(text)
    assert hint in caught.value.hint
    if line is not None:
        assert f"body.inp:{line}: " in caught.value.message
    assert caught.value.exit_code == 2


WHOLE_FILE_REFUSALS = {
    "no elements": (NODES, "body.inp: holds no elements"),
    "element on element": (
        SQUARE + "*ELEMENT, TYPE=CPE3\n8, 20, 30, 10\n",
        "body.inp: element 5 and element 8, .* lie on the same side of a common facet",
    ),
    "double node": (
        SQUARE.replace("7, 10, 30, 40", "7, 10, 35, 40") + "*NODE\n35, 10, 10\n",
        "body.inp: nodes 30 and 35 lie in one place",
    ),
    "one name for two sets": (
        SQUARE + '*NSET, NSET="a b"\n10\n*NSET, NSET=a_b\n20\n',
        "the sets 'a b' and 'a_b' would both be called 'a_b'",
    ),
    "bent": (SQUARE.replace("40, 0., 10.", "40, 0., 10., 1."), "triangles at z from 0 to 1"),
}


@pytest.mark.parametrize(
    ("text", "said"), WHOLE_FILE_REFUSALS.values(), ids=WHOLE_FILE_REFUSALS.keys()
)
def test_faults_of_the_body_name_nodes_and_elements_as_the_file_does(read, text, said):
    with pytest.raises(MeshError, match=said):
        read(text)


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


@settings(max_examples=40, deadline=None)
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
    boundary = boundary_facets(cells)
    chosen = boundary[rng.permutation(len(boundary))[: rng.integers(1, len(boundary) + 1)]]
    faces = FACES[dimension + 1]
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
