"""Loads: pressure and chambers, motors, forces, tendons, tethers."""

from itertools import pairwise
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, ValidationInfo, field_validator, model_validator

from softsim.scene.part import ORIGIN, Part
from softsim.scene.profiles import (
    EventCyclesProfile,
    MassProfile,
    PressureProfile,
    ShareProfile,
    VolumeProfile,
    is_ever_suction,
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
    NotNegativePressure,
    NotNegativeTime,
    NotNegativeTurningStiffness,
    NotNegativeVolume,
    Number,
    Point,
    PositiveForce,
    PositiveFrequency,
    PositiveLength,
    PositiveMass,
    PositivePressure,
    PositiveStiffness,
    PositiveViscosity,
    PositiveVolume,
    PositiveVolumeFlow,
    SetReference,
    StressVector,
    Text,
    written,
)

Q = TypeVar("Q")

# Values with which the pressure of the profile acts on the facets as it is.
AS_GIVEN: dict[str, Any] = {"on_skin": (), "factor": 1.0, "offset": 0.0}


class FollowerPressure(Part):
    """Pressure on facets that follows the deformation."""

    kind: Literal["follower_pressure"] = Field(description="Kind of load.")
    facets: tuple[SetReference, ...] = Field(
        min_length=1, description='Facet sets: "skin.chamber_top".'
    )
    reacts_on: Text | None = Field(
        default=None, description="Rigid body that closes the chamber and feels the reaction."
    )
    profile: PressureProfile = Field(
        description="Pressure over time, as a gauge shows it, or the rules that it follows. "
        "Kinds constant and table may be negative: suction."
    )
    on_skin: tuple[tuple[NotNegativePressure, NotNegativePressure], ...] = Field(
        default=(),
        description="[pressure of the profile, pressure on the skin] pairs, both rising from 0, "
        "where a line between gauge and robot lets them differ; linear in between and beyond.",
    )
    factor: Number = Field(
        default=1.0, gt=0.0, description="Pressure on the plane model over that of the profile."
    )
    offset: NotNegativePressure = Field(
        default=written("0 Pa"),
        description="Part of that pressure that acts on nothing in the plane model, such as what "
        "hoop tension carries: on the facets acts factor times (pressure - offset), never "
        "below 0.",
    )

    @field_validator("on_skin")
    @classmethod
    def _scale_rises(
        cls, scale: tuple[tuple[float, float], ...]
    ) -> tuple[tuple[float, float], ...]:
        if scale and (len(scale) < 2 or scale[0] != (0.0, 0.0)):
            raise ValueError("begins with [0 Pa, 0 Pa] and has one more pair at least")
        for number, (one, following) in enumerate(pairwise(scale), start=2):
            if not (following[0] > one[0] and following[1] > one[1]):
                raise ValueError(f"pair {number} must be above pair {number - 1} in both values")
        return scale

    @field_validator("on_skin", "factor", "offset")
    @classmethod
    def _goes_with_the_profile(cls, value: Q, info: ValidationInfo) -> Q:
        profile = info.data.get("profile")
        if value == AS_GIVEN[info.field_name or ""]:
            return value
        if isinstance(profile, EventCyclesProfile):
            raise ValueError("does not go with event_cycles: its pressures are those on the skin")
        if is_ever_suction(profile):
            raise ValueError(
                "does not go with a negative pressure, which acts on the facets as given: "
                "what on_skin, factor and offset say holds for overpressure"
            )
        return value

    @property
    def acts_as_given(self) -> bool:
        """Whether the facets feel the pressure of the profile as it is."""
        return all(getattr(self, key) == value for key, value in AS_GIVEN.items())


class _Chamber(Part):
    facets: tuple[SetReference, ...] = Field(
        min_length=1,
        description='Facet sets around the chamber: "skin.chamber". They form a closed surface, or '
        "end where nodes are fixed or tied (in a half section also on the axis).",
    )
    reacts_on: Text | None = Field(
        default=None, description="Rigid body that closes the chamber and feels the reaction."
    )


class AddedVolume(_Chamber):
    """A chamber into which a liquid is pumped: its volume is prescribed, its pressure follows."""

    kind: Literal["added_volume"] = Field(description="Kind of load.")
    profile: VolumeProfile = Field(description="Volume added since the start.")


class _Gas(_Chamber):
    dead_volume: NotNegativeVolume = Field(
        default=written("0 ml"), description="Of the line and the pump, filled as the chamber is."
    )
    excluded_volume: NotNegativeVolume = Field(
        default=written("0 ml"),
        description="Of what stands inside the chamber, such as a frame; in a half section all "
        "that lies between the surface and the axis counts as chamber.",
    )
    temperature: Number = Field(default=293.15, gt=0.0, description="Of the gas, in kelvin.")
    gas_constant: Number = Field(
        default=287.05, gt=0.0, description="Specific, in J/(kg K); dry air by default."
    )
    ambient_pressure: PositivePressure = Field(
        default=written("101325 Pa"), description="Absolute pressure outside."
    )


class AddedGas(_Gas):
    """A chamber into which a mass of gas is let: ideal, isothermal."""

    kind: Literal["added_gas"] = Field(description="Kind of load.")
    profile: MassProfile = Field(description="Mass of gas added since the start.")


class Pump(Part):
    """A pump that is on or off. Its flow falls linearly with the pressure that it works against;
    nothing flows backward.
    """

    flow: PositiveVolumeFlow = Field(description="Into ambient pressure, as ambient air.")
    stall: PositivePressure = Field(description="Overpressure at which nothing flows any more.")


class Valve(Part):
    """A valve to the outside that is open or closed. It passes C (p^2 - p_ambient^2)."""

    flow: PositiveVolumeFlow = Field(description="Of the open valve, as ambient air.")
    pressure: PositivePressure = Field(description="Overpressure before it, at that flow.")


class AirTube(Part):
    """A tube to the chamber; the air in it flows in layers, at one temperature. Its own volume
    counts half to either end.
    """

    length: PositiveLength = Field(description="Length.")
    bore: PositiveLength = Field(description="Inner diameter.")
    viscosity: PositiveViscosity = Field(
        default=written("1.81e-5 Pa*s"), description="Of the gas; air at 20 degrees by default."
    )


class Pneumatic(_Gas):
    """A chamber at the end of a tube, fed by a pump and emptied by a valve that follow what a
    sensor beside them shows, not what the skin feels.

    The history's `pressure` is the sensor's, `section_pressure` the skin's. Further columns are
    `wanted_pressure`, `air_flow` (into the chamber, as ambient air) and `air_supply` (1: the pump
    runs, -1: the valve is open).
    """

    kind: Literal["pneumatic"] = Field(description="Kind of load.")
    pump: Pump = Field(description="What inflates.")
    valve: Valve = Field(description="What deflates.")
    tube: AirTube = Field(description="What leads to the chamber.")
    line_volume: PositiveVolume = Field(description="Of pump, valve and sensor, before the tube.")
    band: PositivePressure = Field(
        default=written("0.2 kPa"),
        description="While the profile rises, and after, the pump keeps the sensor within this "
        "much about it; while it falls, and after, the valve does.",
    )
    volume_ratio: Number = Field(
        default=1.0,
        gt=0.0,
        description="True volume of the chamber over that of the model: 2 for a ring section of "
        "two sectors of 90 deg. dead_volume and excluded_volume are true ones.",
    )
    profile: PressureProfile = Field(
        description="What the sensor is to show over time, or the rules that this follows. Where "
        "it falls faster than the valve can follow, deflation is natural: the valve stays open."
    )

    @field_validator("profile")
    @classmethod
    def _pump_only_blows(cls, profile: Any) -> Any:
        if is_ever_suction(profile):
            raise ValueError("must not be negative: the pump blows and the valve opens outwards")
        return profile


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
    """A load that may rise, or swing, over time."""

    ramp: NotNegativeTime = Field(
        default=written("0 s"), description="Time to the full load, smooth."
    )
    profile: ShareProfile | None = Field(
        default=None, description="Share of the load over time, such as {kind: sine, frequency: "
        "20 Hz}; instead of the ramp."
    )  # fmt: skip

    @field_validator("profile")
    @classmethod
    def _one_of_both(cls, profile: Any, info: ValidationInfo) -> Any:
        if profile is not None and info.data.get("ramp", 0.0) != 0.0:
            raise ValueError("does not go with ramp: both say how the load rises")
        return profile


class NodalForce(OverTime):
    """A force on a node set, shared by mass."""

    kind: Literal["nodal_force"] = Field(description="Kind of load.")
    nodes: SetReference = Field(description='Node set: "block.top".')
    force: ForceVector = Field(description="Total force on the set.")


class SurfaceTraction(OverTime):
    """A force per area at rest that keeps its direction and size, however the surface moves: a
    dead load (ABAQUS: TRVEC without following).
    """

    kind: Literal["surface_traction"] = Field(description="Kind of load.")
    facets: tuple[SetReference, ...] = Field(min_length=1, description='Facet sets: "block.top".')
    traction: StressVector = Field(description="Force per area at rest.")


class BodyForce(OverTime):
    """A force per volume at rest that keeps its direction."""

    kind: Literal["body_force"] = Field(description="Kind of load.")
    bodies: tuple[Text, ...] = Field(min_length=1, description="Bodies, by name.")
    density: ForceDensityVector = Field(description="Force per volume at rest.")


class RigidForce(OverTime):
    """A force of constant direction on a rigid body, at its centre of mass."""

    kind: Literal["rigid_force"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body.")
    force: ForceVector = Field(description="The force.")


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
        default=None, description="How much of it is drawn in, times the profile."
    )
    stiffness: PositiveStiffness | None = Field(
        default=None, description="Tension over elongation of the whole cable, where it is pulled."
    )
    tension: PositiveForce | None = Field(
        default=None, description="Its tension, times the profile."
    )

    @model_validator(mode="after")
    def _is_driven_once(self) -> "PulledCable":
        if (self.pull is None) == (self.tension is None):
            raise ValueError("is driven by either a pull or a tension: give one of them")
        if (self.pull is None) != (self.stiffness is None):
            raise ValueError("needs a stiffness where it is drawn in by a pull, and only there")
        return self


Load = Annotated[
    FollowerPressure
    | AddedVolume
    | AddedGas
    | Pneumatic
    | EccentricMass
    | SinusoidalForce
    | NodalForce
    | SurfaceTraction
    | BodyForce
    | RigidForce
    | AxialRelief
    | Tendon
    | Tether
    | PulledCable,
    Field(discriminator="kind"),
]
