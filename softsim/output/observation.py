"""What is measured at a moment of a run: a row of the history, a frame of the fields.

Contact quantities are averages over the interval since the last row, so that the vibration of the
motor does not alias into them; a row of spikes is in contact if it touched within the interval.
"""

from dataclasses import dataclass

import numpy as np

from softsim.elements.measures import measure_elements
from softsim.model import Model
from softsim.solver.energy import Energies, EnergyBalance, Meter
from softsim.solver.explicit import ExplicitSolver

# Column -> unit. Energies carry ABAQUS's names in comments.
UNITS = {
    "time": "s",
    "pressure": "Pa",  # of the profile: what a gauge on the robot shows
    "section_pressure": "Pa",  # what acts on the plane model
    "frame_x": "m",
    "frame_y": "m",
    "frame_angle": "rad",
    "body_x": "m",  # centre of mass of the meshed bodies
    "contact_count": "-",  # nodes in contact with walls at this moment
    "rows_in_contact": "-",  # rows of spikes that touched within the interval
    "wall_force_x": "N",  # of the walls on the robot, mean of the interval
    "wall_force_normal": "N",  # sum of normal forces, mean of the interval
    "internal_energy": "J",  # ALLSE: law and Maxwell springs
    "kinetic_energy": "J",  # ALLKE
    "external_work": "J",  # ALLWK: pressure, motor, forces, gravity
    "friction_dissipation": "J",  # ALLFD
    "viscous_dissipation": "J",  # ALLVD + ALLCD: Maxwell dashpots, bulk and contact damping
    "contact_energy": "J",  # ALLPW: penalty springs
    "energy_error": "-",  # |ETOTAL - ETOTAL(0)| over the largest turnover
}


@dataclass(frozen=True)
class Observation:
    """A row of the history and the energies behind it."""

    row: dict[str, float]
    energies: Energies


def observe(
    solver: ExplicitSolver, meter: Meter, balance: EnergyBalance, interval: float
) -> Observation:
    """Measure the first scenario now; `interval` [s] since contact impulses were cleared."""
    model = solver.models[0]
    energies, grip, body_x = meter.read()
    row = dict.fromkeys(UNITS, float("nan"))
    row["time"] = solver.time
    if model.pressures:
        load = model.pressures[0]
        row["pressure"] = float(load.profile.at(solver.time))
        row["section_pressure"] = float(load.section_profile.at(solver.time))
    if model.rigid_bodies:
        (row["frame_x"], row["frame_y"]), row["frame_angle"] = frame_pose(solver, 0)
    row["body_x"] = body_x
    row["contact_count"] = grip.contact_count
    row |= {"rows_in_contact": 0.0, "wall_force_x": 0.0, "wall_force_normal": 0.0}
    if grip.normal_impulse > 0.0 and interval > 0.0:
        row["rows_in_contact"] = rows_in_contact(solver)
        row["wall_force_x"] = grip.impulse_x / interval
        row["wall_force_normal"] = grip.normal_impulse / interval
    row["internal_energy"] = energies.internal
    row["kinetic_energy"] = energies.kinetic
    row["external_work"] = energies.external_work
    row["friction_dissipation"] = energies.friction_dissipation
    row["viscous_dissipation"] = energies.viscous_dissipation
    row["contact_energy"] = energies.contact
    row["energy_error"] = balance.error(energies)
    return Observation(row, energies)


def rows_in_contact(solver: ExplicitSolver) -> int:
    """Rows of spikes of which a node touched a wall since impulses were cleared."""
    model = solver.models[0]
    touched = np.zeros(len(model.points), dtype=bool)
    for walls in solver.terms.wall_contacts:
        touched[model.contact.nodes] = walls.normal_impulse.to_numpy()[0] > 0.0
    return sum(bool(touched[nodes].any()) for nodes in model.rows.values())


def frame_pose(solver: ExplicitSolver, body: int) -> tuple[np.ndarray, float]:
    """Where the scene's centre of a rigid body is now (2,) [m], and its angle [rad]."""
    bodies = solver.terms.rigid_bodies
    angle = float(bodies.angle.to_numpy()[0, body])
    c, s = np.cos(angle), np.sin(angle)
    arm = bodies.bodies[body].centre - bodies.rest_centre[body]
    turned = np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])
    return bodies.centre.to_numpy()[0, body] + turned, angle


@dataclass(frozen=True)
class Frame:
    """Fields of a moment, as FieldWriter.append takes them."""

    point_data: dict[str, np.ndarray]
    cell_data: dict[str, np.ndarray]
    extra: dict[str, np.ndarray]


def mesh_of(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """All bodies as one mesh: points (n, 2) [m], cells (m, 3)."""
    points = np.concatenate([b.points for b in model.bodies])
    return points, np.concatenate([b.cells + b.first_node for b in model.bodies])


def frame(solver: ExplicitSolver) -> Frame:
    """Fields of the first scenario now."""
    model = solver.models[0]
    x = solver.positions()[0]
    parts = [measure_elements(b.points, b.cells, x[b.nodes], b.material) for b in model.bodies]
    points, _ = mesh_of(model)
    poses = [frame_pose(solver, r) for r in range(len(model.rigid_bodies))]
    pose_rows = np.array([[*centre, angle] for centre, angle in poses])
    return Frame(
        {
            "displacement": x[: len(points)] - points,
            "pressure": np.concatenate([p.nodal_pressure for p in parts]),
        },
        {
            "stretch": np.concatenate([p.stretch for p in parts]),
            "von_mises": np.concatenate([p.von_mises for p in parts]),
        },
        {"frame_pose": pose_rows} if poses else {},
    )


def description(model: Model, title: str) -> dict:
    """What FieldWriter.describe stores for the figures: walls, outlines, sets, title."""
    outlines = [
        [*(o.centre - model.rigid_bodies[o.body].centre), *(2.0 * o.half_size)]
        for o in model.outlines
    ]
    sets = {f"{b.name}.{name}": nodes for b in model.bodies for name, nodes in b.node_sets.items()}
    return {
        "walls": np.concatenate([model.walls.points, model.walls.normals], axis=1),
        "outlines": np.array(outlines).reshape(-1, 4),
        "outline_bodies": np.array([o.body for o in model.outlines], dtype=int),
        "sets": sets,
        "title": title,
    }
