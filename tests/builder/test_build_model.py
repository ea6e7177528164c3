from pathlib import Path

import numpy as np
import pytest

from softsim.applications import entry
from softsim.builder import build_model
from softsim.errors import SceneError
from softsim.materials.library import library_material, library_names
from softsim.scene.bodies import STRUCTURES
from softsim.scene.loading import load_scene
from softsim.scene.loads import Load
from softsim.scene.meshes import FileMesh, MeshSource
from softsim.scene.text import SchemaLocation
from softsim.scene.walls import WALLS

SCENES = sorted((Path(__file__).parents[2] / "scenes").glob("*.yaml"))
MESH = "{generator: block, length: 10 mm, height: 5 mm, element_size: 2.5 mm}"
CUBE = f"""\
bodies:
  cube:
    mesh: {MESH}
    formulation: plane_strain
    thickness: 10 mm
    material: dragon_skin_10
time: {{end: 1 s}}
"""
FIXED = CUBE.replace("time:", "    fixed: [top]\ntime:")
PFR = """\
bodies:
  skin:
    mesh: {generator: pfr_section, outer_diameter: 17 mm, spike_height: 5 mm}
    formulation: plane_strain
    thickness: 7 mm
    material: dragon_skin_10
rigid_bodies:
  frame: {mass: 8 g, inertia: 1 kg*mm^2, tied: [skin.knots]}
time: {end: 1 s}
"""
RINGS = PFR.replace("plane_strain", "ring_section\n    sector: 90 deg\n    rings: skin")
CHAMBER = """\
loads:
  air:
    kind: follower_pressure
    facets: [%s]
    reacts_on: frame
    profile: {kind: constant, value: 1 kPa}
"""
GMSH = """\
$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
4
1 0 0 0
2 10 0 0
3 10 10 0
4 0 10 0
$EndNodes
$Elements
2
1 2 2 1 1 1 2 3
2 2 2 1 1 1 3 4
$EndElements
"""


def rigid(**tied):
    """The section `rigid_bodies` with a body for each keyword, tied to those node sets."""
    return "rigid_bodies:\n" + "".join(
        f"  {name}: {{mass: 1 g, inertia: 1 kg*mm^2, tied: [{', '.join(sets)}]}}\n"
        for name, sets in tied.items()
    )


def load(**keys):
    """The section `loads` with one load."""
    return "loads:\n  one:\n" + "".join(f"    {key}: {value}\n" for key, value in keys.items())


@pytest.fixture
def refused(build):
    """The error of a scene that no model can be built from."""

    def build_and_fail(*arguments):
        with pytest.raises(SceneError) as caught:
            build(*arguments)
        return caught.value

    return build_and_fail


PUSH = {"kind": "nodal_force", "force": "[1 N, 0 N]"}
SHAKE = {"kind": "sinusoidal_force", "amplitude": "1 N", "frequency": "9 Hz"}
BLOW = {"kind": "follower_pressure", "profile": "{kind: constant, value: 1 kPa}"}
SECOND = CUBE[CUBE.index("  cube:") : CUBE.index("time:")].replace("cube:", "thick:")
SECOND = SECOND.replace("thickness: 10 mm", "thickness: 20 mm")


@pytest.mark.parametrize(
    ("text", "pointed_at", "message", "hint"),
    [
        # names that do not exist
        (CUBE + load(nodes="cube.tpo", **PUSH), "cube.tpo",
         "there is no node set 'cube.tpo'", "did you mean 'top'?"),
        (CUBE + load(nodes="cbe.top", **PUSH), "cbe.top", "'cbe.top'", "bodies: cube"),
        (CUBE + load(facets="[cube.top, cube.rihgt]", **BLOW), "cube.rihgt]",
         "there is no facet set 'cube.rihgt'", "did you mean 'right'"),
        (FIXED.replace("[top]", "[top, botom]"), "botom]",
         "there is no node set 'cube.botom'", "did you mean 'bottom'"),
        (CUBE + rigid(frame=["cube.knots"]), "cube.knots]",
         "there is no node set 'cube.knots'", "node sets: "),
        (CUBE.replace("skin_10", "skin_11"), "dragon_skin_11",
         "there is no material 'dragon_skin_11'", "did you mean 'dragon_skin_10'"),
        (CUBE + rigid(frame=["cube.top"]) + load(acts_on="fame", **SHAKE), "fame",
         "there is no rigid body 'fame'", "did you mean 'frame'?"),
        (CUBE + load(acts_on="frame", **SHAKE), "frame",
         "there is no rigid body 'frame'", "rigid bodies: none"),
        (CUBE + load(facets="[cube.top, cube.surface]", **BLOW), "[cube.top, cube.surface]",
         "in more than one of these sets", "once"),
        (CUBE + load(facets="[cube.top]", reacts_on="frame", **BLOW), "frame",
         "there is no rigid body 'frame'", "rigid bodies: none"),
        # nodes with two masters, forces without effect
        (CUBE + rigid(one=["cube.top"], two=["cube.bottom", "cube.left"]), "cube.left]",
         "a node of 'cube.left' is already fixed or tied", "tied to one body only"),
        (FIXED + rigid(one=["cube.left"]), "cube.left]",
         "a node of 'cube.left' is already fixed or tied", "tied to one body only"),
        (FIXED + load(nodes="cube.top", **PUSH), "cube.top",
         "a node of 'cube.top' is fixed or tied", "load free nodes"),
        (CUBE + rigid(one=["cube.top"]) + load(nodes="cube.left", **PUSH), "cube.left",
         "a node of 'cube.left' is fixed or tied", "load free nodes"),
        # geometry
        (PFR + "environment: {walls: {pipe: {kind: pipe, diameter: 25 mm}}}\n", "25 mm",
         "wall 'pipe' starts 1 mm inside the body", "a diameter of at least 27 mm"),
        (CUBE + "environment: {walls: {floor: {kind: plane, point: [0 m, 2 mm]}}}\n", "[0 m, 2 mm]",
         "wall 'floor' starts 2 mm inside the body", "move the wall or the body"),
        (CUBE + rigid(frame=["cube.top"]) + CHAMBER % "cube.top, cube.right",
         "[cube.top, cube.right]",
         "the chamber is open: its facets end at (5.00, 0.00) mm", "tie both ends to 'frame'"),
        (CUBE.replace("time:", SECOND + "time:") + load(facets="[cube.top, thick.top]", **BLOW),
         "[cube.top, thick.top]", "bodies of different thickness", "a separate load"),
        (PFR.replace("17 mm", "14 mm"), "{generator", "outer_diameter is 14 mm", ""),
        (RINGS.replace("rings: skin", "rings: skn"), "skn",
         "there is no cell set 'skn' in the mesh of 'skin'", "did you mean 'skin'"),
        (RINGS.replace("rings: skin", "rings: skin_top"), "skin_top",
         "belongs to no ring cell, but the node opposite it does", "both strips"),
        (RINGS.replace("rings: skin", "rings: skin\n    rotation: 5 deg"), "5 deg",
         "the mesh of a ring_section cannot be turned", "environment.inclination"),
        (CUBE.replace("mesh:", "mirror: z\n    mesh:"), "z", "a section has no z", "write x or y"),
        (RINGS + CHAMBER % "skin.surface", "[skin.surface]",
         "that belongs to no ring, so they do not enclose", "facets of the rings only"),
        (RINGS.replace("tied", "free: [rotation, z], tied"), "z]",
         "'frame' cannot move in z", "directions of a rigid body here: x, y, rotation_z"),
        # rigid bodies
        (CUBE + rigid(frame=["cube.top"]).replace("tied", "free: [y], initial_velocity: "
         "[1 m/s, 0 m/s], tied"), "[1 m/s, 0 m/s]",
         "'frame' has an initial velocity in x", "add x to rigid_bodies.frame.free"),
        (CUBE + rigid(frame=["cube.top"]).replace("tied", "outline: {length: 9 mm, height: 4 mm}, "
         "supports: [cube.bottom], tied"), "[cube.bottom]",
         "inside the outline of 'frame'", "shrink it, or move the body"),
        # time
        (CUBE.replace("end: 1 s", "end: 1 s, increment: 1 ms"), "1 ms",
         "the time step 1e+03 us is above the stable step", 'write "auto", or at most'),
        # files
        (CUBE.replace(MESH, "{file: none.msh}"), "none.msh}", "there is no file", ""),
        (CUBE.replace(MESH, "{file: ../x.msh}"), "../x.msh}", "is outside the folder", ""),
        (CUBE.replace(MESH, "{file: /etc/hostname}"), "/etc/", "is outside the folder", ""),
        (CUBE.replace(MESH, "{file: scene.yaml}"), "{file", "format is not supported", "formats"),
        (CUBE.replace("element_size: 2.5 mm", "element_size: 5 nm"), "5 nm",
         "is more than 10000 times the element_size", "too many cells"),
    ],
)  # fmt: skip
def test_each_refusal_points_at_the_key_and_says_what_would_be_right(
    refused, text, pointed_at, message, hint
):
    error = refused(text)
    place = error.location
    assert place.text == text.splitlines()[place.line - 1]
    assert place.text[place.column - 1 :].startswith(pointed_at)
    assert message in error.message and hint in error.hint


def test_scenes_with_the_same_loads_have_them_in_one_order(build):
    """Of a kind in the order of the scene."""
    loads = {
        "pull": "{kind: nodal_force, nodes: cube.top, force: [1 N, 0 N]}",
        "push": "{kind: nodal_force, nodes: cube.top, force: [-1 N, 0 N]}",
        "air": "{kind: follower_pressure, facets: [cube.left], "
        "profile: {kind: constant, value: 1 kPa}}",
    }
    for names in (("pull", "air", "push"), ("pull", "push", "air")):
        of_scene = "".join(f"  {name}: {loads[name]}\n" for name in names)
        assert build(f"{CUBE}loads:\n{of_scene}").load_names == ("air", "pull", "push")


def test_what_an_option_breaks_is_reported_under_the_option(refused):
    pipe = "environment: {walls: {pipe: {kind: pipe, diameter: 40 mm}}}\n"
    error = refused(PFR + pipe, "environment.walls.pipe.diameter=20 mm")
    assert str(error.location) == "--set environment.walls.pipe.diameter=20 mm"


def test_a_pipe_just_as_wide_as_the_robot_is_accepted(build):
    model = build(PFR + "environment: {walls: {pipe: {kind: pipe, diameter: 27 mm}}}\n")
    assert np.abs(model.points[:, 1]).max() == pytest.approx(13.5e-3)


def test_the_increment_that_is_offered_is_accepted(build, refused):
    text = CUBE.replace("end: 1 s", "end: 1 s, increment: %s")
    offered = refused(text % "1 s").hint.rpartition("at most ")[2]
    assert build(text % offered).time_increment > 0.0


@pytest.mark.parametrize(
    ("tied", "facets"),
    [
        (["cube.top", "cube.bottom"], "cube.right"),  # from one tied end to the other
        (["cube.top"], "cube.surface"),  # a ring
    ],
)
def test_a_closed_chamber_is_accepted(build, tied, facets):
    model = build(CUBE + rigid(frame=tied) + CHAMBER % facets)
    assert model.pressures[0].body == 0


def test_without_a_body_to_react_on_a_pressure_needs_no_chamber(build):
    model = build(CUBE + load(facets="[cube.right]", **BLOW))
    assert model.pressures[0].body is None


def test_a_node_tied_twice_to_the_same_body_is_tied_once(build):
    model = build(CUBE + rigid(frame=["cube.top", "cube.left", "cube.top"]))
    tied = model.rigid_bodies[0].tied
    assert len(tied) == len(set(tied)) == 7  # 5 on top, 3 on the left, the corner on both
    assert not model.is_free[tied].any() and model.is_free.any(axis=1).sum() == 15 - 7


def test_masses_places_and_velocities_of_two_bodies(build):
    second = SECOND.replace("    material", "    position: [0 mm, 9 mm]\n    material")
    second += "    initial_velocity: [2 m/s, 0 m/s]\n    fixed: [top]\n"
    model = build(CUBE.replace("time:", second + "time:"))
    first, last = slice(0, 15), slice(15, 30)
    assert model.mass[first].sum() == pytest.approx(1070 * 10e-3 * 10e-3 * 5e-3)
    assert model.mass[last].sum() == pytest.approx(1070 * 20e-3 * 10e-3 * 5e-3)
    assert model.points[last, 1].min() == pytest.approx(9e-3)
    held = np.isclose(model.points[:, 1], 14e-3)
    np.testing.assert_array_equal(model.is_free, np.stack([~held, ~held], axis=1))
    np.testing.assert_array_equal(model.velocity[last, 0], np.where(held[last], 0.0, 2.0))
    assert not model.velocity[first].any()


def test_a_material_of_the_scene_wins_over_the_library(build):
    own = "materials: {dragon_skin_10: {law: yeoh, C10: 1 kPa, density: 2000 kg/m^3}}\n"
    material = build(CUBE + own).regions[0].material
    assert (material.density, material.bulk_modulus) == (2000.0, pytest.approx(20 * 2 * 1e3))


def test_the_library_lists_what_it_has():
    assert library_names()
    assert all(library_material(name) is not None for name in library_names())
    assert library_material("gold") is None


def test_a_mesh_file_is_read_in_its_unit(build, tmp_path):
    (tmp_path / "square.msh").write_text(GMSH)
    model = build(CUBE.replace(MESH, "{file: square.msh, length_unit: 1 cm}"))
    assert np.ptp(model.points, axis=0) == pytest.approx([0.1, 0.1])


def test_each_entry_point_of_the_schema_exists():
    of_loads = [load.built_by for load in SchemaLocation(Load).models]
    assert len(of_loads) > 10
    of_meshes = [
        mesh.built_by for mesh in SchemaLocation(MeshSource).models if mesh is not FileMesh
    ]
    for point in (*of_loads, *of_meshes, *STRUCTURES.values(), *WALLS):
        assert callable(entry(point)), point


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_each_scene_of_the_project_builds(path):
    model = build_model(load_scene(path))
    assert np.isfinite(model.points).all() and (model.mass[model.is_free.any(axis=1)] > 0.0).all()


STRIPS = """\
*NODE
1, 0, 1
2, 2, 1
3, 1, 2
4, 0, -1
5, 2, -1
6, 1, %s
*ELEMENT, TYPE=CPE3, ELSET=WALL
1, 1, 2, 3
2, 4, 6, 5
"""
ASTRIDE = """\
*NODE
1, 0, -1
2, 2, -1
3, 2, 1
4, 0, 1
*ELEMENT, TYPE=CPE3, ELSET=WALL
1, 1, 2, 3
2, 1, 3, 4
"""
FILED = """\
bodies:
  wall: {mesh: {file: strips.inp}, formulation: ring_section, thickness: 1 mm, sector: 90 deg,
         rings: WALL, material: dragon_skin_10}
time: {end: 1 s}
"""


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (STRIPS % -2.5, "has no node opposite it: a ring_section must be symmetric"),
        (ASTRIDE, "touches the axis: a ring needs a hole"),
    ],
)  # fmt: skip
def test_strips_that_are_no_rings(tmp_path, mesh, message):
    """Read from a file, whose CPE3 are a plane section or a ring section."""
    (tmp_path / "scene.yaml").write_text(FILED)
    (tmp_path / "strips.inp").write_text(STRIPS % -2)
    model = build_model(load_scene(tmp_path / "scene.yaml"))
    assert model.regions[0].geometry.opposite[model.bodies[0].cells].shape == (2, 3)
    (tmp_path / "strips.inp").write_text(mesh)
    with pytest.raises(SceneError) as caught:
        build_model(load_scene(tmp_path / "scene.yaml"))
    assert message in caught.value.message and "scene.yaml:" in str(caught.value)


MIXED = """\
*NODE
1, 0, 0
2, 2, 0
3, 2, 2
4, 0, 2
5, 4, 1
*ELEMENT, TYPE=CPE4R
1, 1, 2, 3, 4
*ELEMENT, TYPE=CPE3
2, 2, 5, 3
"""


def test_triangles_and_quadrilaterals_stand_in_one_body_and_in_one_scene(build, tmp_path):
    (tmp_path / "mixed.inp").write_text(MIXED)
    body = CUBE[CUBE.index("  cube:") : CUBE.index("time:")]
    mixed = body.replace("cube:", "mixed:").replace(MESH, "{file: mixed.inp}")
    model = build(CUBE.replace("time:", mixed + "time:"))
    assert [b.cells.shape[1] for b in model.bodies] == [4, 4]
    areas = [sum(r.volumes.sum() for r in b.regions) / 10e-3 for b in model.bodies]
    np.testing.assert_allclose(areas, [50e-6, 6e-6])
    alone = build(CUBE)
    assert alone.bodies[0].cells.shape[1] == 3
    np.testing.assert_allclose(model.mass[: len(alone.points)], alone.mass)


def test_surfaces_of_hexahedra_touch_in_triangles(build):
    text = """\
bodies:
  a: {mesh: {generator: box, length: 3 mm, width: 2 mm, height: 1 mm, element_size: 1 mm,
             cells: quad}, formulation: solid, material: dragon_skin_10}
contact: {self_contact: [a]}
time: {end: 1 s}
"""
    data = build(text).self_contact
    assert data.facets.shape == (2 * 2 * (6 + 3 + 2), 3)
    np.testing.assert_allclose(data.facet_size, np.sqrt(2) * 1e-3)
