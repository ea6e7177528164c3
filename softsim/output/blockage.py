"""Rules that find the cause of a blockage when a body is stuck in a pipe.

The rules are evaluated in order, on the rows of the last whole pressure cycle. Their thresholds
are choices, not measurements; summary.json holds the thresholds and the values compared.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from softsim.model import Passage
from softsim.output.passage import History, has_fallen, last_rows

# Share of the rows in which a wedged frame touches the wall: the most of the time. One that rattles
# while the motor shakes it touches in few.
TOUCHING = 0.5
# Share of the walls' forces on the frame that cancel out. It is 0.5 of a frame that is clamped from
# two sides, and near zero of one that lies on one side: half of the most counts.
PINCHED = 0.25
# Share that makes a part of the resistance the main part.
MAIN_PART = 0.5


@dataclass(frozen=True)
class BlockageIndicators:
    """Indicators of a blockage, from the rows of the last whole cycle.

    touching_share: fraction of the rows in which the frame touches the wall. pinch_share: fraction
    of the wall forces on the frame that cancel out. frame_drag_share, narrowing_drag_share:
    fractions of the wall forces against the motion that act on the frame, and where the pipe
    narrows. most_rows: largest number of rows of spikes in contact. way_forward, way_back: largest
    displacement in each direction [m]. fell_back: distance from the farthest position to the last
    one [m]. has_fallen: True if that counts as a fall.
    """

    touching_share: float
    pinch_share: float
    frame_drag_share: float
    narrowing_drag_share: float
    most_rows: float
    way_forward: float
    way_back: float
    fell_back: float
    has_fallen: bool


def blockage_indicators(passage: Passage, history: History) -> BlockageIndicators:
    """Return the indicators that the rules use, from the rows of the last whole cycle."""
    rows = last_rows(passage, history)
    sums = {
        name: float(history[name][rows].sum())
        for name in ("frame_wall_force", "frame_pinch", "drag", "frame_drag", "narrowing_drag")
    }
    s = history["arc_length"]
    way = s[rows]
    fell_back = float(s.max() - s[-1])
    return BlockageIndicators(
        touching_share=float((history["clearance"][rows] <= 0.0).mean()),
        pinch_share=share(sums["frame_pinch"], sums["frame_wall_force"]),
        frame_drag_share=share(sums["frame_drag"], sums["drag"]),
        narrowing_drag_share=share(sums["narrowing_drag"], sums["drag"]),
        most_rows=float(history["rows_in_contact"][rows].max()),
        way_forward=float((way - np.minimum.accumulate(way)).max()),
        way_back=float((np.maximum.accumulate(way) - way).max()),
        fell_back=fell_back,
        has_fallen=has_fallen(passage, fell_back),
    )


def share(part: float, whole: float) -> float:
    """Return part / whole; 0 if whole is 0."""
    return part / whole if whole > 0.0 else 0.0


def lost_grip(indicators: BlockageIndicators) -> bool:
    """Return True if the body ended farther back than its own length, so it fell."""
    return indicators.has_fallen


def is_wedged(indicators: BlockageIndicators) -> bool:
    """Return True if the rigid frame is wedged.

    It touches the wall most of the time, and is either clamped from two sides or carries most of
    the drag.
    """
    clamped = indicators.pinch_share >= PINCHED or indicators.frame_drag_share >= MAIN_PART
    return indicators.touching_share >= TOUCHING and clamped


def is_caught(indicators: BlockageIndicators) -> bool:
    """Return True if most of the drag acts on nodes where the pipe narrows."""
    return indicators.narrowing_drag_share >= MAIN_PART


RULES: dict[str, Callable[[BlockageIndicators], bool]] = {
    "lost grip and fell": lost_grip,
    "frame wedged": is_wedged,
    "spikes caught on a step": is_caught,
}
NO_THRUST = "no thrust"
"""Cause reported if no rule holds: nothing obstructs the body, but it does not move."""


def blocked_by(indicators: BlockageIndicators) -> str:
    """Return the name of the first rule that holds, else NO_THRUST."""
    return next((name for name, holds in RULES.items() if holds(indicators)), NO_THRUST)


def contact_description(indicators: BlockageIndicators) -> str:
    """Return a description of the contact of the spikes in the last cycle."""
    if indicators.most_rows == 0.0:
        return "no row of spikes touches the wall"
    rows = f"up to {indicators.most_rows:g} rows of spikes touch the wall"
    forward, back = indicators.way_forward * 1e3, indicators.way_back * 1e3
    return f"{rows}; in the last phase {forward:.1f} mm forward and {back:.1f} mm backward"
