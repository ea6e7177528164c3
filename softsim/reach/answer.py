"""Distance that a robot travels in a layout until the tether tension exceeds its pulling force.

Trials give the pulling force in a level pipe, against friction, and in an upright pipe, against
weight. Other pipes need both: the part R of the tension T is hanging weight that acts at rest too
(reach/tension.py), and the robot lifts its own weight by the sine of the inclination. The pulling
force is

    P = P_level + h (P_upright - P_level),   h = max(R / T, sin(beta), 0)

which is the result of trials at both ends, and an assumption between them. In a segment with a
change of diameter the lower of the pulling forces at both ends applies.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from softsim.reach.tension import (
    Bracket,
    Tension,
    TetherProperties,
    Way,
    radii,
    rises,
    tension_along,
)
from softsim.reach.trials import Heading, TrialPipe

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
