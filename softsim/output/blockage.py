"""What blocks a body that is stuck in a pipe: a rule each, asked one after the other.

The rules look at the rows of the last whole pressure cycle. Their thresholds are choices, not
measurements; they and what they were held against are in summary.json.
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
    """Of the last rows: touching_share, in which the frame touches; pinch_share, of the walls'
    forces on it that cancel out; frame_drag_share and narrowing_drag_share, of the walls' forces
    against the way that act on the frame, and where the pipe narrows; most_rows, of spikes in
    contact; way_forward and way_back [m], the largest of each. fell_back [m], from the farthest
    place to the end, and whether it counts as a fall.
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
    """What the rules are asked of: the rows of the last whole cycle."""
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
    """part / whole, none of nothing."""
    return part / whole if whole > 0.0 else 0.0


def lost_grip(indicators: BlockageIndicators) -> bool:
    """It ended farther behind than its own length: it did not stop there, it fell."""
    return indicators.has_fallen


def is_wedged(indicators: BlockageIndicators) -> bool:
    """The frame, which does not yield, touches most of the time, and is either clamped from two
    sides or takes the most of what holds the robot back.
    """
    clamped = indicators.pinch_share >= PINCHED or indicators.frame_drag_share >= MAIN_PART
    return indicators.touching_share >= TOUCHING and clamped


def is_caught(indicators: BlockageIndicators) -> bool:
    """The most of what holds the robot back acts on nodes where the pipe narrows."""
    return indicators.narrowing_drag_share >= MAIN_PART


RULES: dict[str, Callable[[BlockageIndicators], bool]] = {
    "lost grip and fell": lost_grip,
    "frame wedged": is_wedged,
    "spikes caught on a step": is_caught,
}
NO_THRUST = "no thrust"
"""What is left where no rule holds: nothing is in the way, and yet it does not go on."""


def blocked_by(indicators: BlockageIndicators) -> str:
    """The first of the rules that holds."""
    return next((name for name, holds in RULES.items() if holds(indicators)), NO_THRUST)


def contact_description(indicators: BlockageIndicators) -> str:
    """What the spikes did, in words."""
    if indicators.most_rows == 0.0:
        return "no row of spikes touches the wall"
    rows = f"up to {indicators.most_rows:g} rows of spikes touch the wall"
    forward, back = indicators.way_forward * 1e3, indicators.way_back * 1e3
    return f"{rows}; in the last phase {forward:.1f} mm forward and {back:.1f} mm backward"
