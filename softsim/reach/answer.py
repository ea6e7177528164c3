"""How far a robot gets along a layout: where the tension of its tether exceeds what it can pull.

A trial says what it pulls level, against friction, and upright, against weight. In between a layout
asks for both: of the tension T the part R hangs and pulls at rest too (reach/tension.py), and the
robot lifts its own weight by the sine of the inclination. Taken is the pull

    P = P_level + h (P_upright - P_level),   h = max(R / T, sin(beta), 0)

which is what trials found at both ends, and an assumption between them. Where the pipe narrows or
widens the lower of the pulls at both ends of that segment counts.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from softsim.reach.pull import Bracket
from softsim.reach.tension import Tension, Tether, Way, radii, rises, tension_along
from softsim.reach.trials import Heading, TrialPipe

Pulls = Mapping[TrialPipe, Bracket]
ALIKE = 1e-6  # shares of upright below this are level


@dataclass(frozen=True, eq=False)
class Load:
    """What a way asks of a robot, at the same places: the tension, and h (n,) [-]."""

    tension: Tension
    uprightness: np.ndarray


@dataclass(frozen=True)
class Distance:
    """How far a robot gets [m] on the way to an exit, at least and at most; length of the way."""

    exit: str
    least: float
    most: float
    length: float

    @property
    def sentence(self) -> str:
        """In words."""
        to = f"of {self.length:.3g} m to the exit '{self.exit}'"
        if self.least >= self.length:
            return f"the robot gets all the way {to}"
        if self.most >= self.length:
            return f"the robot gets at least {self.least:.3g} m {to}, and possibly all the way"
        return f"the robot gets {self.least:.3g} to {self.most:.3g} m {to}"


def load_of(way: Way, tether: Tether, down: np.ndarray) -> Load:
    """What a way asks of a robot with a tether."""
    tension = tension_along(way, tether, down)
    drawing, holding = tension.drawing, tension.holding
    hanging = np.divide(holding, drawing, out=np.zeros(len(drawing)), where=drawing > 0.0)
    share = np.clip(np.maximum(hanging, rises(way, down)), 0.0, 1.0)
    return Load(tension, np.where(share < ALIKE, 0.0, np.where(share > 1.0 - ALIKE, 1.0, share)))


def needed(way: Way, loads: Iterable[Load]) -> set[TrialPipe]:
    """The trials that decide how far a robot gets along a way."""
    found = set()
    for load in loads:
        for both, share in zip(radii(way), load.uprightness, strict=True):
            for radius in both:
                found |= {TrialPipe(diameter(radius), heading) for heading in weights(share)}
    return found


def weights(share: float) -> dict[Heading, float]:
    """How much the pull of each heading counts, of those that do."""
    both = {Heading.level: 1.0 - share, Heading.upright: share}
    return {heading: weight for heading, weight in both.items() if weight > 0.0}


def diameter(radius: float) -> float:
    """Of a pipe [m], rounded to a nanometre."""
    return round(2.0 * radius, 9)


def pulls_along(way: Way, load: Load, pulls: Mapping[TrialPipe, float]) -> np.ndarray:
    """What a robot can pull (n,) [N] at the places of a way."""
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
    """Arc length [m] up to which the tension does not exceed the pull, (n,) each; linear between
    places.
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


def distance(way: Way, loads: tuple[Load, Load], pulls: Pulls) -> Distance:
    """Along a way, at least with the lower and at most with the higher pulls. loads: with the least
    and with the most friction. More of it asks for more, but hangs less: either may be the worse.
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
    """The same in a long straight pipe [m]: P / w upright, P / (mu w) level."""
    if pipe.heading is Heading.upright:
        return pull.low / weight, pull.high / weight
    return carried(pull.low, weight * friction[1]), carried(pull.high, weight * friction[0])


def carried(pull: float, rate: float) -> float:
    """Length [m] at which a tension that grows by `rate` [N/m] reaches a pull [N]."""
    if pull == 0.0:
        return 0.0
    return pull / rate if rate > 0.0 else math.inf
