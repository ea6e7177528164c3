"""Chambers: pressure on facets, a liquid or a gas within, pump and valve at the end of a tube."""

from itertools import pairwise
from typing import Any, Literal, TypeVar

from pydantic import Field, ValidationInfo, field_validator

from softsim.scene.part import Part
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
        min_length=1, description="Facet sets, such as [skin.chamber_top]."
    )
    reacts_on: Text | None = Field(
        default=None, description="Rigid body that closes the chamber and feels the reaction."
    )
    profile: PressureProfile = Field(
        description="Pressure over time, as a gauge shows it, or the rules that it follows. "
        "Negative values are suction."
    )
    on_skin: tuple[tuple[NotNegativePressure, NotNegativePressure], ...] = Field(
        default=(),
        description="[pressure of the profile, pressure on the skin] pairs, both rising from 0, "
        "where a line between gauge and robot lets them differ; linear in between and beyond.",
    )
    factor: Number = Field(
        default=1.0,
        gt=0.0,
        description="Multiplier: on the facets acts factor times the pressure of the profile.",
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
        if profile is None or value == AS_GIVEN[info.field_name or ""]:
            return value
        if isinstance(profile, EventCyclesProfile):
            raise ValueError("does not go with event_cycles: its pressures are those on the skin")
        if is_ever_negative(profile):
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
    profile: VolumeProfile = Field(description="Volume added since the start, over time.")


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
    profile: MassProfile = Field(description="Mass of gas added since the start, over time.")


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
        if is_ever_negative(profile):
            raise ValueError("must not be negative: the pump blows and the valve opens outwards")
        return profile
