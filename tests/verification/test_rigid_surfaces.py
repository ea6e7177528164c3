"""Rigid bodies with a mesh surface against deformable ones: force, momenta, energy."""

import io

import meshio
import numpy as np
import pytest
from rich.console import Console

from softsim.compute import fields
from softsim.output.history import read_history
from softsim.solver.energy import EnergyBalance, EnergyReader

CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=float)
QUADS = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)
CUBE = np.concatenate([QUADS[:, [0, 1, 2]], QUADS[:, [0, 2, 3]]])

MATERIAL = """
materials: {rubber: {law: neo_hooke, C10: 50 kPa, bulk_modulus: 2 MPa, density: 1000 kg/m^3}}
"""
PRESSED = (
    MATERIAL
    + """
bodies:
  soft: {mesh: {generator: box, length: 4 mm, height: 4 mm, width: 4 mm, element_size: 1 mm,
                cells: quad}, formulation: solid, material: rubber, position: [1 mm, 0 mm, 1 mm]}
conditions:
  floor: {kind: fixed, nodes: soft.bottom}
  press: {MOVED, direction: y, displacement: {kind: smooth_step, value: -0.4 mm, duration: 5 ms}}
time: {end: 5 ms, procedure: static}
output: {frame_interval: 1 s, probes: {floor: {kind: reaction, nodes: soft.bottom}}}
"""
)
BY_CUBE = """
rigid_bodies:
  cube: {mass: 1 g, inertia: 6 g*mm^2, center: [3 mm, 7 mm, 3 mm], free: [y],
         surface: {file: cube.stl, length_unit: 6 mm, position: [0 mm, 4 mm, 0 mm]}}
environment: {gravity: 0 m/s^2}
contact: {self_contact: [soft, cube], friction_coefficient: 0, allowed_penetration: 0.002}
"""
BY_WALL = """
environment: {gravity: 0 m/s^2,
              walls: {lid: {kind: plane, point: [0 mm, 4 mm, 0 mm], normal: [0, -1, 0]}}}
contact: {friction_coefficient: 0, penalty_stiffness: 100 N/mm}
"""


@pytest.fixture
def cube(tmp_path):
    """Write cube.stl beside the scene: a cube whose edges are one unit long."""
    mesh = meshio.Mesh(CORNERS, [("triangle", CUBE)])
    meshio.write(tmp_path / "cube.stl", mesh, file_format="stl", binary=True)


@pytest.mark.slow
@pytest.mark.usefixtures("cube")
def test_a_rigid_cube_presses_as_a_flat_wall(
    kernel_cache, monkeypatch, write_scene, tmp_path, record_verification
):
    """A cube from an STL file goes 10 % into a block: the force is that of a wall."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    def force(text, moved):
        scene = write_scene(PRESSED.replace("MOVED", moved) + text)
        run(scene, (), tmp_path / moved[6:10], "cpu", console=Console(file=io.StringIO()))
        return read_history(tmp_path / moved[6:10] / "history.csv")["floor_y"][-1]

    exact = force(BY_WALL, "kind: wall_motion, wall: lid")
    found = force(BY_CUBE, "kind: rigid_motion, body: cube")
    record_verification("block pressed by a rigid cube of triangles [N]", exact, found)
    assert found == pytest.approx(exact, rel=0.01)


IN_SPACE = """
bodies:
  soft: {mesh: {generator: box, length: 3 mm, height: 2 mm, width: 3 mm, element_size: 1 mm,
                cells: quad}, formulation: solid, material: rubber}
rigid_bodies:
  cube: {mass: 20 mg, inertia: [20 mg*mm^2, 30 mg*mm^2, 25 mg*mm^2], center: [2 mm, 3.3 mm, 1.6 mm],
         initial_velocity: [0.5 m/s, -4 m/s, 0.3 m/s], initial_angular_velocity: 300 rad/s,
         surface: {file: cube.stl, length_unit: 2 mm, position: [1 mm, 2.3 mm, 0.6 mm]}}
"""
IN_THE_PLANE = """
bodies:
  soft: {mesh: {generator: block, length: 3 mm, height: 2 mm, element_size: 1 mm, cells: quad},
         formulation: plane_strain, thickness: 3 mm, material: rubber}
rigid_bodies:
  cube: {mass: 20 mg, inertia: 20 mg*mm^2, center: [0.5 mm, 3.3 mm],
         initial_velocity: [0.5 m/s, -4 m/s], initial_angular_velocity: 300 rad/s,
         surface: {points: [[0 mm, 0 mm], [2 mm, 0 mm], [2 mm, 2 mm], [0 mm, 2 mm]],
                   position: [-0.5 mm, 2.3 mm]}}
"""
FREE = (
    MATERIAL
    + """
environment: {gravity: 0 m/s^2}
contact: {self_contact: [soft, cube], friction_coefficient: 0.4}
time: {end: 1 s}
"""
)


def momenta(solver):
    """Linear (3,) and angular momentum about the origin (3,), at half steps as the scheme keeps
    them.
    """
    model, bodies = solver.models[0], solver.terms.rigid_bodies

    def in_space(vectors):
        return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))

    m, v = model.mass[:, None], in_space(fields.read(solver.terms.nodes.velocity)[0])
    x = in_space(solver.positions()[0])
    M = fields.read(bodies.mass)[0]
    X, V = (in_space(fields.read(f)[0]) for f in (bodies.centre, bodies.velocity))
    angular = (m * np.cross(x, v)).sum(axis=0) + M * np.cross(X, V)[0]
    return (m * v).sum(axis=0) + M * V[0], angular + fields.read(bodies.angular_momentum)[0, 0]


@pytest.mark.usefixtures("cube")
@pytest.mark.parametrize("scene", [IN_SPACE, IN_THE_PLANE], ids=["space", "plane"])
def test_a_rigid_cube_thrown_at_a_block(build, start, scene):
    """Both fly freely and rub: momenta are kept to round-off, energy within its limit."""
    model = build(scene + FREE)
    solver = start(model)
    reader = EnergyReader(solver)
    balance = EnergyBalance.starting(reader.read(), model)
    linear, angular = momenta(solver)
    errors = []
    while solver.time < 2.5e-3:
        solver.advance(20)
        errors.append(balance.error(reader.read()))
    assert (fields.read(solver.terms.self_contacts[0].facet) < 0).all()  # they have parted
    after = momenta(solver)
    speed = fields.read(solver.terms.rigid_bodies.velocity)[0, 0, 1]
    assert speed > (after[0][1] - model.rigid_bodies[0].mass * speed) / model.mass.sum() + 1.0
    np.testing.assert_allclose(after[0], linear, atol=1e-11 * np.abs(linear).max())
    np.testing.assert_allclose(after[1], angular, atol=1e-10 * np.abs(angular).max())
    assert reader.read().friction_dissipation > 0.0
    assert max(errors) < 0.01
