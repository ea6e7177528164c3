"""A particle slides down a ball without friction, and leaves where its weight no longer holds it.

From the top with the speed v0 it has v^2 = v0^2 + 2 g R (1 - cos a) at the angle a, and needs the
force m v^2 / R towards the centre, of which weight gives m g cos a: it leaves at
    cos a = 2/3 + v0^2 / (3 g R).
"""

import numpy as np
import pytest

from softsim.compute import fields
from softsim.errors import SceneError

G, RADIUS, SPEED = 9.81, 50e-3, 0.2
FAR = {
    2: "{generator: block, length: 10 mm, height: 10 mm, element_size: 10 mm}, "
    "formulation: plane_strain, thickness: 10 mm",
    3: "{generator: box, length: 10 mm, height: 10 mm, width: 10 mm, element_size: 10 mm}, "
    "formulation: solid",
}
# The particle: a rigid ball of a tenth of a nanometre, whose points all touch at one place.
SCENE = """
bodies:
  far: {mesh: MESH, material: rubber, position: [-1 m, 0 m], fixed: [surface]}
materials:
  rubber: {law: neo_hooke, C10: 1 kPa, density: 1000 kg/m^3}
rigid_bodies:
  particle: {mass: 1 g, inertia: 1 g*mm^2, outline: {radius: 1e-7 mm},
             center: [10 mm, 70.0000001 mm], initial_velocity: [0.2 m/s, 0 m/s]}
environment:
  walls: {ball: {kind: sphere, center: [10 mm, 20 mm], diameter: 100 mm}}
contact: {friction_coefficient: 0, penalty_stiffness: 1 kN/m}
time: {end: 1 s}
"""


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_particle_leaves_a_ball(build, start, record_verification, dimension):
    """Sampled every 0.1 ms, in which it turns by 0.1 deg."""
    solver = start(build(SCENE.replace("MESH", FAR[dimension])))
    walls, bodies = solver.terms.wall_contacts[0], solver.terms.rigid_bodies
    centre = np.zeros(dimension)
    centre[:2] = 10e-3, 20e-3
    last = 0.0
    while True:
        solver.advance(round(1e-4 / solver.time_increment))
        arm = fields.read(bodies.centre)[0, 0] - centre
        if np.linalg.norm(arm) > RADIUS + 1e-6:
            break
        if fields.read(walls.normal_force).any():
            last = arm[1] / np.linalg.norm(arm)
    exact = 2.0 / 3.0 + SPEED**2 / (3.0 * G * RADIUS)
    record_verification(f"cosine where a particle leaves a ball, {dimension}D", exact, last)
    assert last == pytest.approx(exact, abs=5e-3)


@pytest.mark.parametrize("dimension", [2, 3])
def test_gap_and_picture(build, dimension):
    """Faces and lines lie on it, their free side outside."""
    wall = build(SCENE.replace("MESH", FAR[dimension])).walls[0]
    x = np.random.default_rng(1).uniform(-0.1, 0.1, (50, dimension))
    centre = np.zeros(dimension)
    centre[:2] = 10e-3, 20e-3
    gap = np.linalg.norm(x - centre, axis=1) - RADIUS
    np.testing.assert_allclose(wall.gaps(x)["ball"], gap, atol=1e-15)
    (pieces,) = wall.drawn().values()
    np.testing.assert_allclose(wall.gaps(pieces.reshape(-1, dimension))["ball"], 0.0, atol=1e-15)
    if dimension == 2:
        way = pieces[:, 1] - pieces[:, 0]
        normal = np.stack([-way[:, 1], way[:, 0]], axis=1)
    else:  # of the diagonals: at the poles two corners are one
        normal = np.cross(pieces[:, 2] - pieces[:, 0], pieces[:, 3] - pieces[:, 1])
    assert (((pieces.mean(axis=1) - centre) * normal).sum(axis=1) > 0.0).all()


def test_what_starts_in_it_is_refused(build):
    with pytest.raises(SceneError, match="'ball' starts 100 mm inside"):
        build(
            SCENE.replace("MESH", FAR[2]),
            "environment.walls.ball.diameter=300 mm",
        )
