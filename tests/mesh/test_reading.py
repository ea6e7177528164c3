import logging

import meshio
import numpy as np
import pytest

from softsim.errors import MeshError
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


def written(path, text):
    path.write_text(text)
    return path


def test_gmsh_groups_become_sets_with_facets_turned_outward(tmp_path, caplog):
    mesh = read_mesh(written(tmp_path / "body.msh", GMSH))
    assert mesh.points.tolist() == [[0, 0], [0.01, 0], [0.01, 0.01], [0, 0.01]]
    assert mesh.facet_sets["inlet"].tolist() == [[0, 1], [1, 2]]
    assert mesh.node_sets["inlet"].tolist() == [0, 1, 2]
    assert mesh.cell_sets["skin"].tolist() == [0, 1]
    assert "turned 1 inverted cells of 2" in caplog.text


def test_lines_inside_the_body_are_a_node_set_only(tmp_path, caplog):
    mesh = read_mesh(written(tmp_path / "body.msh", GMSH))
    assert mesh.node_sets["crack"].tolist() == [0, 2]
    assert "crack" not in mesh.facet_sets
    assert "'crack' is not on the boundary" in caplog.text


def test_abaqus_sets(tmp_path):
    mesh = read_mesh(written(tmp_path / "body.inp", ABAQUS), length_unit=1.0)
    assert mesh.points.max() == 10
    assert mesh.node_sets["clamped"].tolist() == [0, 3]
    assert mesh.cell_sets["skin"].tolist() == [0, 1]


def test_vtu_drops_the_plane_and_loose_nodes(tmp_path, caplog):
    path = tmp_path / "body.vtu"
    meshio.write(path, meshio.Mesh(POINTS, [("triangle", TRIANGLES)]))
    with caplog.at_level(logging.WARNING):
        mesh = read_mesh(path)
    assert mesh.points.shape == (4, 2)
    assert "dropped 1 nodes" in caplog.text


def test_tetrahedra_are_read_in_three_dimensions(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    path = tmp_path / "body.vtu"
    meshio.write(path, meshio.Mesh(points, [("tetra", np.array([[0, 2, 1, 3]]))]))
    mesh = read_mesh(path)
    assert mesh.dimension == 3
    assert len(mesh.facet_sets["surface"]) == 4


def test_second_order_and_other_cells_are_refused_by_name(tmp_path):
    path = tmp_path / "body.vtu"
    six = np.array([[0, 1, 2, 3, 4, 5]])
    quad = np.array([[0, 1, 2, 3]])
    points = np.random.default_rng(0).random((6, 3))
    meshio.write(path, meshio.Mesh(points, [("triangle6", six), ("quad", quad)]))
    with pytest.raises(MeshError, match=r"body\.vtu: cells of type quad, triangle6"):
        read_mesh(path)


def test_a_bent_surface_is_no_plane_body(tmp_path):
    points = POINTS[:4] + np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 1]])
    path = tmp_path / "body.vtu"
    meshio.write(path, meshio.Mesh(points, [("triangle", TRIANGLES)]))
    with pytest.raises(MeshError, match="triangles at z from 2 to 3"):
        read_mesh(path)


def test_a_file_without_cells_is_refused(tmp_path):
    path = tmp_path / "body.vtu"
    meshio.write(path, meshio.Mesh(POINTS, [("line", np.array([[0, 1]]))]))
    with pytest.raises(MeshError, match="holds no triangles"):
        read_mesh(path)


def test_the_name_surface_is_kept(tmp_path):
    path = written(tmp_path / "body.inp", ABAQUS.replace("clamped", "surface"))
    with pytest.raises(MeshError, match="'surface' is kept"):
        read_mesh(path)


def test_faults_of_the_mesh_name_the_file(tmp_path):
    path = written(tmp_path / "body.inp", ABAQUS.replace("4, 0., 10.", "4, 5., 5."))
    with pytest.raises(MeshError, match=r"body\.inp: cell 1 at .* is flat"):
        read_mesh(path)


@pytest.mark.parametrize("name", ["broken.msh", "broken.vtu", "broken.inp", "notes.txt"])
def test_an_unreadable_file_is_named(tmp_path, name):
    with pytest.raises(MeshError, match=f"{name}: "):
        read_mesh(written(tmp_path / name, "$Nonsense\n"))


def test_an_element_unknown_to_the_reader_is_named(tmp_path):
    path = written(tmp_path / "body.inp", ABAQUS.replace("CPS3", "CPE3"))
    with pytest.raises(MeshError, match="Element type not available: CPE3"):
        read_mesh(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(MeshError, match=r"gone\.msh: no such mesh file"):
        read_mesh(tmp_path / "gone.msh")
