"""Experiments of a calibration, and what follows from their histories.

An experiment is a slow inflation, or a push at one pressure. The frame is held: the nodes tied to
it get a prescribed displacement, zero except in a push. Gravity, motors and other forces are left
out; contact and friction stay as in the scene. The evaluation gives wall forces, pressures that
correspond and stiffnesses, and the lines for the scene.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import nnls

from softsim.errors import CalibrationError
from softsim.report.diagram import FLAT, STEPS, Diagram, Panel, PlotAxis, PlotSeries, Scale
from softsim.report.style import BLUE, INK, ORANGE
from softsim.report.table import Table, cell
from softsim.scene.loading import LoadedScene, overridden
from softsim.scene.loads import FollowerPressureSpec
from softsim.scene.schema import Scene
from softsim.scene.text import Tree, plain
from softsim.scene.walls import PipeWall

# -------------------------------------------------------------------------------------------------
# Parts of a scene that a calibration uses, found by their kinds.


@dataclass(frozen=True)
class Specimen:
    """Scene with one air pressure in one pipe.

    pressure: name of the load. body: name of the body that it inflates. frame: name of the rigid
    body tied to that, None if its ends are fixed. pipe: name of the wall. diameter [m]: of the
    pipe.
    """

    loaded: LoadedScene
    pressure: str
    body: str
    frame: str | None
    pipe: str
    diameter: float

    @property
    def formulation(self) -> str:
        """Kinematics of the body."""
        return self.loaded.scene.bodies[self.body].formulation

    @property
    def axes(self) -> str:
        """Letters of the model's axes."""
        return "xyz" if self.formulation == "solid" else "xy"


def section_specimen(loaded: LoadedScene) -> Specimen:
    """Return the specimen of the plane section.

    Raises
    ------
    SceneError: it is not plane strain, or has not one follower pressure and one pipe.
    """
    return _specimen(loaded, ("plane_strain", "ring_section"), "the section must be")


def reference_specimen(loaded: LoadedScene) -> Specimen:
    """Return the specimen of the body that the section represents.

    Raises
    ------
    SceneError: it is neither solid nor axisymmetric, or has not one follower pressure and one pipe.
    """
    return _specimen(
        loaded, ("solid", "axisymmetric"), "the reference must be a body of formulation"
    )


def refuse_other_pipe(section: Specimen, reference: Specimen) -> None:
    """Raise SceneError unless both specimens are in pipes of the same diameter."""
    if abs(section.diameter - reference.diameter) > 1e-9 * reference.diameter:
        raise section.loaded.error(
            ("environment", "walls", section.pipe, "diameter"),
            f"the pipe of the section is {section.diameter * 1e3:g} mm wide, that of the "
            f"reference {reference.diameter * 1e3:g} mm",
            "choose one with --set or --set-reference "
            f"environment.walls.{reference.pipe}.diameter='{section.diameter * 1e3:g} mm'",
        )


def _specimen(loaded: LoadedScene, formulations: tuple[str, ...], role: str) -> Specimen:
    scene = loaded.scene
    for name, body in scene.bodies.items():
        if body.formulation not in formulations:
            raise loaded.error(
                ("bodies", name, "formulation"),
                f"'{name}' is {body.formulation}: {role} {' or '.join(formulations)}",
                "softsim calibrate-section SECTION_SCENE --reference SOLID_SCENE",
            )
    air = {n: load for n, load in scene.loads.items() if isinstance(load, FollowerPressureSpec)}
    if len(air) != 1:
        raise loaded.error(
            ("loads",),
            f"has {len(air)} loads of kind follower_pressure; one is needed",
            "give the scene one such load; its profile has no effect here",
        )
    pipes = {n: w for n, w in scene.environment.walls.items() if isinstance(w, PipeWall)}
    others = len(scene.environment.walls) - len(pipes)
    if len(pipes) != 1 or others:
        raise loaded.error(
            ("environment", "walls"),
            f"has {len(pipes)} pipes and {others} other walls; exactly one pipe is needed",
            "write environment: {walls: {pipe: {kind: pipe, diameter: 36 mm}}}",
        )
    (pressure, load), (pipe, wall) = next(iter(air.items())), next(iter(pipes.items()))
    inflated = load.facets[0].partition(".")[0]
    frames = [n for n, r in scene.rigid_bodies.items() if r.tied]
    if len(frames) > 1:
        raise loaded.error(
            ("rigid_bodies",),
            f"bodies are tied to {len(frames)} rigid bodies: {', '.join(frames)}; one is needed",
            "remove the others",
        )
    return Specimen(loaded, pressure, inflated, frames[0] if frames else None, pipe, wall.diameter)


# -------------------------------------------------------------------------------------------------
# The stiffness with which spikes hold a frame in its pipe, from a small displacement of it.


@dataclass(frozen=True)
class Move:
    """A displacement of the frame along `axis` by `distance` [m], from `begin` to `end` [s].

    Forces are read in the `rest` [s] before it and in the last `rest` before `until` [s].
    """

    axis: str
    distance: float
    begin: float
    end: float
    until: float
    rest: float


@dataclass(frozen=True)
class SpecimenStiffness:
    """Force over displacement [N/m], and how far the force still swings, over its change [-]."""

    value: float
    unrest: float


def stiffness(history: Mapping[str, np.ndarray], move: Move) -> SpecimenStiffness:
    """Stiffness along a move's axis: by how much the walls push back, over the distance."""
    time, force = history["time"], history[f"wall_force_{move.axis}"]
    before = force[(time > move.begin - move.rest) & (time <= move.begin)]
    after = force[(time > move.until - move.rest) & (time <= move.until)]
    change = float(before.mean() - after.mean())
    swing = 0.5 * float(np.ptp(after))
    return SpecimenStiffness(change / move.distance, abs(swing / change) if change else np.inf)


# -------------------------------------------------------------------------------------------------
# Scenes of the experiments.

HISTORY_ROWS = 300
FRAMES = 6
RISE_POINTS = 41
"""Points of the smooth rise: its chord is off by at most 6/(8 n^2), 5e-4 of the pressure."""

PUSH_DISTANCE = 0.05e-3
"""Displacement of the frame [m]: half of m_e r_e / m = 0.1 mm, by which its motor shakes a free
robot."""

MOVE_TIME, REST_TIME, SETTLING_TIME = 30e-3, 20e-3, 250e-3
"""Seconds in which the frame moves, over which a force is read, and given to a force to settle:
twice the slowest branch of the library's silicones, 0.12 s, by which an inflated skin creeps on."""

Points = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Push:
    """A push of the frame: its scene, and the moves in it."""

    scene: LoadedScene
    moves: tuple[Move, ...]


def inflation(specimen: Specimen, highest: float, duration: float) -> LoadedScene:
    """Return the scene of a smooth pressure rise to `highest` [Pa] within `duration` [s]."""
    return _quasi_static(specimen, _smooth_rise(highest, duration), {}, duration)


def push(specimen: Specimen, pressure: float, duration: float) -> Push:
    """Return the scene of a push of the inflated body.

    The pressure rises to `pressure` [Pa] within `duration` [s] and is held; then the frame moves
    transverse to the pipe, along y, and after that along the pipe, x.
    """
    moves, begin = [], duration + SETTLING_TIME
    for axis in ("y", "x"):
        end = begin + MOVE_TIME
        until = end + SETTLING_TIME
        moves.append(Move(axis, PUSH_DISTANCE, begin, end, until, REST_TIME))
        begin = until
    courses = {
        move.axis: [(0.0, 0.0), (move.begin, 0.0), (move.end, move.distance)] for move in moves
    }
    rise = _smooth_rise(pressure, duration)
    return Push(_quasi_static(specimen, rise, courses, begin), tuple(moves))


def _quasi_static(
    specimen: Specimen, pressure: Points, courses: Mapping[str, Points], end: float
) -> LoadedScene:
    """Return the scene with its air pressure as the only load, and the frame held or moved.

    pressure: points [s, Pa]. courses: axis -> points [s, m] of the displacement of the frame.
    """
    tree = _only_load(specimen.loaded.tree, specimen.pressure)
    for override in _overrides(specimen, pressure, courses, end):
        tree = overridden(tree, override)
    return replace(specimen.loaded, scene=Scene.model_validate(plain(tree)), tree=tree)


def _only_load(tree: Tree, name: str) -> Tree:
    """Return `tree` without any other load."""
    top = plain_mapping(tree)
    loads = top["loads"]
    kept = replace(loads, value={name: plain_mapping(loads)[name]})
    return replace(tree, value={**top, "loads": kept})


def plain_mapping(tree: Tree) -> dict[str, Tree]:
    """Return the entries of a tree that is a mapping."""
    assert isinstance(tree.value, dict)  # the scene is valid
    return tree.value


def _overrides(
    specimen: Specimen, pressure: Points, courses: Mapping[str, Points], end: float
) -> Iterator[str]:
    air = f"loads.{specimen.pressure}"
    yield f"{air}.profile={_table(pressure, 'Pa')}"
    yield f"{air}.on_skin=[]"
    yield f"{air}.factor=1.0"
    yield f"{air}.offset=0 Pa"
    yield f"{air}.reacts_on=null"
    yield "environment.gravity=0 m/s^2"
    yield f"time.end={end!r} s"
    yield "time.procedure=dynamic"
    yield f"output.history_interval={end / HISTORY_ROWS!r} s"
    yield f"output.frame_interval={end / FRAMES!r} s"
    yield "expect={}"
    if specimen.frame is None:
        return
    frame = f"rigid_bodies.{specimen.frame}"
    tied = specimen.loaded.scene.rigid_bodies[specimen.frame].tied
    yield f"{frame}.tied=[]"
    yield f"{frame}.free=[]"
    for number, nodes in enumerate(tied):
        for axis in specimen.axes:
            course = courses.get(axis, [(0.0, 0.0), (end, 0.0)])
            yield (
                f"conditions.calibration_{number}_{axis}={{kind: prescribed, nodes: {nodes}, "
                f"direction: {axis}, displacement: {_table(course, 'm')}}}"
            )


def _smooth_rise(highest: float, duration: float) -> Points:
    """Return points [s, Pa] of highest u^2 (3 - 2 u), u = time / duration."""
    u = np.linspace(0.0, 1.0, RISE_POINTS)
    values = highest * u**2 * (3.0 - 2.0 * u)
    return list(zip((duration * u).tolist(), values.tolist(), strict=True))


def _table(points: Points, unit: str) -> str:
    """Return a profile of kind table as YAML."""
    listed = ", ".join(f"[{t!r} s, {value!r} {unit}]" for t, value in points)
    return f"{{kind: table, points: [{listed}]}}"


# -------------------------------------------------------------------------------------------------
# Force on a pipe's wall over a rising pressure, from the history of a slow inflation.


@dataclass(frozen=True)
class WallCurve:
    """Wall force of a slowly inflated body in a pipe.

    pressure (k,) [Pa], rising; force (k,) [N]: sum of the normal forces on the wall; rows (k,):
    rows of spikes that touch; kinetic_share (k,): kinetic over internal energy [-].
    """

    pressure: np.ndarray
    force: np.ndarray
    rows: np.ndarray
    kinetic_share: np.ndarray

    @property
    def touch(self) -> float:
        """Pressure [Pa] above which contact is never lost.

        Raises CalibrationError if there is no contact at the highest pressure.
        """
        if self.force[-1] == 0.0:
            raise CalibrationError(
                f"no contact with the pipe up to {self.highest / 1e3:.4g} kPa",
                "inflate further (--highest), or choose a narrower pipe",
            )
        apart = np.flatnonzero(self.force == 0.0)
        return float(self.pressure[apart[-1] + 1 if len(apart) else 0])

    @property
    def highest(self) -> float:
        """Highest pressure of the curve [Pa]."""
        return float(self.pressure[-1])

    @property
    def largest_kinetic_share(self) -> float:
        """Largest ratio of kinetic to internal energy during contact [-]: small if quasi-static."""
        return float(self.kinetic_share[self.pressure >= self.touch].max())

    def force_at(self, pressure: np.ndarray) -> np.ndarray:
        """Return the force [N] at pressures [Pa]."""
        return np.interp(pressure, self.pressure, self.force)

    def rows_at(self, pressure: np.ndarray) -> np.ndarray:
        """Return the rows in contact in the sample nearest to pressures [Pa]."""
        between = 0.5 * (self.pressure[1:] + self.pressure[:-1])
        return self.rows[np.searchsorted(between, pressure)]

    def pressure_at(self, force: np.ndarray) -> np.ndarray:
        """Return the first pressures [Pa] at which the wall force reaches `force` [N]; else NaN."""
        touching = self.pressure >= self.touch
        pressure, felt = self.pressure[touching], self.force[touching]
        # The force may fall for a moment, as a row lets go: the first sample that reaches counts.
        reached = np.searchsorted(np.maximum.accumulate(felt), force)
        found = np.where(reached == 0, pressure[0], np.nan)
        crossed = (reached > 0) & (reached < len(felt))
        after = reached[crossed]
        share = (force[crossed] - felt[after - 1]) / (felt[after] - felt[after - 1])
        found[crossed] = pressure[after - 1] + share * (pressure[after] - pressure[after - 1])
        return found


def wall_curve(history: Mapping[str, np.ndarray]) -> WallCurve:
    """Return the curve of a run whose pressure only rises, from its history.

    The force in a history is the mean since the previous row, so its pressure is that halfway.
    Raises CalibrationError if the history has too few rows.
    """
    pressure = history["pressure"]
    if len(pressure) < 3:
        raise CalibrationError(
            "the history of the inflation has fewer than three rows",
            "inflate more slowly (--ramp)",
        )
    internal = np.maximum(history["internal_energy"][1:], np.finfo(float).tiny)
    halfway = 0.5 * (pressure[1:] + pressure[:-1])
    rising = np.concatenate([[True], np.diff(halfway) > 0.0])
    return WallCurve(
        halfway[rising],
        history["wall_force_normal"][1:][rising],
        history["rows_in_contact"][1:][rising],
        (history["kinetic_energy"][1:] / internal)[rising],
    )


# -------------------------------------------------------------------------------------------------
# Pressure on a plane section that corresponds to a pressure in space.

FORCE_SHARE = 0.5
"""Force on the section's walls over that around the body in space: n/2 spikes of n."""

POINTS = 201
"""Pressures of a fit, evenly spaced: a robot whose air leaves at a constant rate spends as much
time at each."""


@dataclass(frozen=True)
class PressureMapping:
    """Pressures that press each spike alike, and the line q = factor (p - offset) through them.

    pressure p (k,) and section_pressure q (k,) [Pa]: matched ones, from the touch of the body in
    space to the highest pressure that both reached. factor [-], offset [Pa].
    """

    pressure: np.ndarray
    section_pressure: np.ndarray
    factor: float
    offset: float

    def line(self, pressure: np.ndarray) -> np.ndarray:
        """Pressure on the section [Pa] at pressures [Pa], as a scene's factor and offset give."""
        return self.factor * np.maximum(pressure - self.offset, 0.0)

    @property
    def largest_deviation(self) -> float:
        """Largest distance of a matched pressure from the line [Pa], on the section."""
        return float(np.abs(self.line(self.pressure) - self.section_pressure).max())


def matched(
    reference: WallCurve, section: WallCurve, thickness_ratio: float = 1.0
) -> PressureMapping:
    """Pressures at which the section's walls feel FORCE_SHARE of what the reference's do.

    The line is the least-squares one with a factor and an offset not below zero, which is what a
    scene can say. thickness_ratio: thickness of the section that it is for over that of `section`;
    its force is proportional to it.

    Raises
    ------
    CalibrationError: no contact, or the section reaches no force that the reference has.
    """
    share = FORCE_SHARE / thickness_ratio
    strongest = float(section.force.max())
    reached = reference.pressure_at(np.array([strongest / share]))[0]
    end = reference.highest if np.isnan(reached) else float(reached)
    if not end > reference.touch:
        raise CalibrationError(
            f"the wall force of the section is at most {strongest:.3g} N: less than {share:.3g} "
            "of that of the reference at first contact",
            "raise the pressure of the section (--highest), or its thickness",
        )
    pressure = np.linspace(reference.touch, end, POINTS)
    due = np.minimum(share * reference.force_at(pressure), strongest)
    on_section = section.pressure_at(due)
    # q = factor p - c with c = factor offset: linear in both, neither below zero.
    (factor, c), _ = nnls(np.column_stack([pressure, -np.ones(POINTS)]), on_section)
    return PressureMapping(pressure, on_section, float(factor), float(c / factor))


# -------------------------------------------------------------------------------------------------
# Results of a calibration.


@dataclass(frozen=True)
class Stiffnesses:
    """Stiffnesses of reference and section along one axis."""

    axis: str
    reference: SpecimenStiffness
    section: SpecimenStiffness

    @property
    def ratio(self) -> float:
        """Stiffness of the reference over that of the section [-]."""
        return self.reference.value / self.section.value


@dataclass(frozen=True)
class Calibration:
    """Parameters with which a plane section represents a body in space.

    mapping: at the section's `thickness` [m]. pushed_at: pressures [Pa] on the reference and on the
    section at which the frame was pushed. stiffnesses: measured in the push, transverse to the pipe
    first; empty if the reference has no frame to push. thick_mapping: the mapping at
    `equivalent_thickness`. spikes: number around a row. remarks: warnings on incomplete results.
    """

    reference: WallCurve
    section: WallCurve
    mapping: PressureMapping
    thickness: float
    spikes: int
    pushed_at: tuple[float, float]
    stiffnesses: tuple[Stiffnesses, ...] = ()
    thick_mapping: PressureMapping | None = None
    remarks: tuple[str, ...] = ()

    @property
    def equivalent_thickness(self) -> float | None:
        """Thickness [m] at which the section has the transverse stiffness of the reference."""
        return self.thickness * self.stiffnesses[0].ratio if self.stiffnesses else None

    @property
    def spikes_per_strip(self) -> float:
        """Spikes that a strip of the section stands for: n/4, see `softsim.apps.calibration`."""
        return self.spikes / 4.0

    def samples(self, count: int = 9) -> dict[str, np.ndarray]:
        """Return a table over pressures from touch to the highest matched one, (count,) each.

        pressure and section_pressure (matched), line (the fitted section pressure) [Pa];
        reference_force and section_force [N] at these; reference_rows, section_rows.
        """
        m = self.mapping
        pressure = np.linspace(m.pressure[0], m.pressure[-1], count)
        on_section = np.interp(pressure, m.pressure, m.section_pressure)
        line = m.line(pressure)
        return {
            "pressure": pressure,
            "section_pressure": on_section,
            "line": line,
            "reference_force": self.reference.force_at(pressure),
            "section_force": self.section.force_at(line),
            "reference_rows": self.reference.rows_at(pressure),
            "section_rows": self.section.rows_at(line),
        }

    def as_json(self) -> dict[str, Any]:
        """Return all results as plain numbers and lists, SI units."""
        found: dict[str, Any] = {
            "factor": self.mapping.factor,
            "offset": self.mapping.offset,
            "largest_deviation": self.mapping.largest_deviation,
            "touch": self.reference.touch,
            "section_touch": self.section.touch,
            "highest_matched": float(self.mapping.pressure[-1]),
            "reference_kinetic_share": self.reference.largest_kinetic_share,
            "section_kinetic_share": self.section.largest_kinetic_share,
            "thickness": self.thickness,
            "spikes": self.spikes,
            "equivalent_thickness": self.equivalent_thickness,
            "pushed_at": list(self.pushed_at),
            "stiffness": {
                s.axis: {
                    "reference": vars(s.reference),
                    "section": vars(s.section),
                    "ratio": s.ratio,
                }
                for s in self.stiffnesses
            },
            "samples": {name: values.tolist() for name, values in self.samples().items()},
            "remarks": list(self.remarks),
        }
        if self.thick_mapping is not None:
            found["at_equivalent_thickness"] = {
                "factor": self.thick_mapping.factor,
                "offset": self.thick_mapping.offset,
                "largest_deviation": self.thick_mapping.largest_deviation,
            }
        for name, curve in (("reference", self.reference), ("section", self.section)):
            found[f"{name}_curve"] = {key: values.tolist() for key, values in vars(curve).items()}
        return found


# -------------------------------------------------------------------------------------------------
# Report of a calibration: curves, numbers, and the lines for the scene.


def calibration_diagram(found: Calibration) -> Diagram:
    """Return the diagram of wall force, section pressure and rows in contact over the pressure.

    The section is plotted at the pressures of the fitted line.
    """
    reference, section, m = found.reference, found.section, found.mapping
    seen = reference.pressure <= m.pressure[-1]
    inflated = m.line(reference.pressure[seen])
    covered = (inflated >= section.pressure[0]) & (inflated <= section.highest)
    p, over = reference.pressure * 1e-3, reference.pressure[seen][covered] * 1e-3
    force, rows = section.force_at(inflated[covered]), section.rows_at(inflated[covered])
    line = f"q = {m.factor:.3g} (p - {m.offset * 1e-3:.3g} kPa)"
    forces = [
        PlotSeries(
            f"reference, {FORCE_SHARE:g} of the force", p, FORCE_SHARE * reference.force, BLUE
        ),
        PlotSeries("section, at factor x (p - offset)", over, force, ORANGE, "--"),
    ]
    pressures = [
        PlotSeries("equal force per spike", m.pressure * 1e-3, m.section_pressure * 1e-3, INK),
        PlotSeries(line, m.pressure * 1e-3, m.line(m.pressure) * 1e-3, ORANGE, "--"),
    ]
    touching = [
        PlotSeries("reference", p, reference.rows, BLUE, STEPS),
        PlotSeries("section", over, rows, ORANGE, STEPS),
    ]
    panels = [
        Panel(PlotAxis(Scale("wall force [N]"), forces)),
        Panel(PlotAxis(Scale("pressure of the section q [kPa]"), pressures)),
        Panel(
            PlotAxis(Scale("rows in contact", whole=True, from_zero=True), touching), height=FLAT
        ),
    ]
    return Diagram("Calibration", Scale("pressure of the reference p [kPa]"), panels)


def calibration_rows(found: Calibration) -> list[tuple[str, str]]:
    """Return the numbers of a calibration as (name, text)."""
    m = found.mapping
    each = found.thickness / found.spikes_per_strip
    kinetic = [100 * c.largest_kinetic_share for c in (found.reference, found.section)]
    rows = [
        (
            "first contact",
            f"{_kpa(found.reference.touch)} (reference), {_kpa(found.section.touch)} (section)",
        ),
        (
            "matched up to",
            f"{_kpa(m.pressure[-1])} (reference), {_kpa(m.section_pressure[-1])} (section)",
        ),
        ("factor", f"{m.factor:.4g}"),
        ("offset", _kpa(m.offset)),
        ("largest error", f"{_kpa(m.largest_deviation)} of the section pressure"),
        (
            "kinetic energy",
            f"at most {kinetic[0]:.2g} % of the internal energy (reference), {kinetic[1]:.2g} % "
            "(section)",
        ),
        (
            "thickness",
            f"{found.thickness * 1e3:.4g} mm per strip, which represents n/4 = "
            f"{found.spikes_per_strip:g} spikes of {each * 1e3:.3g} mm",
        ),
    ]
    for s, direction in zip(found.stiffnesses, ("transverse", "along the pipe"), strict=False):
        rows.append(
            (
                f"stiffness, {direction}",
                f"{s.reference.value:.4g} N/m at {_kpa(found.pushed_at[0])} (reference), "
                f"{s.section.value:.4g} N/m at {_kpa(found.pushed_at[1])} (section), ratio "
                f"{s.ratio:.3g}",
            )
        )
    if found.equivalent_thickness is not None:
        rows.append(
            (
                "equivalent thickness",
                f"{found.equivalent_thickness * 1e3:.4g} mm, for equal transverse stiffness",
            )
        )
    return rows


def sample_table(found: Calibration) -> Table:
    """Return the table of the comparison at some pressures."""
    headings = ["p [kPa]", "q, matched [kPa]", "q, linear fit [kPa]", "force, reference [N]",
                "force, section [N]", "rows, reference", "rows, section"]  # fmt: skip
    columns = [
        [cell(value * scale, form) for value in values]
        for values, (scale, form) in zip(
            found.samples().values(),
            [*[(1e-3, ".2f")] * 3, *[(1.0, ".3f")] * 2, *[(1.0, ".0f")] * 2],
            strict=True,
        )
    ]
    return Table(list(zip(*columns, strict=True)), headings)


def scene_lines(found: Calibration, pressure: str, body: str) -> str:
    """Return the YAML lines for the section's scene, with its own or the equivalent thickness."""
    blocks = [_block(pressure, body, found.mapping, found.thickness, "section as in the scene")]
    if found.thick_mapping is not None and found.equivalent_thickness is not None:
        thick = (found.thick_mapping, found.equivalent_thickness)
        blocks.append(
            _block(pressure, body, *thick, "alternative: equal transverse stiffness as well")
        )
    return "\n\n".join(blocks)


def _block(pressure: str, body: str, m: PressureMapping, thickness: float, remark: str) -> str:
    return (
        f"# {remark}\n"
        f"bodies:\n  {body}:\n    thickness: {thickness * 1e3:.4g} mm\n"
        f"loads:\n  {pressure}:\n    factor: {m.factor:.4g}\n    offset: {_kpa(m.offset)}"
    )


def _kpa(pressure: float) -> str:
    return f"{pressure * 1e-3:.4g} kPa"
