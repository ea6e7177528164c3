"""Every capability once, in three structures: the physics of the default tier of tests.

Each scene holds as many elements, loads, walls and structures as fit into one model, so that they
share one compiled solver. Each runs for some milliseconds. The energy balance then closes only if
the force, the stored energy, the work and the dissipation of every part agree; the history shows
that every part took part; and a second solver that takes over the state halfway computes the same
bits, so that no part keeps a state that a checkpoint lacks.
"""

import re
import zlib

import numpy as np
import pytest
import yaml

MATERIALS = """
materials:
  soft: {law: yeoh, C10: 36 kPa, C20: 5 kPa, density: 1070 kg/m^3,
         prony: [{g: 0.3, relaxation_time: 1 ms}]}
  firm: {law: mooney_rivlin, C10: 60 kPa, C01: 20 kPa, density: 1070 kg/m^3}
time: {end: 1 s}
"""

BLOCK = "formulation: plane_strain, thickness: 5 mm, material: soft"
PIECE = "mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm}"
# Pieces fly at walls of one kind each; a beam of quadrilaterals carries the structures.
PLANE = f"""
bodies:
  beam: {{mesh: {{generator: block, length: 10 mm, height: 2 mm, element_size: 1 mm, cells: quad}},
         {BLOCK}, position: [5 mm, 20 mm], fixed: [left]}}
  tip: {{mesh: {{generator: block, length: 2 mm, height: 2 mm, element_size: 0.6 mm}},
        formulation: plane_strain, thickness: 5 mm, material: firm, position: [11 mm, 20 mm]}}
  striker: {{{PIECE}, {BLOCK}, position: [3 mm, 22.3 mm], initial_velocity: [0.2 m/s, -1 m/s]}}
  on_plane: {{{PIECE}, {BLOCK}, position: [-20 mm, 0.1 mm], initial_velocity: [0.3 m/s, -0.5 m/s]}}
  in_pipe: {{{PIECE}, {BLOCK}, position: [-20 mm, 57.9 mm], initial_velocity: [0.3 m/s, 0.5 m/s]}}
  on_disc: {{{PIECE}, {BLOCK}, position: [20 mm, 13.1 mm], initial_velocity: [0.3 m/s, -0.5 m/s]}}
  on_box: {{{PIECE}, {BLOCK}, position: [40 mm, 13.1 mm], initial_velocity: [0.3 m/s, -0.5 m/s]}}
  on_line: {{{PIECE}, {BLOCK}, position: [60 mm, 13.1 mm], initial_velocity: [0.3 m/s, -0.5 m/s]}}
ties: {{glue: {{nodes: tip.left, facets: beam.right, tolerance: 0.1 mm}}}}
layers:
  film: {{facets: beam.bottom, thickness: 0.1 mm, youngs_modulus: 5 MPa, density: 800 kg/m^3}}
fibres:
  thread: {{body: beam, points: [[1 mm, 21 mm], [9 mm, 21 mm]], spacing: 1 mm, diameter: 0.2 mm,
           youngs_modulus: 50 MPa, density: 1000 kg/m^3}}
cables:
  tail: {{points: [[70 mm, 40 mm], [76 mm, 40 mm]], segment_length: 1.5 mm, diameter: 1 mm,
         mass_per_length: 3 g/m, stretching_stiffness: 60 N, bending_stiffness: 20 N*mm^2}}
rigid_bodies:
  frame: {{mass: 2 g, inertia: 20 g*mm^2, center: [69 mm, 40 mm], tied: [tail.start_segment],
          outline: {{length: 2 mm, height: 2 mm}}, initial_velocity: [-0.2 m/s, 0 m/s]}}
environment:
  walls:
    pipe: {{kind: pipe, diameter: 60 mm, axis_height: 30 mm}}
    plane: {{kind: plane}}
    disc: {{kind: sphere, center: [20 mm, 10 mm], diameter: 6 mm}}
    box: {{kind: cylinder, center: [40 mm, 10 mm], direction: x, diameter: 6 mm, length: 6 mm}}
    line: {{kind: polyline, points: [[60 mm, 13 mm], [65 mm, 10 mm], [55 mm, 10 mm]], closed: true}}
contact: {{friction_coefficient: 0.3, self_contact: [beam, tip, striker],
          pairs: [{{between: [beam, striker], friction_coefficient: 0.6}}]}}
conditions:
  raised: {{kind: wall_motion, wall: box, direction: y,
           displacement: {{kind: ramp, value: 0.2 mm, duration: 2 ms}}}}
loads:
  air: {{kind: follower_pressure, facets: [beam.top], profile: {{kind: constant, value: 2 kPa,
        ramp: 1 ms}}}}
  motor: {{kind: eccentric_mass, acts_on: frame, eccentric_mass: 0.2 g, radius: 1 mm,
          frequency: 150 Hz, rotation_axis: z, spin_up: 1 ms}}
  shaker: {{kind: sinusoidal_force, acts_on: frame, amplitude: 0.05 N, frequency: 200 Hz,
           spin_up: 0 ms}}
  push: {{kind: rigid_force, acts_on: frame, force: [0.1 N, 0 N]}}
  relief: {{kind: axial_relief, acts_on: frame, share: 0.5}}
  gauge: {{kind: tendon, acts_on: frame, direction: [1, 0]}}
  hose: {{kind: tether, acts_on: frame, drag: 0.02 N, pitch_stiffness: 1 N*mm/rad}}
  pull: {{kind: nodal_force, nodes: tip.right, force: [0 N, -0.05 N], ramp: 1 ms}}
  shear: {{kind: surface_traction, facets: [tip.top], traction: [500 Pa, 0 Pa]}}
  wind: {{kind: body_force, bodies: [on_plane], density: [20000 N/m^3, 0 N/m^3]}}
  winch: {{kind: pulled_cable, eyelets: [[1 mm, 20.5 mm], [5 mm, 20.5 mm], [9 mm, 20.5 mm]],
          pull: 0.1 mm, stiffness: 1 N/mm, profile: {{kind: smooth_step, duration: 2 ms}}}}
output: {{probes: {{end: {{kind: displacement, nodes: tip.right}}}}}}
{MATERIALS}"""
PLANE_ACTS = {
    "thread_tension", "tail_tension", "winch_tension", "winch_drawn_in", "box_drive_force", "pull",
    "tether_drag", "wall_force_normal", "slip_share", "hourglass_energy", "pressure", "end_y",
}  # fmt: skip

SOLID = "formulation: solid, material: soft"
CUBE = "mesh: {generator: box, length: 2 mm, height: 2 mm, width: 2 mm, element_size: 2 mm}"
# A brick of hexahedra with a block of tetrahedra tied to it, pieces that fly at both and at a wall.
SPACE = f"""
bodies:
  brick: {{mesh: {{generator: box, length: 4 mm, height: 2 mm, width: 2 mm, element_size: 1 mm,
          cells: quad}}, {SOLID}, position: [0 mm, 20 mm, 0 mm], fixed: [left]}}
  tip: {{mesh: {{generator: box, length: 2 mm, height: 2 mm, width: 2 mm, element_size: 0.7 mm}},
        {SOLID}, position: [4 mm, 20 mm, 0 mm]}}
  striker: {{{CUBE}, {SOLID}, position: [2 mm, 22.2 mm, 0 mm],
            initial_velocity: [0 m/s, -1 m/s, 0.2 m/s]}}
  on_plane: {{{CUBE}, {SOLID}, position: [-9 mm, 0.1 mm, 0 mm],
             initial_velocity: [0.3 m/s, -0.5 m/s, 0 m/s]}}
ties: {{glue: {{nodes: tip.left, facets: brick.right, tolerance: 0.1 mm}}}}
rigid_bodies:
  frame: {{mass: 2 g, inertia: [20 g*mm^2, 30 g*mm^2, 30 g*mm^2], center: [-1 mm, 40 mm, 0 mm],
          initial_angular_velocity: 10 rad/s}}
environment: {{walls: {{plane: {{kind: plane, normal: [0, 1, 0]}}}}}}
contact: {{friction_coefficient: 0.3, self_contact: [brick, tip, striker]}}
loads:
  air: {{kind: follower_pressure, facets: [brick.top], profile: {{kind: constant, value: 2 kPa,
        ramp: 1 ms}}}}
  motor: {{kind: eccentric_mass, acts_on: frame, eccentric_mass: 0.2 g, radius: 1 mm,
          frequency: 150 Hz, rotation_axis: x, spin_up: 1 ms}}
{MATERIALS}"""
SPACE_ACTS = {"wall_force_normal", "slip_share", "hourglass_energy", "pressure", "frame_z"}

# Tubes of triangles and of quadrilaterals in a bore: one driven by a liquid, one by a gas, one by a
# pump at the end of an air line, one by a network.
REVOLVED = f"""
bodies:
  wet: {{mesh: {{generator: block, length: 1 mm, height: 5 mm, element_size: 1 mm}},
        formulation: axisymmetric, material: soft, position: [4 mm, 0 mm], fixed: [bottom, top]}}
  dry: {{mesh: {{generator: block, length: 1 mm, height: 5 mm, element_size: 1 mm, cells: quad}},
        formulation: axisymmetric, material: soft, position: [4 mm, 10 mm], fixed: [bottom, top]}}
  pumped: {{mesh: {{generator: block, length: 1 mm, height: 5 mm, element_size: 1 mm}},
           formulation: axisymmetric, material: soft, position: [4 mm, 20 mm],
           fixed: [bottom, top]}}
  fed: {{mesh: {{generator: block, length: 1 mm, height: 5 mm, element_size: 1 mm}},
        formulation: axisymmetric, material: soft, position: [4 mm, 30 mm], fixed: [bottom, top]}}
  ball: {{mesh: {{generator: block, length: 1 mm, height: 1 mm, element_size: 1 mm}},
         formulation: axisymmetric, material: soft, position: [1 mm, -1.9 mm],
         initial_velocity: [0 m/s, -0.5 m/s]}}
environment:
  walls:
    bore: {{kind: pipe, diameter: 9.02 mm}}
    floor: {{kind: plane, point: [0 mm, -2 mm]}}
loads:
  liquid: {{kind: added_volume, facets: [wet.left],
           profile: {{kind: smooth_step, value: 3 ul, duration: 2 ms}}}}
  gas: {{kind: added_gas, facets: [dry.left],
        profile: {{kind: smooth_step, value: 20 ug, duration: 2 ms}}}}
  line: {{kind: pneumatic, facets: [pumped.left], line_volume: 0.2 ml,
         pump: {{flow: 200 ml/s, stall: 50 kPa}}, valve: {{flow: 30 ml/s, pressure: 20 kPa}},
         tube: {{length: 20 mm, bore: 2 mm}},
         profile: {{kind: table, points: [[0 s, 0 kPa], [1 ms, 5 kPa], [5 ms, 5 kPa]]}}}}
pneumatics:
  nodes:
    wall: {{kind: regulator, flow: 300 ml/s, relieving: true,
           profile: {{kind: smooth_step, value: 9 kPa, duration: 1 ms}}}}
    pump: {{kind: pump, flow: 50 ml/s, stall: 20 kPa}}
    syringe: {{kind: syringe, volume: 1 ml, profile: {{kind: ramp, value: 0.1 ml, duration: 3 ms}}}}
    fed: {{kind: chamber, facets: [fed.left]}}
  edges:
    tube: {{kind: tube, between: [wall, fed], length: 10 mm, bore: 2 mm}}
    pulsed: {{kind: valve, between: [pump, fed], flow: 30 ml/s, pressure: 20 kPa, pulses: 1 kHz,
             opening: {{kind: constant, value: 0.4}}}}
    needle: {{kind: tube, between: [syringe, fed], length: 5 mm, bore: 1 mm}}
    leak: {{kind: valve, between: [fed, ambient], flow: 20 ml/s, pressure: 20 kPa}}
robot: {{chamber: line}}
output: {{probes: {{room: {{kind: volume, facets: [wet.left]}}}}}}
{MATERIALS}"""
REVOLVED_ACTS = {
    "pressure_liquid", "pressure_gas", "pressure_line", "air_flow", "wall_force_normal", "room",
    "pressure_fed", "line_pressure_wall", "supply_wall", "supply_pump", "volume_fed", "flow_tube",
    "flow_pulsed", "flow_needle", "flow_leak", "content_syringe",
}  # fmt: skip

STRUCTURES = {
    "plane": (PLANE, PLANE_ACTS),
    "space": (SPACE, SPACE_ACTS),
    "revolved": (REVOLVED, REVOLVED_ACTS),
}


INTERVAL = 0.2e-3  # s, between rows of the history
ROWS = 10  # in each half of the run


class History:
    """Rows of the history of a solver that begins."""

    def __init__(self, solver, reader):
        from softsim.output.observation import Observer
        from softsim.solver.energy import EnergyBalance
        from softsim.solver.stable_step import stable_step

        model = solver.models[0]
        self.solver, self.reader = solver, reader
        self.dt = 0.5 * stable_step(model, model.points).value
        solver.begin(self.dt)
        balance = EnergyBalance.starting(reader.read(), model)
        self.observer = Observer(solver.scenario(0), reader, balance)

    def half(self):
        """Advance by ROWS intervals and return their rows."""
        rows = []
        for _ in range(ROWS):
            self.solver.advance(round(INTERVAL / self.dt))
            self.reader.update()
            rows.append(self.observer.observe(INTERVAL).row)
            self.solver.clear_impulses(0)
        return rows


@pytest.mark.starts(1)
@pytest.mark.parametrize("name", STRUCTURES)
def test_every_part_acts_and_energy_is_balanced(build, restart, name):
    from softsim.output.observation import columns
    from softsim.solver.energy import EnergyReader
    from softsim.solver.explicit import ExplicitSolver

    text, acts = STRUCTURES[name]
    model = build(text)
    restart()
    solver = ExplicitSolver([model])
    history = History(solver, EnergyReader(solver))
    rows = history.half()
    middle, time, count = solver.state(), solver.time, solver.increment_count
    rows += history.half()
    largest = {column: max(abs(row[column]) for row in rows) for column in columns(model)}
    assert not {column for column in acts if not largest[column] > 0.0}
    assert largest["energy_error"] < 1e-3
    end = solver.state()
    solver.restore(middle, time, count, history.dt)
    np.testing.assert_equal(history.half(), rows[ROWS:])
    for part, array in end.items():
        np.testing.assert_array_equal(solver.state()[part], array, err_msg=part)


# A solver that takes a model with other numbers computes what a new one computes.

SOFTENS = "materials.soft.mullins={r: 1.6, m: 2 kPa, beta: 0.4}"
ADHERES = "contact.adhesion={glue: {work_of_adhesion: 0.1 J/m^2, pull_off_stress: 2 kPa}}"
ADDED = {"plane": (), "space": (SOFTENS, ADHERES), "revolved": ()}

QUANTITY = re.compile(r"-?\d+(\.\d+)?(?= )")
KEPT = {"element_size", "segment_length", "spacing", "tolerance"}
"""Keys that change the number of elements, and the width of a search."""
COMPILED = {"tail"}
"""Names below which numbers are constants of kernels: the radius of a cable at a wall."""


def changed(part, key=""):
    """Return a part of a scene with all quantities up to a thousandth smaller.

    Equal ones of the same key remain equal: what shares elements continues to share them.
    """
    if isinstance(part, dict):
        return {k: v if k in COMPILED else changed(v, k) for k, v in part.items()}
    if isinstance(part, list):
        return [changed(entry, key) for entry in part]
    if isinstance(part, bool) or not isinstance(part, str | float) or key in KEPT:
        return part
    factor = 1.0 - 1e-3 * zlib.crc32(f"{key} {part}".encode()) / 2**32
    if isinstance(part, float):
        return factor * part
    return QUANTITY.sub(lambda number: f"{factor * float(number[0])!r}", part)


@pytest.mark.physics
@pytest.mark.parametrize("name", STRUCTURES)
def test_a_solver_that_takes_other_numbers_computes_what_a_new_one_does(build, restart, name):
    from softsim.solver.energy import EnergyReader
    from softsim.solver.explicit import ExplicitSolver

    text, over = STRUCTURES[name][0], ADDED[name]
    given = build(text, *over)
    other = build(yaml.safe_dump(changed(yaml.safe_load(text)), sort_keys=False), *over)

    restart()
    solver = ExplicitSolver([given])
    reader = EnergyReader(solver)
    first = History(solver, reader).half()
    assert solver.take_models([other])
    rows, end = History(solver, reader).half(), solver.state()
    assert all(row != before for row, before in zip(rows, first, strict=True))
    restart()
    solver = ExplicitSolver([other])
    np.testing.assert_equal(rows, History(solver, EnergyReader(solver)).half())
    for part, array in solver.state().items():
        np.testing.assert_array_equal(end[part], array, err_msg=part)
