"""Meshes of geometry: volumes against closed forms, named surfaces, refusals."""

import sys

import meshio
import numpy as np
import pytest
import solids

from softsim.errors import MeshError, SceneError
from softsim.mesh import cad
from softsim.mesh.cad import chambers, mesh_solid, stored_mesh, with_named_surfaces
from softsim.mesh.mesh import Mesh
from softsim.mesh.quality import quality
from softsim.mesh.reading import read_mesh
from softsim.robots.block import block, box

ENDS = {"x_min", "x_max", "y_min", "y_max", "z_min", "z_max"}


@pytest.fixture
def meshed(tmp_path):
    """Mesh a geometry file with elements of `size` in mm."""

    def mesh(source, size, length_unit=None, cells="simplex"):
        return mesh_solid(source, tmp_path / "out.msh", 1e-3 * size, length_unit, cells)

    return mesh


@pytest.mark.parametrize("name", ["finger.step", "finger.brep", "finger.stl", "finger.STP"])
def test_a_finger_with_a_chamber(tmp_path, meshed, name, caplog):
    """Plane faces are meshed exactly: the volumes of solid and chamber are those of the boxes."""
    source = solids.finger(tmp_path / name.lower()).rename(tmp_path / name)
    mesh = meshed(source, 5)
    assert quality(mesh).volume == pytest.approx(1e-9 * (60 * 16 * 14 - 52 * 9 * 8), rel=1e-6)
    assert set(mesh.facet_sets) == {*ENDS, "chamber1", "surface"}
    (chamber,) = chambers(mesh)
    assert chamber.volume == pytest.approx(1e-9 * 52 * 9 * 8, rel=1e-6) and not chamber.opening
    assert mesh.points[mesh.node_sets["x_max"], 0] == pytest.approx(0.06)
    has_unit = name.lower().endswith(("step", "stp"))
    assert ("has no unit of length; taken as mm" in caplog.text) is not has_unit
    stored = read_mesh(tmp_path / "out.msh").mesh
    np.testing.assert_allclose(stored.points, mesh.points, atol=1e-12)
    assert {n: len(f) for n, f in stored.facet_sets.items()} == {
        n: len(f) for n, f in mesh.facet_sets.items()
    }


def test_the_unit_that_a_step_file_states_is_converted(tmp_path, meshed):
    source = solids.finger(tmp_path / "finger.step")
    text = source.read_text().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)")
    source.write_text(text)
    assert np.ptp(meshed(source, 50).points, axis=0) == pytest.approx([0.6, 0.16, 0.14])


def test_a_spherical_cavity_converges_to_its_closed_form(tmp_path, meshed):
    """The deficit of an inscribed polyhedron falls with the square of the size of its facets."""
    volume = solids.ball(tmp_path / "ball.step")
    exact = 4.0 / 3.0 * np.pi * 6e-3**3
    assert 1e-9 * volume == pytest.approx(20e-3**3 - exact, rel=1e-6)
    deficits = []
    for size in (4.0, 2.0):
        mesh = meshed(tmp_path / "ball.step", size)
        (chamber,) = chambers(mesh)
        assert quality(mesh).volume + chamber.volume == pytest.approx(20e-3**3, rel=1e-9)
        deficits.append(1.0 - chamber.volume / exact)
    assert 0.0 < deficits[1] < 0.04
    assert deficits[0] / deficits[1] == pytest.approx(4.0, rel=0.35)


def test_a_pocket_in_a_planar_end_is_a_chamber(tmp_path, meshed):
    mesh = meshed(solids.cup(tmp_path / "cup.step"), 3)
    (chamber,) = chambers(mesh)
    assert chamber.opening == "y_min"
    assert chamber.volume == pytest.approx(np.pi * 5e-3**2 * 24e-3, rel=0.1)
    deepest = mesh.points[mesh.node_sets["chamber1"], 1].max()
    assert deepest == pytest.approx(24e-3) and "y_max" in mesh.facet_sets


def test_round_faces_of_an_stl(tmp_path, meshed):
    """Triangles of the file, 2 mm long, are replaced by larger ones."""
    fine = meshed(solids.cup(tmp_path / "cup.step"), 2)
    triangles = [("triangle", fine.facet_sets["surface"])]
    meshio.write(tmp_path / "cup.stl", meshio.Mesh(1e3 * fine.points, triangles))
    coarse = meshed(tmp_path / "cup.stl", 4)
    assert len(coarse.cells) < 0.5 * len(fine.cells)
    (chamber,) = chambers(coarse)
    assert chamber.opening == "y_min"
    assert chamber.volume == pytest.approx(chambers(fine)[0].volume, rel=0.15)
    assert quality(coarse).volume == pytest.approx(quality(fine).volume, rel=0.05)


def test_walls_of_one_tetrahedron_are_counted(tmp_path, meshed):
    source = solids.finger(tmp_path / "finger.step")
    coarse, fine = (chambers(meshed(source, size))[0].thin for size in (8, 1.5))
    assert coarse > 0.9 and fine < 0.05


def test_a_through_hole_is_no_chamber(tmp_path, meshed):
    assert chambers(meshed(solids.plate(tmp_path / "plate.step"), 3)) == []


def test_hexahedra_of_a_swept_section(tmp_path, meshed):
    """The plate is swept across its thickness; a twisted bar has equal sections and is no sweep."""
    mesh = meshed(solids.plate(tmp_path / "plate.step"), 1.5, cells="quad")
    assert set(quality(mesh).cell_kinds) == {"hexahedra"}
    exact = 1e-9 * 3 * (30 * 20 - np.pi * 4**2)
    assert quality(mesh).volume == pytest.approx(exact, rel=0.01)
    assert len(np.unique(mesh.points[:, 2].round(9))) == 3
    for make in (solids.twisted, solids.finger):
        with pytest.raises(MeshError, match="a constant section along x, y or z only"):
            meshed(make(tmp_path / "other.step"), 3, cells="quad")


def test_solids_that_touch_become_one_body_with_cell_sets(tmp_path, meshed):
    mesh = meshed(solids.two_blocks(tmp_path / "two.step"), 5)
    assert quality(mesh).piece_count == 1
    parts = [mesh.cell_sets[name] for name in ("solid1", "solid2")]
    volumes = sorted(quality(Mesh(*_part(mesh, part))).volume for part in parts)
    assert volumes == pytest.approx([1e-6, 2e-6])


def _part(mesh, members):
    used, cells = np.unique(mesh.cells[members], return_inverse=True)
    return mesh.points[used], cells.reshape(-1, 4)


def test_a_gmsh_script_keeps_its_groups(tmp_path, meshed):
    script = tmp_path / "block.geo"
    script.write_text(
        'SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 0.03, 0.01, 0.01};\n'
        'Physical Volume("rubber") = {1};\nPhysical Surface("root") = {1};\n'
    )
    mesh = meshed(script, 5)
    assert np.ptp(mesh.points, axis=0) == pytest.approx([0.03, 0.01, 0.01])  # taken as metres
    assert set(mesh.facet_sets) == {*ENDS, "root", "surface"}
    assert len(mesh.cell_sets["rubber"]) == len(mesh.cells)
    assert set(read_mesh(tmp_path / "out.msh").mesh.cell_sets) == {"rubber"}


def test_ends_of_a_generated_block():
    mesh = with_named_surfaces(box(length=0.02, width=0.01, height=0.01, element_size=5e-3))
    for name, same in {
        "x_min": "left",
        "x_max": "right",
        "y_min": "bottom",
        "y_max": "top",
    }.items():
        assert set(mesh.node_sets[name]) == set(mesh.node_sets[same])


def test_quadratic_tetrahedra_are_read_as_linear_ones(tmp_path):
    path = tmp_path / "quadratic.msh"
    with solids.drawn(tmp_path / "block.step") as occ:
        occ.addBox(0, 0, 0, 10, 10, 10)
        occ.synchronize()
        solids.gmsh.option.setNumber("Mesh.ElementOrder", 2)
        solids.gmsh.model.mesh.generate(3)
        solids.gmsh.write(str(path))
    with pytest.raises(MeshError, match="cells of type line3, tetra10, triangle6") as caught:
        read_mesh(path)
    assert "reduce_order: true" in caught.value.hint
    found = read_mesh(path, reduce_order=True)
    assert found.midside_nodes > len(found.mesh.points)
    assert set(quality(found.mesh).cell_kinds) == {"tetrahedra"}
    assert quality(found.mesh).volume == pytest.approx(1e-6, rel=1e-9)


def test_an_stl_of_two_parts_and_a_plane_mesh_are_refused(tmp_path, meshed):
    with solids.drawn(tmp_path / "two.stl") as occ:
        occ.addBox(0, 0, 0, 10, 10, 10)
        occ.addBox(30, 0, 0, 10, 10, 10)
    with pytest.raises(MeshError, match="2 closed surfaces, of which none contains the others"):
        meshed(tmp_path / "two.stl", 5)
    with pytest.raises(MeshError, match="the mesh is plane"):
        with_named_surfaces(block(length=0.02, height=0.01, element_size=5e-3))


REFUSED = {
    "open.stl": ("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                 "vertex 0 1 0\nendloop\nendfacet\nendsolid a\n", "the surface is open"),
    "broken.step": ("not a STEP file", "gmsh cannot mesh this geometry"),
    "plane.geo": ("Point(1) = {0, 0, 0, 1};\n", "contains no solid"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_solid_is_refused(tmp_path, meshed, name):
    text, said = REFUSED[name]
    (tmp_path / name).write_text(text)
    with pytest.raises(MeshError, match=said):
        meshed(tmp_path / name, 1)


def test_a_size_far_too_small_and_a_second_unit_are_refused(tmp_path, meshed):
    source = solids.finger(tmp_path / "finger.step")
    with pytest.raises(MeshError, match="more than 5e\\+06"):
        meshed(source, 0.01)
    with pytest.raises(MeshError, match="states its unit of length itself"):
        meshed(source, 5, length_unit=1.0)


# Geometry in a scene.

SCENE = """
bodies:
  finger:
    mesh: {file: finger.step, size: 6 mm}
    formulation: solid
    material: dragon_skin_30
    fixed: [x_min]
time: {end: 1 s, procedure: static}
"""


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("SOFTSIM_CACHE", str(folder))
    return folder / "meshes"


def test_geometry_of_a_scene_is_meshed_once(tmp_path, build, own_cache, monkeypatch):
    source = solids.finger(tmp_path / "finger.step")
    first = build(SCENE)
    assert "chamber1" in first.bodies[0].facet_sets
    assert {p.name for p in tmp_path.iterdir()} == {"finger.step", "scene.yaml", "cache"}
    (stored,) = own_cache.iterdir()
    with monkeypatch.context() as patched:
        patched.setattr(cad, "mesh_solid", None)  # a second build does not mesh
        np.testing.assert_array_equal(build(SCENE).bodies[0].points, first.bodies[0].points)
    build(SCENE, "bodies.finger.mesh.size=7 mm")
    source.write_text(source.read_text() + "\n")
    build(SCENE)
    assert len(list(own_cache.iterdir())) == 3 and stored.is_file()


def test_a_missing_gmsh_is_an_error_of_the_scene(tmp_path, build, own_cache, monkeypatch):
    solids.finger(tmp_path / "finger.step")
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(SceneError, match="meshed by the package gmsh") as caught:
        build(SCENE)
    assert str(caught.value.location).endswith("scene.yaml:4:11")
    assert "pip install gmsh" in caught.value.hint


@pytest.mark.parametrize(
    ("change", "said", "hint"),
    [
        ("{file: finger.step}", "is CAD geometry, not a mesh", "{file: finger.step, size: 1 mm}"),
        ("{file: finger.step, size: 6 mm, length_unit: 1 m}", "states its unit of length", ""),
        ("{file: finger.msh, size: 6 mm}", "is a mesh already", "size applies to geometry"),
        ("{file: finger.msh, cells: quad}", "is a mesh already", "cells applies to geometry"),
        (
            "{file: finger.geo, size: 6 mm}",
            "a gmsh script is not meshed",
            "softsim mesh finger.geo",
        ),
    ],
)
def test_refusals_of_a_scene(tmp_path, build, own_cache, change, said, hint):
    for name in ("finger.step", "finger.msh", "finger.geo"):
        (tmp_path / name).write_text("")
    with pytest.raises(SceneError, match=said) as caught:
        build(SCENE, f"bodies.finger.mesh={change}")
    assert hint in caught.value.hint


def test_length_unit_scales_geometry_without_a_unit(tmp_path, own_cache):
    source = solids.finger(tmp_path / "finger.brep")
    mesh = read_mesh(stored_mesh(source, 0.2, 0.0254, "simplex")).mesh
    assert np.ptp(mesh.points, axis=0) == pytest.approx(0.0254 * np.array([60, 16, 14]))
