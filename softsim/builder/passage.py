"""Robot of a scene: its parts, its passage along pipes, its crossing of a ground, its end time."""

import math
from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from softsim.builder.walls import pipes
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.pipe_path import PipePath
from softsim.contact.wall import Wall
from softsim.errors import SceneError
from softsim.loads.pressure import FollowerPressure
from softsim.model import Body, Crossing, Passage, Robot, SteadyProbe
from softsim.scene.bodies import BallOutline, CylinderOutline
from softsim.scene.names import Names, close_names
from softsim.scene.outputs import probe_columns
from softsim.scene.schema import Layout
from softsim.scene.text import nearest
from softsim.scene.walls import PipePathWall, Terrain

# -------------------------------------------------------------------------------------------------
# Parts of a model in the roles that a scene names: frame, chamber, rows, track.

PLACE = ("robot",)


SIDES = (("bottom", "top"), ("left", "right"))
"""Names of the sides of a robot by the sign of y and z: it travels along +x, and +y is up."""


def robot(
    names: Names, bodies: Sequence[Body], chamber: FollowerPressure | None, points: np.ndarray
) -> Robot:
    """Return the parts that the scene names, or the first of each kind.

    chamber: the result of `chamber`. points (n, d) [m]: all nodes at rest.
    """
    named = None if chamber is None else chamber.name
    found = rows(names, bodies)
    assumptions = names.scene.robot.assumptions
    return Robot(frame(names), named, found, sides(found, points), track(names), assumptions)


def frame(names: Names) -> int | None:
    """Return the number of the rigid body that is the frame; None without one."""
    given = names.scene.robot.frame
    if given is not None:
        return names.rigid_number(given, (*PLACE, "frame"))
    return 0 if names.scene.rigid_bodies else None


def chamber(names: Names, chambers: Sequence[FollowerPressure]) -> FollowerPressure | None:
    """Return the pressure that is the robot's chamber; None without one."""
    given = names.scene.robot.chamber
    if given is None:
        return chambers[0] if chambers else None
    by_name = {one.name: one for one in chambers}
    if given not in by_name:
        raise names.loaded.error(
            (*PLACE, "chamber"),
            f"load '{given}' is not a pressure",
            close_names(given, list(by_name), "chambers"),
        )
    return by_name[given]


def rows(names: Names, bodies: Sequence[Body]) -> dict[str, np.ndarray]:
    """Return node sets (k,) by name, those of each pattern in the order of the mesh."""
    sets = {f"{b.name}.{name}": nodes for b in bodies for name, nodes in b.node_sets.items()}
    found: dict[str, np.ndarray] = {}
    for k, pattern in enumerate(names.scene.robot.rows):
        named = {name: nodes for name, nodes in sets.items() if fnmatchcase(name, pattern)}
        if not named:
            raise names.loaded.error(
                (*PLACE, "rows", k),
                f"no node set is called '{pattern}'",
                close_names(pattern, list(sets), "node sets"),
            )
        found |= named
    return found


def track(names: Names) -> str | None:
    """Return the name of the probe whose path over the ground is recorded; None without one."""
    given, keys = names.scene.robot.track, (*PLACE, "track")
    if given is None:
        return None
    probes = names.scene.output.probes
    followed = [name for name, probe in probes.items() if probe.kind == "displacement"]
    if given not in followed:
        raise names.loaded.error(
            keys,
            f"there is no probe '{given}' of kind displacement",
            close_names(given, followed, "probes of this kind"),
        )
    if names.dimension != 3 or not names.scene.rigid_bodies:
        raise names.loaded.error(
            keys,
            "a track needs a 3D model of a robot with a frame, the rigid body that defines its "
            "heading",
            "leave track out; the columns of the probe contain its position",
        )
    return given


def sides(rows: dict[str, np.ndarray], points: np.ndarray) -> dict[str, np.ndarray]:
    """Return the nodes of all rows, by the side of the robot on which they lie at rest.

    The side is the transverse direction in which a node is farthest from the mean of all.
    """
    if not rows:
        return {}
    nodes = np.unique(np.concatenate(list(rows.values())))
    across = (points[nodes] - points[nodes].mean(axis=0))[:, 1:]
    farthest = np.abs(across).argmax(axis=1)
    ahead = np.take_along_axis(across, farthest[:, None], axis=1)[:, 0] >= 0.0
    return {
        name: nodes[(farthest == k) & (ahead == bool(sign))]
        for k, pair in enumerate(SIDES[: across.shape[1]])
        for sign, name in enumerate(pair)
    }


# -------------------------------------------------------------------------------------------------
# Passage along pipes.


def passage(
    names: Names,
    walls: Sequence[Wall],
    outline_nodes: Sequence[np.ndarray],
    chamber: FollowerPressure | None,
) -> Passage | None:
    """Return the passage that the scene's layout defines; None without a layout.

    outline_nodes: nodes of the outline of each rigid body (k,).
    """
    layout = names.scene.layout
    if layout is None:
        refuse_verdict(names)
        return None
    network = network_of(names, layout, walls)
    refuse_unknown_exit(names, network)
    body = body_of(names, layout)
    name = list(names.scene.rigid_bodies)[body]
    data = names.scene.rigid_bodies[name]
    if data.outline is None:
        raise names.loaded.error(
            ("rigid_bodies", name),
            f"'{name}' has no outline, so the clearance in '{network.name}' cannot be computed",
            "give it an outline, such as {length: 33 mm, height: 15 mm}",
        )
    length = outline_length(data.outline)
    centre = names.vector(data.center, ("rigid_bodies", name, "center"))
    (branch,), (start,) = (found.tolist() for found in network.locate(centre[None]))
    if branch != 0:
        raise names.loaded.error(
            ("rigid_bodies", name, "center"),
            f"'{name}' starts in the branch '{network.branches[branch].path.name}'",
            "start the pipe at the robot, and lead to the branch by a tee or cross",
        )
    return Passage(
        network=network,
        items=items(names, network),
        body=body,
        length=length,
        outline=outline_nodes[body],
        start=start,
        goals=goals(names, layout, network, start, length),
        in_cycles=chamber is not None and chamber.source.cycle_count > 0,
        patience=layout.patience,
        patience_time=layout.patience_time,
        least_progress=layout.least_progress,
    )


def refuse_verdict(names: Names) -> None:
    """Raise SceneError if the scene expects a verdict or an exit but has no layout."""
    expect = names.scene.expect
    for key, wanted in (("passes", expect.passes), ("exit", expect.exit)):
        if wanted is not None:
            raise names.loaded.error(
                ("expect", key),
                f"{key} needs a layout, which this scene does not have",
                "add layout: {} and a wall of kind pipe_path",
            )


def refuse_unknown_exit(names: Names, network: PipeNetwork) -> None:
    """Raise SceneError if the expected exit does not exist."""
    wanted = names.scene.expect.exit
    if wanted is not None and wanted not in network.exits:
        raise names.loaded.error(
            ("expect", "exit"),
            f"no branch leads to the exit '{wanted}' of '{network.name}'",
            close_names(wanted, list(network.exits), "exits"),
        )


def network_of(names: Names, layout: Layout, walls: Sequence[Wall]) -> PipeNetwork:
    """Return the pipes that the layout refers to."""
    paths = {wall.name: wall for wall in walls if isinstance(wall, PipeNetwork)}
    if not paths:
        raise names.loaded.error(
            ("environment", "walls"),
            "a layout needs a wall of kind pipe_path, and there is none",
            "for example pipe: {kind: pipe_path, diameter: 36 mm, pipe: [{straight: 120 mm}, "
            "{bend: 90 deg, radius: 60 mm}, {straight: 80 mm}]}",
        )
    if layout.path is None and len(paths) > 1:
        raise names.loaded.error(
            ("layout",),
            f"there are {len(paths)} pipes: {', '.join(paths)}",
            "name one of them: path: NAME",
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
    """Return the number of the rigid body that has to pass."""
    if layout.body is not None:
        return names.rigid_number(layout.body, ("layout", "body"))
    if not names.scene.rigid_bodies:
        raise names.loaded.error(
            ("layout",),
            "a layout needs a rigid body whose path is followed, and the scene has none",
            "add a robot: use softsim assess LAYOUT --robot pfr, or include: [robot:pfr]",
        )
    return 0


def items(names: Names, network: PipeNetwork) -> tuple[str, ...]:
    """Return the scene's text of each entry in its lists of pipes: "bend 90 deg, radius 60 mm"."""
    wall = names.scene.environment.walls[network.name]
    assert isinstance(wall, PipePathWall)
    keys = ("environment", "walls", network.name)
    lists = (nearest(names.loaded.tree, (*keys, *place))[0].value for place in pipes(wall))
    return tuple(
        ", ".join(f"{key} {said.text}" for key, said in entry.value.items())
        for listed in lists
        if isinstance(listed, list)
        for entry in listed
        if isinstance(entry.value, dict)
    )


def outline_length(outline: CylinderOutline | BallOutline) -> float:
    """Return the length [m] of an outline along the pipe in which it starts."""
    if isinstance(outline, BallOutline):
        return 2.0 * outline.radius
    return outline.length


def goals(
    names: Names, layout: Layout, network: PipeNetwork, start: float, length: float
) -> tuple[float, ...]:
    """Return, for each branch, the arc length [m] at which a body has passed.

    The body is `length` [m] long and starts at `start` [m]. The value is infinite for a branch
    without an exit.
    """
    if not network.exits:
        raise names.loaded.error(
            ("environment", "walls", network.name, "closed"),
            "the robot cannot leave the pipes: no exit is open",
            "leave one end open",
        )
    return tuple(
        goal(names, layout, network.name, branch.path, start, length)
        if branch.exit is not None
        else np.inf
        for branch in network.branches
    )


def goal(
    names: Names, layout: Layout, wall: str, path: PipePath, start: float, length: float
) -> float:
    """Return the arc length [m] at which a body has passed one path of a wall; see `goals`."""
    if layout.goal is None:
        found = default_goal(path, start, length)
        keys: tuple[str, ...] = ("environment", "walls", wall, "pipe")
    else:
        found, keys = layout.goal, ("layout", "goal")
    # A branch begins in the middle of what it leaves.
    if not max(start, path.segments[0].start) < found <= path.length:
        raise names.loaded.error(
            keys,
            f"the body starts at {start * 1e3:g} mm along the path, which ends at "
            f"{path.length * 1e3:g} mm: the goal at {found * 1e3:g} mm is not between them",
            "set the goal ahead of the body and within the pipe",
        )
    return found


def default_goal(path: PipePath, start: float, length: float) -> float:
    """Return the arc length [m] at which a body `length` [m] long lies wholly in the last segment.

    If it does not fit into the segment or starts there, its front is at the end of the path.
    """
    last = path.segments[-1]
    inside = last.start + 0.5 * length
    if last.length > length and start < inside and start < last.start:
        return inside
    return path.length - 0.5 * length


# -------------------------------------------------------------------------------------------------
# Crossing of the ground by a body, with its goal.


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
    walls = list(names.walls(Terrain).values())  # type: ignore[type-abstract]
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


# -------------------------------------------------------------------------------------------------
# End of a run: at its time, after a pressure cycle, or when a probe of a static run is steady.


def end_time(names: Names, chamber: FollowerPressure | None) -> float:
    """Return the latest end of the run [s].

    It is the time of the scene, or the end of the last pressure cycle that the run waits for, if
    the profile defines it.
    """
    time = names.scene.time
    latest = names.beginning.time + time.end
    if time.cycles is None:
        return latest
    if chamber is None:
        raise _refused(names, "no pressure has cycles to count")
    refuse_missing_cycles(names, chamber, time.cycles)
    return min(latest, chamber.source.cycle_end(time.cycles))


def refuse_missing_cycles(names: Names, chamber: FollowerPressure, asked: int) -> None:
    """Raise SceneError if the run waits for more cycles than the chamber of the robot has.

    The history counts the cycles of no other chamber.
    """
    most, name = chamber.source.cycle_count, chamber.name
    if asked <= most:
        return
    if most == 0:
        raise _refused(names, f"the pressure of '{name}', the chamber of the robot, has no cycles")
    raise names.loaded.error(
        ("time", "cycles"),
        f"the run is to end after {asked} pressure cycles, but '{name}' has only {most:g}",
        f"write at most {most:g}, or raise loads.{name}.profile.count",
    )


def steady_probe(names: Names) -> SteadyProbe | None:
    """Return the probe that ends a static run once it is steady, or None."""
    time, probes = names.scene.time, names.scene.output.probes
    if time.until is None:
        return None
    name = time.until.probe
    if name not in probes:
        raise names.loaded.error(
            ("time", "until", "probe"),
            f"there is no probe '{name}'",
            close_names(name, list(probes), "probes") if probes else "add output.probes",
        )
    columns = probe_columns(name, probes[name].kind, "xyz"[: names.dimension])
    since = names.beginning.time + time.end
    return SteadyProbe(name, tuple(columns), time.until.within, since)


def refuse_steady_probe(names: Names) -> None:
    """Raise SceneError if a dynamic run should end when a probe is steady."""
    if names.scene.time.until is not None:
        raise names.loaded.error(
            ("time", "until"),
            "only a static run can end when a probe is steady",
            "write procedure: static, or leave `until` out",
        )


def _refused(names: Names, problem: str) -> SceneError:
    return names.loaded.error(
        ("time", "cycles"),
        f"the run is to end after pressure cycles: {problem}",
        "leave cycles out, so that the run ends at `end`, or use a profile of kind cycles",
    )
