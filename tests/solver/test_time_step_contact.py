"""The stable step of what touches, and of light rigid bodies."""

import numpy as np
import pytest

from softsim.compute import fields
from softsim.contact.simple_walls import facing_one_way
from softsim.mesh.mesh import Mesh
from softsim.mesh.quality import quality
from softsim.solver.stable_step import stable_step

PRESSED = """
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 0.5 mm},
      formulation: plane_strain, thickness: 5 mm, material: rubber}
materials:
  rubber: {law: yeoh, C10: 36 kPa, density: 1000 kg/m^3}
environment: {gravity: 0 m/s^2, walls: {floor: {kind: plane, point: [0 mm, -0.01 mm]}}}
conditions:
  press: {kind: prescribed, nodes: b.top, direction: y,
          displacement: {kind: ramp, value: -0.2 mm, duration: 1 ms}}
  push: {kind: prescribed, nodes: b.top, direction: x,
         displacement: {kind: ramp, value: 0.5 mm, duration: 4 ms}}
contact: {friction_coefficient: 0.5, penalty_stiffness: PENALTY}
solver: {bulk_viscosity: 0}
time: {end: 1 s}
"""


@pytest.mark.parametrize("penalty", ["7.2 kN/m", "720 kN/m"])
def test_pressed_on_a_floor(build, start, penalty):
    """Stick and slip under a load, at 0.9 of the bound, with the penalty stiffness that `auto`
    takes and with a hundredfold: all energy is accounted for.
    """
    from softsim.solver.energy import EnergyBalance, EnergyReader

    model = build(PRESSED.replace("PENALTY", penalty))
    solver = start(model, share=0.9)
    reader = EnergyReader(solver)
    balance = EnergyBalance.starting(reader.read(), model)
    for _ in range(8):
        solver.advance(500)
        error = balance.error(reader.read())
    assert fields.read(solver.terms.wall_contacts[0].normal_force).sum() > 0.1
    assert error < 0.02


def test_contact_limits_the_step(build):
    """A penalty spring far stiffer than the body sets the limit: sqrt(2) / omega of the lightest
    node that may touch, less the dashpot's share: it must not be thrown back faster than it came.
    """
    stiff = 720e6
    model = build(PRESSED.replace("PENALTY", f"{stiff} N/m"), "contact.damping_ratio=0.3")
    expected = np.sqrt(2.0 * model.mass[model.contact.nodes].min() / stiff)
    # The dashpot counts as a spring 2 c / dt, at a step of at least 0.7 / omega: 2 * 2 * 0.3 / 0.7.
    least = expected / np.sqrt(1.0 + 1.8)
    found = stable_step(model, model.points)
    assert least < found.value < expected
    assert found.limit == "contact stiffness"
    both = f"limited by {found.limit}; stability limit {found.stable * 1e6:.3g} us"
    assert both in found.describe()
    assert found.value < found.stable < np.sqrt(2.0) * found.value


def test_a_light_rigid_body_in_a_static_run_is_named(build):
    """There stability asks for less than a hit does, and no element is to blame."""
    text = LIGHT.replace("MASS", "1 ug").replace("INERTIA", "1e-9 kg*mm^2")
    model = build(text.replace("end: 1 s", "end: 1 s, procedure: static"))
    found = stable_step(model, model.points)
    assert found.limit == "contact of a rigid body"
    assert found.value == found.stable


def test_walls_that_are_touched_at_once():
    """Two walls that face each other count once, a corner twice; a copy of a wall counts too."""
    up, down, right = np.array([[0.0, 1.0], [0.0, -1.0], [1.0, 0.0]])
    assert len(facing_one_way(np.array([up, down]))) == 1
    assert len(facing_one_way(np.array([up, right]))) == 2
    assert len(facing_one_way(np.array([up, down, right, -right]))) == 2
    assert len(facing_one_way(np.array([up, down, down]))) == 2
    assert len(facing_one_way(np.zeros((0, 2)))) == 0


LIGHT = """
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 0.5 mm},
      formulation: plane_strain, thickness: 5 mm, material: rubber, fixed: [left]}
rigid_bodies:
  plate: {mass: MASS, inertia: INERTIA, center: [2.2 mm, 1 mm], tied: [b.right],
          outline: {length: 0.2 mm, height: 2 mm}}
materials:
  rubber: {law: yeoh, C10: 36 kPa, density: 1000 kg/m^3}
environment: {gravity: 0 m/s^2, walls: {floor: {kind: plane, point: [0 mm, -0.02 mm]}}}
solver: {bulk_viscosity: 0}
time: {end: 1 s}
"""


@pytest.mark.parametrize(
    "mass, inertia", [("1 ug", "1e-9 kg*mm^2"), ("1 mg", "1e-6 kg*mm^2"), ("1 g", "1e-3 kg*mm^2")]
)
def test_a_light_plate_on_the_end(build, start, mass, inertia):
    """A rigid body much lighter than the nodes tied to it, and one much heavier, shaken against a
    floor that its corners strike: stable at 0.95 of the bound.
    """
    from softsim.solver.energy import EnergyReader

    model = build(LIGHT.replace("MASS", mass).replace("INERTIA", inertia))
    solver = start(model, share=0.95)
    memory, reader = solver.state(), EnergyReader(solver)
    noise = np.random.default_rng(1).standard_normal(model.points.shape)
    memory["nodes/velocity"] = (1e-2 * noise * model.is_free)[None]
    memory["rigid_bodies/velocity"] = np.array([[[0.0, -0.05]]])
    step = solver.time_increment
    solver.restore(memory, 0.0, 0, step)
    solver.begin(step)
    before = reader.read().kinetic
    solver.advance(round(min(4e-3 / step, 20_000)))
    assert reader.read().kinetic < 10.0 * before


ALONE = """
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 2 mm},
      formulation: plane_strain, thickness: 5 mm, material: rubber FIXED}
materials:
  rubber: {law: yeoh, C10: 36 kPa, density: 1000 kg/m^3}
time: {end: 1 s}
"""
HOLDER = """
rigid_bodies:
  plate: {mass: 1 g, inertia: 1 g*mm^2, center: [1.5 mm, 1 mm], tied: [b.right], free: []}
"""


def test_nothing_can_move(build):
    """Every node is fixed or tied to a body that is held: the step is that of the free block."""
    free = build(ALONE.replace("FIXED", ""))
    held = build(ALONE.replace("FIXED", ", fixed: [left]") + HOLDER)
    found = stable_step(held, held.points)
    assert found.value == stable_step(free, free.points).value
    assert found.value <= found.stable


def test_the_bad_element_is_named(build, write_mesh_with_a_sliver):
    """One flat element among good ones limits the step, and the message points at it."""
    flattest = quality(write_mesh_with_a_sliver).smallest_altitude_cell
    model = build(
        "bodies: {b: {mesh: {file: mesh.inp, length_unit: 1 m}, formulation: plane_strain,\n"
        "  thickness: 5 mm, material: rubber}}\n"
        "materials: {rubber: {law: yeoh, C10: 36 kPa, density: 1000 kg/m^3}}\n"
        "time: {end: 1 s}\n"
    )
    found = stable_step(model, model.points)
    corners = np.sort(model.points[model.bodies[0].cells[found.element]], axis=0)
    expected = write_mesh_with_a_sliver.points[write_mesh_with_a_sliver.cells[flattest]]
    np.testing.assert_allclose(corners, np.sort(expected, axis=0), atol=1e-12)
    assert found.altitude < 0.1e-3
    assert f"element {found.element} of 'b'" in found.describe()
    assert "altitude 0.0344 mm" in found.describe()


@pytest.fixture
def write_mesh_with_a_sliver(tmp_path):
    """A regular mesh in whose middle one node lies close to the edge opposite of it."""
    from softsim.robots.block import block

    mesh = block(4e-3, 4e-3, 0.5e-3)
    points = mesh.points.copy()
    middle = int(np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1)))
    around = mesh.cells[(mesh.cells == middle).any(axis=1)]
    towards = points[around[0][around[0] != middle]].mean(axis=0)
    points[middle] += 0.9 * (towards - points[middle])
    mesh = Mesh(points, mesh.cells)
    text = "*NODE\n" + "".join(f"{a + 1}, {x:.12e}, {y:.12e}\n" for a, (x, y) in enumerate(points))
    text += "*ELEMENT, TYPE=CPE3\n"
    for e, cell in enumerate(mesh.cells):
        text += f"{e + 1}, " + ", ".join(str(a + 1) for a in cell) + "\n"
    (tmp_path / "mesh.inp").write_text(text)
    return mesh
