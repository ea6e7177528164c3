"""Which rows of spikes touch the wall, from a frame of a run.

A node in contact lies behind the wall: the penalty spring that pushes it back is compressed.
"""

import numpy as np

from softsim.output.fields import Frames, read_frames
from softsim.output.folder import RESULTS
from validation.cases import Outcome

ROWS = ("j1", "j2", "j3", "j4", "j5")  # from the front


def rows_touching(outcome: Outcome, time: float) -> np.ndarray | None:
    """Whether each of ROWS touches (5,), in the frame nearest to `time` [s]; None of a run that
    failed. Raises OutputError: the run has no frames.
    """
    if outcome.folder is None or outcome.failure:
        return None
    frames = read_frames(outcome.folder / RESULTS)
    gap = wall_gap(frames, int(np.argmin(np.abs(frames.times - time))))
    return np.array([bool((gap[frames.sets[f"skin.{row}"]] < 0.0).any()) for row in ROWS])


def wall_gap(frames: Frames, index: int) -> np.ndarray:
    """Distance of every node (n,) [m] from the nearest straight wall; negative behind it."""
    x = frames.points + frames.point_data["displacement"][index][:, : frames.points.shape[1]]
    dimension = x.shape[1]
    walls = frames.described["walls"]
    points, normals = walls[:, :dimension], walls[:, dimension:]
    return np.asarray(((x[:, None] - points) * normals).sum(axis=2).min(axis=1))
