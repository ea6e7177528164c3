"""Polylines and surfaces in scenes: what is built, and where a refusal points."""

import meshio
import numpy as np
import pytest

from softsim.builder import build_model
from softsim.errors import SceneError
from softsim.scene.loading import load_scene

PLANE = """\
bodies:
  block: {mesh: {generator: block, length: 10 mm, height: 6 mm, element_size: 2 mm},
          formulation: plane_strain, thickness: 10 mm, material: dragon_skin_30}
environment:
  walls:
    ground:
      kind: polyline
      points: [[-20 mm, -1 mm], [5 mm, -1 mm], [20 mm, -2 mm]]
time: {end: 1 s}
"""
SPACE = """\
bodies:
  box: {mesh: {generator: box, length: 4 mm, height: 3 mm, width: 3 mm, element_size: 3 mm},
        formulation: solid, material: dragon_skin_30}
environment:
  walls:
    hollow:
      kind: surface
      file: room.stl
      free_side: inside
      position: [-5 mm, -5 mm, -5 mm]
      spacing: 1 mm
time: {end: 1 s}
"""
CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * 20.0
FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)
ROOM = np.concatenate([FACES[:, [0, 1, 2]], FACES[:, [0, 2, 3]]])


@pytest.fixture
def room(tmp_path):
    """Write room.stl beside the scene: a cube of 20 units, or some of its triangles."""

    def write(triangles=ROOM):
        mesh = meshio.Mesh(CORNERS, [("triangle", triangles)])
        meshio.write(tmp_path / "room.stl", mesh, file_format="stl", binary=True)

    return write


def refusal(write_scene, text):
    with pytest.raises(SceneError) as refused:
        build_model(load_scene(write_scene(text)))
    assert refused.value.exit_code == 2
    return refused.value


def test_a_polyline_in_the_scene_or_in_a_file_is_the_same_wall(build, tmp_path):
    (one,) = build(PLANE).walls
    (tmp_path / "ground.csv").write_text("x, y\n-2, -0.1\n0.5, -0.1\n2, -0.2\n")
    points = "points: [[-20 mm, -1 mm], [5 mm, -1 mm], [20 mm, -2 mm]]"
    (other,) = build(PLANE.replace(points, "file: ground.csv\n      length_unit: 1 cm")).walls
    np.testing.assert_allclose(one.polyline.points, other.polyline.points, atol=1e-17)
    assert one.names == ("ground",)


def test_in_space_a_polyline_is_the_same_at_every_z(build):
    walls = """{kind: polyline, points: [[-20 mm, -1 mm], [5 mm, -1 mm], [20 mm, -2 mm]]}"""
    box, _, rest = SPACE.partition("      kind: surface")
    text = box.replace("    hollow:\n", f"    hollow: {walls}\n") + rest[rest.index("time:") :]
    (wall,) = build(text).walls
    places = np.array([[0.0, 1e-3, 0.0], [0.0, 1e-3, 7e-3], [-1.0, -3e-3, 1.0]])
    np.testing.assert_allclose(wall.gaps(places)["hollow"], [2e-3, 2e-3, -2e-3])
    with pytest.raises(SceneError, match="the same at every z, so its points have no z"):
        build(text.replace("[5 mm, -1 mm]", "[5 mm, -1 mm, 2 mm]"))


def test_the_spacing_is_the_median_edge_of_the_surfaces_or_as_given(build, room):
    room()
    (wall,) = build(SPACE).walls
    assert wall.spacing == pytest.approx(1e-3)
    (wall,) = build(SPACE, "environment.walls.hollow.spacing=auto").walls
    assert wall.spacing == pytest.approx(3e-3)


@pytest.mark.parametrize("side, sign", [("inside", 1.0), ("outside", -1.0)])
def test_a_surface_is_free_on_the_side_that_is_said(build, room, side, sign):
    """The room, or the same block as an obstacle, with the box moved out of it."""
    room()
    place = {"inside": "[0 mm, 0 mm, 0 mm]", "outside": "[30 mm, 0 mm, 0 mm]"}[side]
    (wall,) = build(
        SPACE, f"environment.walls.hollow.free_side={side}", f"bodies.box.position={place}"
    ).walls
    places = np.array([[0.0, 0.0, 0.0], [10e-3, 10e-3, 17e-3]])
    np.testing.assert_allclose(wall.gaps(places)["hollow"], sign * np.array([5e-3, -2e-3]))


# key that is replaced, what stands there instead, line and column, what is said
PLANE_REFUSALS = {
    "one point": ("points: [[-20 mm, -1 mm], [5 mm, -1 mm], [20 mm, -2 mm]]",
                  "points: [[0 mm, 0 mm]]", (8, 15), "1 different points: at least 2"),
    "in space": ("[5 mm, -1 mm]", "[5 mm, -1 mm, 2 mm]", (8, 33), "has 3 components"),
    "a spacing": ("kind: polyline", "kind: polyline\n      spacing: 1 mm", (8, 7), "spacing"),
    "crossing": ("[20 mm, -2 mm]", "[5 mm, -9 mm], [0 mm, 0 mm]", (8, 15),
                 "crosses itself: edges 0 and 2"),
    "no file": ("points: [[-20 mm, -1 mm], [5 mm, -1 mm], [20 mm, -2 mm]]", "file: none.csv",
                (8, 13), "there is no file"),
    "block in it": ("-1 mm], [5 mm, -1 mm]", "1 mm], [5 mm, 1 mm]", (7, 13),
                    "wall 'ground' starts 1 mm inside the body"),
    "a surface": ("kind: polyline\n      points: [[-20 mm, -1 mm], [5 mm, -1 mm], [20 mm, -2 mm]]",
                  "kind: surface\n      file: room.stl\n      free_side: inside", (7, 13),
                  "a surface file describes a wall in 3D"),
    "both": ("kind: polyline", "kind: polyline\n      file: ground.csv", (8, 13),
             "give points or a file"),
    "neither": ("points: [[-20 mm, -1 mm], [5 mm, -1 mm], [20 mm, -2 mm]]", "closed: false",
                (7, 7), "a polyline needs points"),
}  # fmt: skip


@pytest.mark.parametrize("case", PLANE_REFUSALS)
def test_polylines_that_are_refused(write_scene, case):
    old, new, place, message = PLANE_REFUSALS[case]
    assert old in PLANE
    error = refusal(write_scene, PLANE.replace(old, new))
    assert message in str(error)
    assert (error.location.line, error.location.column) == place


SPACE_REFUSALS = {
    "missing": ("room.stl", "hall.stl", (8, 13), "there is no file"),
    "no STL": ("room.stl", "scene.yaml", (8, 13), "not an STL file"),
    "too fine": ("spacing: 1 mm", "spacing: 5 um", (11, 16), "spacing of the wall to 0.08"),
    "adhesion": ("time:", "contact: {adhesion: {glue: {work_of_adhesion: 1 J/m^2, range: 4 mm}}}\n"
                 "time:", (12, 21), "range is 4 mm, and the gaps of the wall 'hollow' are exact up "
                 "to 3 mm"),
}  # fmt: skip


@pytest.mark.parametrize("case", SPACE_REFUSALS)
def test_surfaces_that_are_refused(write_scene, room, case):
    room()
    old, new, place, message = SPACE_REFUSALS[case]
    assert old in SPACE
    error = refusal(write_scene, SPACE.replace(old, new))
    assert message in str(error)
    assert (error.location.line, error.location.column) == place


def test_an_open_surface_is_refused_at_its_file(write_scene, room):
    room(ROOM[1:])
    error = refusal(write_scene, SPACE)
    assert "3 edges do not have exactly two triangles" in str(error)
    assert "in the unit of the file" in str(error)
    assert (error.location.line, error.location.column) == (8, 13)
