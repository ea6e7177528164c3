"""Tension of a tether along a layout, and the distance at which it exceeds the pulling force."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from softsim.apps.reach.trials import Bracket, Heading, TrialPipe
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.pipe_path import BEND, PipePath, Segment

# -------------------------------------------------------------------------------------------------
# Tension of a tether that is drawn through pipes, from the entrance to the robot at its end.
#
# A tether of weight w [N/m] lies on the wall with the force p per length that balances its weight
# across the pipe and, in a bend, its tension (t: unit tangent in the direction of travel, g: unit
# vector down, kappa n: curvature towards the centre of the bend):
#
#     p = T kappa n + w (g - (g.t) t)
#     dT/ds = -w g.t + mu |p|        while it is drawn forward
#     dR/ds = -w g.t - mu |p(R)|     when it is about to slide back
#
# T is the tension that the robot must overcome, R the one that keeps the tether from sliding back:
# the part of T that is hanging weight and acts on a robot at rest too. At the entrance nothing
# holds the tether: T = R = 0. A tether cannot push: neither falls below 0 on downward paths that
# are steeper than its angle of friction.
#
# On a straight path p is w cos(beta), and T grows by w (sin(beta) + mu cos(beta)) per length.
# Without weight a bend by theta gives T exp(mu theta), the capstan equation of Euler and Eytelwein.
# In general the equation is integrated. The corner where pipes branch has no length and adds the
# factor exp(mu theta) alone. Friction is Coulomb friction; bending stiffness and diameter of the
# tether are neglected.

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
# Distance that a robot travels in a layout until the tether tension exceeds its pulling force.
#
# Trials give the pulling force in a level pipe, against friction, and in an upright pipe, against
# weight. Other pipes need both: the part R of the tension T is hanging weight that acts at rest too
# (above), and the robot lifts its own weight by the sine of the inclination. The pulling
# force is
#
#     P = P_level + h (P_upright - P_level),   h = max(R / T, sin(beta), 0)
#
# which is the result of trials at both ends, and an assumption between them. In a segment with a
# change of diameter the lower of the pulling forces at both ends applies.

Pulls = Mapping[TrialPipe, Bracket]
LEVEL_TOLERANCE = 1e-6  # shares of upright below this are level


@dataclass(frozen=True, eq=False)
class PathLoad:
    """Load on a robot at the points of a path: the tension, and h (n,) [-]."""

    tension: Tension
    uprightness: np.ndarray


@dataclass(frozen=True)
class Distance:
    """Least and largest distance [m] of a robot on the path to an exit, and its length [m]."""

    exit: str
    least: float
    most: float
    length: float

    @property
    def sentence(self) -> str:
        """Distance as a sentence."""
        to = f"of {self.length:.3g} m to the exit '{self.exit}'"
        if self.least >= self.length:
            return f"the robot gets all the way {to}"
        if self.most >= self.length:
            return f"the robot gets at least {self.least:.3g} m {to}, and possibly all the way"
        return f"the robot gets {self.least:.3g} to {self.most:.3g} m {to}"


def load_of(way: Way, tether: TetherProperties, down: np.ndarray) -> PathLoad:
    """Return the load of a path on a robot with a tether; down: unit vector of gravity (3,)."""
    tension = tension_along(way, tether, down)
    drawing, holding = tension.drawing, tension.holding
    hanging = np.divide(holding, drawing, out=np.zeros(len(drawing)), where=drawing > 0.0)
    share = np.clip(np.maximum(hanging, rises(way, down)), 0.0, 1.0)
    return PathLoad(
        tension,
        np.where(share < LEVEL_TOLERANCE, 0.0, np.where(share > 1.0 - LEVEL_TOLERANCE, 1.0, share)),
    )


def needed(way: Way, loads: Iterable[PathLoad]) -> set[TrialPipe]:
    """Return the pipes of the trials that a path needs."""
    found = set()
    for load in loads:
        for both, share in zip(radii(way), load.uprightness, strict=True):
            for radius in both:
                found |= {TrialPipe(diameter(radius), heading) for heading in weights(share)}
    return found


def weights(share: float) -> dict[Heading, float]:
    """Return the nonzero weights of the pulling forces of both headings, for h = `share`."""
    both = {Heading.level: 1.0 - share, Heading.upright: share}
    return {heading: weight for heading, weight in both.items() if weight > 0.0}


def diameter(radius: float) -> float:
    """Return the diameter [m] of a pipe, rounded to a nanometre."""
    return round(2.0 * radius, 9)


def pulls_along(way: Way, load: PathLoad, pulls: Mapping[TrialPipe, float]) -> np.ndarray:
    """Return the pulling force (n,) [N] of a robot at the points of a path."""
    return np.array(
        [
            min(
                sum(w * pulls[TrialPipe(diameter(r), h)] for h, w in weights(share).items())
                for r in both
            )
            for both, share in zip(radii(way), load.uprightness, strict=True)
        ]
    )


def farthest(arc: np.ndarray, tension: np.ndarray, pull: np.ndarray) -> float:
    """Return the arc length [m] up to which the tension does not exceed the pulling force.

    arc [m], tension, pull [N]: (n,) each, interpolated linearly between the points.
    """
    left = pull - tension
    beyond = np.flatnonzero(left < 0.0)
    if not len(beyond):
        return float(arc[-1])
    k = beyond[0]
    if k == 0:
        return float(arc[0])
    if np.isinf(left[k - 1]):  # up to there it can pull whatever is asked
        return float(arc[k])
    share = left[k - 1] / (left[k - 1] - left[k])
    return float(arc[k - 1] + share * (arc[k] - arc[k - 1]))


def distance(way: Way, loads: tuple[PathLoad, PathLoad], pulls: Pulls) -> Distance:
    """Return the least and largest distance along a path, from the lower and higher pulling forces.

    loads: with the least and with the most friction. More friction increases the tension, but
    decreases its hanging part, so either may be worse.
    """
    least, most = (
        [
            farthest(
                load.tension.arc_length,
                load.tension.drawing,
                pulls_along(way, load, {pipe: getattr(b, end) for pipe, b in pulls.items()}),
            )
            for load in loads
        ]
        for end in ("low", "high")
    )
    return Distance(way.exit, min(least), max(most), way.length)


def straight_distance(
    pipe: TrialPipe, pull: Bracket, weight: float, friction: tuple[float, float]
) -> tuple[float, float]:
    """Return the least and largest distance [m] in a long straight pipe.

    P / w upright and P / (mu w) level, with the pulling force P and the tether's weight w [N/m].
    """
    if pipe.heading is Heading.upright:
        return pull.low / weight, pull.high / weight
    return carried(pull.low, weight * friction[1]), carried(pull.high, weight * friction[0])


def carried(pull: float, rate: float) -> float:
    """Return the length [m] at which a tension that grows by `rate` [N/m] reaches `pull` [N]."""
    if pull == 0.0:
        return 0.0
    return pull / rate if rate > 0.0 else math.inf
