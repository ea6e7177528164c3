"""Section `layout` of summary.json: verdict, position, time in each segment, and cause."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from softsim.contact.path_features import nearest_feature
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.pipe_segment import Segment
from softsim.model import Model, Passage
from softsim.output import blockage
from softsim.output.passage import History, Verdict, after_history


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
    indicators = blockage.blockage_indicators(passage, history)
    return {
        "blocked_by": blockage.blocked_by(indicators),
        "remark": blockage.contact_description(indicators),
        "evidence": asdict(indicators),
        "thresholds": {
            "touching_share": blockage.TOUCHING,
            "pinch_share": blockage.PINCHED,
            "frame_drag_share": blockage.MAIN_PART,
            "narrowing_drag_share": blockage.MAIN_PART,
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
