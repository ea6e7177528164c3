"""What an ABAQUS input file may not hold is refused with its line and a way out."""

import pytest
from abaqus_decks import CAE, NODES, SQUARE, TETRAHEDRON

from softsim.errors import MeshError
from softsim.mesh.reading import read_mesh


@pytest.fixture
def read(tmp_path):
    def read_text(text: str, **options):
        path = tmp_path / "body.inp"
        path.write_text(text)
        return read_mesh(path, **options)

    return read_text


def with_type(kind):
    return SQUARE.replace("type=CPE3", f"type={kind}")


REFUSALS = {
    "plane second order": (
        with_type("CPE6M"),
        9,
        "type CPE6M, second-order triangles, are",
        "reduce_order: true next to the file name",
    ),
    "solid second order": (
        with_type("C3D10"),
        9,
        "type C3D10, second-order tetrahedra, are",
        "linear elements: C3D4, C3D5, C3D6, C3D8, C3D8R",
    ),
    "axisymmetric second order": (with_type("CAX8RH"), 9, "type CAX8RH", "CAX3, CAX4, CAX4R"),
    "nodes of a quadrilateral": (with_type("CPE4R"), 10, "5 has 3 nodes; CPE4R has 4", ""),
    "face of a triangle beside quadrilaterals": (
        SQUARE.replace("7, 10, 30, 40", "*ELEMENT, TYPE=CPE4R\n7, 10, 30, 40, 40")
        + "*SURFACE, NAME=a\n7, S4\n5, S4\n",
        15,
        "elements CPE3 have no face 'S4'",
        "S1, S2, S3",
    ),
    "shell": (with_type("S3"), 9, "type S3 are not", "CPE3, CPE4, CPE4R"),
    "formulations": (
        SQUARE + "*ELEMENT, TYPE=CAX3\n8, 10, 20, 30\n",
        12,
        r"mixed formulations: elements of type CAX3 and of type CPE3 \(line 9\)",
        "element types CPE for the whole body, or CAX",
    ),
    "dimensions": (
        SQUARE + "*ELEMENT, TYPE=C3D4\n8, 10, 20, 30, 40\n",
        12,
        r"mixed dimensions: elements of type C3D4 and of type CPE3 \(line 9\)",
        "one file for each",
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
        "elements CPE3 have no face 'S4'",
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
    "no number": (SQUARE.replace("1.D1", "<y>"), 7, "'<y>' is not a number", ""),
    "no label": (SQUARE.replace("20, 10.,", "b, 10.,"), 6, "'b' is not a node number", ""),
    "include": ("*INCLUDE, INPUT=mesh.inp\n", 1, r"\*INCLUDE is not supported", "insert the text"),
    "moved nodes": (
        SQUARE + "*IMPERFECTION, FILE=modes, STEP=1\n",
        12,
        r"\*IMPERFECTION is not supported",
        "change the coordinates",
    ),
    "generated nodes": (SQUARE + "*NGEN\n", 12, r"\*NGEN is not supported", "write out the nodes"),
    "node system": (
        SQUARE.replace("*Node", "*Node, system=C"),
        4,
        r"the parameter SYSTEM of \*NODE is not supported",
        "supported: NSET",
    ),
    "moved instance": (
        CAE.replace("part=Skin\n*End", "part=Skin\n 0., 5., 0.\n*End"),
        26,
        "the instance 'Skin-1' is placed away",
        "write instance: Skin-1 next to the file name",
    ),
    "two instances": (
        CAE.replace("*End Instance\n", "*End Instance\n*Instance, name=Skin-2, part=Skin\n"),
        27,
        "the file has 2 instances: Skin-1, Skin-2",
        "write instance: Skin-1 next to",
    ),
    "two parts": (
        SQUARE + "*Part, name=Skin\n*End Part\n*Part, name=Frame\n*End Part\n",
        14,
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
    "no elements": (NODES, "body.inp: contains no elements"),
    "element on element": (
        SQUARE + "*ELEMENT, TYPE=CPE3\n8, 20, 30, 10\n",
        "body.inp: element 5 and element 8, .* lie on the same side of a common facet",
    ),
    "double node": (
        SQUARE.replace("7, 10, 30, 40", "7, 10, 35, 40") + "*NODE\n35, 10, 10\n",
        "body.inp: nodes 30 and 35 are at the same place",
    ),
    "one name for two sets": (
        SQUARE + '*NSET, NSET="a b"\n10\n*NSET, NSET=a_b\n20\n',
        "the sets 'a b' and 'a_b' would both be called 'a_b'",
    ),
    "bent": (SQUARE.replace("40, 0., 10.", "40, 0., 10., 1."), "plane cells with z from 0 to 1"),
}


@pytest.mark.parametrize(
    ("text", "said"), WHOLE_FILE_REFUSALS.values(), ids=WHOLE_FILE_REFUSALS.keys()
)
def test_faults_of_the_body_name_nodes_and_elements_as_the_file_does(read, text, said):
    with pytest.raises(MeshError, match=said):
        read(text)
