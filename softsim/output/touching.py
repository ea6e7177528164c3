"""Contact of a robot with its walls, from its history: area, number and duration of contacts.

A row of the history holds the contact within the interval before it, so the resolution is that of
the history.
"""

from typing import Any

import numpy as np

from softsim.model import Model
from softsim.scene.columns import ROW_FORCE

LEAST_AWAY = 1e-3
"""Time [s] without contact after which a contact counts as a new one."""

History = dict[str, np.ndarray]


def interval_integrals(t: np.ndarray, means: np.ndarray) -> np.ndarray:
    """Return the integrals (rows,) of a column of means over the interval before each row."""
    return means * np.diff(t, prepend=t[0])


def touching_areas(history: History) -> dict[str, float | None]:
    """Return the largest and the mean area in contact [m^2]; no mean for a run of zero duration."""
    t, area = history["time"], history["contact_area"]
    span = t[-1] - t[0]
    return {
        "largest_contact_area": float(area.max()),
        "mean_contact_area": float(interval_integrals(t, area).sum() / span) if span > 0 else None,
    }


def row_contacts(model: Model, history: History) -> dict[str, Any]:
    """Return the number of contacts of each row of spikes or limbs, and its fraction of the time in
    contact.
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
    """Return how many separate contacts a history contains.

    t (rows,) [s]: times of the rows. touched (rows,): True for contact in the interval before.
    """
    rows = np.flatnonzero(touched)
    if not len(rows):
        return 0
    away = t[rows[1:] - 1] - t[rows[:-1]]
    return 1 + int((away >= LEAST_AWAY * (1.0 - 1e-6)).sum())
