"""Loads that keep their direction: tractions and body forces, over any profile.

Their sums are exact on any mesh; a body force is shared as weight is, a traction as pressure. What
forces on nodes do from there on, other tests say of nodal forces.
"""

import numpy as np
import pytest

from softsim.errors import SceneError

BLOCK = """
bodies:
  b: {mesh: {generator: block, length: 8 mm, height: 3 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
loads: {pull: {LOAD}}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""
BOX = BLOCK.replace("generator: block", "generator: box, width: 2 mm").replace(
    "plane_strain, thickness: 5 mm", "solid"
)
RING = BLOCK.replace("plane_strain, thickness: 5 mm", "axisymmetric, position: [10 mm, 0 mm]")
TRACTION = "kind: surface_traction, facets: [b.right], traction: [2 kPa, -1 kPa]"
VOLUME = "kind: body_force, bodies: [b], density: [3 kN/m^3, 0 N/m^3]"


@pytest.mark.parametrize(
    "scene, area, volume",
    [
        (BLOCK, 3e-3 * 5e-3, 8e-3 * 3e-3 * 5e-3),
        (BOX, 3e-3 * 2e-3, 8e-3 * 3e-3 * 2e-3),
        # About the axis: a ring of 6 to 14 mm, its outer side.
        (RING, 2.0 * np.pi * 14e-3 * 3e-3, np.pi * (14e-3**2 - 6e-3**2) * 3e-3),
    ],
    ids=["plane strain", "solid", "axisymmetric"],
)
def test_the_sum_is_exact(build, scene, area, volume):
    """Traction times area, density times volume; the moment that of a load spread evenly."""
    pull = build(scene.replace("LOAD", TRACTION)).loads[0]
    np.testing.assert_allclose(pull.forces.sum(axis=0)[:2], area * np.array([2e3, -1e3]), rtol=1e-9)
    weight = build(scene.replace("LOAD", VOLUME)).loads[0]
    np.testing.assert_allclose(weight.forces.sum(axis=0)[0], 3e3 * volume, rtol=1e-9)
    model = build(scene.replace("LOAD", TRACTION))
    height = model.points[pull.nodes, 1]
    share = pull.forces[:, 0] / pull.forces[:, 0].sum()
    assert share @ height == pytest.approx(model.points[:, 1].mean(), rel=1e-9)


@pytest.mark.parametrize("scene", [BLOCK, BOX, RING], ids=["plane strain", "solid", "axisymmetric"])
def test_a_body_force_of_rho_g_is_weight(build, scene):
    model = build(scene.replace("LOAD", VOLUME))
    load, rho = model.loads[0], model.regions[0].material.density
    acceleration = np.zeros(model.dimension)
    acceleration[0] = 3e3 / rho
    weight = model.mass[load.nodes, None] * acceleration
    np.testing.assert_allclose(load.forces, weight, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize("scene", [BLOCK, BOX], ids=["plane strain", "solid"])
def test_a_traction_along_the_normal_is_the_pressure_at_rest(build, scene):
    """On a flat side: p dV/dx, which about an axis has a part along the surface too."""
    model = build(scene.replace("LOAD", TRACTION.replace("[2 kPa, -1 kPa]", "[-2 kPa, 0 Pa]")))
    body, load = model.bodies[0], model.loads[0]
    facets = body.facet_sets["right"]
    expected = np.zeros_like(model.points)
    gradient = body.regions[0].geometry.volume_gradient(model.points, facets)
    np.add.at(expected, facets, 2e3 * gradient)
    np.testing.assert_allclose(load.forces, expected[load.nodes], rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(
    "given, at",
    [
        ("", 1.0),
        (", ramp: 10 ms", 0.5),
        (", profile: {kind: constant}", 1.0),
        (", profile: {kind: ramp, duration: 20 ms}", 0.25),
        (", profile: {kind: smooth_step, duration: 20 ms}", 0.15625),
        (", profile: {kind: sine, frequency: 50 Hz, phase: 30 deg}", np.sin(2.0 * np.pi / 3.0)),
        (", profile: {kind: table, points: [[0 s, 1], [10 ms, -1]]}", 0.0),
    ],
)
def test_over_time(build, given, at):
    """At 5 ms."""
    load = build(BLOCK.replace("LOAD", TRACTION + given)).loads[0]
    assert load.share.at(5e-3) == pytest.approx(at, abs=1e-4)


@pytest.mark.parametrize(
    "given, said",
    [
        (TRACTION + ", ramp: 1 ms, profile: {kind: constant}", "does not go with ramp"),
        (TRACTION.replace("b.right", "b.nothing"), "nothing"),
        (TRACTION.replace("2 kPa", "2 N"), "pressure"),
        (TRACTION.replace("[b.right]", "[b.right, b.right]"), "twice"),
        (VOLUME.replace("[b]", "[c]"), "no body 'c'"),
        (VOLUME.replace("3 kN/m^3", "3 kN"), "force per volume"),
        (VOLUME + ", profile: {kind: saw}", "sine"),
    ],
)
def test_what_is_no_load_is_refused(build, given, said):
    with pytest.raises(SceneError, match=said):
        build(BLOCK.replace("LOAD", given))
