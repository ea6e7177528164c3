"""Crossing of the ground by a body, with its goal."""

import math

import numpy as np

from softsim.builder.names import Names, close_names
from softsim.model import Body, Crossing
from softsim.scene.terrain import Terrain


def crossing(names: Names, bodies: tuple[Body, ...]) -> Crossing | None:
    """Return the crossing that the scene defines; None without one."""
    asked = names.scene.crossing
    if asked is None:
        return None
    known = {body.name: body for body in bodies}
    name = asked.body or next(iter(known))
    if name not in known:
        raise names.loaded.error(
            ("crossing", "body"),
            f"there is no body '{name}'",
            close_names(name, list(known), "bodies"),
        )
    walls = [w for w in names.scene.environment.walls.values() if isinstance(w, Terrain)]
    if asked.goal is None and not walls:
        raise names.loaded.error(
            ("crossing",),
            "the goal is unknown: no wall is a ramp, a semicircle or a step_field",
            "give goal: the x coordinate that the rear end must pass",
        )
    goal = walls[-1].foot[0] + walls[-1].crossed if asked.goal is None else asked.goal
    foot = walls[0].foot[0] if walls else goal
    body = known[name]
    nodes = np.arange(body.nodes.start, body.nodes.stop)
    if body.points[:, 0].min() > goal:
        raise names.loaded.error(
            ("crossing",),
            f"'{name}' starts beyond the goal at x = {1e3 * goal:.4g} mm",
            "give it another position, or another goal",
        )
    patience = math.inf if asked.patience is None else asked.patience
    return Crossing(nodes, goal, foot, patience)
