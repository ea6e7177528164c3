"""Cables: their nodes along a line, their masses, their contact with walls."""

from collections.abc import Mapping, Sequence

import numpy as np

from softsim.builder.contact import ALLOWED_PENETRATION, PenaltyStiffness
from softsim.builder.loads import ELASTIC_SLIP
from softsim.builder.names import MeshedBody, Names, PlacedCable, in_mm, model_vector
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.wall import OffsetWall, Wall
from softsim.elements.axisymmetric import Axisymmetric
from softsim.elements.cable import Cable
from softsim.loads.tether import EndDrag
from softsim.model import CableData
from softsim.scene import structural
from softsim.scene.loading import LoadedScene

LEAST_SEGMENTS = 4


def placed_cables(loaded: LoadedScene, bodies: Mapping[str, MeshedBody]) -> dict[str, PlacedCable]:
    """Return the cables of a scene, in its order.

    Their nodes are numbered one cable after the other, behind those of the bodies. Raises
    SceneError for a cable without a length, or too short for its segments.
    """
    geometry = next(iter(bodies.values())).geometry
    first_node = sum(len(body.mesh.points) for body in bodies.values())
    result = {}
    for name, data in loaded.scene.cables.items():
        keys = ("cables", name)
        if isinstance(geometry, Axisymmetric):
            raise loaded.error(
                keys, "a cable in an axisymmetric model would be a disc", "leave the cable out"
            )
        if name in bodies:
            raise loaded.error(keys, f"a body is also called '{name}'", "rename one of them")
        corners = np.array(
            [
                model_vector(loaded, geometry.dimension, point, (*keys, "points", k))
                for k, point in enumerate(data.points)
            ]
        )
        points = along(loaded, name, data, corners)
        result[name] = PlacedCable(points, first_node)
        first_node += len(points)
    return result


def along(
    loaded: LoadedScene, name: str, data: structural.CableSpec, corners: np.ndarray
) -> np.ndarray:
    """Return nodes (k, d) [m], evenly spaced along the line through `corners` (c, d) [m]."""
    steps = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    for k in np.flatnonzero(steps == 0.0):
        raise loaded.error(
            ("cables", name, "points", int(k) + 1),
            f"'{name}' has two successive points at {in_mm(corners[k])}",
            "leave one of them out",
        )
    stations = np.concatenate([[0.0], np.cumsum(steps)])
    count = round(stations[-1] / data.segment_length)
    if count < LEAST_SEGMENTS:
        raise loaded.error(
            ("cables", name, "segment_length"),
            f"'{name}' is {stations[-1] * 1e3:.4g} mm long and has {count} segments of "
            f"{data.segment_length * 1e3:.4g} mm",
            f"at least {LEAST_SEGMENTS} are needed: set segment_length to at most "
            f"{stations[-1] * 1e3 / LEAST_SEGMENTS:.4g} mm",
        )
    places = np.linspace(0.0, stations[-1], count + 1)
    return np.stack([np.interp(places, stations, column) for column in corners.T], axis=1)


def cable_points(names: Names) -> np.ndarray:
    """Return the nodes (n, d) [m] of all cables."""
    return np.concatenate(
        [np.zeros((0, names.dimension)), *(placed.points for placed in names.cables.values())]
    )


def cable_mass(names: Names, name: str) -> np.ndarray:
    """Return the mass (k,) [kg] of the nodes of a cable: half of the segments beside each."""
    lengths = names.cables[name].lengths
    halves = 0.5 * names.scene.cables[name].mass_per_length * lengths
    return np.append(halves, 0.0) + np.append(0.0, halves)


def built_cables(
    names: Names, is_free: np.ndarray, stiffness: PenaltyStiffness, walls: Sequence[Wall]
) -> tuple[CableData, ...]:
    """Return all cables of a model with these walls; is_free (n, d): of all nodes.

    Raises SceneError if a cable starts inside a wall.
    """
    result = []
    for name, placed in names.cables.items():
        data = names.scene.cables[name]
        moves = is_free[placed.nodes].any(axis=1)
        held = ~(moves[:-1] | moves[1:])
        friction = data.friction_coefficient
        if friction is None:
            friction = names.scene.contact.friction_coefficient
        contact = stiffness.contact(placed.nodes[moves], friction)
        refuse_penetration(names, name, walls, placed.points[moves])
        refuse_beyond_pipes(names, name, walls, placed.points)
        cable = Cable(
            name=name,
            nodes=placed.nodes,
            lengths=placed.lengths,
            joint_lengths=joint_lengths(placed.lengths, held),
            stretching_stiffness=data.stretching_stiffness,
            bending_stiffness=data.bending_stiffness,
            gauge=int(np.argmin(held)),
        )
        result.append(CableData(cable, 0.5 * data.diameter, contact))
    return tuple(result)


def joint_lengths(lengths: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Return the length (k - 2,) [m] that each joint represents: half of the segments beside it.

    A segment whose two ends are held does not bend and does not count, unless both segments are
    held.
    """
    bending = np.where(held, 0.0, lengths)
    either = np.where(held[:-1] & held[1:], lengths[:-1] + lengths[1:], bending[:-1] + bending[1:])
    return np.asarray(0.5 * either)


def refuse_penetration(names: Names, name: str, walls: Sequence[Wall], places: np.ndarray) -> None:
    """Raise SceneError if a node that may touch a wall, at places (k, d) [m], starts inside it."""
    for wall in walls:
        radius = 0.5 * names.scene.cables[name].diameter
        for surface, gap in OffsetWall(wall, radius).gaps(places).items():
            if gap.min() < -ALLOWED_PENETRATION:
                raise names.loaded.error(
                    ("cables", name, "points"),
                    f"'{name}' starts {-gap.min() * 1e3:.3g} mm inside the wall '{surface}' at "
                    f"{in_mm(places[gap.argmin()])}, with its radius of {radius * 1e3:.3g} mm",
                    "lay it along the free side of the wall",
                )


def refuse_beyond_pipes(names: Names, name: str, walls: Sequence[Wall], places: np.ndarray) -> None:
    """Raise SceneError if a cable with nodes at places (k, d) [m] lies only partly in a pipe.

    It would hang down over the rim at the start of the pipe.
    """
    for wall in walls:
        if not isinstance(wall, PipeNetwork):
            continue
        before = wall.locate(places)[1] < 0.0
        if before.any() and not before.all():
            longest = float(np.linalg.norm(np.diff(places[~before], axis=0), axis=1).sum())
            raise names.loaded.error(
                ("cables", name, "points"),
                f"{int(before.sum())} of the {len(places)} nodes of '{name}' lie outside the pipe "
                f"'{wall.name}', before its start",
                f"make it {longest * 1e3:.3g} mm long, or make the pipe longer at its start",
            )


def end_drags(names: Names) -> dict[str, EndDrag]:
    """Return the drags on the ends of cables, by name: friction of the part beyond the end."""
    result = {}
    for name, placed in names.cables.items():
        drag = names.scene.cables[name].end_drag
        place = placed.points[-1]
        along = place - placed.points[-2]
        axis = along / np.linalg.norm(along)
        if drag > 0.0:
            before, end = map(int, placed.nodes[-2:])
            held = EndDrag(before, end, place, axis, drag / ELASTIC_SLIP, drag)
            result[f"cables.{name}.end_drag"] = held
    return result
