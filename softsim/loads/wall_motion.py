"""Moving walls: a wall of any kind, displaced along one axis over time."""

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
    """Wall `wall`, displaced along coordinate number `axis` by `displacement` [m over s] from rest.

    The history records the force that moves it, averaged over the interval.
    """

    wall: Wall
    axis: int
    displacement: Own[Profile]

    @property
    def names(self) -> tuple[str, ...]:
        return self.wall.names

    @property
    def columns(self) -> dict[str, str]:
        """Column of the force that moves the wall -> unit."""
        return {force_column(self.names[0]): "N"}

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the signed gaps (n,) [m] of x (n, d) to the surfaces at rest, by name."""
        return self.wall.gaps(x)

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Return a lower bound (n,) [m] of the gap at any time.

        A gap changes by at most `steepest` times the displacement.
        """
        farthest = float(np.abs(self.displacement.values).max())
        return self.wall.least_gap(x) - self.steepest() * farthest

    def steepest(self) -> float:
        return self.wall.steepest()

    def thickness(self) -> float:
        return self.wall.thickness()

    def obstacle(self, alike: Sequence["MovingWall"], places: np.ndarray) -> Obstacle:
        """Return the kernel class of the wall, in the axes of the moving frame."""
        return self.wall.obstacle([moving.wall for moving in alike], places)

    def frame(self, alike: Sequence["MovingWall"]) -> "MovingFrame":
        """Return the axes that move with the wall."""
        table = ProfileTable([moving.displacement for moving in alike])
        return MovingFrame(force_column(self.names[0]), self.axis, table, len(alike))

    def offset(self, time: float) -> np.ndarray:
        """Return the displacement (3,) [m] at a time [s]; zero before t = 0."""
        return np.eye(3)[self.axis] * float(self.displacement.at(max(time, 0.0)))

    def time_scaled(self, factor: float) -> "MovingWall":
        return replace(self, displacement=self.displacement.time_scaled(factor))

    def touched_at_once(self) -> tuple[float, float]:
        return self.wall.touched_at_once()

    def corners(self) -> np.ndarray:
        return self.wall.corners()

    def drawn(self) -> dict[str, np.ndarray]:
        return self.wall.drawn()


def force_column(surface: str) -> str:
    """Return the name of the column with the force that moves the wall of a surface."""
    return f"{surface.partition('.')[0]}_drive_force"


class MovingFrame(FixedFrame):
    """Axes whose origin is displaced along `axis` by `table` [m over s], without rotation.

    With the forces F of its surfaces on the bodies in contact, the motion does the work F . u,
    summed by the trapezoidal rule as in the energy balance of the contact. Fields (scenarios,):
    present offset [m], displacement of the last step [m], speed in it [m/s], work [J] up to its
    middle.
    """

    def __init__(self, column: str, axis: int, table: ProfileTable, scenarios: int) -> None:
        self.column, self.axis, self.table = column, axis, table
        nothing = np.zeros(scenarios)
        self.offset, self.way, self.speed, self.work = (real_field(nothing) for _ in range(4))
        self.contacts: list[NodalForces] = []

    def carry(self, contact: NodalForces) -> None:
        """Register a contact of the surfaces."""
        self.contacts.append(contact)

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.STEER: [Pass("loads", 1, (self.steer,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        return {
            "wall_offset": self.offset,
            "wall_way": self.way,
            "wall_speed": self.speed,
            "wall_work": self.work,
        }

    def forget_work(self) -> None:
        fields.write(self.work, 0.0)

    def readings(self, scenario: int, interval: float) -> dict[str, float]:
        """Return the mean force that moves the wall [N]: the force of the wall on the bodies."""
        rows = [fields.read_row(contact.impulse, scenario) for contact in self.contacts]
        impulse = sum(row[:, self.axis].sum() for row in rows)
        return {self.column: float(impulse) / interval if interval > 0.0 else 0.0}

    @ti.func
    def steer(self, s, i, t, dt):
        """Move the frame to its position at the end t of the step, before nodes and bodies move."""
        offset = self.table.at(s, t)
        way = offset - self.offset[s]
        force = self._force(s)
        self.work[s] = self.work[s] + 0.5 * force * (self.way[s] + way)
        self.offset[s], self.way[s], self.speed[s] = offset, way, way / dt

    @ti.func
    def work_done(self, s, part):
        """Return the work of the motion so far [J]; its last half step has the present force."""
        work = ti.cast(0.0, backend.real)
        if part == 0:
            work = self.work[s] + 0.5 * self._force(s) * self.way[s]
        return work

    @ti.func
    def _force(self, s):
        """Return the present force of all contacts along the axis [N]."""
        force = ti.cast(0.0, backend.real)
        for contact in ti.static(self.contacts):
            force += contact.total_force(s)[self.axis]
        return force

    @ti.func
    def local_position(self, s, x):
        """Return a place x (d) in the frame's axes [m]."""
        q = x
        q[self.axis] -= self.offset[s]
        return q

    @ti.func
    def relative_velocity(self, s, x, v):
        """Return the velocity relative to the frame [m/s]."""
        u = v
        u[self.axis] -= self.speed[s]
        return u
