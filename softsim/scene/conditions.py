"""Conditions on node sets and rigid bodies."""

from typing import Annotated, Literal

from pydantic import Field

from softsim.scene.part import Part
from softsim.scene.profiles import LengthProfile
from softsim.scene.quantities import PositiveMass, SetReference, Text, VelocityVector

Axis = Literal["x", "y", "z"]


class Fixed(Part):
    """Nodes held in place."""

    kind: Literal["fixed"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set: "beam.left".')
    directions: tuple[Axis, ...] | None = Field(
        default=None, min_length=1, description="Which components; all by default."
    )


class Symmetry(Part):
    """Nodes on a plane of symmetry: they stay in it."""

    kind: Literal["symmetry"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set: "block.left".')
    normal: Axis = Field(description="Direction across the plane.")


class Prescribed(Part):
    """Nodes of which one component follows a profile."""

    kind: Literal["prescribed"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set: "block.right".')
    direction: Axis = Field(description="Component that is prescribed.")
    displacement: LengthProfile = Field(description="Displacement over time, from zero.")


class RigidMotion(Part):
    """A rigid body of which the centre follows a profile along one direction, such as a plate of a
    press; it stays free otherwise.
    """

    kind: Literal["rigid_motion"] = Field(description="Kind of condition.")
    body: Text = Field(description="Rigid body.")
    direction: Axis = Field(description="Along which it is moved.")
    displacement: LengthProfile = Field(description="Displacement over time, from zero.")


class PointMass(Part):
    """A mass on nodes, shared equally, without inertia of its own against turning."""

    kind: Literal["point_mass"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set: "beam.tip".')
    mass: PositiveMass = Field(description="In all.")


class InitialVelocity(Part):
    """Nodes that start with a velocity; it replaces that of their body."""

    kind: Literal["initial_velocity"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set: "bar.end".')
    velocity: VelocityVector = Field(description="At the start.")


Condition = Annotated[
    Fixed | Symmetry | Prescribed | RigidMotion | PointMass | InitialVelocity,
    Field(discriminator="kind"),
]
