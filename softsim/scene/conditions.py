"""Conditions on node sets and rigid bodies."""

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from softsim.scene.profiles import LengthProfile, VelocityProfile
from softsim.scene.quantities import (
    AT_REST,
    AngularVelocityOrVector,
    Axis,
    Point,
    PositiveMass,
    SetReference,
    Spec,
    Text,
    VelocityVector,
)


class Fixed(Spec):
    """Fixed nodes."""

    kind: Literal["fixed"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "beam.left".')
    directions: tuple[Axis, ...] | None = Field(
        default=None, min_length=1, description="Fixed components. Default: all."
    )


class Symmetry(Spec):
    """Nodes on a plane of symmetry, which stay in the plane."""

    kind: Literal["symmetry"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "block.left".')
    normal: Axis = Field(description="Normal of the plane.")


class _Moved(Spec):
    """A motion along one direction, given by its displacement or by its velocity over time."""

    displacement: LengthProfile | None = Field(
        default=None, description="Displacement over time, starting at zero."
    )
    velocity: VelocityProfile | None = Field(
        default=None, description="Velocity over time, instead of the displacement."
    )

    @model_validator(mode="after")
    def _is_moved_once(self) -> "_Moved":
        if (self.displacement is None) == (self.velocity is None):
            raise ValueError("needs either a displacement or a velocity: give one of them")
        return self


class Prescribed(_Moved):
    """Prescribed motion of nodes along one direction."""

    kind: Literal["prescribed"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "block.right".')
    direction: Axis = Field(description="Component that is prescribed.")


class RigidMotionSpec(_Moved):
    """Prescribed motion of a rigid body's centre along one direction, for example of the plate of
    a press. The other degrees of freedom stay free.
    """

    kind: Literal["rigid_motion"] = Field(description="Kind of condition.")
    body: Text = Field(description="Name of the rigid body.")
    direction: Axis = Field(description="Direction of the motion.")


class WallMotion(_Moved):
    """Prescribed motion of a wall along one direction, for example of a press or a
    shaking ground.
    """

    kind: Literal["wall_motion"] = Field(description="Kind of condition.")
    wall: Text = Field(description="Name of the wall in `environment.walls`.")
    direction: Axis = Field(description="Direction of the motion.")


class PointMass(Spec):
    """Mass added to nodes in equal parts, without rotational inertia."""

    kind: Literal["point_mass"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "beam.tip".')
    mass: PositiveMass = Field(description="Total mass of the set.")


class InitialVelocity(Spec):
    """Initial velocity v + omega x (x - c) of nodes, as of a rigid motion. It
    replaces the initial velocity of their body.
    """

    kind: Literal["initial_velocity"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "bar.end".')
    velocity: VelocityVector = Field(default=AT_REST, description="Velocity v.")
    angular_velocity: AngularVelocityOrVector | None = Field(
        default=None,
        description="Angular velocity omega: about z, or in 3D a vector. Not in an axisymmetric "
        "model.",
    )
    about: Point | None = Field(
        default=None,
        description="Point c, which moves with v. Default: centre of mass of the set.",
    )

    @field_validator("about")
    @classmethod
    def _turns_about_it(
        cls, about: tuple[float, ...] | None, info: ValidationInfo
    ) -> tuple[float, ...] | None:
        if about is not None and info.data.get("angular_velocity", 0.0) is None:
            raise ValueError("has no effect without angular_velocity")
        return about

    @model_validator(mode="after")
    def _says_a_motion(self) -> "InitialVelocity":
        if not self.model_fields_set & {"velocity", "angular_velocity"}:
            raise ValueError("gives no motion: give velocity, angular_velocity or both")
        return self


Condition = Annotated[
    Fixed | Symmetry | Prescribed | RigidMotionSpec | WallMotion | PointMass | InitialVelocity,
    Field(discriminator="kind"),
]
