import meshio
import numpy as np
import pytest

from softsim.errors import MeshError
from softsim.mesh.mesh import open_rim, signed_volumes
from softsim.mesh.quality import check
from softsim.mesh.reading import read_mesh

# A unit square in two triangles, the second one clockwise; node 4 belongs to no cell.
POINTS = np.array([[0, 0, 2], [10, 0, 2], [10, 10, 2], [0, 10, 2], [5, 5, 2.0]])
TRIANGLES = np.array([[0, 1, 2], [0, 3, 2]])

GMSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
1 1 "inlet"
1 3 "crack"
2 2 "skin"
$EndPhysicalNames
$Nodes
4
1 0 0 2
2 10 0 2
3 10 10 2
4 0 10 2
$EndNodes
$Elements
5
1 1 2 1 1 1 2
2 1 2 1 1 3 2
3 1 2 3 1 1 3
4 2 2 2 1 1 2 3
5 2 2 2 1 1 4 3
$EndElements
"""

ABAQUS = """*HEADING
*NODE
1, 0., 0.
2, 10., 0.
3, 10., 10.
4, 0., 10.
*ELEMENT, TYPE=CPS3, ELSET=skin
1, 1, 2, 3
2, 1, 3, 4
*NSET, NSET=clamped
1, 4
"""

TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])


def written(path, text):
    path.write_text(text)
    return path


def test_gmsh_groups_become_sets_with_facets_turned_outward(tmp_path, caplog):
    read = read_mesh(written(tmp_path / "body.msh", GMSH))
    mesh = read.mesh
    assert mesh.points.tolist() == [[0, 0], [0.01, 0], [0.01, 0.01], [0, 0.01]]
    assert mesh.facet_sets["inlet"].tolist() == [[0, 1], [1, 2]]
    assert mesh.node_sets["inlet"].tolist() == [0, 1, 2]
    assert mesh.cell_sets["skin"].tolist() == [0, 1]
    assert (read.element_type, read.turned_cells, read.dropped_nodes) == ("", 1, 0)
    assert "turned 1 inverted cells of 2, the first one is cell 1" in caplog.text


def test_lines_inside_the_body_are_a_node_set_only(tmp_path, caplog):
    mesh = read_mesh(written(tmp_path / "body.msh", GMSH)).mesh
    assert mesh.node_sets["crack"].tolist() == [0, 2]
    assert "crack" not in mesh.facet_sets
    assert "'crack' is not on the boundary" in caplog.text


def test_abaqus_sets(tmp_path):
    mesh = read_mesh(written(tmp_path / "body.inp", ABAQUS), length_unit=1.0).mesh
    assert mesh.points.max() == 10
    assert mesh.node_sets["clamped"].tolist() == [0, 3]
    assert mesh.cell_sets["skin"].tolist() == [0, 1]


def test_vtu_drops_the_plane_and_refuses_loose_nodes(tmp_path):
    path = tmp_path / "body.vtu"
    meshio.write(path, meshio.Mesh(POINTS[:4], [("triangle", TRIANGLES)]))
    assert read_mesh(path).mesh.points.shape == (4, 2)
    meshio.write(path, meshio.Mesh(POINTS, [("triangle", TRIANGLES)]))
    with pytest.raises(MeshError, match=r"node 4 at .* belongs to no cell"):
        read_mesh(path)


def test_tetrahedra_are_read_in_three_dimensions(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    path = tmp_path / "body.vtu"
    meshio.write(path, meshio.Mesh(points, [("tetra", np.array([[0, 2, 1, 3]]))]))
    mesh = read_mesh(path).mesh
    assert mesh.dimension == 3
    assert len(mesh.facet_sets["surface"]) == 4


def test_second_order_and_other_cells_are_refused_by_name(tmp_path):
    path = tmp_path / "body.vtu"
    six = np.array([[0, 1, 2, 3, 4, 5]])
    ten = np.array([[0, 1, 2, 3, 4, 5, 0, 1, 2, 3]])
    points = np.random.default_rng(0).random((6, 3))
    meshio.write(path, meshio.Mesh(points, [("triangle6", six), ("tetra10", ten)]))
    with pytest.raises(MeshError, match=r"body\.vtu: cells of type tetra10, triangle6") as caught:
        read_mesh(path)
    assert "reduce_order: true" in caught.value.hint


def test_mid_side_nodes_of_second_order_cells_are_left_out(tmp_path):
    """Two triangles of six nodes; sets of cells, lines and nodes keep what they have of corners."""
    corners, middles = POINTS[:4], (POINTS[[0, 1, 0, 2, 3]] + POINTS[[1, 2, 2, 3, 0]]) / 2
    blocks = [
        ("triangle6", np.array([[0, 1, 2, 4, 5, 6], [0, 2, 3, 6, 7, 8]])),
        ("line3", np.array([[0, 1, 4]])),
    ]
    data = {"first": [np.array([1, 0]), np.array([0])], "inlet": [np.array([0, 0]), np.array([1])]}
    path = tmp_path / "body.vtu"
    meshio.write(path, meshio.Mesh(np.vstack([corners, middles]), blocks, cell_data=data))
    file = read_mesh(path, length_unit=1.0, reduce_order=True)
    assert file.mesh.points.tolist() == corners[:, :2].tolist()
    assert file.mesh.cells.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert file.mesh.cell_sets["first"].tolist() == [0]
    assert file.mesh.facet_sets["inlet"].tolist() == [[0, 1]]
    assert file.changes == ("5 mid-side nodes dropped",)


@pytest.mark.parametrize(
    ("name", "said", "hint"),
    [
        ("foot.STEP", "is CAD geometry, not a mesh", "`softsim mesh foot.STEP --size 1mm`"),
        ("foot.iges", "is CAD geometry, not a mesh", "{file: foot.iges, size: 1 mm}"),
        ("foot.brep", "is CAD geometry, not a mesh", "softsim mesh foot.brep"),
        ("foot.geo", "is a script for gmsh, not a mesh", "softsim mesh foot.geo"),
        ("foot.stl", "a closed surface of triangles, not a volume mesh", "softsim mesh foot.stl"),
        ("foot.ply", "a closed surface of triangles, not a volume mesh", "convert it to STL"),
        ("foot.xdmf", "this mesh format is not supported", "formats: .msh, .vtu, .inp"),
    ],
)
def test_what_is_no_mesh_is_said_with_the_way_to_one(tmp_path, name, said, hint):
    with pytest.raises(MeshError, match=said) as caught:
        read_mesh(written(tmp_path / name, ""))
    assert hint in caught.value.hint


def test_quadrilaterals_and_triangles_are_one_body(tmp_path, caplog):
    """The second quadrilateral is clockwise; groups go over cells and lines of both."""
    text = GMSH.replace(
        "3 10 10 2\n4 0 10 2", "3 10 10 2\n4 0 10 2\n5 20 5 2\n6 0 -10 2\n7 10 -10 2"
    )
    text = text.replace("$Nodes\n4", "$Nodes\n7")
    a, b = text.index("$Elements"), text.index("$EndElements")
    elements = ["1 1 2 1 1 1 4", "2 1 2 1 1 3 5", "3 3 2 2 1 1 2 3 4", "4 2 2 2 1 2 5 3",
                "5 3 2 4 1 1 2 7 6"]  # fmt: skip
    text = text[:a] + "\n".join(["$Elements", "5", *elements, ""]) + text[b:]
    text = text.replace('3\n1 1 "inlet"\n1 3 "crack"', '2\n1 1 "inlet"')
    mesh = read_mesh(written(tmp_path / "body.msh", text)).mesh
    check(mesh)
    assert mesh.cells.shape == (3, 4)
    np.testing.assert_allclose(signed_volumes(mesh.points, mesh.cells).sum(), 250e-6)
    assert len(mesh.cell_sets["skin"]) == 2
    inlet = {frozenset(f) for f in mesh.facet_sets["inlet"].tolist()}
    assert inlet == {frozenset([0, 3]), frozenset([2, 4])}
    assert "turned 1 inverted cells of 3" in caplog.text


def test_hexahedra_wedges_pyramids_and_tetrahedra_are_one_body(tmp_path):
    points = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1],
         [2, 0, 0], [2, 0, 1], [0.5, 0.5, 2], [0.5, 2, 1.5]]
    )  # fmt: skip
    blocks = [
        ("tetra", np.array([[7, 6, 10, 11]])),
        ("quad", np.array([[0, 1, 2, 3]])),
        ("hexahedron", np.array([[0, 1, 2, 3, 4, 5, 6, 7]])),
        ("wedge", np.array([[1, 8, 2, 5, 9, 6]])),
        ("triangle", np.array([[1, 2, 8]])),
        ("pyramid", np.array([[4, 5, 6, 7, 10]])),
    ]
    below = [np.array([int(kind in ("quad", "triangle"))]) for kind, _ in blocks]
    inside = [np.array([int(kind in ("pyramid", "hexahedron"))]) for kind, _ in blocks]
    path = tmp_path / "body.vtu"
    data = {"below": below, "inside": inside}
    meshio.write(path, meshio.Mesh(points, blocks, cell_data=data))
    mesh = read_mesh(path, length_unit=1.0).mesh
    volumes = signed_volumes(mesh.points, mesh.cells)
    np.testing.assert_allclose(volumes[mesh.cell_sets["inside"]], [1.0, 1 / 3])
    np.testing.assert_allclose(sorted(volumes)[1:], [1 / 3, 1 / 2, 1.0])
    below = {frozenset(f) for f in mesh.facet_sets["below"].tolist()}
    assert below == {frozenset([0, 1, 2, 3]), frozenset([1, 2, 8])}
    assert open_rim(mesh.facet_sets["surface"]).shape == (0, 2)


def test_hexahedra_on_tetrahedra_without_pyramids_between_are_refused(tmp_path):
    points = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1],
         [0, 0, 2]]
    )  # fmt: skip
    blocks = [("hexahedron", np.arange(8)[None]), ("tetra", np.array([[4, 5, 6, 8], [4, 6, 7, 8]]))]
    path = tmp_path / "body.vtu"
    meshio.write(path, meshio.Mesh(points, blocks))
    with pytest.raises(MeshError, match=r"cell 0 and cell 1, .* meet with a quadrilateral"):
        read_mesh(path)


def test_a_bent_surface_is_no_plane_body(tmp_path):
    points = POINTS[:4] + np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 1]])
    path = tmp_path / "body.vtu"
    meshio.write(path, meshio.Mesh(points, [("triangle", TRIANGLES)]))
    with pytest.raises(MeshError, match="plane cells with z from 2 to 3"):
        read_mesh(path)


def test_a_file_without_cells_is_refused(tmp_path):
    path = tmp_path / "body.vtu"
    meshio.write(path, meshio.Mesh(POINTS, [("line", np.array([[0, 1]]))]))
    with pytest.raises(MeshError, match="contains no triangles"):
        read_mesh(path)


def test_the_name_surface_is_kept(tmp_path):
    path = written(tmp_path / "body.inp", ABAQUS.replace("clamped", "surface"))
    with pytest.raises(MeshError, match="'surface' is reserved"):
        read_mesh(path)


def test_faults_of_the_mesh_name_the_file(tmp_path):
    path = written(tmp_path / "body.inp", ABAQUS.replace("4, 0., 10.", "4, 5., 5."))
    with pytest.raises(MeshError, match=r"body\.inp: element 2 at .* is flat"):
        read_mesh(path)


@pytest.mark.parametrize("name", ["broken.msh", "broken.vtu", "broken.inp", "notes.txt"])
def test_an_unreadable_file_is_named(tmp_path, name):
    with pytest.raises(MeshError, match=rf"{name}:(1:)? "):
        read_mesh(written(tmp_path / name, "$Nonsense\n"))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(MeshError, match=r"gone\.msh: file not found"):
        read_mesh(tmp_path / "gone.msh")


def test_gmsh_groups_without_members_are_refused(tmp_path):
    text = GMSH.replace("$PhysicalNames\n3", '$PhysicalNames\n4\n1 9 "tip"')
    with pytest.raises(MeshError, match=r"body\.msh: the set 'tip' is empty"):
        read_mesh(written(tmp_path / "body.msh", text))


def test_gmsh_points_become_a_node_set(tmp_path):
    text = GMSH.replace("$PhysicalNames\n3", '$PhysicalNames\n4\n0 9 "tip"')
    text = text.replace("$Elements\n5", "$Elements\n6\n6 15 2 9 1 3")
    mesh = read_mesh(written(tmp_path / "body.msh", text)).mesh
    assert mesh.node_sets["tip"].tolist() == [2]


def test_a_facet_listed_twice_counts_once(tmp_path):
    text = GMSH.replace("$Elements\n5", "$Elements\n6\n6 1 2 1 1 2 1")
    mesh = read_mesh(written(tmp_path / "body.msh", text)).mesh
    assert mesh.facet_sets["inlet"].tolist() == [[0, 1], [1, 2]]


def test_vtu_arrays_of_zeros_and_ones_are_sets(tmp_path):
    path = tmp_path / "body.vtu"
    blocks = [("triangle", TRIANGLES), ("line", np.array([[1, 2], [0, 1]]))]
    meshio.write(
        path,
        meshio.Mesh(
            POINTS[:4],
            blocks,
            point_data={"tip": np.array([0, 0, 1, 1]), "id": np.arange(4), "x": POINTS[:4, 0]},
            cell_data={
                "inlet 1": [np.array([0, 0]), np.array([1, 0])],
                "skin": [np.array([0, 1]), np.array([0, 0])],
            },
        ),
    )
    mesh = read_mesh(path).mesh
    assert mesh.node_sets["tip"].tolist() == [2, 3]
    assert mesh.facet_sets["inlet_1"].tolist() == [[1, 2]]
    assert mesh.cell_sets["skin"].tolist() == [1]
    assert set(mesh.node_sets) == {"tip", "inlet_1", "skin", "surface"}


def test_sets_that_meshio_writes_to_vtu_come_back(tmp_path):
    path = tmp_path / "body.vtu"
    blocks = [("triangle", TRIANGLES), ("line", np.array([[0, 1], [1, 2], [2, 3]]))]
    groups = {
        "inlet": [np.array([], dtype=int), np.array([0, 1])],
        "outlet": [np.array([], dtype=int), np.array([2])],
    }
    points = {"tip": np.array([2])}
    meshio.write(path, meshio.Mesh(POINTS[:4], blocks, cell_sets=groups, point_sets=points))
    mesh = read_mesh(path).mesh
    assert mesh.node_sets["tip"].tolist() == [2]
    assert mesh.facet_sets["inlet"].tolist() == [[0, 1], [1, 2]]
    assert mesh.facet_sets["outlet"].tolist() == [[2, 3]]


def test_a_vtu_array_without_a_member_is_an_empty_set(tmp_path):
    path = tmp_path / "body.vtu"
    data = {"tip": np.zeros(4, dtype=int)}
    meshio.write(path, meshio.Mesh(POINTS[:4], [("triangle", TRIANGLES)], point_data=data))
    with pytest.raises(MeshError, match=r"body\.vtu: the set 'tip' is empty"):
        read_mesh(path)


def test_triangles_on_tetrahedra_are_facets_but_triangles_apart_are_refused(tmp_path):
    path = tmp_path / "body.vtu"
    points = np.vstack([TETRAHEDRON, [5, 5, 5]])
    for corner, fits in ((2, True), (4, False)):
        blocks = [("tetra", [[0, 1, 2, 3]]), ("triangle", [[0, 1, corner]])]
        data = {"base": [np.array([0]), np.array([1])]}
        meshio.write(path, meshio.Mesh(points[: 4 + (not fits)], blocks, cell_data=data))
        if fits:
            assert read_mesh(path).mesh.facet_sets["base"].tolist() == [[0, 2, 1]]
        else:
            with pytest.raises(MeshError, match="mixed dimensions: triangle 0 at"):
                read_mesh(path)


def test_cells_with_nodes_that_do_not_exist_are_refused(tmp_path):
    path = tmp_path / "body.vtu"
    meshio.write(path, meshio.Mesh(POINTS, [("triangle", np.array([[0, 1, 7]]))]))
    with pytest.raises(MeshError, match="the cells: node number 7 is out of range"):
        read_mesh(path)


def test_two_pieces_are_one_body_with_a_warning(tmp_path, caplog):
    path = tmp_path / "body.vtu"
    points = np.vstack([POINTS[:4], POINTS[:4] + np.array([20, 0, 0])])
    meshio.write(path, meshio.Mesh(points, [("triangle", np.vstack([TRIANGLES, TRIANGLES + 4]))]))
    assert len(read_mesh(path).mesh.cells) == 4
    assert "the body consists of 2 pieces" in caplog.text
