"""Conditions on node sets and rigid bodies."""

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from softsim.scene.part import AT_REST, Part
from softsim.scene.profiles import LengthProfile, VelocityProfile
from softsim.scene.quantities import (
    AngularVelocityOrVector,
    Axis,
    Point,
    PositiveMass,
    SetReference,
    Text,
    VelocityVector,
)


class Fixed(Part):
    """Nodes held in place."""

    kind: Literal["fixed"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "beam.left".')
    directions: tuple[Axis, ...] | None = Field(
        default=None, min_length=1, description="Which components; all by default."
    )


class Symmetry(Part):
    """Nodes on a plane of symmetry: they stay in it."""

    kind: Literal["symmetry"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "block.left".')
    normal: Axis = Field(description="Direction across the plane.")


class _Moved(Part):
    """A motion along one direction, given by its displacement or by its velocity over time."""

    displacement: LengthProfile | None = Field(
        default=None, description="Displacement over time, from zero."
    )
    velocity: VelocityProfile | None = Field(
        default=None, description="Velocity over time, in place of the displacement."
    )

    @model_validator(mode="after")
    def _is_moved_once(self) -> "_Moved":
        if (self.displacement is None) == (self.velocity is None):
            raise ValueError("is moved by a displacement or a velocity: give one of them")
        return self


class Prescribed(_Moved):
    """Nodes of which one component follows a profile."""

    kind: Literal["prescribed"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "block.right".')
    direction: Axis = Field(description="Component that is prescribed.")


class RigidMotion(_Moved):
    """A rigid body of which the centre follows a profile along one direction, such as a plate of a
    press; it stays free otherwise.
    """

    kind: Literal["rigid_motion"] = Field(description="Kind of condition.")
    body: Text = Field(description="Rigid body.")
    direction: Axis = Field(description="Direction along which it is moved.")


class WallMotion(_Moved):
    """A wall of any kind that is displaced along one direction, such as a press or a shaking
    ground.
    """

    kind: Literal["wall_motion"] = Field(description="Kind of condition.")
    wall: Text = Field(description="Wall, by its name in environment.walls.")
    direction: Axis = Field(description="Direction along which it is moved.")


class PointMass(Part):
    """A mass on nodes, shared equally, without inertia of its own against turning."""

    kind: Literal["point_mass"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "beam.tip".')
    mass: PositiveMass = Field(description="In all.")


class InitialVelocity(Part):
    """Nodes that start with the velocity v + omega x (x - c) of a rigid motion; it replaces that of
    their body.
    """

    kind: Literal["initial_velocity"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "bar.end".')
    velocity: VelocityVector = Field(default=AT_REST, description="v, at the start.")
    angular_velocity: AngularVelocityOrVector | None = Field(
        default=None,
        description="omega: about z, or in space a vector. Not in an axisymmetric model.",
    )
    about: Point | None = Field(
        default=None,
        description="c, the point that moves with v; by default the set's centre of mass.",
    )

    @field_validator("about")
    @classmethod
    def _turns_about_it(
        cls, about: tuple[float, ...] | None, info: ValidationInfo
    ) -> tuple[float, ...] | None:
        if about is not None and info.data.get("angular_velocity", 0.0) is None:
            raise ValueError("means nothing without angular_velocity")
        return about

    @model_validator(mode="after")
    def _says_a_motion(self) -> "InitialVelocity":
        if not self.model_fields_set & {"velocity", "angular_velocity"}:
            raise ValueError("gives no motion: give velocity, angular_velocity or both")
        return self


Condition = Annotated[
    Fixed | Symmetry | Prescribed | RigidMotion | WallMotion | PointMass | InitialVelocity,
    Field(discriminator="kind"),
]
