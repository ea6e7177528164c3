"""Outlines of rigid bodies, which move with them: gap and normal seen from outside."""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import real_field, vector_field
from softsim.rigid.frame import RigidBodies


@ti.data_oriented
class MovingFrame:
    """The axes of rigid body number `body`, in which its outline stands still."""

    count = 1

    def __init__(self, bodies: RigidBodies, body: int, centre: np.ndarray) -> None:
        self.bodies, self.body = bodies, body
        self.centre = vector_field(np.asarray(centre)[None])

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps: none, the body has its own."""
        return {}

    @ti.func
    def may_touch(self, s, i, q):
        """Whether contact node number i at q may touch: its gap is as cheap."""
        return 1

    @ti.func
    def local_position(self, s, x):
        """Place in the body's axes [m]."""
        return self.bodies.to_body(s, self.body, x - self.bodies.centre[s, self.body])

    @ti.func
    def relative_velocity(self, s, x, v):
        """Velocity relative to the body's material point at x, in the body's axes [m/s]."""
        return self.bodies.to_body(s, self.body, v - self.bodies.velocity_at(s, self.body, x))

    @ti.func
    def global_vector(self, s, f):
        """A vector of the body's axes in space."""
        return self.bodies.to_space(s, self.body, f)


@dataclass(frozen=True)
class CylinderShape:
    """A capped cylinder about coordinate number `axis`; in the plane a rectangle [m]."""

    axis: int
    half_length: float
    radius: float

    def gap(self, arms: np.ndarray) -> np.ndarray:
        """Signed gap [m] of places (n, d) relative to its centre."""
        across = np.delete(arms, self.axis, axis=1)
        side = np.linalg.norm(across, axis=1) - self.radius
        return np.maximum(side, np.abs(arms[:, self.axis]) - self.half_length)

    def obstacle(self, bodies: RigidBodies, body: int, centre: np.ndarray) -> "Cylinder":
        """In kernels, on rigid body number `body`; centre: (d,) [m] in the body's own axes,
        measured from its centre of mass.
        """
        return Cylinder(bodies, body, centre, self)


@ti.data_oriented
class Cylinder(MovingFrame):
    """A capped cylinder: in the plane a rectangle, in a half section too (axis y).

    centre: (d,) in the body's own axes, measured from its centre of mass [m].
    """

    def __init__(
        self, bodies: RigidBodies, body: int, centre: np.ndarray, shape: CylinderShape
    ) -> None:
        super().__init__(bodies, body, centre)
        self.axis = shape.axis
        self.half_length = real_field(np.array([shape.half_length]))
        self.radius = real_field(np.array([shape.radius]))

    @ti.func
    def gap_and_normal(self, s, i, w, q):
        """Signed gap to the nearer of side and cap [m] (the edge between them is no case of its
        own: a soft skin lies on the sides) and its outward normal, both in the body's axes.
        """
        d = q - self.centre[0]
        along = d[self.axis]
        d[self.axis] = 0.0
        distance = d.norm()
        gap = distance - self.radius[0]
        normal = d / ti.max(distance, 1e-12)
        if ti.abs(along) - self.half_length[0] > gap:
            gap = ti.abs(along) - self.half_length[0]
            normal = ti.Vector.zero(backend.real, self.bodies.dimension)
            normal[self.axis] = ti.math.sign(along)
        return gap, normal


@dataclass(frozen=True)
class BallShape:
    """A ball; in the plane a disc [m]."""

    radius: float

    def gap(self, arms: np.ndarray) -> np.ndarray:
        """Signed gap [m] of places (n, d) relative to its centre."""
        return np.linalg.norm(arms, axis=1) - self.radius

    def obstacle(self, bodies: RigidBodies, body: int, centre: np.ndarray) -> "Ball":
        """In kernels, on rigid body number `body`; centre: (d,) [m] in the body's own axes,
        measured from its centre of mass.
        """
        return Ball(bodies, body, centre, self)


@ti.data_oriented
class Ball(MovingFrame):
    """A ball: in the plane a disc, in a half section a ball on the axis."""

    def __init__(
        self, bodies: RigidBodies, body: int, centre: np.ndarray, shape: BallShape
    ) -> None:
        super().__init__(bodies, body, centre)
        self.radius = real_field(np.array([shape.radius]))

    @ti.func
    def gap_and_normal(self, s, i, w, q):
        """Signed gap [m] and the outward normal."""
        d = q - self.centre[0]
        distance = d.norm()
        return distance - self.radius[0], d / ti.max(distance, 1e-12)


Shape = CylinderShape | BallShape
