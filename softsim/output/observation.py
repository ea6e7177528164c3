"""Measurements at one time of a run: a row of the history, a frame of the fields.

Contact quantities are averages over the interval since the last row, so that the vibration of the
motor does not alias into them; a row of spikes is in contact if it touched within the interval.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti
from scipy.spatial.transform import Rotation

from softsim.analysis.passage import analyses
from softsim.compute.term import Sampler, Samples
from softsim.contact.simple_walls import Cylinder
from softsim.contact.wall import Wall
from softsim.elements.geometry import cauchy_stress, measure_elements
from softsim.loads.load import Load
from softsim.loads.pressure import FollowerPressure
from softsim.model import Model, Probe
from softsim.output.fields import Frame, Frames, SeriesInMemory
from softsim.rigid import Pose
from softsim.scene.measures import OF_PROBES
from softsim.scene.outputs import probe_columns
from softsim.scene.quantities import CHAMBER_PRESSURE, COLUMNS, ROW_FORCE, SIDE_FORCE
from softsim.solver.energy import (
    Energies,
    EnergyBalance,
    EnergyReader,
    unbalanced_share,
    wall_contact,
    wall_fields,
)
from softsim.solver.explicit import Scenario
from softsim.structures.structure import Structure


def columns(model: Model) -> dict[str, str]:
    """Return the columns of the history of a model, name -> unit.

    `COLUMNS` (scene/quantities.py) gives their meaning.
    """
    axes, chamber, path = "xyz"[: model.dimension], model.chamber, model.relaxation
    found = units_of("time")
    if chamber is not None:
        found |= units_of("pressure", "section_pressure")
    found |= dict.fromkeys(several_chambers(model), "Pa") | units_of("cycles_done")
    if chamber is not None:
        found |= chamber.source.columns
    if model.robot.frame is not None:
        found |= units_of(*(f"frame_{a}" for a in axes), "frame_angle")
        found |= units_of(*(f"frame_rotation_{a}" for a in axes if axes == "xyz"))
    found |= units_of(*(f"body_{a}" for a in axes))
    found |= units_of("contact_count", "contact_area", "rows_in_contact")
    found |= units_of(*(f"wall_force_{a}" for a in axes), "wall_force_normal")
    found |= dict.fromkeys(parts_pressed(model), "N") | units_of("slip_share")
    owners: list[Load | Wall | Structure] = [*model.loads, *model.walls, *model.structures]
    for owner in owners:
        found |= owner.columns
    found |= units_of("internal_energy", *hourglass_columns(model), "kinetic_energy")
    found |= units_of("external_work", "friction_dissipation", "viscous_dissipation")
    found |= units_of(*damage_columns(model), "contact_energy", "energy_error")
    if path is not None:
        found |= units_of("unbalanced_share")
        found |= units_of(*(("load_time", "unstable_modes") if path.follows_path else ()))
    for analysis in analyses(model):
        found |= analysis.columns
    for probe in model.probes:
        names = probe_columns(probe.name, probe.kind, axes)
        found |= dict.fromkeys(names, OF_PROBES[probe.kind].unit)
    return found


def units_of(*names: str) -> dict[str, str]:
    """Return the units of columns, by name."""
    return {name: COLUMNS[name].unit for name in names}


def hourglass_columns(model: Model) -> tuple[str, ...]:
    """Return the columns of hourglass modes; none if the elements have no such modes."""
    found = any(region.has_hourglass_modes for region in model.regions)
    return ("hourglass_energy",) if found else ()


def damage_columns(model: Model) -> tuple[str, ...]:
    """Return the column of the Mullins effect; none if no material softens."""
    found = any(region.material.mullins is not None for region in model.regions)
    return ("damage_dissipation",) if found else ()


def probe_values(model: Model, probe: Probe, x: np.ndarray) -> np.ndarray:
    """Return the values (columns,) of a probe that follow from the nodes at x (n, d) [m], SI.

    A reaction does not, see `reaction`.
    """
    if probe.kind == "volume":
        return np.array([probe.geometry.enclosed_volume(x, probe.members)])
    if probe.kind == "radius":
        axis = 0 if len(x[0]) == 3 else 1
        return np.linalg.norm(np.delete(x[probe.members], axis, axis=1), axis=1).mean(keepdims=True)
    if probe.kind == "rotation":
        return mean_rotation(model.points[probe.members], x[probe.members])
    return (x - model.points)[probe.members].mean(axis=0)


def reaction(model: Model, probe: Probe, force: np.ndarray, gravity: np.ndarray) -> np.ndarray:
    """Return the force (d,) [N] that holds the nodes of a probe, under a gravity (d,) [m/s^2].

    It is the opposite of what the rest does to them, the nodal forces (n, d) [N] and their weight.
    """
    weight = model.mass[probe.members].sum() * gravity
    return -force[probe.members].sum(axis=0) - weight


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
    """Observer of a scenario: `take` samples a row, `rows` returns the columns of all since then.

    It stores what does not change between rows. Columns of a static run, and those of
    analyses, are of the present state: there each row is computed before the next increment.
    most: number of rows whose columns are computed together, at most. energy_error: of the last
    sample.
    """

    def __init__(
        self, scenario: Scenario, reader: EnergyReader, balance: EnergyBalance, most: int = 1
    ) -> None:
        self.scenario, self.reader, self.balance = scenario, reader, balance
        model = scenario.model
        self.columns = tuple(columns(model))
        self.hourglass_columns = hourglass_columns(model)
        self.damage_columns = damage_columns(model)
        self.parts_pressed = parts_pressed(model)
        self.chambers = several_chambers(model)
        self.analyses = analyses(model)
        self.areas = np.zeros(len(model.points))
        for body in model.bodies:
            self.areas[body.nodes] = body.surface_areas
        self.refusals = [term.refuse for term in scenario.terms.everything]
        self.sampler = Sampler(scenario.number, self._sampled(), most)
        self.energies: list[Energies] = []
        self.energy_errors: list[float] = []
        self.energy_error = 0.0

    def _sampled(self) -> list[ti.Field]:
        """Return the fields that the columns need."""
        terms, model = self.scenario.terms, self.scenario.model
        needed = [terms.nodes.position, *wall_fields(terms)]
        if any(probe.kind == "reaction" for probe in model.probes):
            needed += [terms.nodes.force, terms.nodes.gravity]
        if model.robot.frame is not None:
            needed += terms.rigid_bodies.pose_fields
        return needed + [field for term in terms.everything for field in term.sampled()]

    def take(self, interval: float) -> Energies:
        """Sample a row and return its energies; the energy reader must be up to date.

        interval: time since the contact impulses of the scenario were cleared [s].
        """
        scenario = self.scenario
        for refuse in self.refusals:
            refuse(scenario.number)
        energies = self.reader.of_scenario(scenario.number)
        self.energy_error = self.balance.error(energies)
        self.sampler.take(scenario.time, scenario.load_time, interval)
        self.energies.append(energies)
        self.energy_errors.append(self.energy_error)
        return energies

    @property
    def is_empty(self) -> bool:
        """True if all rows sampled have their columns."""
        return not self.energies

    @property
    def is_full(self) -> bool:
        """True if the columns must be computed before the next row is sampled."""
        return self.sampler.is_full

    def observe(self, interval: float) -> Observation:
        """Return the current row of the history; reader and interval as for `take`."""
        energies = self.take(interval)
        row = {name: float(values[-1]) for name, values in self.rows().items()}
        return Observation(row, energies)

    def rows(self) -> dict[str, np.ndarray]:
        """Return the columns (rows,) of the rows sampled since the last call."""
        scenario, model = self.scenario, self.scenario.model
        samples = self.sampler.handed_over()
        found = dict.fromkeys(self.columns, np.full(len(samples), np.nan))
        found["time"] = samples.times
        if model.chamber is not None:
            found |= scenario.term_of(model.chamber).chamber_readings(samples)
        for name, chamber in self.chambers.items():
            found[name] = scenario.term_of(chamber).chamber_readings(samples)["pressure"]
        if model.robot.frame is not None:
            found |= frame_columns_of(sampled_poses(scenario, model.robot.frame, samples))
        found |= self._of_walls(samples)
        centres = scenario.centres_of_mass(samples.read(scenario.terms.nodes.position))
        for axis, values in zip("xyz", centres.T, strict=False):
            found[f"body_{axis}"] = values
        for term in reversed(scenario.terms.everything):  # of equal columns the first load's remain
            found |= term.readings(samples)
        found |= self._of_energies()
        if model.relaxation is not None:
            found["unbalanced_share"] = np.array([unbalanced_share(scenario)])
        for analysis in self.analyses:
            found |= analysis.readings(scenario, samples)
        if model.probes:
            found |= self._of_probes(samples)
        return found

    def _of_walls(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the columns (rows,) of contact with walls."""
        walls, robot = wall_contact(self.scenario, samples), self.scenario.model.robot
        rates = samples.rates  # of impulses, to mean forces
        pressed = walls.normal_impulses * rates[:, None]
        of_rows = [pressed[:, nodes].any(axis=1) for nodes in robot.rows.values()]
        found = {
            "contact_count": walls.contact_count,
            "slip_share": walls.slip_share,
            "contact_area": np.array([self.areas[row > 0.0].sum() for row in pressed]),
            "rows_in_contact": np.sum(of_rows, axis=0) if of_rows else np.zeros(len(samples)),
            "wall_force_normal": walls.normal_impulse * rates,
        }
        for name, nodes in self.parts_pressed.items():
            found[name] = np.take(pressed, nodes, axis=1).sum(axis=1)
        for axis, impulse in zip("xyz", walls.impulse.T, strict=False):
            found[f"wall_force_{axis}"] = impulse * rates
        return found

    def _of_energies(self) -> dict[str, np.ndarray]:
        """Return the columns (rows,) of the energies, and begin anew."""
        energies, errors = self.energies, self.energy_errors
        self.energies, self.energy_errors = [], []
        found = {
            "internal_energy": [e.internal for e in energies],
            **{name: [e.hourglass for e in energies] for name in self.hourglass_columns},
            "kinetic_energy": [e.kinetic for e in energies],
            "external_work": [e.external_work for e in energies],
            "friction_dissipation": [e.friction_dissipation for e in energies],
            "viscous_dissipation": [e.viscous_dissipation for e in energies],
            **{name: [e.damage_dissipation for e in energies] for name in self.damage_columns},
            "contact_energy": [e.contact for e in energies],
            "energy_error": errors,
        }
        return {name: np.array(values) for name, values in found.items()}

    def _of_probes(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the columns (rows,) of probes."""
        model, nodes = self.scenario.model, self.scenario.terms.nodes
        positions = samples.read(nodes.position)
        found: dict[str, np.ndarray] = {}
        for probe in model.probes:
            names = probe_columns(probe.name, probe.kind, "xyz"[: model.dimension])
            if probe.kind == "reaction":
                acting = zip(samples.read(nodes.force), samples.read(nodes.gravity), strict=True)
                values = [reaction(model, probe, force, gravity) for force, gravity in acting]
            else:
                values = [probe_values(model, probe, x) for x in positions]
            found |= dict(zip(names, np.array(values).T, strict=True))
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


def sampled_poses(scenario: Scenario, body: int, samples: Samples) -> list[Pose]:
    """Return the pose of a rigid body in each row of samples."""
    bodies = scenario.terms.rigid_bodies
    of_body = (samples.read(field)[:, body] for field in bodies.pose_fields)
    return [bodies.pose(body, *row) for row in zip(*of_body, strict=True)]


def frame_readings(pose: Pose) -> dict[str, float]:
    """Return the position [m] and rotation [rad] of the robot's frame, by column."""
    now = {f"frame_{a}": float(c) for a, c in zip("xyz", pose.centre, strict=False)}
    now["frame_angle"] = pose.angle
    if len(pose.centre) == 3:
        turn = zip("xyz", pose.rotation_vector, strict=True)
        now |= {f"frame_rotation_{a}": float(c) for a, c in turn}
    return now


def frame_columns_of(poses: Sequence[Pose]) -> dict[str, np.ndarray]:
    """Return the columns (rows,) of `frame_readings` for the pose of each row."""
    readings = [frame_readings(pose) for pose in poses]
    return {name: np.array([row[name] for row in readings]) for name in readings[0]}


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
    poses = [scenario.pose(r) for r in range(len(model.rigid_bodies))]
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
        scenario.time,
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
    return {
        **drawn_walls(model.walls),
        **dict(item for analysis in analyses(model) for item in analysis.drawn().items()),
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
