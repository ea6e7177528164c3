"""How a robot touches its walls, from its history: over which area, its rows how often and for how
long.

A row of the history says what touched within the interval before it: what is told here is as fine
as the history is.
"""

from typing import Any

import numpy as np

from softsim.model import Model
from softsim.scene.columns import ROW_FORCE

LEAST_AWAY = 1e-3
"""Time [s] without touch after which a contact is a new one."""

History = dict[str, np.ndarray]


def interval_integrals(t: np.ndarray, means: np.ndarray) -> np.ndarray:
    """Integrals (rows,) over the interval before each row of a column that holds its means."""
    return means * np.diff(t, prepend=t[0])


def touching_areas(history: History) -> dict[str, float | None]:
    """The largest and the mean area that touched walls [m^2]; no mean of a run without time."""
    t, area = history["time"], history["contact_area"]
    span = t[-1] - t[0]
    return {
        "largest_contact_area": float(area.max()),
        "mean_contact_area": float(interval_integrals(t, area).sum() / span) if span > 0 else None,
    }


def row_contacts(model: Model, history: History) -> dict[str, Any]:
    """Of each row of spikes or limbs: how often it came to touch a wall, and its share of the time
    in touch.
    """
    t = history["time"]
    touched = [history[f"{ROW_FORCE}{name}"] > 0.0 for name in model.robot.rows]
    span = t[-1] - t[0]
    return {
        "row_contacts": [contact_count(t, of_row) for of_row in touched],
        "row_contact_shares": [
            float(interval_integrals(t, of_row).sum() / span) if span > 0.0 else None
            for of_row in touched
        ],
    }


def contact_count(t: np.ndarray, touched: np.ndarray) -> int:
    """How often something began to touch, at the rows' times t (rows,) [s], that did so within the
    intervals before some of them (rows,).
    """
    rows = np.flatnonzero(touched)
    if not len(rows):
        return 0
    away = t[rows[1:] - 1] - t[rows[:-1]]
    return 1 + int((away >= LEAST_AWAY * (1.0 - 1e-6)).sum())
