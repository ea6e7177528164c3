"""Tension of a tether that is drawn through pipes, from the entrance to the robot at its end.

A tether of weight w [N/m] lies on the wall with the force p per length that balances its weight
across the pipe and, in a bend, its tension (t: unit tangent in the direction of travel, g: unit
vector down, kappa n: curvature towards the centre of the bend):

    p = T kappa n + w (g - (g.t) t)
    dT/ds = -w g.t + mu |p|        while it is drawn forward
    dR/ds = -w g.t - mu |p(R)|     when it is about to slide back

T is the tension that the robot must overcome, R the one that keeps the tether from sliding back:
the part of T that is hanging weight and acts on a robot at rest too. At the entrance nothing holds
the tether: T = R = 0. A tether cannot push: neither falls below 0 on downward paths that are
steeper than its angle of friction.

On a straight path p is w cos(beta), and T grows by w (sin(beta) + mu cos(beta)) per length. Without
weight a bend by theta gives T exp(mu theta), the capstan equation of Euler and Eytelwein. In
general the equation is integrated. The corner where pipes branch has no length and adds the factor
exp(mu theta) alone. Friction is Coulomb friction; bending stiffness and diameter of the tether are
neglected.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.pipe_path import BEND, PipePath, Segment

CORNER = 0.5 * np.pi  # rad: pipes leave each other at right angles
POINTS_PER_SEGMENT = 41  # at which the tension within a segment is told
ACCURACY = 1e-9  # of the integration, relative


@dataclass(frozen=True)
class TetherProperties:
    """Tether with a weight [N/m] and a friction coefficient [-]."""

    weight: float
    friction: float


@dataclass(frozen=True, eq=False)
class Tension:
    """Tension of a tether along a path.

    arc_length (n,) [m]: rising, with two equal values at corners. drawing (n,) [N]: tension that
    draws the tether forward. holding (n,) [N]: least tension that keeps it from sliding back.
    """

    arc_length: np.ndarray
    drawing: np.ndarray
    holding: np.ndarray


@dataclass(frozen=True, eq=False)
class Way:
    """Path from the start of a layout to an exit: segments, and the length [m] along each.

    corners: numbers of the parts before which the path turns from a pipe into a branch.
    """

    exit: str
    parts: tuple[tuple[Segment, float], ...]
    corners: frozenset[int]

    @property
    def length(self) -> float:
        """Arc length [m] of the end of the path."""
        segment, length = self.parts[-1]
        return segment.start + length


def ways(network: PipeNetwork) -> list[Way]:
    """Return the path to each exit of a layout."""
    found = []
    for name, number in network.exits.items():
        leaves = network.ways_to(number)
        parts: list[tuple[Segment, float]] = []
        corners = []
        paths = {branch: network.branches[branch].path for branch in leaves}
        for branch in sorted(leaves, key=lambda each: paths[each].segments[0].start):
            if parts:
                corners.append(len(parts))
            parts += until(paths[branch], leaves[branch])
        found.append(Way(name, tuple(parts), frozenset(corners)))
    return found


def until(path: PipePath, end: float) -> list[tuple[Segment, float]]:
    """Return the segments of a path up to an arc length [m], and their lengths [m] up to there."""
    return [(s, min(s.end, end) - s.start) for s in path.segments if s.start < end]


def tension_along(way: Way, tether: TetherProperties, down: np.ndarray) -> Tension:
    """Return the tensions of a tether along a path; down: unit vector of gravity (3,)."""
    drawing, holding = Drawn(tether, 1.0), Drawn(tether, -1.0)
    arcs, both = [], []
    last = np.zeros(2)
    for number, (segment, length) in enumerate(way.parts):
        if number in way.corners:
            last = last * np.exp(tether.friction * CORNER * np.array([1.0, -1.0]))
        along = np.linspace(0.0, length, POINTS_PER_SEGMENT)
        tensions = np.stack(
            [each.along(segment, down, along, start)
             for each, start in zip((drawing, holding), last, strict=True)]
        )  # fmt: skip
        arcs.append(segment.start + along)
        both.append(tensions)
        last = tensions[:, -1]
    drawn, held = np.concatenate(both, axis=1)
    return Tension(np.concatenate(arcs), drawn, held)


@dataclass(frozen=True)
class Drawn:
    """Tether that is drawn forward (`sense` 1, friction acts backward) or slides back (-1)."""

    tether: TetherProperties
    sense: float

    def along(
        self, segment: Segment, down: np.ndarray, along: np.ndarray, first: float
    ) -> np.ndarray:
        """Return the tension (n,) [N] at lengths (n,) [m] in a segment.

        first [N]: tension at the start of the segment. down (3,): unit vector of gravity.
        """
        if segment.kind != BEND:
            return self.along_straight(in_space(segment.tangent), down, along, first)
        return self.along_bend(segment, down, along, first)

    def along_straight(
        self, tangent: np.ndarray, down: np.ndarray, along: np.ndarray, first: float
    ) -> np.ndarray:
        """Return the tension (n,) [N] in a straight segment, in closed form."""
        rate = self.rate(tangent, np.zeros(3), down, first)
        return np.asarray(np.maximum(first + rate * along, 0.0))

    def along_bend(
        self, segment: Segment, down: np.ndarray, along: np.ndarray, first: float
    ) -> np.ndarray:
        """Return the tension (n,) [N] in a bend, by integration."""
        forward, side = in_space(segment.tangent), in_space(segment.side)

        def change(s: float, tension: np.ndarray) -> list[float]:
            angle = s / segment.bend_radius
            tangent = np.cos(angle) * forward + np.sin(angle) * side
            curvature = (np.cos(angle) * side - np.sin(angle) * forward) / segment.bend_radius
            now = max(float(tension[0]), 0.0)
            rate = self.rate(tangent, curvature, down, now)
            return [rate if now > 0.0 else max(rate, 0.0)]

        found = solve_ivp(
            change, (0.0, along[-1]), [first], t_eval=along, rtol=ACCURACY,
            atol=ACCURACY * self.tether.weight * along[-1],
            max_step=along[-1] / (POINTS_PER_SEGMENT - 1),
        )  # fmt: skip
        return np.asarray(np.maximum(found.y[0], 0.0))

    def rate(
        self, tangent: np.ndarray, curvature: np.ndarray, down: np.ndarray, tension: float
    ) -> float:
        """Return dT/ds [N/m] for a tangent and a curvature [1/m] (3,) of the path."""
        weight, falling = self.tether.weight, float(down @ tangent)
        pressing = tension * curvature + weight * (down - falling * tangent)
        friction = self.tether.friction * float(np.linalg.norm(pressing))
        return -weight * falling + self.sense * friction


def in_space(vector: np.ndarray) -> np.ndarray:
    """Return a vector of a section or of space as a vector of space (3,)."""
    return np.pad(vector, (0, 3 - len(vector)))


def rises(way: Way, down: np.ndarray) -> np.ndarray:
    """Return the sine of the inclination (n,) at the points of `tension_along`."""
    found = []
    for segment, length in way.parts:
        _, tangents = segment.axis_place(np.linspace(0.0, length, POINTS_PER_SEGMENT))
        found.append([-float(down @ in_space(tangent)) for tangent in tangents])
    return np.concatenate(found)


def radii(way: Way) -> Sequence[tuple[float, float]]:
    """Return the radii [m] of both ends of the segment for each point of `tension_along`."""
    return [segment.radii for segment, _ in way.parts for _ in range(POINTS_PER_SEGMENT)]


# -------------------------------------------------------------------------------------------------
# Pulling force of a robot: the largest drag with which it still advances in each cycle.
#
# It is found by bisection, in equal ratios, between LEAST and MOST; each step is a trial whether
# the robot advances with a drag. A drag that stops the robot is assumed to stop it when larger,
# too. The result is a bracket: the largest drag with which the robot advanced, and the least with
# which it did not.

LEAST, MOST = 0.01, 2.0
"""Range of the searched drags [N] on the robot.

A tenth of the PFR's weight, and twenty times it, which is its pulling force on a force gauge."""


@dataclass(frozen=True)
class Bracket:
    """Bracket of the pulling force, between low and high [N].

    high is infinite if the robot advanced with all drags that were tried, the largest of which lies
    below MOST by less than the required ratio. Both are zero if it does not advance without drag.
    """

    low: float
    high: float


def trials_left(seen: Mapping[float, bool], ratio: float) -> int:
    """Return the largest number of trials until the ends of the bracket differ by at most `ratio`.

    seen: drag -> True if the robot advanced with it.
    """
    low, high = bounds(seen)
    halvings = math.ceil(math.log2(max(1.0, math.log(high / low) / math.log(ratio))) - 1e-9)
    last = 0.0 not in seen and not any(seen.values())
    return max(0, halvings) + int(last)


def next_drag(seen: Mapping[float, bool], ratio: float) -> float | None:
    """Return the drag [N] of the next trial, or None if there is no more trial.

    It is the geometric mean of the bounds. If the robot advanced with none of the drags, 0 N
    follows last.
    """
    low, high = bounds(seen)
    if high / low > ratio * (1.0 + 1e-9):
        return math.sqrt(low * high)
    return 0.0 if not any(seen.values()) and 0.0 not in seen else None


def bounds(seen: Mapping[float, bool]) -> tuple[float, float]:
    """Return the lower and upper bound [N] of the limit, within LEAST and MOST."""
    low = max((drag for drag, moved in seen.items() if moved), default=LEAST)
    high = min((drag for drag, moved in seen.items() if not moved and drag > 0.0), default=MOST)
    return max(low, LEAST), high


def bracket(seen: Mapping[float, bool]) -> Bracket:
    """Return the bracket that results from the trials."""
    moved = [drag for drag, it_moved in seen.items() if it_moved]
    stood = [drag for drag, it_moved in seen.items() if not it_moved]
    if 0.0 in stood:
        return Bracket(0.0, 0.0)
    return Bracket(max(moved, default=0.0), min(stood, default=math.inf))
