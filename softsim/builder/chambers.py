"""Checks of chambers: facets that close one, and what a pressure controlled by events needs."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from softsim.elements.axisymmetric import Axisymmetric
from softsim.elements.geometry import Geometry
from softsim.elements.ring_section import RingSection
from softsim.loads.pressure_control import EventCycles
from softsim.mesh.mesh import open_rim, with_corners
from softsim.model import Model
from softsim.scene.names import MeshedBody, Names, in_mm
from softsim.scene.text import Keys

# -------------------------------------------------------------------------------------------------
# Closed chambers: a check that facets close one, and lids that complete their surface.


def joined_facets(names: Names, references: tuple[str, ...], keys: Keys) -> np.ndarray:
    """Return the facets (k, corners) of the named sets.

    Raises SceneError if one of them is in more than one set.
    """
    facets = np.concatenate(
        [names.facet_set(f, (*keys, "facets", k)) for k, f in enumerate(references)]
    )
    _, counts = np.unique(facets, axis=0, return_counts=True)
    if counts.max() > 1:
        raise names.loaded.error(
            (*keys, "facets"),
            f"{int((counts > 1).sum())} facet(s) are in more than one of these sets: the "
            "load would act on them twice",
            "name each part of the surface once",
        )
    owners = {f.partition(".")[0] for f in references}
    for owner in owners:
        refuse_single_parts(names, facets, names.bodies[owner], (*keys, "facets"))
    return facets


def refuse_single_parts(names: Names, facets: np.ndarray, body: MeshedBody, keys: Keys) -> None:
    """Raise SceneError if facets of a ring section have nodes that belong to no ring.

    In a ring section pressure and traction act on rings: only they enclose a volume.
    """
    if not isinstance(body.geometry, RingSection):
        return
    round_nodes = body.first_node + body.mesh.cells[body.geometry.is_ring]
    single = np.setdiff1d(facets[body.has_nodes(facets)], round_nodes)
    if len(single):
        place = in_mm(body.mesh.points[single[0] - body.first_node])
        raise names.loaded.error(
            keys,
            f"the facets include a node at {place} that belongs to no ring, so they do not "
            "enclose a volume",
            "name facets of the rings only, such as those of the chamber",
        )


def refuse_open_chamber(
    names: Names,
    facets: np.ndarray,
    points: np.ndarray,
    held: np.ndarray,
    remedy: str,
    keys: Keys,
) -> None:
    """Raise SceneError unless the surface of the facets is closed.

    It is closed by itself, by a rim that does not move (all components of `held` (n, d)), or by
    planes of symmetry through the origin that its rim slides on. In a half section the axis closes
    it too, or a plane normal to the axis that its rim slides on; likewise in a ring section.

    remedy: how to hold a rim, for the error message.
    """
    rim = np.unique(open_rim(facets))
    closed = held[rim].all(axis=1)
    mirrored = on_mirror(points, held, rim)
    if isinstance(names.geometry, Axisymmetric):
        # On the axis, or in a plane across it: a flat lid encloses the same wherever its rim is.
        closed |= (points[rim, 0] < 1e-12) | held[rim, 1]
    if isinstance(names.geometry, RingSection):
        closed |= held[rim, 0]
    loose = rim[~(closed | mirrored)]
    if len(loose):
        raise names.loaded.error(
            (*keys, "facets"),
            f"the chamber is open: its facets end at {in_mm(points[loose[0]])}, on a node that "
            "can move independently",
            f"{remedy}, or choose facets that extend from one held end to the other",
        )
    if mirrored.any() and not mirrored.all() and not reaches_axis(names):
        fixed = rim[~mirrored]
        raise names.loaded.error(
            (*keys, "facets"),
            "the rim of the chamber lies only partly on a plane of symmetry, for example not at "
            f"{in_mm(points[fixed[0]])}: its volume cannot be computed",
            "close the chamber with facets of the body, or model the whole body",
        )


def reaches_axis(names: Names) -> bool:
    """Return True if a facet encloses the space between itself and an axis."""
    return isinstance(names.geometry, Axisymmetric | RingSection)


def on_mirror(points: np.ndarray, held: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return True (k,) for nodes that slide on a plane of symmetry x_i = 0.

    Their component i is held, but not all components are.
    """
    at_zero = np.abs(points[nodes]) < 1e-9 * np.ptp(points, axis=0).max()
    return (held[nodes] & at_zero).any(axis=1) & ~held[nodes].all(axis=1)


def lids(names: Names, facets: np.ndarray, points: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Return facets (k, corners) over the held rims of a surface, so that it encloses a volume.

    There are none where they would add nothing to the volume as seen from the origin: in half and
    ring sections they run straight to the axis, and planes of symmetry go through the origin. The
    open chains of a section are joined, the end of each to a start, so that the sum of distances is
    smallest: two strips of a robot enclose the space between them.
    """
    rim = open_rim(facets)
    nodes = np.unique(rim)
    nothing = np.zeros((0, facets.shape[1]), dtype=int)
    if reaches_axis(names) or on_mirror(points, held, nodes).any():
        return nothing
    if len(nodes) == 0:
        return nothing
    if facets.shape[1] == 2:
        starts = np.setdiff1d(facets[:, 0], facets[:, 1])
        ends = np.setdiff1d(facets[:, 1], facets[:, 0])
        ways = np.linalg.norm(points[ends][:, None] - points[starts], axis=2)
        from scipy.optimize import linear_sum_assignment  # slow to import, and seldom needed

        first, second = linear_sum_assignment(ways)
        return np.column_stack([ends[first], starts[second]])
    fans = []
    following = dict(rim.tolist())
    while following:
        loop = chain(following, next(iter(following)))
        for node in loop[:-1]:
            del following[node]
        fans += [[loop[0], a, b] for a, b in pairwise(loop[1:-1])]
    return with_corners(np.array(fans).reshape(-1, 3), 2, facets.shape[1])


def smallest_volume(geometry: Geometry, facets: np.ndarray, points: np.ndarray) -> float:
    """Return the volume [m^3] that counts as none: 1e-9 of the facets' area times their extent."""
    size = np.ptp(points[np.unique(facets)], axis=0).max()
    area = np.linalg.norm(geometry.volume_gradient(points, facets), axis=2).sum()
    return float(1e-9 * area * size)


def chain(following: dict[int, int], start: int) -> list[int]:
    """Return the nodes from `start` along `following`, to its end or back to the start."""
    nodes = [start]
    while nodes[-1] in following:
        nodes.append(following[nodes[-1]])
        if nodes[-1] == start:
            break
    return nodes


# -------------------------------------------------------------------------------------------------
# Checks that a robot has what a pressure controlled by events needs.

# Rows of the history by which a speed is told at least.
ROWS_OF_A_SPEED = 4


def refuse_what_cannot_be_felt(names: Names, model: Model) -> None:
    """Raise SceneError if a controlled pressure needs events that the history does not record."""
    for keys, settings in controls(model):
        refuse_a_second_chamber(names, model, keys)
        refuse_no_motion(names, model, keys)
        refuse_missing_rows(names, model, settings, keys)
        refuse_a_short_window(names, settings, keys)


def controls(model: Model) -> Iterator[tuple[Keys, EventCycles]]:
    """Yield the keys and the settings of the profile of each controlled pressure."""
    for load in model.pressures:
        if load.source.control is not None:
            yield ("loads", load.name, "profile"), load.source.control


def refuse_a_second_chamber(names: Names, model: Model, keys: Keys) -> None:
    """Raise SceneError if the pressure is not that of the robot's chamber.

    The history records no other pressure.
    """
    chamber = model.chamber
    if chamber is not None and keys[1] != chamber.name:
        raise names.loaded.error(
            keys,
            f"event_cycles can only drive the chamber of the robot, which is '{chamber.name}'",
            f"write robot: {{chamber: {keys[1]}}}",
        )


def refuse_no_motion(names: Names, model: Model, keys: Keys) -> None:
    """Raise SceneError if the model is static or has no frame whose motion could be measured."""
    if model.relaxation is not None:
        raise names.loaded.error(
            keys,
            "event_cycles respond to the motion of the robot, and a static procedure has none",
            "write time.procedure: dynamic, or a profile of kind cycles",
        )
    if not model.rigid_bodies:
        raise names.loaded.error(
            keys,
            "event_cycles need the motion of the robot's frame, and there is no frame",
            "add rigid_bodies, or write a profile of kind cycles",
        )


def refuse_missing_rows(names: Names, model: Model, settings: EventCycles, keys: Keys) -> None:
    """Raise SceneError if a criterion needs more rows of spikes than the robot has."""
    for key in ("contact_rows", "least_rows"):
        wanted = getattr(settings, key)
        if wanted > len(model.robot.rows):
            raise names.loaded.error(
                (*keys, key),
                f"{key} needs {wanted}, but robot.rows names {len(model.robot.rows)}",
                "name more node sets there, such as ['skin.j*[0-9]']; 0 switches the criterion off",
            )


def refuse_a_short_window(names: Names, settings: EventCycles, keys: Keys) -> None:
    """Raise SceneError if the motion window has too few rows of the history to compute a speed."""
    least = ROWS_OF_A_SPEED * names.scene.output.history_interval
    if settings.motion_window < least:
        raise names.loaded.error(
            (*keys, "motion_window"),
            f"within {settings.motion_window * 1e3:.4g} ms the history has too few rows to "
            f"compute a speed: at least {ROWS_OF_A_SPEED} are needed",
            f"set at least {least * 1e3:.4g} ms, or a shorter output.history_interval",
        )
