"""Measurements at one time of a run: a row of the history, a frame of the fields.

Contact quantities are averages over the interval since the last row, so that the vibration of the
motor does not alias into them; a row of spikes is in contact if it touched within the interval.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from softsim.analysis import passage as along_path
from softsim.analysis.passage import CROSSING_COLUMNS, end_readings
from softsim.contact.simple_walls import Cylinder
from softsim.contact.wall import Wall
from softsim.elements.geometry import cauchy_stress, measure_elements
from softsim.loads.load import Load
from softsim.loads.pressure import FollowerPressure
from softsim.model import Model, Probe
from softsim.output.fields import Frames, SeriesInMemory
from softsim.scene.outputs import probe_columns
from softsim.scene.quantities import CHAMBER_PRESSURE, ROW_FORCE, SIDE_FORCE
from softsim.solver.energy import (
    Energies,
    EnergyBalance,
    EnergyReader,
    unbalanced_share,
    wall_contact,
)
from softsim.solver.explicit import Scenario
from softsim.structures.structure import Structure


def columns(model: Model) -> dict[str, str]:
    """Return the columns of the history of a model, name -> unit.

    Comments give the ABAQUS names of the energies.
    """
    axes = "xyz"[: model.dimension]
    chamber = model.chamber
    first = {"time": "s"}
    if chamber is not None:
        first["pressure"] = "Pa"  # of the robot's chamber: what its gauge shows
        first["section_pressure"] = "Pa"  # what acts on the plane model
    # Of each of several, what its gauge shows.
    first |= dict.fromkeys(several_chambers(model), "Pa")
    first["cycles_done"] = "-"  # cycles of the pressure that have ended
    if chamber is not None:
        first |= chamber.source.columns
    if model.robot.frame is not None:
        first |= frame_columns(axes)
    owners: list[Load | Wall | Structure] = [*model.loads, *model.walls, *model.structures]
    of_terms = {name: unit for owner in owners for name, unit in owner.columns.items()}
    last = {
        **{f"body_{a}": "m" for a in axes},  # centre of mass of the meshed bodies
        "contact_count": "-",  # nodes, and corners of walls, in contact at this moment
        "contact_area": "m^2",  # at rest, of surface nodes that touched walls within the interval
        "rows_in_contact": "-",  # rows of spikes that touched within the interval
        **{f"wall_force_{a}": "N" for a in axes},  # of the walls on the robot, mean of the interval
        "wall_force_normal": "N",  # sum of normal forces, mean of the interval
        **dict.fromkeys(parts_pressed(model), "N"),  # the same of each row of spikes, and each side
        "slip_share": "-",  # of the normal impulse of the interval that slipping nodes carried
        **of_terms,  # what their terms read
        "internal_energy": "J",  # ALLSE: law, Maxwell springs, cables, fibres, tendons ...
        **hourglass_columns(model),
        "kinetic_energy": "J",  # ALLKE
        "external_work": "J",  # ALLWK: pressure, motor, forces, gravity
        "friction_dissipation": "J",  # ALLFD: contact, tethers
        "viscous_dissipation": "J",  # ALLVD + ALLCD: dashpots, bulk viscosity, relaxation's damping
        **damage_columns(model),
        "contact_energy": "J",  # ALLPW: penalty springs, adhesion
        "energy_error": "-",  # |ETOTAL - ETOTAL(0)| over the largest reference energy
    }
    if model.relaxation is not None:
        last["unbalanced_share"] = "-"  # of the forces, see solver/energy.py
        if model.relaxation.follows_path:
            last["load_time"] = "s"  # at which loads are taken: falls where the path turns back
            last["unstable_modes"] = "-"  # negative eigenvalues of the tangent stiffness
    if model.passage is not None:
        last |= along_path.PATH_COLUMNS
    if model.crossing is not None:
        last |= CROSSING_COLUMNS
    for probe in model.probes:
        last |= dict.fromkeys(probe_columns(probe.name, probe.kind, axes), PROBE_UNITS[probe.kind])
    return first | last


def hourglass_columns(model: Model) -> dict[str, str]:
    """Return the columns of hourglass modes -> unit; empty if the elements have none."""
    found = any(region.has_hourglass_modes for region in model.regions)
    return {"hourglass_energy": "J"} if found else {}  # ALLAE: a part of the internal one


def damage_columns(model: Model) -> dict[str, str]:
    """Return the column of the Mullins effect -> unit; empty if no material softens."""
    found = any(region.material.mullins is not None for region in model.regions)
    return {"damage_dissipation": "J"} if found else {}  # ALLDMD


def frame_columns(axes: str) -> dict[str, str]:
    """Return the columns of the robot's frame -> unit; axes: of the model."""
    found = {f"frame_{a}": "m" for a in axes} | {"frame_angle": "rad"}  # about z
    if axes == "xyz":
        found |= {f"frame_rotation_{a}": "rad" for a in axes}  # rotation vector
    return found


PROBE_UNITS = {
    "displacement": "m", "rotation": "rad", "radius": "m", "reaction": "N", "volume": "m^3",
}  # fmt: skip


def probe_values(scenario: Scenario, probe: Probe, x: np.ndarray) -> np.ndarray:
    """Return the current values (columns,) of a probe, SI, with the nodes at x (n, d) [m]."""
    if probe.kind == "volume":
        return np.array([probe.geometry.enclosed_volume(x, probe.members)])
    if probe.kind == "radius":
        axis = 0 if len(x[0]) == 3 else 1
        return np.linalg.norm(np.delete(x[probe.members], axis, axis=1), axis=1).mean(keepdims=True)
    if probe.kind == "rotation":
        return mean_rotation(scenario.model.points[probe.members], x[probe.members])
    if probe.kind == "displacement":
        return (x - scenario.model.points)[probe.members].mean(axis=0)
    # What holds the nodes is the opposite of what the rest does to them, their weight included.
    model = scenario.model
    weight = model.mass[probe.members].sum() * scenario.read(scenario.terms.nodes.gravity)
    return -scenario.read(scenario.terms.nodes.force)[probe.members].sum(axis=0) - weight


def mean_rotation(rest: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Return the rotation [rad] that moves points (n, d) closest to their present places.

    Squares of the distances are minimized (Kabsch 1976). In a plane it is an angle (1,), in space a
    rotation vector (3,); NaN if a place is not finite.
    """
    if not np.isfinite(now).all():
        return np.full(1 if now.shape[1] == 2 else 3, np.nan)
    a, b = rest - rest.mean(axis=0), now - now.mean(axis=0)
    if a.shape[1] == 2:
        return np.arctan2([(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()], (a * b).sum())
    return Rotation.align_vectors(b, a)[0].as_rotvec()


@dataclass(frozen=True)
class Observation:
    """A row of the history and the energies behind it."""

    row: dict[str, float]
    energies: Energies


class Observer:
    """Observer of a scenario, row by row; it stores what does not change between rows."""

    def __init__(self, scenario: Scenario, reader: EnergyReader, balance: EnergyBalance) -> None:
        self.scenario, self.reader, self.balance = scenario, reader, balance
        model = scenario.model
        self.blank = dict.fromkeys(columns(model), float("nan"))
        self.hourglass_columns = hourglass_columns(model)
        self.damage_columns = damage_columns(model)
        self.parts_pressed = parts_pressed(model)
        self.chambers = several_chambers(model)
        self.areas = np.zeros(len(model.points))
        for body in model.bodies:
            self.areas[body.nodes] = body.surface_areas

    def observe(self, interval: float) -> Observation:
        """Return the current row of the history; the energy reader must be up to date.

        interval: time since the contact impulses of the scenario were cleared [s].
        """
        scenario, reader, model = self.scenario, self.reader, self.scenario.model
        energies, walls = reader.of_scenario(scenario.number), wall_contact(scenario)
        centre = scenario.centre_of_mass()
        row = self.blank.copy()
        row["time"] = scenario.time
        if model.chamber is not None:
            row |= scenario.term_of(model.chamber).chamber_readings(
                scenario.number, scenario.load_time
            )
        for name, chamber in self.chambers.items():
            term = scenario.term_of(chamber)
            row[name] = term.chamber_readings(scenario.number, scenario.load_time)["pressure"]
        if model.robot.frame is not None:
            row |= frame_readings(frame_pose(scenario, model.robot.frame))
        row["contact_count"] = walls.contact_count
        row["slip_share"] = walls.slip_share
        rate = 1.0 / interval if interval > 0.0 else 0.0  # impulses since then to mean forces
        pressed = walls.normal_impulses * rate
        row["contact_area"] = float(self.areas[pressed > 0.0].sum())
        row["rows_in_contact"] = sum(bool(pressed[k].any()) for k in model.robot.rows.values())
        row["wall_force_normal"] = walls.normal_impulse * rate
        for name, nodes in self.parts_pressed.items():
            row[name] = float(pressed[nodes].sum())
        for i, axis in enumerate("xyz"[: model.dimension]):
            row[f"body_{axis}"] = float(centre[i])
            row[f"wall_force_{axis}"] = walls.impulse[i] * rate
        for term in reversed(scenario.terms.everything):  # of a kind, the first load is told
            row |= term.readings(scenario.number, interval)
        row["internal_energy"] = energies.internal
        row |= dict.fromkeys(self.hourglass_columns, energies.hourglass)
        row["kinetic_energy"] = energies.kinetic
        row["external_work"] = energies.external_work
        row["friction_dissipation"] = energies.friction_dissipation
        row["viscous_dissipation"] = energies.viscous_dissipation
        row |= dict.fromkeys(self.damage_columns, energies.damage_dissipation)
        row["contact_energy"] = energies.contact
        row["energy_error"] = self.balance.error(energies)
        if model.relaxation is not None:
            row["unbalanced_share"] = unbalanced_share(scenario)
        if model.passage is not None:
            place = frame_pose(scenario, model.passage.body).centre
            row |= along_path.path_readings(scenario, model.passage, place, interval)
        if model.crossing is not None or model.probes:
            row |= self._of_places(scenario.positions())
        return Observation(row, energies)

    def _of_places(self, x: np.ndarray) -> dict[str, float]:
        """Return the columns that depend on the positions of all nodes, x (n, d) [m]."""
        model = self.scenario.model
        found: dict[str, float] = {}
        if model.crossing is not None:
            found |= end_readings(model.crossing, x)
        for probe in model.probes:
            names = probe_columns(probe.name, probe.kind, "xyz"[: model.dimension])
            values = probe_values(self.scenario, probe, x).tolist()
            found |= dict(zip(names, values, strict=True))
        return found


def several_chambers(model: Model) -> dict[str, FollowerPressure]:
    """Return the chambers by the column of their pressure; empty for fewer than two."""
    chambers = model.pressures
    return {f"{CHAMBER_PRESSURE}{c.name}": c for c in chambers} if len(chambers) > 1 else {}


def parts_pressed(model: Model) -> dict[str, np.ndarray]:
    """Return the nodes of the robot's rows and sides, by the column of the wall force on them."""
    robot = model.robot
    rows = {f"{ROW_FORCE}{name}": nodes for name, nodes in robot.rows.items()}
    return rows | {f"{SIDE_FORCE}{name}": nodes for name, nodes in robot.sides.items()}


@dataclass(frozen=True)
class Pose:
    """Current pose of a rigid body.

    centre: position of the centre given in the scene (d,) [m]. orientation: quaternion
    (w, x, y, z).
    """

    centre: np.ndarray
    orientation: np.ndarray

    @property
    def angle(self) -> float:
        """Rotation about z [rad], continuous up to a whole turn in either direction."""
        return float(2.0 * np.arctan2(self.orientation[3], self.orientation[0]))

    @property
    def rotation_vector(self) -> np.ndarray:
        """Axis times angle (3,) [rad], continuous up to a whole turn."""
        w, v = self.orientation[0], self.orientation[1:]
        length = np.linalg.norm(v)
        if length == 0.0:
            return np.zeros(3)
        return 2.0 * np.arctan2(length, w) * v / length


def frame_pose(scenario: Scenario, body: int) -> Pose:
    """Return the current pose of a rigid body."""
    bodies = scenario.terms.rigid_bodies
    moved = (bodies.centre, bodies.orientation, bodies.rotation)
    centre, orientation, rotation = (scenario.read(field)[body] for field in moved)
    d = bodies.dimension
    arm = bodies.bodies[body].centre - bodies.rest_centre[body]
    return Pose(centre + rotation[:d, :d] @ arm, orientation)


def frame_readings(pose: Pose) -> dict[str, float]:
    """Return the position [m] and rotation [rad] of the robot's frame, by column."""
    now = {f"frame_{a}": float(c) for a, c in zip("xyz", pose.centre, strict=False)}
    now["frame_angle"] = pose.angle
    if len(pose.centre) == 3:
        turn = zip("xyz", pose.rotation_vector, strict=True)
        now |= {f"frame_rotation_{a}": float(c) for a, c in turn}
    return now


@dataclass(frozen=True)
class Frame:
    """Fields at one time, in the form of FieldWriter.append."""

    point_data: dict[str, np.ndarray]
    cell_data: dict[str, np.ndarray]
    extra: dict[str, np.ndarray]


def mesh_of(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Return all bodies as one mesh: points (n, d) [m], cells (m, nodes per cell)."""
    points = np.concatenate([b.points for b in model.bodies])
    return points, np.concatenate([b.cells + b.first_node for b in model.bodies])


def frame(scenario: Scenario, further: Sequence[str]) -> Frame:
    """Return the current fields of a scenario; further: names from `output.fields`."""
    model = scenario.model
    x = scenario.positions()
    peaks = iter(scenario.peak_energies())
    of_bodies = [[(r, next(peaks)) for r in b.regions] for b in model.bodies]
    measured = [[measure_elements(r, x[r.nodes], peak) for r, peak in of] for of in of_bodies]
    parts = list(zip(model.bodies, measured, strict=True))
    points, _ = mesh_of(model)
    poses = [frame_pose(scenario, r) for r in range(len(model.rigid_bodies))]
    pose_rows = np.array(
        [
            [*p.centre, p.angle] if model.dimension == 2 else [*p.centre, *p.orientation]
            for p in poses
        ]
    )
    pressure = np.concatenate([b.nodal_mean(m.nodal_pressure for m in of) for b, of in parts])
    of_points = {"displacement": x[: len(points)] - points, "pressure": pressure}
    if "velocity" in further:
        of_points["velocity"] = scenario.read(scenario.terms.nodes.velocity)[: len(points)]
    if "contact_force" in further:
        of_points["contact_force"] = wall_forces(scenario)[: len(points)]
    of_cells = {
        "stretch": np.concatenate([b.joined(m.stretch for m in of) for b, of in parts]),
        "von_mises": np.concatenate([b.joined(m.von_mises for m in of) for b, of in parts]),
    }
    if "stress" in further:
        of_cells["stress"] = np.concatenate(
            [
                b.joined(cauchy_stress(r, x[r.nodes], peak) for r, peak in of)
                for b, of in zip(model.bodies, of_bodies, strict=True)
            ]
        )
    return Frame(
        of_points,
        of_cells,
        ({"frame_pose": pose_rows} if poses else {})
        | line_places(model, x)
        | wall_offsets(model, scenario.time),
    )


def present_frames(scenario: Scenario, described: Mapping[str, Any]) -> Frames:
    """Return the present fields of a scenario as a single frame in memory.

    described: what `description` returns for its model.
    """
    points, cells = mesh_of(scenario.model)
    now = frame(scenario, ())
    return Frames(
        points, cells, np.array([scenario.time]),
        point_data={name: SeriesInMemory([a]) for name, a in now.point_data.items()},
        cell_data={name: SeriesInMemory([a]) for name, a in now.cell_data.items()},
        extra={name: SeriesInMemory([a]) for name, a in now.extra.items()},
        described={n: a for n, a in described.items() if isinstance(a, np.ndarray)},
        titles={n: text for n, text in described.items() if isinstance(text, str)},
        sets=described["sets"],
    )  # fmt: skip


def wall_forces(scenario: Scenario) -> np.ndarray:
    """Return the current force of all walls on each node (n, d) [N]."""
    found = np.zeros_like(scenario.model.points)
    for walls in scenario.terms.wall_contacts:
        found[scenario.model.contact.nodes] += scenario.read(walls.force)
    return found


def line_places(model: Model, x: np.ndarray) -> dict[str, np.ndarray]:
    """Return the points (k, d) [m] of all lines that structures draw, by kind.

    Kinds without members are left out. x: positions of all nodes (n, d) [m].
    """
    return {kind: np.concatenate(lines) for kind, lines in drawn_lines(model, x).items() if lines}


def drawn_lines(model: Model, x: np.ndarray) -> dict[str, list[np.ndarray]]:
    """Return the lines (k, d) [m] of all structures by kind, with all nodes at x (n, d) [m]."""
    result: dict[str, list[np.ndarray]] = {"cables": [], "fibres": []}
    for structure in model.all_structures:
        for kind, lines in structure.lines(x).items():
            result[kind] += lines
    return result


def wall_offsets(model: Model, time: float) -> dict[str, np.ndarray]:
    """Return the displacement of each wall (w, d) [m] at a time [s], if there are walls."""
    offsets = [wall.offset(time)[: model.dimension] for wall in model.walls]
    return {"wall_offset": np.array(offsets)} if offsets else {}


def description(model: Model, title: str) -> dict:
    """Return the figure data that FieldWriter.describe stores: walls, outlines, sets, title."""
    outlines, owners = [], []
    for outline in model.outlines:
        shape = outline.shape
        if model.dimension == 2 and isinstance(shape, Cylinder):
            size = np.roll([2.0 * shape.half_length, 2.0 * shape.radius], shape.axis)
            outlines.append([*(shape.centre - model.rigid_bodies[outline.body].centre), *size])
            owners.append(outline.body)
    sets = {f"{b.name}.{name}": nodes for b in model.bodies for name, nodes in b.node_sets.items()}
    line_starts = {
        kind: np.cumsum([0, *map(len, lines)])[:-1]
        for kind, lines in drawn_lines(model, model.points).items()
    }
    facets = [s.drawn_facets for s in model.structures if len(s.drawn_facets)]
    passage = model.passage
    return {
        **drawn_walls(model.walls),
        **({} if passage is None else along_path.path_samples(passage.network)),
        "gravity": model.gravity,
        "outlines": np.array(outlines).reshape(-1, 4),
        "outline_bodies": np.array(owners, dtype=int),
        **rigid_surfaces(model),
        **{f"{kind.removesuffix('s')}_starts": starts for kind, starts in line_starts.items()},
        **({"layers": np.concatenate(facets)} if facets else {}),
        "sets": sets,
        "title": title,
        "formulation": model.regions[0].geometry.name,
    }


def rigid_surfaces(model: Model) -> dict[str, np.ndarray]:
    """Return the mesh surfaces of rigid bodies for FieldWriter.describe, if there are any."""
    bodies = [(r, body) for r, body in enumerate(model.rigid_bodies) if len(body.faces)]
    if not bodies:
        return {}
    nodes = [np.unique(body.faces) for _, body in bodies]
    arms = [model.points[n] - b.centre for n, (_, b) in zip(nodes, bodies, strict=True)]
    faces = np.concatenate([body.faces for _, body in bodies])
    return {
        "rigid_vertices": np.concatenate(arms),
        "rigid_vertex_bodies": np.repeat([r for r, _ in bodies], [len(n) for n in nodes]),
        "rigid_faces": np.searchsorted(np.concatenate(nodes), faces),
    }


def drawn_walls(walls: Sequence[Wall]) -> dict[str, np.ndarray]:
    """Return the data of the walls for figures, concatenated by name.

    NAME_owner holds the number of the wall of each row of NAME.
    """
    parts: dict[str, list[np.ndarray]] = {}
    for number, wall in enumerate(walls):
        for name, array in wall.drawn().items():
            parts.setdefault(name, []).append(array)
            parts.setdefault(f"{name}_owner", []).append(np.full(len(array), number))
    return {name: np.concatenate(arrays) for name, arrays in parts.items()}
