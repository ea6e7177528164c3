"""Analyses that only some robots need: passage through pipes, crossing of an obstacle.

The verdict on a passage is passed, stuck, or unfinished. It is decided row by row. A robot moves
forward in jerks and is drawn back by a millimetre or two whenever the air leaves, so the farthest
position that it has reached counts. The place in a verdict ("in the elbow") is the scene's own text
of a segment.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from softsim.compute.term import Samples
from softsim.contact.pipe_network import PipeNetwork, stations
from softsim.contact.pipe_path import Segment, narrowings, nearest_feature
from softsim.model import Crossing, Model, Passage
from softsim.scene.quantities import COLUMNS
from softsim.solver.explicit import Scenario

if TYPE_CHECKING:
    from softsim.output.stop_conditions import StopCondition

History = dict[str, np.ndarray]

SEEN = ("time", "arc_length", "cycles_done", "branch")
"""Columns of a history that decide the verdict."""


class Verdict(str, Enum):
    """Verdict on a passage; unfinished: the time was up while the body still moved."""

    PASSED = "passed"
    STUCK = "stuck"
    UNFINISHED = "unfinished"


@dataclass(frozen=True)
class Standstill:
    """Period in which a body made less than the least progress of its passage.

    began, duration: time of its last sufficient progress, and time without progress since [s].
    arc_length, branch: its farthest position at that time [m], and the branch of that position.
    """

    began: float
    duration: float
    arc_length: float
    branch: int


class PassageCondition:
    """Stop condition that follows a body along its pipes and ends a run with the verdict.

    exit: the exit through which the body passed. branch: the branch of its farthest position.
    longest_standstill: up to now. idle_cycles: the most consecutive whole pressure cycles without
    the least progress.
    """

    name = "layout"

    def __init__(self, passage: Passage) -> None:
        self.passage = passage
        self.verdict = Verdict.UNFINISHED
        self.exit: str | None = None
        self.farthest, self.branch = passage.start, 0
        # Where and when it had last gained `least_progress`, and in which cycle, counted from 1.
        self.milestone, self.milestone_time, self.milestone_cycle = passage.start, 0.0, 0
        self.longest_standstill = Standstill(0.0, 0.0, passage.start, 0)
        self.idle_cycles = 0

    @property
    def is_over(self) -> bool:
        """True once there is a verdict."""
        return self.verdict is not Verdict.UNFINISHED

    @property
    def patience_used(self) -> float:
        """Largest fraction of the patience that the body has used up so far; it is stuck at 1."""
        if self.passage.in_cycles:
            return self.idle_cycles / self.passage.patience
        return self.longest_standstill.duration / self.passage.patience_time

    @property
    def way_share(self) -> float:
        """Covered fraction of the path from the start to the goal, from 0 to 1."""
        start, goal = self.passage.start, self.passage.goal_beyond(self.branch)
        return min(1.0, max(0.0, (self.farthest - start) / (goal - start)))

    def see_row(self, row: Mapping[str, float]) -> None:
        self.see(*(row[name] for name in SEEN))

    def see(self, time: float, arc_length: float, cycles_done: float, branch: float) -> None:
        """Update the verdict with a row of the history.

        time [s]; arc_length: of the body's centre [m]; cycles_done: number of finished pressure
        cycles; branch: number of the branch of the centre.
        """
        if self.is_over:
            return
        passage = self.passage
        self._note_standstill(time, cycles_done)
        if arc_length > self.farthest:
            self.farthest, self.branch = arc_length, int(branch)
        if self.farthest >= self.milestone + passage.least_progress:
            self.milestone, self.milestone_time = self.farthest, time
            self.milestone_cycle = int(cycles_done) + 1
        if arc_length >= passage.goals[int(branch)]:
            self.verdict, self.exit = Verdict.PASSED, passage.network.branches[int(branch)].exit
        elif self._has_stopped(time, cycles_done) or self._has_fallen(arc_length):
            self.verdict = Verdict.STUCK

    def _note_standstill(self, time: float, cycles_done: float) -> None:
        """Update the longest time and the most whole cycles without a milestone."""
        standing = time - self.milestone_time
        if standing > self.longest_standstill.duration:
            self.longest_standstill = Standstill(
                self.milestone_time, standing, self.milestone, self.branch
            )
        self.idle_cycles = max(self.idle_cycles, int(cycles_done) - self.milestone_cycle)

    def _has_fallen(self, arc_length: float) -> bool:
        return has_fallen(self.passage, self.farthest - arc_length)

    def _has_stopped(self, time: float, cycles_done: float) -> bool:
        """Return True if there was no progress for the whole patience; only whole cycles count."""
        if self.passage.in_cycles:
            return cycles_done - self.milestone_cycle >= self.passage.patience
        return time - self.milestone_time >= self.passage.patience_time


def has_fallen(passage: Passage, way_back: float) -> bool:
    """Return True if a body that moved back by `way_back` [m] from its farthest place has fallen.

    The limit is its own length, ten times the elastic recoil.
    """
    return way_back > passage.length


def after_history(passage: Passage, history: History) -> PassageCondition:
    """Return the condition after all rows of a history."""
    condition = PassageCondition(passage)
    for row in zip(*(history[name].tolist() for name in SEEN), strict=True):
        condition.see(*row)
    return condition


def last_rows(passage: Passage, history: History) -> np.ndarray:
    """Return a mask (rows,) of the rows of the last whole cycle.

    In a run without cycles it selects the last `patience_time`. Without a whole cycle it selects
    all rows.
    """
    time, done = history["time"], history["cycles_done"]
    if not passage.in_cycles:
        return np.asarray(time >= time[-1] - passage.patience_time)
    return np.asarray(done == max(done[-1] - 1.0, 0.0))


# -------------------------------------------------------------------------------------------------
# Position of a body along its pipe, its clearance, and the wall forces that push or brake it.

# A node this near [m] to a place where the pipe narrows touches what narrows it: the thickness of a
# spike.
REACH = 2e-3

PATH_COLUMNS = {
    name: COLUMNS[name].unit
    for name in (
        "arc_length", "branch", "clearance",
        # means of the interval
        "frame_wall_force", "frame_pinch", "frame_drag", "thrust", "drag", "narrowing_drag",
    )
}  # fmt: skip
"""Additional columns in the history of a layout, name -> unit."""


def path_readings(
    scenario: Scenario, passage: Passage, centre: np.ndarray, interval: float
) -> dict[str, float]:
    """Return the current values of the PATH_COLUMNS.

    centre: of the body (d,) [m]. interval: time since the impulses were cleared [s].
    """
    x = scenario.positions()
    branch, s = passage.network.locate(centre[None])
    row = {
        "arc_length": float(s[0]),
        "branch": float(branch[0]),
        "clearance": float(passage.network.gap(x[passage.outline]).min()),
    }
    nodes, forces = wall_forces(scenario, interval)
    of_frame = np.isin(nodes, passage.outline)
    return row | frame_forces(forces[of_frame]) | forces_along(
        passage.network, x[nodes], forces, of_frame
    )  # fmt: skip


def path_samples(network: PipeNetwork) -> dict[str, np.ndarray]:
    """Return samples of the pipes for figures: `path` and `path_branch`.

    path (n, 2 d + 2): arc length, point, tangent and radius at each sampled arc length.
    path_branch (n,): number of the branch of each row.
    """
    samples = [np.column_stack(stations(b.path.segments)) for b in network.branches]
    branches = np.repeat(np.arange(len(samples)), [len(one) for one in samples])
    return {"path": np.concatenate(samples), "path_branch": branches}


def wall_forces(scenario: Scenario, interval: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (k,) that pressed on walls since the impulses were cleared, and the mean
    forces (k, d) [N] of all walls on them, adhesion included.
    """
    model = scenario.model
    impulses = np.zeros((len(model.contact.nodes), model.dimension))
    touched = np.zeros(len(impulses), dtype=bool)
    for walls in scenario.terms.wall_contacts:
        impulses += scenario.read(walls.impulse)
        touched |= scenario.read(walls.normal_impulse) > 0.0
    touched &= interval > 0.0
    return model.contact.nodes[touched], impulses[touched] / (interval or 1.0)


def frame_forces(forces: np.ndarray) -> dict[str, float]:
    """Return the sum of the magnitudes of forces (k, d) [N], and their clamping force.

    The clamping force is half of the part that cancels out in the vector sum: N for two
    opposite forces N, 0 for parallel forces.
    """
    whole = float(np.linalg.norm(forces, axis=1).sum())
    rest = float(np.linalg.norm(forces.sum(axis=0)))
    return {"frame_wall_force": whole, "frame_pinch": 0.5 * (whole - rest)}


def forces_along(
    network: PipeNetwork, places: np.ndarray, forces: np.ndarray, of_frame: np.ndarray
) -> dict[str, float]:
    """Return the sums of the force components along the path and against it [N].

    forces (k, d) [N] act at places (k, d) [m]. of_frame (k,): True for forces on the outline.
    """
    branch, s = network.locate(places)
    along = (forces * network.tangents(branch, s)).sum(axis=1)
    drag = np.maximum(-along, 0.0)
    near = np.zeros(len(s), dtype=bool)
    for number, one in enumerate(network.branches):
        low, high = narrowings(one.path).T
        within = ((s[:, None] >= low - REACH) & (s[:, None] <= high + REACH)).any(axis=1)
        near |= within & (branch == number)
    return {
        "frame_drag": float(drag[of_frame].sum()),
        "thrust": float(np.maximum(along, 0.0).sum()),
        "drag": float(drag.sum()),
        "narrowing_drag": float(drag[near].sum()),
    }


# -------------------------------------------------------------------------------------------------
# Rules that find the cause of a blockage when a body is stuck in a pipe.
#
# The rules are evaluated in order, on the rows of the last whole pressure cycle. Their thresholds
# are choices, not measurements; summary.json holds the thresholds and the values compared.

# Share of the rows in which a wedged frame touches the wall: the most of the time. One that rattles
# while the motor shakes it touches in few.
TOUCHING = 0.5
# Share of the walls' forces on the frame that cancel out. It is 0.5 of a frame that is clamped from
# two sides, and near zero of one that lies on one side: half of the most counts.
PINCHED = 0.25
# Share that makes a part of the resistance the main part.
MAIN_PART = 0.5


@dataclass(frozen=True)
class BlockageIndicators:
    """Indicators of a blockage, from the rows of the last whole cycle.

    touching_share: fraction of the rows in which the frame touches the wall. pinch_share: fraction
    of the wall forces on the frame that cancel out. frame_drag_share, narrowing_drag_share:
    fractions of the wall forces against the motion that act on the frame, and where the pipe
    narrows. most_rows: largest number of rows of spikes in contact. way_forward, way_back: largest
    displacement in each direction [m]. fell_back: distance from the farthest position to the last
    one [m]. has_fallen: True if that counts as a fall.
    """

    touching_share: float
    pinch_share: float
    frame_drag_share: float
    narrowing_drag_share: float
    most_rows: float
    way_forward: float
    way_back: float
    fell_back: float
    has_fallen: bool


def blockage_indicators(passage: Passage, history: History) -> BlockageIndicators:
    """Return the indicators that the rules use, from the rows of the last whole cycle."""
    rows = last_rows(passage, history)
    sums = {
        name: float(history[name][rows].sum())
        for name in ("frame_wall_force", "frame_pinch", "drag", "frame_drag", "narrowing_drag")
    }
    s = history["arc_length"]
    way = s[rows]
    fell_back = float(s.max() - s[-1])
    return BlockageIndicators(
        touching_share=float((history["clearance"][rows] <= 0.0).mean()),
        pinch_share=share(sums["frame_pinch"], sums["frame_wall_force"]),
        frame_drag_share=share(sums["frame_drag"], sums["drag"]),
        narrowing_drag_share=share(sums["narrowing_drag"], sums["drag"]),
        most_rows=float(history["rows_in_contact"][rows].max()),
        way_forward=float((way - np.minimum.accumulate(way)).max()),
        way_back=float((np.maximum.accumulate(way) - way).max()),
        fell_back=fell_back,
        has_fallen=has_fallen(passage, fell_back),
    )


def share(part: float, whole: float) -> float:
    """Return part / whole; 0 if whole is 0."""
    return part / whole if whole > 0.0 else 0.0


def lost_grip(indicators: BlockageIndicators) -> bool:
    """Return True if the body ended farther back than its own length, so it fell."""
    return indicators.has_fallen


def is_wedged(indicators: BlockageIndicators) -> bool:
    """Return True if the rigid frame is wedged.

    It touches the wall most of the time, and is either clamped from two sides or carries most of
    the drag.
    """
    clamped = indicators.pinch_share >= PINCHED or indicators.frame_drag_share >= MAIN_PART
    return indicators.touching_share >= TOUCHING and clamped


def is_caught(indicators: BlockageIndicators) -> bool:
    """Return True if most of the drag acts on nodes where the pipe narrows."""
    return indicators.narrowing_drag_share >= MAIN_PART


RULES: dict[str, Callable[[BlockageIndicators], bool]] = {
    "lost grip and fell": lost_grip,
    "frame wedged": is_wedged,
    "spikes caught on a step": is_caught,
}
NO_THRUST = "no thrust"
"""Cause reported if no rule holds: nothing obstructs the body, but it does not move."""


def blocked_by(indicators: BlockageIndicators) -> str:
    """Return the name of the first rule that holds, else NO_THRUST."""
    return next((name for name, holds in RULES.items() if holds(indicators)), NO_THRUST)


def contact_description(indicators: BlockageIndicators) -> str:
    """Return a description of the contact of the spikes in the last cycle."""
    if indicators.most_rows == 0.0:
        return "no row of spikes touches the wall"
    rows = f"up to {indicators.most_rows:g} rows of spikes touch the wall"
    forward, back = indicators.way_forward * 1e3, indicators.way_back * 1e3
    return f"{rows}; in the last phase {forward:.1f} mm forward and {back:.1f} mm backward"


# -------------------------------------------------------------------------------------------------
# Verdict on a body that crosses an obstacle: passed if its rear end gets past the goal in time.
#
# The reason for a body that has not passed follows from the motion of its ends alone.

PASSED, STUCK = "passed", "stuck"
CROSSING_COLUMNS = {name: COLUMNS[name].unit for name in ("rear_x", "front_x")}
LATE = 0.25  # share of a run by whose end it is told whether the body still moves
SLIPPED = 0.1  # of its length: the way back after which it has slipped
STANDS = 0.02  # of its length: what stands gains less in the LATE part of the run or its patience


def end_readings(crossing: Crossing, x: np.ndarray) -> dict[str, float]:
    """Return the positions of the body's rear and front end [m], with all nodes at x (n, d) [m]."""
    places = x[crossing.nodes, 0]
    return {"rear_x": float(places.min()), "front_x": float(places.max())}


class CrossingCondition:
    """Stop condition: the body has crossed, or has made no progress for its patience."""

    name = "crossing"

    def __init__(self, crossing: Crossing) -> None:
        self.crossing = crossing
        self.is_over = False
        self.farthest = -np.inf  # rear end when it last came farther [m]
        self.since = 0.0  # [s]

    def see_row(self, row: Mapping[str, float]) -> None:
        t, rear = row["time"], row["rear_x"]
        if rear > self.farthest + STANDS * (row["front_x"] - rear):
            self.farthest, self.since = rear, t
        has_stood = t - self.since > self.crossing.patience
        self.is_over |= rear > self.crossing.goal or has_stood


def crossing_report(crossing: Crossing, history: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Return the verdict, `passed` as 1 or 0, its time [s], the farthest ends [m], a sentence."""
    t, rear, front = history["time"], history["rear_x"], history["front_x"]
    passed = bool(rear.max() > crossing.goal)
    when = float(t[np.argmax(rear > crossing.goal)]) if passed else None
    sentence = f"passed at {when:.4g} s" if passed else why_stuck(crossing, t, rear, front)
    return {
        "verdict": PASSED if passed else STUCK,
        "passed": float(passed),
        "time": when,
        "farthest_rear": float(rear.max()),
        "farthest_front": float(front.max()),
        "sentence": sentence,
    }


def why_stuck(crossing: Crossing, t: np.ndarray, rear: np.ndarray, front: np.ndarray) -> str:
    """Return why a body has not crossed: it slipped back, ran out of time, or stands still."""
    length = float(np.median(front - rear))
    back = rear.max() - rear[-1]
    place = f"its front is at x = {1e3 * front[-1]:.4g} mm"
    if back > SLIPPED * length:
        return f"stuck: slipped back by {1e3 * back:.3g} mm, {place}"
    late = t >= t[-1] - min(LATE * (t[-1] - t[0]), crossing.patience)
    gained = rear[late][-1] - rear[late][0]
    if gained > STANDS * length:
        return f"stuck: still moving at the end time, {place}"
    meets = front.max() > crossing.foot
    what = "at the obstacle" if meets else "before the obstacle, without thrust"
    return f"stuck: stands still {what}, {place}"


# -------------------------------------------------------------------------------------------------
# Section `layout` of summary.json: verdict, position, time in each segment, and cause.


def layout_report(
    passage: Passage, history: History, assumed: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the report on a layout: verdict, place, margin, segments, cause of a blockage.

    Parameters
    ----------
    passage: the path of the body, and the conditions of the verdicts passed and stuck.
    history: column -> (rows,), SI.
    assumed: assumptions of the verdict, from `assumptions`.

    Returns
    -------
    The section `layout` of summary.json, SI; lengths are arc lengths along the path.
    """
    course = after_history(passage, history)
    time, s = history["time"], history["arc_length"]
    longest = course.longest_standstill
    report: dict[str, Any] = {
        "verdict": course.verdict.value,
        "start": passage.start,
        "goal": passage.goal_beyond(course.branch),
        "exits": list(passage.network.exits),
        "time": float(time[-1]),
        "where": where(passage, course.branch, course.farthest),
        "final_arc_length": float(s[-1]),
        "segments": [
            segment_report(passage, number, segment, history)
            for number, branch in enumerate(passage.network.branches)
            for segment in branch.path.segments
        ],
        "at_end": {
            "rows_in_contact": float(history["rows_in_contact"][-1]),
            "clearance": finite(history["clearance"][-1]),
        },
    }
    if course.exit is not None:
        report["exit"] = course.exit
    if course.verdict is Verdict.STUCK:
        report |= blockage_report(passage, history)
    report["patience"] = {
        name: getattr(passage, name) for name in ("patience", "patience_time", "least_progress")
    }
    report["longest_standstill"] = {
        "began": longest.began,
        "duration": longest.duration,
        "where": where(passage, longest.branch, longest.arc_length),
    }
    report["idle_cycles"] = course.idle_cycles if passage.in_cycles else None
    report["patience_used"] = course.patience_used
    report["assumptions"] = list(assumed)
    return report | {"sentence": sentence(report), "margin": margin(report)}


def assumptions(model: Model) -> tuple[str, ...]:
    """Return the assumptions of a verdict as sentences: dimension, friction, the robot's own."""
    memory = (
        f"the limit follows the normal force with a memory of {1e3 * model.friction_memory:.3g} ms"
        if model.friction_memory > 0.0
        else "Coulomb's law without memory"
    )
    space = {
        2: "plane section (2D) of robot and pipe",
        3: "robot and pipe in 3D",
    }
    return (
        f"model: {space[model.points.shape[1]]}",
        f"friction: coefficient {model.contact.friction_coefficient:.3g} on all walls; {memory}",
        *model.robot.assumptions,
    )


def where(passage: Passage, branch: int, place: float) -> dict[str, Any]:
    """Return the segment and the nearest feature of a place [m] along a branch.

    The segment is given by its number in the user's lists, from 1; the feature with its distance
    ahead of the place [m].
    """
    path = passage.network.branches[branch].path
    segment = path.segment_at(place)
    nearest = nearest_feature(path, place)
    return {
        "branch": path.name,
        "segment": segment.item + 1,
        "what": passage.items[segment.item],
        "arc_length": place,
        "nearest_feature": nearest
        and {
            "name": f"{nearest.edge.value} {passage.items[nearest.item]}".strip(),
            "segment": nearest.item + 1,
            "distance": nearest.place - place,
        },
    }


def segment_report(
    passage: Passage, branch: int, segment: Segment, history: History
) -> dict[str, Any]:
    """Return the passage of the body's centre through a segment of a branch.

    It holds the times [s] of the first entry and exit, None if there was none; the mean speed in
    the segment [m/s]; rows in contact and least clearance [m] while in it. The segment also counts
    as left once the body is in a branch that starts from it or later.
    """
    time, s = history["time"], history["arc_length"]
    path = passage.network.branches[branch].path
    here = history["branch"] == branch
    gone_off = np.isin(history["branch"], later_branches(passage.network, branch, segment.start))
    is_first, is_last = branch == 0, segment is path.segments[-1]
    reached = here & (s >= segment.start) | gone_off
    entered = 0 if is_first and passage.start >= segment.start else first(reached)
    left = first(gone_off if is_last else here & (s >= segment.end) | gone_off)
    skipped = entered is None or (is_first and passage.start >= segment.end)
    stay = slice(entered, None if left is None else left + 1)
    inside = here & ((s >= segment.start) & (s < segment.end) | is_last & (s >= segment.end))
    found: dict[str, Any] = {
        "branch": path.name,
        "segment": segment.item + 1,
        "what": passage.items[segment.item],
        "start": segment.start,
        "end": segment.end,
        "entered": None if skipped else float(time[entered]),
        "left": None if skipped or left is None else float(time[left]),
        "mean_speed": None if skipped else mean_speed(time[stay], s[stay]),
        "rows_in_contact": None,
        "most_rows_in_contact": None,
        "least_clearance": None,
    }
    if inside.any():
        rows, clearance = history["rows_in_contact"][inside], history["clearance"][inside]
        found["rows_in_contact"] = float(np.median(rows))
        found["most_rows_in_contact"] = float(rows.max())
        found["least_clearance"] = finite(clearance.min())
    return found


def later_branches(network: PipeNetwork, branch: int, place: float) -> list[int]:
    """Return the branches whose path from the start leaves a branch at `place` [m] or later."""
    ways = (network.ways_to(number) for number in range(len(network.branches)))
    left = (way.get(branch, -np.inf) for way in ways)
    return [n for n, arc in enumerate(left) if n != branch and arc >= place]


def first(condition: np.ndarray) -> int | None:
    """Return the first row at which the condition (rows,) holds; None if it never does."""
    return int(np.argmax(condition)) if condition.any() else None


def mean_speed(time: np.ndarray, s: np.ndarray) -> float | None:
    """Return the mean speed [m/s] from the first place to the farthest; None for a single row."""
    span = float(time[-1] - time[0])
    return float(s.max() - s[0]) / span if span > 0.0 else None


def finite(value: float) -> float | None:
    """Return the number, or None if it is not finite: no wall is near beyond an open end."""
    return float(value) if np.isfinite(value) else None


def blockage_report(passage: Passage, history: History) -> dict[str, Any]:
    """Return the cause that blocked a stuck body, its indicators, and the rules' thresholds."""
    indicators = blockage_indicators(passage, history)
    return {
        "blocked_by": blocked_by(indicators),
        "remark": contact_description(indicators),
        "evidence": asdict(indicators),
        "thresholds": {
            "touching_share": TOUCHING,
            "pinch_share": PINCHED,
            "frame_drag_share": MAIN_PART,
            "narrowing_drag_share": MAIN_PART,
            "fell_back": passage.length,
        },
    }


def sentence(report: dict[str, Any]) -> str:
    """Return the verdict in a line. Lengths are displacements of the body's centre."""
    place, time = report["where"], report["time"]
    gained = (place["arc_length"] - report["start"]) * 1e3
    by_exit = f" through the exit '{report.get('exit')}'" if len(report["exits"]) > 1 else ""
    said = {
        Verdict.PASSED: lambda: (
            f"passed{by_exit}: the centre of the robot moved {gained:.0f} mm from start to goal "
            f"in {time:.1f} s"
        ),
        Verdict.STUCK: lambda: f"stuck in {segment_of(place)}: {report['blocked_by']}",
        Verdict.UNFINISHED: lambda: (
            f"unfinished: the centre of the robot moved {gained:.0f} of "
            f"{(report['goal'] - report['start']) * 1e3:.0f} mm from start to goal in "
            f"{time:.1f} s; it is in {segment_of(place)}"
        ),
    }
    return said[Verdict(report["verdict"])]()


def margin(report: dict[str, Any]) -> str:
    """Return in a line how close the body came to the verdict stuck, and where."""
    longest, patience = report["longest_standstill"], report["patience"]
    step = f"{1e3 * patience['least_progress']:.3g} mm"
    used = f"{longest['duration']:.1f} of {patience['patience_time']:.3g} s"
    if report["idle_cycles"] is not None:
        used = f"{report['idle_cycles']} of {patience['patience']} complete pressure cycles"
    return (
        f"longest standstill: {longest['duration']:.1f} s with less than {step} of progress, from "
        f"t = {longest['began']:.1f} s, in {segment_of(longest['where'])}; closest to the "
        f"verdict stuck: {used} without progress"
    )


def segment_of(place: dict[str, Any]) -> str:
    """Return the segment of a place, as returned by `where`, in words."""
    at = f"{place['arc_length'] * 1e3:.0f} mm"
    return f"segment {place['segment']} ({place['what']}) at {at}"


# -------------------------------------------------------------------------------------------------
# Interface of the analyses: columns of the history, the end of the run, a section of the summary.


class Analysis(Protocol):
    """Interface of an evaluation that a scene asks for.

    name: section of summary.json, and name of the condition that may end the run. columns: of the
    history, name -> unit.
    """

    name: str
    columns: dict[str, str]

    def readings(self, scenario: Scenario, samples: Samples) -> dict[str, np.ndarray]:
        """Return the columns of the present row from the state of a scenario and its samples."""

    def condition(self) -> "StopCondition":
        """Return a new condition that ends the run with the verdict."""

    def report(self, history: History) -> dict[str, Any]:
        """Return the section of the summary."""

    def drawn(self) -> dict[str, np.ndarray]:
        """Return arrays that figures need besides the fields, by name."""


class PassageAnalysis:
    """Analysis of a body that passes a layout of pipes."""

    def __init__(self, model: Model, passage: Passage) -> None:
        self.model, self.passage = model, passage
        self.name, self.columns = PassageCondition.name, PATH_COLUMNS

    def readings(self, scenario: Scenario, samples: Samples) -> dict[str, np.ndarray]:
        place = scenario.pose(self.passage.body).centre
        now = path_readings(scenario, self.passage, place, float(samples.intervals[-1]))
        return {name: np.array([value]) for name, value in now.items()}

    def condition(self) -> PassageCondition:
        return PassageCondition(self.passage)

    def report(self, history: History) -> dict[str, Any]:
        return layout_report(self.passage, history, assumptions(self.model))

    def drawn(self) -> dict[str, np.ndarray]:
        return path_samples(self.passage.network)


class CrossingAnalysis:
    """Analysis of a body that crosses an obstacle."""

    def __init__(self, crossing: Crossing) -> None:
        self.crossing = crossing
        self.name, self.columns = CrossingCondition.name, CROSSING_COLUMNS

    def readings(self, scenario: Scenario, samples: Samples) -> dict[str, np.ndarray]:
        positions = samples.read(scenario.terms.nodes.position)
        ends = [end_readings(self.crossing, x) for x in positions]
        return {name: np.array([end[name] for end in ends]) for name in self.columns}

    def condition(self) -> CrossingCondition:
        return CrossingCondition(self.crossing)

    def report(self, history: History) -> dict[str, Any]:
        return crossing_report(self.crossing, history)

    def drawn(self) -> dict[str, np.ndarray]:
        return {}


def analyses(model: Model) -> list[Analysis]:
    """Return the analyses that the scene of a model asks for."""
    found: list[Analysis] = []
    if model.passage is not None:
        found.append(PassageAnalysis(model, model.passage))
    if model.crossing is not None:
        found.append(CrossingAnalysis(model.crossing))
    return found
