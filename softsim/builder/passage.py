"""The passage of a rigid body along a pipe that a scene's layout asks about."""

from collections.abc import Sequence

import numpy as np

from softsim.builder.names import Names, close_names
from softsim.contact.pipe_path import PipePath
from softsim.contact.wall import Wall
from softsim.loads.pressure import FollowerPressure
from softsim.model import Passage
from softsim.scene.bodies import BallOutline, CylinderOutline
from softsim.scene.layout import Layout
from softsim.scene.tree import nearest


def passage(
    names: Names,
    walls: Sequence[Wall],
    outline_nodes: Sequence[np.ndarray],
    chamber: FollowerPressure | None,
) -> Passage | None:
    """What the scene's layout asks; None without one. outline_nodes: of each rigid body (k,)."""
    layout = names.scene.layout
    if layout is None:
        refuse_verdict(names)
        return None
    path = path_of(names, layout, walls)
    body = body_of(names, layout)
    name = list(names.scene.rigid_bodies)[body]
    data = names.scene.rigid_bodies[name]
    if data.outline is None:
        raise names.loaded.error(
            ("rigid_bodies", name),
            f"'{name}' has no outline: nothing can say whether it fits through '{path.name}'",
            "give it an outline, such as {length: 33 mm, height: 15 mm}",
        )
    length = outline_length(data.outline)
    centre = names.vector(data.center, ("rigid_bodies", name, "center"))
    start = float(path.arc_length(centre[None])[0])
    return Passage(
        path=path,
        items=items(names, path),
        body=body,
        length=length,
        outline=outline_nodes[body],
        start=start,
        goal=goal(names, layout, path, start, length),
        in_cycles=chamber is not None and chamber.drive.cycle_count > 0,
        patience=layout.patience,
        patience_time=layout.patience_time,
        least_progress=layout.least_progress,
    )


def refuse_verdict(names: Names) -> None:
    """Without a layout there is no verdict to expect."""
    if names.scene.expect.passes is not None:
        raise names.loaded.error(
            ("expect", "passes"),
            "passes: the scene asks no question that a verdict could answer",
            "add layout: {}, beside a wall of kind pipe_path",
        )


def path_of(names: Names, layout: Layout, walls: Sequence[Wall]) -> PipePath:
    """The pipe that the layout means."""
    paths = {wall.name: wall for wall in walls if isinstance(wall, PipePath)}
    if not paths:
        raise names.loaded.error(
            ("environment", "walls"),
            "a layout needs a pipe to pass, and no wall is of kind pipe_path",
            "such as pipe: {kind: pipe_path, diameter: 36 mm, pipe: [{straight: 120 mm}, "
            "{bend: 90 deg, radius: 60 mm}, {straight: 80 mm}]}",
        )
    if layout.path is None and len(paths) > 1:
        raise names.loaded.error(
            ("layout",),
            f"there are {len(paths)} pipes: {', '.join(paths)}",
            "say which: path: NAME",
        )
    name = layout.path or next(iter(paths))
    if name not in paths:
        raise names.loaded.error(
            ("layout", "path"),
            f"there is no wall '{name}' of kind pipe_path",
            close_names(name, list(paths), "pipes"),
        )
    return paths[name]


def body_of(names: Names, layout: Layout) -> int:
    """Number of the rigid body that has to pass."""
    if layout.body is not None:
        return names.rigid_number(layout.body, ("layout", "body"))
    if not names.scene.rigid_bodies:
        raise names.loaded.error(
            ("layout",),
            "a layout asks for the way of a rigid body, and the scene has none",
            "add a robot: softsim assess LAYOUT --robot pfr does, include: [robot:pfr] too",
        )
    return 0


def items(names: Names, path: PipePath) -> tuple[str, ...]:
    """What the scene says of the pipe, an entry of its list each: "bend 90 deg, radius 60 mm"."""
    listed = nearest(names.loaded.tree, ("environment", "walls", path.name, "pipe"))[0].value
    assert isinstance(listed, list)
    return tuple(
        ", ".join(f"{key} {said.text}" for key, said in entry.value.items())
        for entry in listed
        if isinstance(entry.value, dict)
    )


def outline_length(outline: CylinderOutline | BallOutline) -> float:
    """Of an outline along the pipe that it starts in [m]."""
    if isinstance(outline, BallOutline):
        return 2.0 * outline.radius
    return outline.length


def goal(names: Names, layout: Layout, path: PipePath, start: float, length: float) -> float:
    """Arc length [m] at which a body `length` [m] long that starts at `start` [m] has passed."""
    if layout.goal is None:
        found = default_goal(path, start, length)
        keys: tuple[str, ...] = ("environment", "walls", path.name, "pipe")
    else:
        found, keys = layout.goal, ("layout", "goal")
    if not start < found <= path.length:
        raise names.loaded.error(
            keys,
            f"the body starts at {start * 1e3:g} mm along the path, which ends at "
            f"{path.length * 1e3:g} mm: it cannot have passed at {found * 1e3:g} mm",
            "the goal lies ahead of the body and within the pipe",
        )
    return found


def default_goal(path: PipePath, start: float, length: float) -> float:
    """Where a body `length` [m] long lies wholly in the last segment, if it fits into it and does
    not start there; else where its front is at the end of the path.
    """
    last = path.segments[-1]
    inside = last.start + 0.5 * length
    if last.length > length and start < inside and start < last.start:
        return inside
    return path.length - 0.5 * length
