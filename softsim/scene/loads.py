"""Loads: of chambers (scene/chambers.py), motors, forces, tendons, tethers, pulled cables."""

from typing import Annotated, Any, Generic, Literal, TypeVar

from pydantic import Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from softsim.scene.chambers import AddedGas, AddedVolume, FollowerPressure, Pneumatic
from softsim.scene.part import ORIGIN, Part, told_by_presence
from softsim.scene.profiles import (
    FactorProfile,
    ForceDensityProfile,
    ForceProfile,
    LengthProfile,
    StressProfile,
)
from softsim.scene.quantities import (
    Angle,
    AutoOrPositiveStiffness,
    AxisVector,
    Direction,
    ForceDensityVector,
    ForceVector,
    NotNegativeForce,
    NotNegativeLength,
    NotNegativeTime,
    NotNegativeTurningStiffness,
    Number,
    Point,
    PositiveForce,
    PositiveFrequency,
    PositiveLength,
    PositiveMass,
    PositiveStiffness,
    SetReference,
    StressVector,
    Text,
    written,
)

P = TypeVar("P")


class EccentricMass(Part):
    """A vibration motor: force m_e r_e omega^2, rotating about an axis that goes with its body."""

    kind: Literal["eccentric_mass"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body that carries the motor.")
    eccentric_mass: PositiveMass = Field(description="m_e; its weight is part of the body's.")
    radius: PositiveLength = Field(description="r_e, of the mass from the motor's axis.")
    frequency: PositiveFrequency = Field(description="Turns in a second.")
    rotation_axis: AxisVector = Field(
        default=written("x"),
        description="x: turns across the pipe, the section sees the y part; z: turns in the "
        "section; or three numbers along it, such as [1, 0, 1].",
    )
    sense: Literal[1, -1] = Field(
        default=1,
        description="1: turns positively about its axis (right-hand rule), from y to z about x, "
        "from x to y about z; -1: the other way.",
    )
    factor: Number = Field(
        default=1.0, gt=0.0, description="Force on the plane model over the motor's."
    )
    spin_up: NotNegativeTime = Field(
        default=written("50 ms"), description="Time to full speed, smooth."
    )
    phase: Angle = Field(
        default=written("0 deg"),
        description="Angle at the start, the way it turns: about x from y on, about y from z on, "
        "about z from x on.",
    )


class SinusoidalForce(Part):
    """A force of given amplitude along a fixed direction."""

    kind: Literal["sinusoidal_force"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body that it acts on, at the centre of mass.")
    amplitude: PositiveForce = Field(description="Largest force.")
    direction: Direction = Field(
        default=(0.0, 1.0), description="Direction; its length does not matter."
    )
    frequency: PositiveFrequency = Field(description="Frequency.")
    spin_up: NotNegativeTime = Field(
        default=written("50 ms"), description="Time to full speed, smooth."
    )
    phase: Angle = Field(default=written("0 deg"), description="Angle at the start.")


class OverTime(Part):
    """A load of a given full value that may rise, or swing, over time."""

    ramp: NotNegativeTime = Field(
        default=written("0 s"), description="Time to the full load, smooth."
    )
    profile: FactorProfile | None = Field(
        default=None, description="Factor of the full load over time, such as {kind: sine, "
        "frequency: 20 Hz}; instead of the ramp. Values with units go with `direction`, in place "
        "of the full load."
    )  # fmt: skip

    @field_validator("profile")
    @classmethod
    def _one_of_both(cls, profile: Any, info: ValidationInfo) -> Any:
        if profile is not None and info.data.get("ramp", 0.0) != 0.0:
            raise ValueError("does not go with ramp: both say how the load rises")
        return profile


class Directed(Part, Generic[P]):
    """A load along a direction, whose size over time is a profile of values with units."""

    direction: Direction = Field(
        description="Direction of positive values; its length does not matter."
    )
    profile: P = Field(
        description="Size over time, such as {kind: sine, amplitude: 10 mN, frequency: 20 Hz} of a "
        "force."
    )


class _OfNodes(Part):
    kind: Literal["nodal_force"] = Field(description="Kind of load.")
    nodes: SetReference = Field(description='Node set, such as "block.top".')


class NodalForce(_OfNodes, OverTime):
    """A force on a node set, shared by mass."""

    force: ForceVector = Field(description="Total force on the set.")


class DirectedNodalForce(_OfNodes, Directed[ForceProfile]):
    """A force on a node set, shared by mass, along a direction."""


class _OfFacets(Part):
    kind: Literal["surface_traction"] = Field(description="Kind of load.")
    facets: tuple[SetReference, ...] = Field(
        min_length=1, description="Facet sets, such as [block.top]."
    )


class SurfaceTraction(_OfFacets, OverTime):
    """A force per area at rest that keeps its direction and size, however the surface moves: a
    dead load (ABAQUS: TRVEC without following).
    """

    traction: StressVector = Field(description="Force per area at rest.")


class DirectedTraction(_OfFacets, Directed[StressProfile]):
    """A force per area at rest along a direction, whatever the surface does: a dead load."""


class _OfBodies(Part):
    kind: Literal["body_force"] = Field(description="Kind of load.")
    bodies: tuple[Text, ...] = Field(min_length=1, description="Bodies, by name.")


class BodyForce(_OfBodies, OverTime):
    """A force per volume at rest that keeps its direction."""

    density: ForceDensityVector = Field(description="Force per volume at rest.")


class DirectedBodyForce(_OfBodies, Directed[ForceDensityProfile]):
    """A force per volume at rest along a direction."""


class _OfRigidBody(Part):
    kind: Literal["rigid_force"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body.")


class RigidForce(_OfRigidBody, OverTime):
    """A force of constant direction on a rigid body, at its centre of mass."""

    force: ForceVector = Field(description="The force.")


class DirectedRigidForce(_OfRigidBody, Directed[ForceProfile]):
    """A force along a direction on a rigid body, at its centre of mass."""


class AxialRelief(Part):
    """Takes a share of the robot's weight along the body's own axis x off it: for a plane section
    that has fewer of the robot's spikes along the axis than across it.
    """

    kind: Literal["axial_relief"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body whose axis it is, and on which it acts.")
    share: Number = Field(
        gt=0.0, lt=1.0, description="Of the weight of all bodies together; 0.5 where the section "
        "has half of the spikes."
    )  # fmt: skip


class Tendon(Part):
    """A tendon from a rigid body to a force gauge far away: a spring that pulls and never pushes.
    The history gets a column `pull`, the tension of the first tendon.
    """

    kind: Literal["tendon"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body that it holds, at the centre of mass.")
    stiffness: PositiveStiffness = Field(
        default=written("2 N/mm"), description="Tension over elongation, the gauge's own included."
    )
    direction: Direction = Field(
        default=(-1.0, 0.0), description="From the body to the gauge; its length does not matter."
    )
    slack: NotNegativeLength = Field(
        default=written("0 mm"), description="Way of the body until the tendon is taut."
    )


class Tether(Part):
    """What a robot trails behind it along its own axis x, such as a tube with wires: friction along
    that axis, weight, stiffness against turning. It acts at all times, before t = 0 too. The
    history gets a column `tether_drag`, the drag of the first tether, positive against the way
    forward.
    """

    kind: Literal["tether"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body that trails it.")
    drag: NotNegativeForce = Field(
        description="Coulomb friction along the body's own x, in whichever sense it moves; at rest "
        "it holds up to this. Across x the tether is limp."
    )
    stiffness: AutoOrPositiveStiffness = Field(
        default="auto", description="Drag over the elastic way on which it builds up; auto: that "
        "way is 0.1 mm."
    )  # fmt: skip
    at: Point = Field(
        default=ORIGIN,
        description="Where it is attached, from the body's centre, in the body's axes; the centre "
        "by default, where drag and weight do not turn the body.",
    )
    weight: NotNegativeForce = Field(
        default=written("0 N"),
        description="Of the part that hangs on the body, along gravity (none where that is 0).",
    )
    pitch_stiffness: NotNegativeTurningStiffness = Field(
        default=written("0 N*mm/rad"),
        description="Torque over small angles against turning about z, from the orientation at "
        "rest: K sin(angle).",
    )
    yaw_stiffness: NotNegativeTurningStiffness = Field(
        default=written("0 N*mm/rad"), description="The same about y, in space only."
    )
    roll_stiffness: NotNegativeTurningStiffness = Field(
        default=written("0 N*mm/rad"), description="The same about x, in space only."
    )


class PulledCable(OverTime):
    """A cable without mass that slides without friction through eyelets in bodies, and is pulled at
    its end: drawn in by `pull`, or with a `tension`. It never pushes. The history gets columns
    NAME_tension and NAME_drawn_in.
    """

    kind: Literal["pulled_cable"] = Field(description="Kind of load.")
    eyelets: tuple[Point, ...] = Field(
        min_length=2,
        description="Places of its eyelets at rest, one after the other, each in a body, which "
        "needs no node there. Here the cable is as long as it is unstretched.",
    )
    pulled_from: Point | None = Field(
        default=None,
        description="Place fixed in space to which it goes on from the first eyelet. Without one "
        "it ends there, in a sheath that is fixed to the body.",
    )
    tolerance: PositiveLength | None = Field(
        default=None,
        description="How far an eyelet may lie outside its body, onto which it is moved; by "
        "default 5 % of the mean side of the facets of its surface.",
    )
    pull: PositiveLength | None = Field(
        default=None, description="Length of it that is drawn in, times the profile."
    )
    pull_profile: LengthProfile | None = Field(
        default=None, description="Length of it that is drawn in, over time; in place of pull."
    )
    stiffness: PositiveStiffness | None = Field(
        default=None, description="Tension over elongation of the whole cable, where it is drawn "
        "in."
    )  # fmt: skip
    tension: PositiveForce | None = Field(
        default=None, description="Its tension, times the profile."
    )
    tension_profile: ForceProfile | None = Field(
        default=None, description="Its tension over time; in place of tension."
    )

    @model_validator(mode="after")
    def _is_driven_once(self) -> "PulledCable":
        drives = ("pull", "pull_profile", "tension", "tension_profile")
        given = [key for key in drives if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError(
                "is driven by either a pull or a tension: give one of " + ", ".join(drives)
            )
        if given[0].startswith("pull") != (self.stiffness is not None):
            raise ValueError("needs a stiffness where it is drawn in by a pull, and only there")
        if given[0].endswith("_profile") and (self.profile is not None or self.ramp != 0.0):
            raise ValueError(
                f"{given[0]} has the values over time: leave out profile and ramp, which are of a "
                "pull or a tension of full value"
            )
        return self


def _by_direction(otherwise: str) -> Discriminator:
    """Tell a load whose profile has values in units from one whose profile has factors."""
    return told_by_presence("direction", ("direction",), otherwise)


NodalLoad = Annotated[
    Annotated[NodalForce, Tag("force")] | Annotated[DirectedNodalForce, Tag("direction")],
    _by_direction("force"),
]
SurfaceLoad = Annotated[
    Annotated[SurfaceTraction, Tag("traction")] | Annotated[DirectedTraction, Tag("direction")],
    _by_direction("traction"),
]
BodyLoad = Annotated[
    Annotated[BodyForce, Tag("density")] | Annotated[DirectedBodyForce, Tag("direction")],
    _by_direction("density"),
]
RigidLoad = Annotated[
    Annotated[RigidForce, Tag("force")] | Annotated[DirectedRigidForce, Tag("direction")],
    _by_direction("force"),
]
Load = Annotated[
    FollowerPressure
    | AddedVolume
    | AddedGas
    | Pneumatic
    | EccentricMass
    | SinusoidalForce
    | NodalLoad
    | SurfaceLoad
    | BodyLoad
    | RigidLoad
    | AxialRelief
    | Tendon
    | Tether
    | PulledCable,
    Field(discriminator="kind"),
]
