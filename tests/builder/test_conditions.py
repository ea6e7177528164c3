"""Conditions on sets: which components they hold, what they add, and what is refused."""

import numpy as np
import pytest

from softsim.errors import SceneError

BODY = """\
bodies:
  b: {mesh: {generator: box, length: 2 mm, height: 2 mm, width: 2 mm, element_size: 1 mm},
      formulation: solid, material: dragon_skin_10}
time: {end: 1 s}
conditions:
"""
RING = """\
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm},
      formulation: axisymmetric, position: [1 mm, 0 mm], material: dragon_skin_10}
time: {end: 1 s}
"""


def test_fixed_holds_all_or_some_components(build):
    model = build(BODY + "  a: {kind: fixed, nodes: b.left}\n"
                         "  c: {kind: fixed, nodes: b.right, directions: [y, z]}\n")  # fmt: skip
    left, right = (model.bodies[0].node_sets[side] for side in ("left", "right"))
    assert not model.is_free[left].any()
    assert model.is_free[right].tolist() == [[True, False, False]] * len(right)


def test_symmetry_holds_what_crosses_the_plane(build):
    model = build(BODY + "  a: {kind: symmetry, nodes: b.bottom, normal: y}\n")
    bottom = model.bodies[0].node_sets["bottom"]
    assert model.is_free[bottom].tolist() == [[True, False, True]] * len(bottom)


def test_a_point_mass_adds_to_the_nodes_equally(build):
    plain = build(BODY + "  a: {kind: fixed, nodes: b.left}\n")
    loaded = build(BODY + "  a: {kind: point_mass, nodes: b.right, mass: 9 g}\n")
    right = plain.bodies[0].node_sets["right"]
    added = loaded.mass - plain.mass
    np.testing.assert_allclose(added[right], 9e-3 / len(right), rtol=1e-9)
    assert added.sum() == pytest.approx(9e-3)


def test_an_initial_velocity_of_a_set(build):
    model = build(
        BODY + "  a: {kind: initial_velocity, nodes: b.right, velocity: [1 m/s, 0 m/s]}\n"
    )
    right = model.bodies[0].node_sets["right"]
    assert (model.velocity[right] == [1.0, 0.0, 0.0]).all()
    assert model.velocity.sum() == len(right)


START = "  a: {kind: initial_velocity, nodes: b.%s, %s}\n"
SECTION = RING.replace("axisymmetric", "plane_strain, thickness: 1 mm") + "conditions:\n"


def test_a_section_starts_to_turn_about_a_point(build):
    """v + omega (-(y - c_y), x - c_x); other nodes stay at rest."""
    motion = "velocity: [1 m/s, 2 m/s], angular_velocity: 20 rad/s, about: [4 mm, -1 mm]"
    model = build(SECTION + START % ("surface", motion))
    x, y = model.points.T
    turning = np.column_stack([1.0 - 20.0 * (y + 1e-3), 2.0 + 20.0 * (x - 4e-3)])
    on_surface = np.isin(np.arange(len(x)), model.bodies[0].node_sets["surface"])
    assert not on_surface.all()
    exact = np.where(on_surface[:, None], turning, 0.0)
    np.testing.assert_allclose(model.velocity, exact, rtol=1e-12, atol=1e-15)


def test_in_space_it_turns_about_any_axis(build):
    """omega x r, written out; a number alone turns about z."""
    motion = "angular_velocity: [1 rad/s, -2 rad/s, 3 rad/s], about: [1 mm, 2 mm, 3 mm]"
    model = build(BODY + START % ("right", motion))
    right = model.bodies[0].node_sets["right"]
    x, y, z = model.points[right].T - np.array([[1e-3], [2e-3], [3e-3]])
    exact = np.column_stack([-2.0 * z - 3.0 * y, 3.0 * x - z, y + 2.0 * x])
    np.testing.assert_allclose(model.velocity[right], exact, rtol=1e-12, atol=1e-15)
    about_z = build(BODY + START % ("right", "angular_velocity: 3 rad/s, about: [1 mm, 2 mm]"))
    exact = np.column_stack([-3.0 * y, 3.0 * x, 0.0 * z])
    np.testing.assert_allclose(about_z.velocity[right], exact, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("text", "motion", "momentum"),
    [(SECTION, "angular_velocity: 9 rad/s", [0.0, 0.0]),
     (SECTION, "velocity: [1 m/s, 2 m/s], angular_velocity: 9 rad/s", [1.0, 2.0]),
     (BODY, "angular_velocity: [9 rad/s, -8 rad/s, 7 rad/s]", [0.0, 0.0, 0.0])],
)  # fmt: skip
def test_by_default_it_turns_about_its_centre_of_mass(build, text, motion, momentum):
    """Its momentum is that of v alone, and point masses count."""
    heavy = "  m: {kind: point_mass, nodes: b.top, mass: 2 g}\n"
    model = build(text + heavy + START % ("surface", motion))
    nodes = model.bodies[0].node_sets["surface"]
    speed = model.mass[nodes] @ model.velocity[nodes] / model.mass[nodes].sum()
    np.testing.assert_allclose(speed, momentum, atol=1e-15)
    assert np.ptp(model.velocity[nodes], axis=0).min() > 1e-3


def test_nodes_on_the_axis_stay_on_it(build):
    model = build(RING)
    left = model.bodies[0].node_sets["left"]
    assert model.is_free[left].tolist() == [[False, True]] * len(left)
    # Mass of the disc, by row sums: exact.
    assert model.mass.sum() == pytest.approx(1070 * np.pi * 2e-3**2 * 2e-3, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        (BODY + "  a: {kind: symmetry, nodes: b.surface, normal: y}\n",
         "do not lie in a plane normal to y", "plane of symmetry"),
        (BODY + "  a: {kind: fixed, nodes: b.left}\n"
         "  p: {kind: prescribed, nodes: b.left, direction: x, "
         "displacement: {kind: ramp, value: 1 mm, duration: 1 s}}\n",
         "already fixed or prescribed along x", "only one condition"),
        (BODY + "  p: {kind: prescribed, nodes: b.left, direction: x, "
         "displacement: {kind: table, points: [[0 s, 1 mm], [1 s, 2 mm]]}}\n",
         "must start with [0 s, 0 mm]", "infinite velocity"),
        (RING + "conditions: {a: {kind: fixed, nodes: b.left, directions: [z]}}\n",
         "no direction z", "solid"),
        (RING.replace("end: 1 s}", "end: 1 s}\nenvironment: {inclination: 5 deg}"),
         "gravity acts along the axis only", "inclination"),
        (RING.replace("[1 mm, 0 mm]", "[0 mm, 0 mm]"),
         "x is the radius", "axis is y"),
        (RING + "rigid_bodies: {r: {mass: 1 g, inertia: 1 kg*mm^2, tied: [b.top], free: [x]}}\n",
         "'r' cannot move in x", "directions of a rigid body here: y"),
        (BODY.replace("conditions:\n", "output: {probes: {v: {kind: volume, facets: [b.left]}}}\n"),
         "the chamber is open", "hold the rim"),
        (RING.replace("axisymmetric", "plane_strain, thickness: 1 mm")
         + "output: {probes: {r: {kind: radius, nodes: b.left}}}\n",
         "has no axis from which a radius", "displacement"),
        (RING.replace("material", "sets: {corner: {box: [[1.9 mm, 1.9 mm], [2.1 mm, 2.1 mm]]}}, "
                      "material")
         + "output: {probes: {r: {kind: rotation, nodes: b.corner}}}\n",
         "the nodes are at one place", "name a set of a face"),
        (BODY.replace("material", "sets: {edge: {box: [[1.9 mm, 1.9 mm, -1 mm], "
                      "[2.1 mm, 2.1 mm, 3 mm]]}}, material")
         .replace("conditions:\n", "output: {probes: {r: {kind: rotation, nodes: b.edge}}}\n"),
         "the nodes are in one line", "name a set of a face"),
        (RING + "conditions:\n" + START % ("top", "angular_velocity: 1 rad/s"),
         "cannot turn", "3D model"),
        (SECTION + START % ("top", "angular_velocity: [0 rad/s, 0 rad/s, 1 rad/s]"),
         "has 3 components, which does not fit a model of 2", "about z"),
        (BODY + START % ("top", "angular_velocity: [0 rad/s, 1 rad/s]"),
         "has 2 components, which does not fit a model of 3", "about x, y and z"),
        (SECTION + START % ("top", "angular_velocity: 1 rad/s, about: [0 mm, 0 mm, 0 mm]"),
         "has 3 components; this model has 2", "solid"),
        (SECTION + START % ("top", "velocity: [1 m/s, 0 m/s], about: [0 mm, 0 mm]"),
         "about: has no effect without angular_velocity", "centre of mass"),
        (SECTION + "  a: {kind: initial_velocity, nodes: b.top}\n",
         "gives no motion: give velocity, angular_velocity", ""),
        (SECTION + START % ("top", "angular_velocity: 1 Hz"),
         'an angular velocity is needed, such as "20 rad/s"', "about z"),
        (RING.replace("axisymmetric", "solid"), "solid needs tetrahedra", "linear tetrahedra"),
        (BODY.replace("conditions:\n", "").replace("end: 1 s", "end: 1 s, procedure: static")
         + "rigid_bodies: {r: {mass: 1 g, inertia: 1 kg*mm^2}}\n"
         "loads: {m: {kind: eccentric_mass, acts_on: r, eccentric_mass: 1 g, radius: 1 mm, "
         "frequency: 9 Hz}}\n",
         "'m' vibrates", "procedure: dynamic"),
    ],
)  # fmt: skip
def test_each_refusal_says_what_is_wrong(build, text, message, hint):
    with pytest.raises(SceneError) as caught:
        build(text)
    assert message in caught.value.message and hint in caught.value.hint


def test_bodies_of_one_scene_share_a_formulation(build):
    second = (
        "  c: {mesh: {generator: box, length: 1 mm, height: 1 mm, width: 1 mm, "
        "element_size: 1 mm}, formulation: solid, material: dragon_skin_10}\n"
    )
    with pytest.raises(SceneError, match="bodies of a scene must have the same formulation"):
        build(RING.replace("time:", second + "time:"))


def test_the_type_of_an_abaqus_element_must_fit_the_formulation(build, tmp_path):
    (tmp_path / "t.inp").write_text(
        "*NODE\n1, 0, 0\n2, 1, 0\n3, 0, 1\n*ELEMENT, TYPE=CAX3\n1, 1, 2, 3\n"
    )
    mesh = RING.replace("{generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm}",
                        "{file: t.inp}")  # fmt: skip
    assert build(mesh).element_count == 1
    with pytest.raises(SceneError, match="elements CAX3 \\(axisymmetric\\)"):
        build(mesh.replace("axisymmetric", "plane_strain, thickness: 1 mm"))
    (tmp_path / "t.inp").write_text((tmp_path / "t.inp").read_text().replace("CAX3", "CPS3"))
    with pytest.raises(SceneError, match="plane-stress elements") as caught:
        build(mesh)
    assert "use CAX3" in caught.value.hint
    with pytest.raises(SceneError, match=r"plane-stress elements \(CPS3\)") as caught:
        build(mesh.replace("axisymmetric", "plane_strain, thickness: 1 mm"))
    assert "use CPE3" in caught.value.hint


def test_what_reading_changed_is_remarked(build, tmp_path):
    (tmp_path / "t.inp").write_text(
        "*NODE\n1, 0, 0\n2, 1, 0\n3, 0, 1\n*ELEMENT, TYPE=CAX3\n1, 1, 3, 2\n"
    )
    mesh = RING.replace("{generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm}",
                        "{file: t.inp}")  # fmt: skip
    remarks = build(mesh).bodies[0].remarks
    assert remarks == ("1 inverted cells turned",)


def test_a_law_unstable_within_its_range_is_refused(build):
    own = "materials: {m: {law: yeoh, C10: 36 kPa, C20: -10 kPa, density: 1 g/cm^3, %s}}\n"
    own %= "strain_range: 1"
    with pytest.raises(SceneError, match="loses its stiffness") as caught:
        build(RING.replace("dragon_skin_10", "m") + own)
    assert caught.value.location.text.startswith("materials: {m:")
