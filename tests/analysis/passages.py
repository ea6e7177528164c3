"""A pipe of five parts, a body in it, and histories of it made up by the arc length over time."""

import numpy as np

from softsim.contact.pipe_layout import Bend, DiameterStep, Straight, path_of_items
from softsim.contact.pipe_network import PipeNetwork
from softsim.model import Passage

ARC = 0.06 * 0.5 * np.pi
PATH = path_of_items(
    "pipe",
    [
        Straight(0.12),
        Bend(0.5 * np.pi, 0.06, 0.0),
        Straight(0.04),
        DiameterStep(30e-3),
        Straight(0.1),
    ],
    36e-3,
    np.zeros(2),
    (False, False),
)
ITEMS = ("straight 120 mm", "bend 90 deg, radius 60 mm", "straight 40 mm", "step 30 mm",
         "straight 100 mm")  # fmt: skip
STEP = 0.16 + ARC
LENGTH = 33e-3


def passage(**changed) -> Passage:
    """From 30 mm to where a body of 33 mm lies in the last segment; patience: two cycles."""
    given = {
        "network": PipeNetwork.of_one(PATH), "items": ITEMS, "body": 0, "length": LENGTH,
        "outline": np.arange(4), "start": 0.03, "goals": (STEP + 0.5 * LENGTH,),
        "in_cycles": True, "patience": 2, "patience_time": 3.0, "least_progress": 5e-3,
    }  # fmt: skip
    return Passage(**{**given, **changed})


def history(times, places, period=2.0, **columns) -> dict[str, np.ndarray]:
    """Rows 10 ms apart of a body at `places` [mm] at `times` [s], linear in between, under cycles
    of `period` [s]; columns: values of others than no contact at all, 3 mm off the wall.
    """
    t = np.arange(0.0, times[-1] + 1e-9, 0.01)
    given = {
        "branch": 0.0,
        "rows_in_contact": 3.0, "clearance": 3e-3, "frame_wall_force": 0.0, "frame_pinch": 0.0,
        "frame_drag": 0.0, "thrust": 0.0, "drag": 0.0, "narrowing_drag": 0.0,
    } | columns  # fmt: skip
    return {
        "time": t,
        "arc_length": 1e-3 * np.interp(t, times, places),
        "cycles_done": np.floor(t / period + 1e-9),
        **{name: np.zeros(len(t)) + value for name, value in given.items()},
    }
