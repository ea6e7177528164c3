"""The study of `softsim assess --repeats`: a robot in a layout with varied uncertain parameters.

Friction, the place where it starts and the angle at which its motor starts are drawn from ranges,
which a Latin hypercube fills evenly. The same seed draws the same values.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from softsim.errors import Option, SceneError
from softsim.scene.loading import LoadedScene
from softsim.scene.loads import EccentricMass
from softsim.scene.text import nearest
from softsim.scene.walls import PipePathWall
from softsim.study.loading import LoadedStudy, loaded_study, tree_of


@dataclass(frozen=True)
class Spread:
    """Number of runs of a robot through a layout, and the ranges of what varies.

    friction: half of the range of the friction coefficient, over the coefficient. start: half of
    the range of the place at which the robot starts, along the pipe [m]. seed: of the draws.
    """

    count: int
    friction: float = 0.1
    start: float = 2e-3
    seed: int = 1


MEASURES = {
    "time": {"of": "layout.time", "about": "time until the verdict"},
    "reached": {"of": "layout.where.arc_length", "about": "farthest place of the centre"},
    "standstill": {"of": "layout.longest_standstill.duration", "about": "longest standstill"},
    "patience_used": {
        "of": "layout.patience_used",
        "about": "fraction of the patience used, 1 if stuck",
    },
}


def repeated_assessment(
    layout: Path, robot: str, loaded: LoadedScene, spread: Spread, overrides: Sequence[str]
) -> LoadedStudy:
    """Return the study that runs a layout with a robot `spread.count` times.

    Parameters
    ----------
    layout, robot: the file of the layout, the name of the standard robot.
    loaded: the scene that they make together with the overrides.
    spread: count and ranges.
    overrides: "a.b.c=value" each, for all runs; a key that varies, varies about its value.

    Raises
    ------
    SceneError: the scene cannot be run with values from these ranges.
    """
    factors = _factors(loaded, spread)
    if not factors:
        raise SceneError(
            "nothing varies: the scene has no friction, no explicit start of its pipe and no motor",
            "set a range of friction or of the start greater than zero",
            Option(f"--repeats {spread.count}"),
        )
    varied = {factor["key"] for factor in factors.values()}
    content = {
        "title": f"{loaded.scene.title or layout.stem}: {robot}, {spread.count} runs",
        "scene": layout.name,
        "robot": robot,
        "factors": factors,
        "design": {"kind": "latin_hypercube", "count": spread.count, "seed": spread.seed},
        "measures": MEASURES,
        "plots": [{"kind": "scatter", "x": name, "y": "standstill"} for name in factors],
    }
    shared = [one for one in overrides if one.partition("=")[0].strip() not in varied]
    return loaded_study(tree_of(content), layout, shared)


def _factors(loaded: LoadedScene, spread: Spread) -> dict[str, dict[str, Any]]:
    """Return the factors: name -> its entry as in a study file."""
    scene, found = loaded.scene, {}
    friction = scene.contact.friction_coefficient
    if friction > 0.0 and spread.friction > 0.0:
        found["friction"] = {
            "key": "contact.friction_coefficient",
            "range": [friction * (1.0 - spread.friction), friction * (1.0 + spread.friction)],
            "about": "friction coefficient",
        }
    walls = scene.environment.walls
    paths = {name: wall for name, wall in walls.items() if isinstance(wall, PipePathWall)}
    asked = scene.layout.path if scene.layout else None
    path = asked if asked in paths else next(iter(paths), None)
    keys = ("environment", "walls", str(path), "start", 0)
    is_written = nearest(loaded.tree, keys)[1] == len(keys)  # a study sets what a scene has
    if path is not None and is_written and spread.start > 0.0:
        ends = [1e3 * (paths[path].start[0] + sign * spread.start) for sign in (-1.0, 1.0)]
        found["start"] = {
            "key": ".".join(map(str, keys)),
            "range": [f"{end:.10g} mm" for end in ends],
            "about": "where the pipe starts, seen from the robot",
        }
    for name, load in scene.loads.items():
        if isinstance(load, EccentricMass):
            found[f"phase_of_{name}"] = {
                "key": f"loads.{name}.phase",
                "range": ["0 deg", "360 deg"],
                "about": f"phase angle of {name} at the start",
            }
    return found
