"""Walls that move: a wall of any kind, displaced along one axis over time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.contact.frame import FixedFrame
from softsim.contact.nodal_forces import NodalForces
from softsim.contact.wall import Obstacle, Wall
from softsim.fields import real_field
from softsim.loads.profile import Profile
from softsim.loads.table import ProfileTable
from softsim.sharing import Own
from softsim.term import Pass, Stage


@dataclass(frozen=True, eq=False)
class MovingWall(Wall):
    """`wall`, displaced along coordinate number `axis` by `displacement` [m over s] from where it
    is at rest. The history gets the force that moves it, the mean over the interval.
    """

    wall: Wall
    axis: int
    displacement: Own[Profile]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the surfaces."""
        return self.wall.names

    @property
    def columns(self) -> dict[str, str]:
        """The force that moves it."""
        return {force_column(self.names[0]): "N"}

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Signed gap (n,) [m] of places x (n, d) to each surface at rest, by its name."""
        return self.wall.gaps(x)

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Lower bound (n,) [m] of the gap at any time: a gap changes by no more than the way, or
        `steepest` times it.
        """
        farthest = float(np.abs(self.displacement.values).max())
        return self.wall.least_gap(x) - self.steepest() * farthest

    def steepest(self) -> float:
        """Largest slope |grad g| of the gap."""
        return self.wall.steepest()

    def thickness(self) -> float:
        """As of the wall at rest."""
        return self.wall.thickness()

    def obstacle(self, alike: Sequence["MovingWall"], places: np.ndarray) -> Obstacle:
        """What kernels meet, in the axes of the wall."""
        return self.wall.obstacle([moving.wall for moving in alike], places)

    def frame(self, alike: Sequence["MovingWall"]) -> "MovingFrame":
        """The axes that move with it."""
        table = ProfileTable([moving.displacement for moving in alike])
        return MovingFrame(force_column(self.names[0]), self.axis, table, len(alike))

    def offset(self, time: float) -> np.ndarray:
        """The displacement (3,) [m] at a time [s]; none before t = 0."""
        return np.eye(3)[self.axis] * float(self.displacement.at(max(time, 0.0)))

    def time_scaled(self, factor: float) -> "MovingWall":
        """The wall, moved `factor` times as fast."""
        return replace(self, displacement=self.displacement.time_scaled(factor))

    def touched_at_once(self) -> tuple[float, float]:
        """As of the wall at rest."""
        return self.wall.touched_at_once()

    def corners(self) -> np.ndarray:
        """As of the wall at rest."""
        return self.wall.corners()

    def drawn(self) -> dict[str, np.ndarray]:
        """As of the wall at rest."""
        return self.wall.drawn()


def force_column(surface: str) -> str:
    """Name of the column with the force that moves the wall of a surface."""
    return f"{surface.partition('.')[0]}_drive_force"


class MovingFrame(FixedFrame):
    """Axes whose origin is displaced along `axis` by `table` [m over s], without turning.

    With the forces F of its surfaces on what touches them, the motion does the work F . u, by the
    trapezoidal rule, as the contact's own books do. Fields, (scenarios,): offset now [m], way of
    the last step [m], speed in it [m/s], work [J] up to its middle.
    """

    def __init__(self, column: str, axis: int, table: ProfileTable, scenarios: int) -> None:
        self.column, self.axis, self.table = column, axis, table
        nothing = np.zeros(scenarios)
        self.offset, self.way, self.speed, self.work = (real_field(nothing) for _ in range(4))
        self.contacts: list[NodalForces] = []

    def carry(self, contact: NodalForces) -> None:
        """Note a contact of the surfaces."""
        self.contacts.append(contact)

    def passes(self) -> dict[Stage, list[Pass]]:
        """Moves the frame before everything drifts."""
        return {Stage.STEER: [Pass("loads", 1, (self.steer,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {
            "wall_offset": self.offset,
            "wall_way": self.way,
            "wall_speed": self.speed,
            "wall_work": self.work,
        }

    def forget_work(self) -> None:
        """No work is done before the first increment."""
        fields.write(self.work, 0.0)

    def readings(self, scenario: int, interval: float) -> dict[str, float]:
        """The mean force that moves the wall [N]: what the wall does to others."""
        rows = [fields.read_row(contact.impulse, scenario) for contact in self.contacts]
        impulse = sum(row[:, self.axis].sum() for row in rows)
        return {self.column: float(impulse) / interval if interval > 0.0 else 0.0}

    @ti.func
    def steer(self, s, i, t, dt):
        """Where the frame is at the end t of the step, before everything drifts."""
        offset = self.table.at(s, t)
        way = offset - self.offset[s]
        force = self._force(s)
        self.work[s] = self.work[s] + 0.5 * force * (self.way[s] + way)
        self.offset[s], self.way[s], self.speed[s] = offset, way, way / dt

    @ti.func
    def work_done(self, s, part):
        """Work of the motion so far [J], the last half step with the force of now."""
        work = ti.cast(0.0, backend.real)
        if part == 0:
            work = self.work[s] + 0.5 * self._force(s) * self.way[s]
        return work

    @ti.func
    def _force(self, s):
        """Of all contacts along the axis now [N]."""
        force = ti.cast(0.0, backend.real)
        for contact in ti.static(self.contacts):
            force += contact.total_force(s)[self.axis]
        return force

    @ti.func
    def local_position(self, s, x):
        """A place x (d) in the frame's axes [m]."""
        q = x
        q[self.axis] -= self.offset[s]
        return q

    @ti.func
    def relative_velocity(self, s, x, v):
        """Velocity relative to the frame [m/s]."""
        u = v
        u[self.axis] -= self.speed[s]
        return u
