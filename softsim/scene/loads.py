"""Loads: pressure in chambers, motors, forces, tendons, tethers, pulled cables.

`built_by` of a class is the entry point of the function that builds the load.
"""

from itertools import pairwise
from typing import Annotated, Any, ClassVar, Generic, Literal, TypeVar

from pydantic import Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from softsim.scene.profiles import (
    EventCyclesProfile,
    FactorProfile,
    ForceDensityProfile,
    ForceProfile,
    LengthProfile,
    MassProfile,
    PressureProfile,
    StressProfile,
    VolumeProfile,
    is_ever_negative,
)
from softsim.scene.quantities import (
    ORIGIN,
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
    Spec,
    StressVector,
    Text,
    chosen_by_presence,
    written,
)

P = TypeVar("P")
Q = TypeVar("Q")

# -------------------------------------------------------------------------------------------------
# Chambers: pressure on facets, a liquid or gas inside, pump and valve at the end of a tube.

# Values with which the pressure of the profile acts on the facets as it is.
AS_GIVEN: dict[str, Any] = {"on_skin": (), "factor": 1.0, "offset": 0.0}


class FollowerPressureSpec(Spec):
    """Pressure on facets, normal to the deformed surface."""

    built_by: ClassVar[str] = "softsim.builder.chambers:pressure"
    kind: Literal["follower_pressure"] = Field(description="Kind of load.")
    facets: tuple[SetReference, ...] = Field(
        min_length=1,
        description="Facet sets on which the pressure acts, such as [skin.chamber_top].",
    )
    reacts_on: Text | None = Field(
        default=None,
        description="Rigid body that closes the chamber and receives the reaction force.",
    )
    profile: PressureProfile = Field(
        description="Gauge pressure over time. Negative values are suction."
    )
    on_skin: tuple[tuple[NotNegativePressure, NotNegativePressure], ...] = Field(
        default=(),
        description="Calibration between gauge and robot: [pressure of the profile, pressure on "
        "the skin] pairs, both increasing from 0, with linear interpolation and extrapolation. "
        "Default: equal pressures.",
    )
    factor: Number = Field(
        default=1.0,
        gt=0.0,
        description="Multiplier of the profile's pressure in a plane model (1 = none).",
    )
    offset: NotNegativePressure = Field(
        default=written("0 Pa"),
        description="Part of the profile's pressure that does not act on the facets of a plane "
        "model, for example the part carried by hoop tension. The pressure on the facets is "
        "factor times (pressure - offset), not less than 0.",
    )

    @field_validator("on_skin")
    @classmethod
    def _scale_rises(
        cls, scale: tuple[tuple[float, float], ...]
    ) -> tuple[tuple[float, float], ...]:
        if scale and (len(scale) < 2 or scale[0] != (0.0, 0.0)):
            raise ValueError("must start with [0 Pa, 0 Pa] and have at least one more pair")
        for number, (one, following) in enumerate(pairwise(scale), start=2):
            if not (following[0] > one[0] and following[1] > one[1]):
                raise ValueError(f"pair {number} must be above pair {number - 1} in both values")
        return scale

    @field_validator("on_skin", "factor", "offset")
    @classmethod
    def _goes_with_the_profile(cls, value: Q, info: ValidationInfo) -> Q:
        profile = info.data.get("profile")
        if profile is None or value == AS_GIVEN[info.field_name or ""]:
            return value
        if isinstance(profile, EventCyclesProfile):
            raise ValueError("does not go with event_cycles, whose pressures are those on the skin")
        if is_ever_negative(profile):
            raise ValueError(
                "does not go with a negative pressure, which acts on the facets as given; "
                "on_skin, factor and offset apply to overpressure only"
            )
        return value


class ChamberSpec(Spec):
    """Closed surface of facets with a fluid inside."""

    facets: tuple[SetReference, ...] = Field(
        min_length=1,
        description='Facet sets around the chamber: "skin.chamber". They form a closed surface, '
        "or end at nodes that are fixed or tied (in an axisymmetric model also at the axis).",
    )
    reacts_on: Text | None = Field(
        default=None,
        description="Rigid body that closes the chamber and receives the reaction force.",
    )


class AddedVolumeSpec(ChamberSpec):
    """Chamber filled with a liquid: the volume is prescribed and the pressure follows."""

    built_by: ClassVar[str] = "softsim.builder.chambers:pressure"
    kind: Literal["added_volume"] = Field(description="Kind of load.")
    profile: VolumeProfile = Field(description="Volume added since the start, over time.")


class _Gas(ChamberSpec):
    dead_volume: NotNegativeVolume = Field(
        default=written("0 ml"),
        description="Volume of the line and the pump, filled like the chamber.",
    )
    excluded_volume: NotNegativeVolume = Field(
        default=written("0 ml"),
        description="Volume of objects inside the chamber, such as a frame. In an axisymmetric "
        "model everything between the surface and the axis counts as chamber.",
    )
    temperature: Number = Field(
        default=293.15, gt=0.0, description="Temperature of the gas in kelvin."
    )
    gas_constant: Number = Field(
        default=287.05, gt=0.0, description="Specific gas constant in J/(kg K). Default: dry air."
    )
    ambient_pressure: PositivePressure = Field(
        default=written("101325 Pa"), description="Absolute ambient pressure."
    )


class AddedGasSpec(_Gas):
    """Chamber filled with a prescribed mass of ideal gas at constant temperature."""

    built_by: ClassVar[str] = "softsim.builder.chambers:pressure"
    kind: Literal["added_gas"] = Field(description="Kind of load.")
    profile: MassProfile = Field(description="Mass of gas added since the start, over time.")


class Pump(Spec):
    """Pump that is either on or off. Its flow decreases linearly with its back
    pressure and never reverses.
    """

    flow: PositiveVolumeFlow = Field(
        description="Flow at ambient pressure, measured as ambient air."
    )
    stall: PositivePressure = Field(description="Gauge pressure at which the flow is zero.")


class Valve(Spec):
    """Outlet valve that is either open or closed. Its flow is C (p^2 - p_ambient^2)
    with absolute pressures.
    """

    flow: PositiveVolumeFlow = Field(
        description="Flow through the open valve at `pressure`, measured as ambient air."
    )
    pressure: PositivePressure = Field(
        description="Gauge pressure before the valve at which `flow` is given."
    )


class AirTube(Spec):
    """Tube to the chamber, with laminar isothermal flow. Half of its volume is
    added to each end.
    """

    length: PositiveLength = Field(description="Length.")
    bore: PositiveLength = Field(description="Inner diameter.")
    viscosity: PositiveViscosity = Field(
        default=written("1.81e-5 Pa*s"),
        description="Dynamic viscosity of the gas. Default: air at 20 degrees Celsius.",
    )


class Pneumatic(_Gas):
    """Chamber at the end of a tube with a pump, a valve and a pressure sensor at the other end.
    Pump and valve control the pressure at the sensor, which differs from the pressure in the
    chamber. In the history `pressure` is that of the sensor and `section_pressure` that of the
    chamber. Further columns: `wanted_pressure`, `air_flow` (into the chamber, as ambient air) and
    `air_supply` (1: pump on, -1: valve open, 0: neither).
    """

    built_by: ClassVar[str] = "softsim.builder.chambers:pressure"
    kind: Literal["pneumatic"] = Field(description="Kind of load.")
    pump: Pump = Field(description="Pump that inflates the chamber.")
    valve: Valve = Field(description="Valve that deflates the chamber.")
    tube: AirTube = Field(description="Tube to the chamber.")
    line_volume: PositiveVolume = Field(
        description="Volume of pump, valve and sensor, before the tube."
    )
    band: PositivePressure = Field(
        default=written("0.2 kPa"),
        description="Tolerance of the pressure at the sensor. The pump keeps the sensor within "
        "this band while the profile rises, and afterwards; the valve does so while it falls, and "
        "afterwards.",
    )
    volume_ratio: Number = Field(
        default=1.0,
        gt=0.0,
        description="True volume of the chamber divided by that of the model, for example 2 for a "
        "ring section with two sectors of 90 deg. dead_volume and excluded_volume are true "
        "volumes.",
    )
    profile: PressureProfile = Field(
        description="Set point of the pressure at the sensor over time, or the rules that give "
        "it. If it falls faster than the valve can follow, the valve stays open."
    )

    @field_validator("profile")
    @classmethod
    def _pump_only_blows(cls, profile: Any) -> Any:
        if is_ever_negative(profile):
            raise ValueError("must not be negative: the pump blows and the valve opens outwards")
        return profile


# -------------------------------------------------------------------------------------------------
# Motors, forces, tendons, tethers and pulled cables.


class EccentricMass(Spec):
    """Vibration motor: a rotating force m_e r_e omega^2 about an axis fixed to its body."""

    built_by: ClassVar[str] = "softsim.loads.nodal:eccentric_motor"
    kind: Literal["eccentric_mass"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body that carries the motor.")
    eccentric_mass: PositiveMass = Field(
        description="Eccentric mass m_e. Its weight is part of the body's mass."
    )
    radius: PositiveLength = Field(
        description="Distance r_e of the eccentric mass from the motor's axis."
    )
    frequency: PositiveFrequency = Field(description="Rotation frequency.")
    rotation_axis: AxisVector = Field(
        default=written("x"),
        description="Axis of rotation. x: the force rotates in the y-z plane, and a 2D model has "
        "its y component only. z: it rotates in the x-y plane. Or three components, such as [1, "
        "0, 1].",
    )
    sense: Literal[1, -1] = Field(
        default=1,
        description="Sense of rotation. 1: positive about the axis by the right-hand rule (from y "
        "to z about x, from x to y about z). -1: negative.",
    )
    factor: Number = Field(
        default=1.0,
        gt=0.0,
        description="Multiplier of the motor's force in a plane model (1 = none).",
    )
    spin_up: NotNegativeTime = Field(
        default=written("50 ms"), description="Time of the smooth acceleration to full speed."
    )
    phase: Angle = Field(
        default=written("0 deg"),
        description="Angle at the start, in the sense of rotation: from y about x, from z about "
        "y, from x about z.",
    )


class SinusoidalForce(Spec):
    """Sinusoidal force along a fixed direction on a rigid body."""

    built_by: ClassVar[str] = "softsim.loads.nodal:sinusoid"
    kind: Literal["sinusoidal_force"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body; the force acts at its centre of mass.")
    amplitude: PositiveForce = Field(description="Amplitude of the force.")
    direction: Direction = Field(
        default=(0.0, 1.0), description="Direction of the force, of any length."
    )
    frequency: PositiveFrequency = Field(description="Frequency.")
    spin_up: NotNegativeTime = Field(
        default=written("50 ms"),
        description="Time of the smooth acceleration to the full frequency.",
    )
    phase: Angle = Field(default=written("0 deg"), description="Phase angle at the start.")


class OverTime(Spec):
    """Load of a given full value with an optional time history."""

    ramp: NotNegativeTime = Field(
        default=written("0 s"), description="Duration of a smooth step to the full load."
    )
    profile: FactorProfile | None = Field(
        default=None,
        description="Factor of the full load over time, instead of `ramp`, such as {kind: sine, "
        "frequency: 20 Hz}. For a profile with units give `direction` instead of the full load.",
    )

    @field_validator("profile")
    @classmethod
    def _one_of_both(cls, profile: Any, info: ValidationInfo) -> Any:
        if profile is not None and info.data.get("ramp", 0.0) != 0.0:
            raise ValueError("does not go with ramp: both define how the load rises")
        return profile


class Directed(Spec, Generic[P]):
    """Load along a direction with a profile of values with units."""

    direction: Direction = Field(description="Direction of positive values, of any length.")
    profile: P = Field(
        description="Magnitude over time, for a force {kind: sine, amplitude: 10 mN, frequency: "
        "20 Hz}."
    )


class _OfNodes(Spec):
    built_by: ClassVar[str] = "softsim.loads.nodal:nodal_force"
    kind: Literal["nodal_force"] = Field(description="Kind of load.")
    nodes: SetReference = Field(description='Node set, such as "block.top".')


class NodalForceSpec(_OfNodes, OverTime):
    """Force on a node set, distributed in proportion to the nodal masses."""

    force: ForceVector = Field(description="Total force on the set.")


class DirectedNodalForce(_OfNodes, Directed[ForceProfile]):
    """Force along a direction on a node set, distributed in proportion to the nodal masses."""


class _OfFacets(Spec):
    built_by: ClassVar[str] = "softsim.loads.nodal:surface_traction"
    kind: Literal["surface_traction"] = Field(description="Kind of load.")
    facets: tuple[SetReference, ...] = Field(
        min_length=1, description="Facet sets, such as [block.top]."
    )


class SurfaceTraction(_OfFacets, OverTime):
    """Traction per undeformed area with a constant direction: a dead load (in
    ABAQUS: TRVEC, FOLLOWER=NO).
    """

    traction: StressVector = Field(description="Force per undeformed area.")


class DirectedTraction(_OfFacets, Directed[StressProfile]):
    """Traction per undeformed area along a direction: a dead load."""


class _OfBodies(Spec):
    built_by: ClassVar[str] = "softsim.loads.nodal:body_force"
    kind: Literal["body_force"] = Field(description="Kind of load.")
    bodies: tuple[Text, ...] = Field(min_length=1, description="Names of the bodies.")


class BodyForce(_OfBodies, OverTime):
    """Force per undeformed volume with a constant direction."""

    density: ForceDensityVector = Field(description="Force per undeformed volume.")


class DirectedBodyForce(_OfBodies, Directed[ForceDensityProfile]):
    """Force per undeformed volume along a direction."""


class _OfRigidBody(Spec):
    built_by: ClassVar[str] = "softsim.loads.nodal:rigid_force"
    kind: Literal["rigid_force"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Name of the rigid body.")


class RigidForceSpec(_OfRigidBody, OverTime):
    """Force with a constant direction on a rigid body, at its centre of mass."""

    force: ForceVector = Field(description="Force.")


class DirectedRigidForce(_OfRigidBody, Directed[ForceProfile]):
    """Force along a direction on a rigid body, at its centre of mass."""


class AxialReliefSpec(Spec):
    """Cancels a fraction of the robot's weight along the x axis of a rigid body, for a plane
    section that has fewer of the robot's spikes along the axis than across it.
    """

    built_by: ClassVar[str] = "softsim.loads.nodal:axial_relief"
    kind: Literal["axial_relief"] = Field(description="Kind of load.")
    acts_on: Text = Field(
        description="Rigid body whose x axis is used and on which the force acts."
    )
    share: Number = Field(
        gt=0.0,
        lt=1.0,
        description="Fraction of the total weight that is cancelled; 0.5 if the section has half "
        "of the spikes.",
    )


class TendonSpec(Spec):
    """Tendon from a rigid body to a distant force gauge: a spring that acts in tension only. The
    history gets a column `pull`, the tension of the first tendon.
    """

    built_by: ClassVar[str] = "softsim.loads.tether:tendon"
    kind: Literal["tendon"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body that the tendon holds, at its centre of mass.")
    stiffness: PositiveStiffness = Field(
        default=written("2 N/mm"), description="Stiffness of the tendon including the gauge."
    )
    direction: Direction = Field(
        default=(-1.0, 0.0), description="Direction from the body to the gauge, of any length."
    )
    slack: NotNegativeLength = Field(
        default=written("0 mm"),
        description="Displacement of the body at which the tendon becomes taut.",
    )


class TetherSpec(Spec):
    """Tether that a robot trails along its x axis, such as a tube with wires: friction along that
    axis, weight and rotational stiffness. It acts at all times, also before t = 0. The history
    gets a column `tether_drag`, the drag of the first tether, positive against forward motion.
    """

    built_by: ClassVar[str] = "softsim.loads.tether:tether"
    kind: Literal["tether"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body that trails the tether.")
    drag: NotNegativeForce = Field(
        description="Coulomb friction along the body's x axis, against either sense of motion; at "
        "rest it resists up to this force. There is no force across the axis."
    )
    stiffness: AutoOrPositiveStiffness = Field(
        default="auto",
        description="Stiffness of the elastic displacement over which the drag builds up. auto: "
        "the full drag after 0.1 mm.",
    )
    at: Point = Field(
        default=ORIGIN,
        description="Point of attachment relative to the body's centre, in the body's axes. "
        "Default: the centre, where drag and weight exert no moment.",
    )
    weight: NotNegativeForce = Field(
        default=written("0 N"),
        description="Weight of the part that hangs on the body, along gravity (no effect without "
        "gravity).",
    )
    pitch_stiffness: NotNegativeTurningStiffness = Field(
        default=written("0 N*mm/rad"),
        description="Rotational stiffness K about z for small angles; the moment is K sin(angle) "
        "from the orientation at rest.",
    )
    yaw_stiffness: NotNegativeTurningStiffness = Field(
        default=written("0 N*mm/rad"), description="Rotational stiffness about y, in 3D only."
    )
    roll_stiffness: NotNegativeTurningStiffness = Field(
        default=written("0 N*mm/rad"), description="Rotational stiffness about x, in 3D only."
    )


class PulledCableSpec(OverTime):
    """Massless cable that slides without friction through eyelets in bodies and is actuated at its
    end, by a length `pull` that is drawn in or by a `tension`. It acts in tension only. The
    history gets the columns NAME_tension and NAME_drawn_in.
    """

    built_by: ClassVar[str] = "softsim.structures.cable:pulled_cable"
    kind: Literal["pulled_cable"] = Field(description="Kind of load.")
    eyelets: tuple[Point, ...] = Field(
        min_length=2,
        description="Positions of the eyelets at rest, in order. Each lies in a body and needs no "
        "node there. The cable is unstretched in this position.",
    )
    pulled_from: Point | None = Field(
        default=None,
        description="Fixed point in space to which the cable leads from the first eyelet. Without "
        "it the cable ends at the first eyelet, in a sheath that is fixed to the body.",
    )
    tolerance: PositiveLength | None = Field(
        default=None,
        description="Largest distance of an eyelet outside its body, onto which it is moved. "
        "Default: 5 % of the mean edge of the body's surface facets.",
    )
    pull: PositiveLength | None = Field(
        default=None, description="Length of cable that is drawn in, multiplied by the profile."
    )
    pull_profile: LengthProfile | None = Field(
        default=None, description="Length of cable that is drawn in, over time; instead of `pull`."
    )
    stiffness: PositiveStiffness | None = Field(
        default=None,
        description="Stiffness of the whole cable. Required for `pull` and `pull_profile`, and "
        "not allowed otherwise.",
    )
    tension: PositiveForce | None = Field(
        default=None, description="Tension, multiplied by the profile."
    )
    tension_profile: ForceProfile | None = Field(
        default=None, description="Tension over time; instead of `tension`."
    )

    @model_validator(mode="after")
    def _is_driven_once(self) -> "PulledCableSpec":
        drives = ("pull", "pull_profile", "tension", "tension_profile")
        given = [key for key in drives if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError("needs either a pull or a tension: give one of " + ", ".join(drives))
        if given[0].startswith("pull") != (self.stiffness is not None):
            raise ValueError("needs a stiffness with a pull, and only then")
        if given[0].endswith("_profile") and (self.profile is not None or self.ramp != 0.0):
            raise ValueError(f"{given[0]} gives the values over time: leave out profile and ramp")
        return self


def _by_direction(otherwise: str) -> Discriminator:
    """Distinguish loads whose profile has values with units from those with factors."""
    return chosen_by_presence("direction", ("direction",), otherwise)


NodalLoad = Annotated[
    Annotated[NodalForceSpec, Tag("force")] | Annotated[DirectedNodalForce, Tag("direction")],
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
    Annotated[RigidForceSpec, Tag("force")] | Annotated[DirectedRigidForce, Tag("direction")],
    _by_direction("force"),
]
Load = Annotated[
    FollowerPressureSpec
    | AddedVolumeSpec
    | AddedGasSpec
    | Pneumatic
    | EccentricMass
    | SinusoidalForce
    | NodalLoad
    | SurfaceLoad
    | BodyLoad
    | RigidLoad
    | AxialReliefSpec
    | TendonSpec
    | TetherSpec
    | PulledCableSpec,
    Field(discriminator="kind"),
]
