"""Interface of walls: their geometry in numpy, and their obstacles in kernels."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import real_field
from softsim.compute.term import Pass, PerScenario, Samples, Stage

# -------------------------------------------------------------------------------------------------
# Axes in which a wall or an outline is at rest, as contact needs them: here those of space.


class FixedFrame:
    """Axes of space; the base class of frames that move.

    A moving frame defines its motion and the work that it does.
    """

    def carry(self, contact: Any) -> None:
        """Register the contact whose forces do work when the frame moves."""

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the passes of an increment that move the frame."""
        return {}

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {}

    def speeds(self) -> list[ti.Field]:
        """Return the fields (scenarios,) of the speeds [m/s] of the motion."""
        return []

    def forget_work(self) -> None:
        """Set the work of the motion to zero."""

    def sampled(self) -> list[ti.Field]:
        """Return the fields that `readings` reads."""
        return []

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the columns of the history (rows,) from samples of the fields in `sampled`."""
        return {}

    @ti.func
    def work_done(self, s, part):
        """Return the work of the motion so far [J]."""
        return ti.cast(0.0, backend.real)

    @ti.func
    def local_position(self, s, x):
        """Return a position x (d) [m] in the frame's axes."""
        return x

    @ti.func
    def relative_velocity(self, s, x, v):
        """Return the velocity [m/s] relative to the frame's point at x, in the frame's axes."""
        return v

    @ti.func
    def global_vector(self, s, f):
        """Return a vector of the frame's axes in the axes of space."""
        return f


class Wall(ABC):
    """Surfaces of one kind, free on one side, in the axes of their frame."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the surfaces; before a dot, if any, the name of the wall in the scene."""

    @abstractmethod
    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the signed gap (n,) [m] of points x (n, d) to each surface, negative inside."""

    @abstractmethod
    def obstacle(self, scenarios: Sequence[Any], places: np.ndarray) -> "Obstacle":
        """Return the obstacle of the wall in kernels.

        scenarios: this wall in every scenario, this one first. places: positions of the contact
        nodes at the start (k, d) [m].
        """

    def steepest(self) -> float:
        """Return the largest slope |grad g| of the gap, 1 where it is a distance."""
        return 1.0

    def band(self) -> float:
        """Return the largest gap [m] that is exact; infinite unless a grid represents the wall."""
        return float("inf")

    def thickness(self) -> float:
        """Return the smallest thickness [m] of the wall.

        A node deeper than half of it leaves on the other side. Infinite where that cannot happen or
        is not known.
        """
        return float("inf")

    def frame(self, scenarios: Sequence[Any]) -> FixedFrame:
        """Return the axes in which the wall is at rest: those of space, unless it moves."""
        return FixedFrame()

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Return a lower bound (n,) [m] of the gap of points x (n, d) at any time."""
        return np.asarray(np.min(list(self.gaps(x).values()), axis=0))

    def offset(self, time: float) -> np.ndarray:
        """Return the displacement (3,) [m] of the wall from its rest position at a time [s]."""
        return np.zeros(3)

    def time_scaled(self, factor: float) -> "Wall":
        """Return the wall with its time history, if it has one, `factor` times as fast."""
        return self

    @property
    def columns(self) -> dict[str, str]:
        """Columns that the contact with this wall adds to the history -> unit."""
        return {}

    def touched_at_once(self) -> tuple[float, float]:
        """Return the number of surfaces that a node can touch at once, and an eigenvalue bound.

        The second is an upper bound of the largest eigenvalue of the sum of n (x) n over their
        normals n; both are multiplied by the slope |grad g| of the gap where that is not 1.
        """
        return len(self.names), float(len(self.names))

    def corners(self) -> np.ndarray:
        """Return the convex corners (c, d) [m] that may lie between the nodes of a surface.

        Only walls with corners in the plane have some.
        """
        return np.zeros((0, 2))

    @abstractmethod
    def drawn(self) -> dict[str, np.ndarray]:
        """Return the arrays of the wall that a run's results store for the figures.

        Names are documented in output/fields.FieldWriter.describe. Arrays of several walls are
        joined.
        """


class Obstacle:
    """Wall in kernels.

    It has `count` surfaces, each with `gap_and_normal(s, i, w, q)` at a point q in the axes of the
    wall's frame.
    """

    count: int
    gap_and_normal: Any

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the passes of an increment, none for a wall that does not change in its frame."""
        return {}

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores, none for a wall without state."""
        return {}

    @ti.func
    def may_touch(self, s, i, q, reach: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return 0 if the gaps of contact node i at q exceed `reach` [m], now and at the last call.

        Else return 1; 0 saves the computation of the gaps. The last call counts so that the end of
        a contact is noticed. It is called once an increment, so a wall may update its data of the
        node here. reach: the largest gap at which forces act, a
        constant. Walls with a cheap gap always return 1.
        """
        return 1


# -------------------------------------------------------------------------------------------------
# Interference fit: walls that start inside bodies and close on them while bodies settle.


@dataclass(frozen=True, eq=False)
class FittedWall(Wall):
    """Wall that starts moved back by the overlap with the bodies and closes while they settle.

    Its surfaces are moved back by `overlap` (w,) [m] at first, so that they just touch the bodies,
    and return smoothly to their positions from the time `begin` [s] on, within `duration` [s],
    before t = 0.
    """

    wall: Wall
    overlap: PerScenario[np.ndarray]
    begin: PerScenario[float]
    duration: PerScenario[float]

    @property
    def names(self) -> tuple[str, ...]:
        return self.wall.names

    @property
    def columns(self) -> dict[str, str]:
        return self.wall.columns

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the signed gap (n,) [m] of points x (n, d) to each surface before it closes."""
        gaps = self.wall.gaps(x)
        return {
            name: gaps[name] + overlap
            for name, overlap in zip(self.names, self.overlap, strict=True)
        }

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Return a lower bound (n,) [m] of the gap at any time: that of the closed wall."""
        return self.wall.least_gap(x)

    def thickness(self) -> float:
        return self.wall.thickness()

    def steepest(self) -> float:
        return self.wall.steepest()

    def band(self) -> float:
        return self.wall.band()

    def obstacle(self, scenarios: Sequence["FittedWall"], places: np.ndarray) -> "FittedObstacle":
        return FittedObstacle(
            self.wall.obstacle([one.wall for one in scenarios], places), scenarios
        )

    def frame(self, scenarios: Sequence["FittedWall"]) -> FixedFrame:
        return self.wall.frame([one.wall for one in scenarios])

    def touched_at_once(self) -> tuple[float, float]:
        return self.wall.touched_at_once()

    def drawn(self) -> dict[str, np.ndarray]:
        """Return the drawing of the closed wall."""
        return self.wall.drawn()


class FittedObstacle(Obstacle):
    """Obstacle whose surfaces are moved back by `open` times the overlap.

    Fields: open (scenarios,) [-], from 1 to 0; overlap (scenarios, w) [m]; begin, duration
    (scenarios,) [s].
    """

    def __init__(self, obstacle: Obstacle, walls: Sequence[FittedWall]) -> None:
        self.inner, self.count = obstacle, obstacle.count
        self.open = real_field(np.zeros(len(walls)))
        self.overlap = real_field(np.array([wall.overlap for wall in walls]))
        self.begin = real_field(np.array([wall.begin for wall in walls]))
        self.duration = real_field(np.array([wall.duration for wall in walls]))

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the pass that updates `open` before forces are computed."""
        return {Stage.MEASURE: [Pass("contact", 1, (self.close,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the checkpoint fields of the wall, which is closed at t = 0."""
        return self.inner.state_fields()

    @ti.func
    def close(self, s, i, t, dt):
        """Compute the fraction of the overlap that is still open at time t."""
        u = ti.min(ti.max((t - self.begin[s]) / self.duration[s], 0.0), 1.0)
        self.open[s] = ti.cast(1.0 - u * u * (3.0 - 2.0 * u), backend.real)

    @ti.func
    def may_touch(self, s, i, q, reach: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return 1 if a node may touch the closed wall, which is the nearer one."""
        return self.inner.may_touch(s, i, q, reach)

    @ti.func
    def gap_and_normal(self, s, i, w, q):
        """Return the signed gap [m] at q to surface w as it is now, and the unit normal."""
        gap, n = self.inner.gap_and_normal(s, i, w, q)
        return gap + self.open[s] * self.overlap[s, w], n


# -------------------------------------------------------------------------------------------------
# Wall offset by the radius of a round body whose centre line is tested for contact.


@dataclass(frozen=True)
class OffsetWall(Wall):
    """Surfaces of a wall, offset by `radius` [m] into the free side."""

    wall: Wall
    radius: float

    @property
    def names(self) -> tuple[str, ...]:
        return self.wall.names

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the signed gap (n,) [m] of balls of the radius at points x (n, d), by surface."""
        return {name: gap - self.radius for name, gap in self.wall.gaps(x).items()}

    def obstacle(self, scenarios: Sequence["OffsetWall"], places: np.ndarray) -> "OffsetObstacle":
        walls = [one.wall for one in scenarios]
        return OffsetObstacle(self.wall.obstacle(walls, places), self.radius)

    def steepest(self) -> float:
        return self.wall.steepest()

    def band(self) -> float:
        return self.wall.band()

    def frame(self, scenarios: Sequence["OffsetWall"]) -> FixedFrame:
        return self.wall.frame([one.wall for one in scenarios])

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Return a lower bound (n,) [m] of the gap of balls at points x (n, d) at any time."""
        return self.wall.least_gap(x) - self.radius

    def touched_at_once(self) -> tuple[float, float]:
        return self.wall.touched_at_once()

    def drawn(self) -> dict[str, np.ndarray]:
        """Return the drawing of the wall without the offset."""
        return self.wall.drawn()


class OffsetObstacle(Obstacle):
    """Obstacle offset by a radius [m]."""

    def __init__(self, obstacle: Obstacle, radius: float) -> None:
        self.inner, self.radius, self.count = obstacle, radius, obstacle.count

    def passes(self) -> dict[Stage, list[Pass]]:
        return self.inner.passes()

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return self.inner.state_fields()

    @ti.func
    def may_touch(self, s, i, q, reach: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        return self.inner.may_touch(s, i, q, ti.static(reach + self.radius))

    @ti.func
    def gap_and_normal(self, s, i, w, q):
        """Return the signed gap [m] of a ball about q, and the unit normal."""
        gap, n = self.inner.gap_and_normal(s, i, w, q)
        return gap - self.radius, n
