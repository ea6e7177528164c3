"""Chambers: pressure on facets, a liquid or gas inside, pump and valve at the end of a tube."""

from itertools import pairwise
from typing import Any, Literal, TypeVar

from pydantic import Field, ValidationInfo, field_validator

from softsim.scene.profiles import (
    EventCyclesProfile,
    MassProfile,
    PressureProfile,
    VolumeProfile,
    is_ever_negative,
)
from softsim.scene.quantities import (
    NotNegativePressure,
    NotNegativeVolume,
    Number,
    PositiveLength,
    PositivePressure,
    PositiveViscosity,
    PositiveVolume,
    PositiveVolumeFlow,
    SetReference,
    Spec,
    Text,
    written,
)

Q = TypeVar("Q")

# Values with which the pressure of the profile acts on the facets as it is.
AS_GIVEN: dict[str, Any] = {"on_skin": (), "factor": 1.0, "offset": 0.0}


class FollowerPressureSpec(Spec):
    """Pressure on facets, normal to the deformed surface."""

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


class _Chamber(Spec):
    facets: tuple[SetReference, ...] = Field(
        min_length=1,
        description='Facet sets around the chamber: "skin.chamber". They form a closed surface, '
        "or end at nodes that are fixed or tied (in an axisymmetric model also at the axis).",
    )
    reacts_on: Text | None = Field(
        default=None,
        description="Rigid body that closes the chamber and receives the reaction force.",
    )


class AddedVolumeSpec(_Chamber):
    """Chamber filled with a liquid: the volume is prescribed and the pressure follows."""

    kind: Literal["added_volume"] = Field(description="Kind of load.")
    profile: VolumeProfile = Field(description="Volume added since the start, over time.")


class _Gas(_Chamber):
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
