"""Output file reach.json: pulling forces with their trials, distances, and curves along paths."""

from pathlib import Path
from typing import Any

from softsim.output.folder import RunFolder
from softsim.reach.answer import Distance, Load, distance, pulls_along, straight_distance
from softsim.reach.plan import Plan
from softsim.reach.pull import Bracket
from softsim.reach.running import Search
from softsim.reach.tension import Way
from softsim.reach.trials import TrialPipe
from softsim.report.reach import ANSWER

ASSUMED = (
    "a drag that stops the robot also stops it when larger",
    "between level and vertical pipes the pulling force varies linearly; the additional effort "
    "in bends is neglected",
    "nothing holds the tether back at the entrance of the layout",
    "the tether has no bending stiffness and does not stretch; in level pipes it does not pull a "
    "robot back",
)


def write_answer(plan: Plan, robot: str, asked: list[Search], folder: Path) -> list[Distance]:
    """Write reach.json, and return the distance of the robot on the path to each exit.

    Raises OutputError if the file cannot be written.
    """
    brackets = {search.pipe: search.bracket for search in asked}
    distances = [
        distance(way, loads, brackets) for way, loads in zip(plan.ways, plan.loads, strict=True)
    ]
    content = {
        "layout": plan.loaded.path,
        "robot": robot,
        "tether": {"weight": plan.weight, "friction_coefficient": plan.friction},
        "pulls": [pull_content(plan, search) for search in asked],
        "exits": [
            way_content(way, loads, brackets, found)
            for way, loads, found in zip(plan.ways, plan.loads, distances, strict=True)
        ],
        "assumptions": ASSUMED,
    }
    RunFolder(folder).write_json_atomic(ANSWER, content)
    return distances


def pull_content(plan: Plan, search: Search) -> dict[str, Any]:
    """Return the content of reach.json for the trials in a pipe."""
    found = search.bracket
    return {
        "pipe": search.pipe.name,
        "diameter": search.pipe.diameter,
        "heading": search.pipe.heading.value,
        "low": found.low,
        "high": found.high,
        "straight_distance": straight_distance(search.pipe, found, plan.weight, plan.friction),
        "trials": [
            {
                "drag": trial.drag,
                "got_on": trial.got_on,
                "progress": trial.progress,
                "speed": trial.speed,
                "wall_time": trial.wall_time,
                "key": trial.key,
            }
            for trial in search.trials
        ],
    }


def way_content(
    way: Way, loads: tuple[Load, Load], brackets: dict[TrialPipe, Bracket], found: Distance
) -> dict[str, Any]:
    """Return the content of reach.json for the path to an exit.

    There are two curves each of tension and pulling force, the lower one first.
    """
    ends = ({p: b.low for p, b in brackets.items()}, {p: b.high for p, b in brackets.items()})
    return {
        "exit": way.exit,
        "length": way.length,
        "least": found.least,
        "most": found.most,
        "sentence": found.sentence,
        "arc_length": loads[0].tension.arc_length,
        "tension": [load.tension.drawing for load in loads],
        "pull": [
            pulls_along(way, load, pulls)
            for load, pulls in zip(reversed(loads), ends, strict=True)
        ],
    }  # fmt: skip
