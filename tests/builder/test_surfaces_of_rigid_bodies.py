"""Mesh surfaces of rigid bodies in scenes: files, places, facets, what is refused."""

import meshio
import numpy as np
import pytest

from softsim.builder import build_model
from softsim.errors import SceneError
from softsim.mesh.surface import depth_in_surface, divided
from softsim.scene.loading import load_scene

SPACE = """\
bodies:
  base: {mesh: {generator: box, length: 4 mm, height: 2 mm, width: 4 mm, element_size: 1 mm},
         formulation: solid, material: dragon_skin_30}
rigid_bodies:
  cube: {mass: 1 g, inertia: 3 g*mm^2, center: [2 mm, 3.6 mm, 2 mm],
         surface: {file: cube.stl, position: [0.5 mm, 2.1 mm, 0.5 mm]}}
contact: {self_contact: [base, cube]}
time: {end: 1 s}
"""
PLANE = """\
bodies:
  base: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
         formulation: plane_strain, thickness: 5 mm, material: dragon_skin_30}
rigid_bodies:
  tip: {mass: 1 g, inertia: 3 g*mm^2, center: [0 mm, 3 mm], surface: SURFACE}
contact: {self_contact: [base, tip.surface]}
time: {end: 1 s}
"""
POINTS = "{points: [[-1 mm, 3 mm], [2 mm, 3 mm], [0 mm, 0 mm]], position: [0 mm, 2.1 mm]}"
CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * 3.0
QUADS = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)
CUBE = np.concatenate([QUADS[:, [0, 1, 2]], QUADS[:, [0, 2, 3]]])


@pytest.fixture
def cube(tmp_path):
    """Write cube.stl beside the scene: a cube of 3 units, or other triangles."""

    def write(triangles=CUBE, points=CORNERS):
        mesh = meshio.Mesh(points, [("triangle", np.asarray(triangles))])
        meshio.write(tmp_path / "cube.stl", mesh, file_format="stl", binary=True)

    return write


def area_vectors(x):
    """Outward normals (f, d) of facets (f, d, d), as long as their areas."""
    if x.shape[2] == 2:
        way = x[:, 1] - x[:, 0]
        return np.stack([way[:, 1], -way[:, 0]], axis=1)
    return 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])


def volume(x):
    """Enclosed by facets (f, d, d)."""
    return (area_vectors(x) * x.mean(axis=1)).sum() / x.shape[2]


@pytest.mark.parametrize("triangles", [CUBE, CUBE[:, ::-1]], ids=["outwards", "inwards"])
def test_an_stl_is_placed_and_divided(build, cube, triangles):
    """Its vertices are tied nodes without mass; facets are no larger than those of the base."""
    cube(triangles)
    model = build(SPACE)
    (body,) = model.rigid_bodies
    assert np.array_equal(np.unique(body.facets), np.sort(body.tied))
    assert not model.mass[body.tied].any() and not model.is_free[body.tied].any()
    x = model.points[body.facets]
    np.testing.assert_allclose(x.min(axis=(0, 1)), [0.5e-3, 2.1e-3, 0.5e-3])
    np.testing.assert_allclose(x.max(axis=(0, 1)), [3.5e-3, 5.1e-3, 3.5e-3])
    assert volume(x) == pytest.approx(27e-9)
    assert volume(model.points[body.faces]) == pytest.approx(27e-9)
    assert len(body.faces) == 12
    assert np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).max() <= 1e-3 * (1.0 + 1e-9)
    assert np.isin(body.facets, model.self_contact.facets).all()


def test_its_size_of_facets_is_the_users(build, cube):
    cube()
    finer = build(SPACE, "rigid_bodies.cube.surface.element_size=0.5 mm")
    assert len(finer.rigid_bodies[0].facets) > 3 * len(build(SPACE).rigid_bodies[0].facets)


def test_a_polygon_in_a_section(build):
    """In either order, turned and moved."""
    model = build(PLANE.replace("SURFACE", POINTS))
    x = model.points[model.rigid_bodies[0].facets]
    assert volume(x) == pytest.approx(4.5e-6)
    turned = POINTS.replace("2.1 mm]", "5.2 mm], rotation: 180 deg")
    text = PLANE.replace("SURFACE", turned).replace("center: [0 mm, 3 mm]", "center: [0 mm, 4 mm]")
    x = build(text).points[build(text).rigid_bodies[0].facets]
    np.testing.assert_allclose(x.min(axis=(0, 1)), [-2e-3, 2.2e-3])
    assert volume(x) == pytest.approx(4.5e-6)


def test_the_boundary_of_a_plane_mesh(build, tmp_path):
    """A surface with a hole keeps the normals of the hole pointing into it."""
    ring = np.array([[x, y] for y in range(4) for x in range(4)]) - [1.5, 0.0]
    corner = np.array([y * 4 + x for y in range(3) for x in range(3) if (x, y) != (1, 1)])
    quads = corner[:, None] + [0, 1, 5, 4]
    meshio.write(
        tmp_path / "ring.vtu", meshio.Mesh(np.pad(ring, ((0, 0), (0, 1))), {"quad": quads})
    )
    model = build(PLANE.replace("SURFACE", "{file: ring.vtu, position: [0 mm, 2.1 mm]}"))
    (body,) = model.rigid_bodies
    assert len(body.faces) == len(body.facets) == 12 + 4
    assert volume(model.points[body.facets]) == pytest.approx(8e-6)
    assert (body.faces[1:12, 0] == body.faces[:11, 1]).all()  # one chain after the other


def test_a_half_section_leaves_its_axis_out(build):
    text = PLANE.replace("SURFACE", POINTS.replace("[-1 mm, 3 mm]", "[0 mm, 3 mm]"))
    text = text.replace("plane_strain, thickness: 5 mm", "axisymmetric")
    text = text.replace("material: dragon", "position: [2 mm, 0 mm], material: dragon")
    model = build(text)
    (body,) = model.rigid_bodies
    assert (model.points[body.facets][:, :, 0].max(axis=1) > 0.0).all()
    assert len(body.faces) == 3


def test_a_surface_is_divided_without_gaps():
    points, facets = divided(CORNERS, CUBE, 0.7)
    edges = np.sort(facets[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    np.testing.assert_array_equal(points[:8], CORNERS)
    x = points[facets]
    sides = np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2)
    assert sides.max() <= 0.7
    height = 2.0 * np.linalg.norm(area_vectors(x), axis=1) / sides.max(axis=1)
    assert (height > 0.3 * sides.max(axis=1)).all()


def test_depth_inside_a_surface():
    places = np.random.default_rng(1).uniform(-1.0, 4.0, (300, 3))
    exact = np.minimum(places, 3.0 - places).min(axis=1).clip(0.0)
    np.testing.assert_allclose(depth_in_surface(places, CORNERS, CUBE), exact, atol=1e-12)
    square = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]])
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    exact = np.minimum(places[:, :2], 3.0 - places[:, :2]).min(axis=1).clip(0.0)
    np.testing.assert_allclose(depth_in_surface(places[:, :2], square, edges), exact, atol=1e-12)


FLIPPED = CUBE.copy()
FLIPPED[0] = FLIPPED[0, ::-1]
UNIT = "rigid_bodies.cube.surface.length_unit="


@pytest.mark.parametrize(
    ("triangles", "overrides", "message", "line"),
    [
        (CUBE[1:], [], "the surface is open: 3 edges", 6),
        (FLIPPED, [], "opposite orientation at 3 edges", 6),
        (CUBE, [UNIT + "1 um"], "0.003 mm, less than that of a facet", 6),
        (CUBE, [UNIT + "1 m"], "more than 200,000 facets: its size is 3e+03 mm", 6),
        (CUBE, ["rigid_bodies.cube.center=[0 mm, 0 mm, 0 mm]"], "outside the surface", None),
        (CUBE, ["rigid_bodies.cube.surface.position=[0.5 mm, 1 mm, 0.5 mm]"], "inside", None),
        (CUBE, ["contact.self_contact=[base, cube.top]"], "'cube' has no facet set 'top'", None),
        (CUBE, ["rigid_bodies.cube.outline={radius: 1 mm}"], "an outline or a surface", None),
        (CUBE, ["rigid_bodies.cube.surface.points=[[0 mm, 0 mm]]"], "a file or points", None),
    ],
)
def test_what_is_refused(write_scene, cube, triangles, overrides, message, line):
    cube(triangles)
    with pytest.raises(SceneError) as refused:
        build_model(load_scene(write_scene(SPACE), overrides))
    assert message in str(refused.value)
    assert refused.value.exit_code == 2
    assert line is None or f":{line}:" in str(refused.value)


def test_flat_triangles_are_refused(write_scene, cube):
    """The edge from corner 0 to 1 has a point in its middle, and a triangle that closes the gap."""
    whole = next(
        k for k, t in enumerate(CUBE) if [0, 1] in np.stack([t, np.roll(t, -1)], 1).tolist()
    )
    halves = [np.where(CUBE[whole] == c, 8, CUBE[whole]) for c in (0, 1)]
    split = [*np.delete(CUBE, whole, axis=0), *halves, [0, 1, 8]]
    cube(split, np.vstack([CORNERS, [0.0, 0.0, 1.5]]))
    with pytest.raises(SceneError, match="1 triangles are flat"):
        build_model(load_scene(write_scene(SPACE)))


def test_an_stl_has_no_place_in_a_section(write_scene, cube):
    cube()
    with pytest.raises(SceneError, match="has 3 dimensions, the model has 2"):
        build_model(load_scene(write_scene(PLANE.replace("SURFACE", "{file: cube.stl}"))))


def test_contact_with_a_rigid_body_needs_a_surface(write_scene):
    text = PLANE.replace(", surface: SURFACE", "").replace("tip.surface", "tip")
    with pytest.raises(SceneError, match="the rigid body 'tip' has no mesh surface"):
        build_model(load_scene(write_scene(text)))


def test_a_body_tied_to_it_is_of_one_part_with_it(build, cube):
    """Their common face is no contact: they are neighbours there."""
    cube()
    tied = "rigid_bodies.cube.tied=[base.top]"
    place = "rigid_bodies.cube.surface.position=[0.5 mm, 1.9 mm, 0.5 mm]"
    data = build(SPACE, tied, place).self_contact
    assert len(set(data.point_part)) == 1
    assert len(set(build(SPACE).self_contact.point_part)) == 2
