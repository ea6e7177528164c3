"""Parts of a model in the roles that a scene names: frame, chamber, rows, track."""

from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from softsim.builder.names import Names, close_names
from softsim.loads.pressure import FollowerPressure
from softsim.model import Body, Robot

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
