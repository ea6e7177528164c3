"""What stands around an animated robot: walls, and the lines that bodies follow."""

from typing import Any

import numpy as np

from softsim.output.fields import Frames
from softsim.report.colours import MILLI
from softsim.report.section import THICKNESS, Section, behind, chains, wall_solid
from softsim.report.snapshots import pictures
from softsim.report.surface import NO_FACES, corners_of_box, wall_faces

Scenery = dict[str, Any]


def scenery(frames: Frames, field: str, everywhere: np.ndarray) -> Scenery:
    """Walls of a run as the figures show them, in mm.

    everywhere: lowest and highest place of the body in the whole run (2, d) [mm].
    In the plane `solids`, each with its outline, the part of it that is the wall's face, and the
    side of the axis on which it is (0: both); in space `faces` (k, 4, 3).
    """
    if frames.points.shape[1] == 3:
        return {"faces": faces_in_space(frames, everywhere).round(3)}
    picture = pictures(frames, [0], field)
    assert isinstance(picture, Section)
    return {
        "solids": [*flat_solids(picture, everywhere), *curved_solids(picture)],
        "lines": picture.centre_lines.round(3),
    }


def flat_solids(picture: Section, everywhere: np.ndarray) -> list[Scenery]:
    """The solid behind each straight wall, wherever the body goes."""
    view = everywhere.T.ravel()
    solids = []
    for wall in picture.walls:
        outline = wall_solid(wall, view)
        solids.append(
            {"outline": outline.round(3), "face": outline[:2].round(3), "side": wall.side}
        )
    return solids


def curved_solids(picture: Section) -> list[Scenery]:
    """A strip of the solid behind each curved wall."""
    depth = THICKNESS * max(np.ptp(picture.view[:2]), np.ptp(picture.view[2:]))
    return [
        {
            "outline": np.concatenate([chain, behind(chain, depth)[::-1]]).round(3),
            "face": chain.round(3),
            "side": 0.0,
        }
        for chain in chains(picture.wall_lines)
    ]


def faces_in_space(frames: Frames, everywhere: np.ndarray) -> np.ndarray:
    """Faces (k, 4, 3) [mm] of walls near the body and of all curved walls, towards the free side by
    the right-hand rule.
    """
    walls = frames.described.get("walls", np.zeros((0, 6))) * [*[MILLI] * 3, 1.0, 1.0, 1.0]
    pipes = frames.described.get("pipes", np.zeros((0, 7))) * [*[MILLI] * 3, 1.0, 1.0, 1.0, MILLI]
    near = wall_faces(walls, pipes, corners_of_box(everywhere))
    curved = frames.described.get("wall_faces", NO_FACES) * MILLI
    if curved.shape[1] == 3:  # a triangle is a face with two corners in one place
        curved = curved[:, [0, 1, 2, 2]]
    return np.concatenate([near, curved])
