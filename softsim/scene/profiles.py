"""Values over time."""

import math
from itertools import pairwise
from typing import Annotated, Generic, Literal, TypeVar

from pydantic import Field, ValidationInfo, field_validator

from softsim.scene.part import Part
from softsim.scene.quantities import (
    Angle,
    Length,
    Mass,
    NotNegativePressure,
    NotNegativeTime,
    Number,
    PositiveForce,
    PositiveFrequency,
    PositivePressure,
    PositivePressureRate,
    PositiveTime,
    PositiveVelocity,
    Pressure,
    Volume,
    WholeNumber,
    written,
)

Q = TypeVar("Q")


class ConstantProfile(Part):
    """A constant pressure."""

    kind: Literal["constant"] = Field(description="Kind of profile.")
    value: Pressure = Field(description="The pressure; negative: suction.")
    ramp: NotNegativeTime = Field(
        default=written("0 s"), description="Time in which it is reached from zero."
    )


class Ramp(Part, Generic[Q]):
    """A linear rise from zero, then constant."""

    kind: Literal["ramp"] = Field(description="Kind of profile.")
    value: Q = Field(description="Reached at the end of the rise.")
    duration: PositiveTime = Field(description="Time of the rise.")


class SmoothStep(Part, Generic[Q]):
    """A rise from zero as u^2 (3 - 2 u), u = time / duration, then constant: without a jump of the
    rate, so that little vibrates (ABAQUS's amplitude SMOOTH STEP is of this kind).
    """

    kind: Literal["smooth_step"] = Field(description="Kind of profile.")
    value: Q = Field(description="Reached at the end of the rise.")
    duration: PositiveTime = Field(description="Time of the rise.")


class Table(Part, Generic[Q]):
    """Straight lines between points, constant after the last."""

    kind: Literal["table"] = Field(description="Kind of profile.")
    points: tuple[tuple[NotNegativeTime, Q], ...] = Field(
        min_length=2, description="[time, value] pairs, times rising."
    )

    @field_validator("points")
    @classmethod
    def _times_rise(cls, points: tuple[tuple[float, Q], ...]) -> tuple[tuple[float, Q], ...]:
        for number, (one, following) in enumerate(pairwise(points)):
            if following[0] <= one[0]:
                raise ValueError(f"point {number + 1} must come later than point {number}")
        return points


class RampedShare(Part):
    """A linear rise from 0 to 1, then 1."""

    kind: Literal["ramp"] = Field(description="Kind of profile.")
    duration: PositiveTime = Field(description="Time of the rise.")


class SmoothShare(Part):
    """A rise from 0 to 1 as u^2 (3 - 2 u), u = time / duration, then 1."""

    kind: Literal["smooth_step"] = Field(description="Kind of profile.")
    duration: PositiveTime = Field(description="Time of the rise.")


class FullShare(Part):
    """All of it from the start."""

    kind: Literal["constant"] = Field(description="Kind of profile.")


class SineShare(Part):
    """sin(2 pi f t + phase), for as long as the run lasts."""

    kind: Literal["sine"] = Field(description="Kind of profile.")
    frequency: PositiveFrequency = Field(description="f.")
    phase: Angle = Field(default=written("0 deg"), description="At t = 0.")


ShareProfile = Annotated[
    FullShare | RampedShare | SmoothShare | SineShare | Table[Number], Field(discriminator="kind")
]
LengthProfile = Annotated[
    Ramp[Length] | SmoothStep[Length] | Table[Length], Field(discriminator="kind")
]
VolumeProfile = Annotated[
    Ramp[Volume] | SmoothStep[Volume] | Table[Volume], Field(discriminator="kind")
]
MassProfile = Annotated[Ramp[Mass] | SmoothStep[Mass] | Table[Mass], Field(discriminator="kind")]


class _Swing(Part):
    highest: PositivePressure = Field(description="Highest pressure.")
    inflation_rate: PositivePressureRate = Field(description="Rise of pressure.")
    lowest: NotNegativePressure = Field(description="Where the next inflation begins (P_M3^S).")
    start: NotNegativeTime = Field(
        default=written("0 s"), description="When the first inflation begins."
    )

    @field_validator("lowest")
    @classmethod
    def _lowest_is_lower(cls, lowest: float, info: ValidationInfo) -> float:
        if lowest >= info.data.get("highest", math.inf):
            raise ValueError("must be below highest")
        return lowest


class _Cycle(_Swing):
    hold: NotNegativeTime = Field(
        default=written("0 s"), description="Time at the highest pressure."
    )
    count: WholeNumber = Field(default=1, ge=1, le=100000, description="Number of cycles.")


class CyclesProfile(_Cycle):
    """Inflate, hold, deflate at a given average rate, rest; again."""

    kind: Literal["cycles"] = Field(description="Kind of profile.")
    deflation_rate: PositivePressureRate = Field(description="Average deflation rate (Df_r^a).")
    rest: NotNegativeTime = Field(
        default=written("0 s"), description="Time at the lowest pressure."
    )


class NaturalDeflationProfile(_Cycle):
    """Inflate, hold, let the air out: an exponential fall."""

    kind: Literal["natural_deflation"] = Field(description="Kind of profile.")
    time_constant: PositiveTime = Field(description="Time in which the pressure falls to 1/e.")

    @field_validator("lowest")
    @classmethod
    def _lowest_is_reached(cls, lowest: float) -> float:
        if lowest == 0.0:
            raise ValueError("must be greater than 0 Pa: an exponential never reaches zero")
        return lowest


class EventCyclesProfile(_Swing):
    """A closed loop: inflate until contact is made, hold, deflate until motion has stopped; again.
    Its pressures are those on the skin, of an air line those at its sensor. What is felt is what
    the history shows, row by row.
    """

    kind: Literal["event_cycles"] = Field(description="Kind of profile.")
    lowest: NotNegativePressure = Field(
        description="Deflation goes no further, whatever happens; contact counts above it only."
    )
    hold: NotNegativeTime = Field(
        default=written("0 s"), description="Time between inflation and deflation."
    )
    contact_force: PositiveForce = Field(
        description="Contact is made when the walls' normal force (column wall_force_normal) is at "
        "least this; choose it well above what weight and motor press with."
    )
    contact_rows: WholeNumber = Field(
        default=1, ge=0, description="Contact is made when at least so many rows of spikes touch."
    )
    contact_window: PositiveTime = Field(
        default=written("20 ms"),
        description="The force is averaged, and touching rows are counted, over this time; some "
        "turns of the motor.",
    )
    deflation_rate: PositivePressureRate = Field(description="Fall of pressure (Df_r^a).")
    motion_speed: PositiveVelocity = Field(
        default=written("20 mm/s"),
        description="The robot moves when its frame does so at this mean speed, forward "
        "along its own axis; deflation ends when it moved and no longer does. Choose it above the "
        "speed at which the robot creeps.",
    )
    slip_speed: PositiveVelocity = Field(
        default=written("5 mm/s"),
        description="Deflation also ends when it slips back at this mean speed. Choose it above "
        "the speed at which the leaving air draws it back, 1 to 2 mm in all.",
    )
    motion_window: PositiveTime = Field(
        default=written("200 ms"), description="Time over which the mean speed is taken."
    )
    least_rows: WholeNumber = Field(
        default=1, ge=0, description="Deflation also ends when so many rows touched and now fewer "
        "do (0: it does not)."
    )  # fmt: skip
    count: Annotated[WholeNumber, Field(ge=1)] | None = Field(
        default=None, description="Number of cycles, after which the pressure stays; by default as "
        "many as fit."
    )  # fmt: skip

    @field_validator("contact_window")
    @classmethod
    def _inflation_takes_longer(cls, window: float, info: ValidationInfo) -> float:
        longest = _duration(info, "inflation_rate")
        if window >= longest:
            raise ValueError(f"must be shorter than an inflation, which takes {longest:.3g} s")
        return window

    @field_validator("motion_window")
    @classmethod
    def _deflation_takes_longer(cls, window: float, info: ValidationInfo) -> float:
        longest = _duration(info, "deflation_rate")
        if window >= longest:
            raise ValueError(
                f"must be shorter than a deflation, which takes {longest:.3g} s at most"
            )
        return window

    @field_validator("least_rows")
    @classmethod
    def _contact_that_is_made_is_not_lost(cls, least: int, info: ValidationInfo) -> int:
        made = info.data.get("contact_rows", least)
        if least > made:
            raise ValueError(
                f"must not be above contact_rows, {made}: contact would be lost when it is made"
            )
        return least


def _duration(info: ValidationInfo, rate: str) -> float:
    """Time [s] from the lowest to the highest pressure or back; infinite while one is unknown."""
    known = info.data
    if not {"highest", "lowest", rate} <= known.keys():
        return math.inf
    return float((known["highest"] - known["lowest"]) / known[rate])


FixedProfile = ConstantProfile | Table[Pressure] | CyclesProfile | NaturalDeflationProfile
PressureProfile = Annotated[FixedProfile | EventCyclesProfile, Field(discriminator="kind")]


def is_ever_suction(profile: Part | None) -> bool:
    """Whether a pressure over time is negative at any time."""
    if isinstance(profile, Table):
        return any(value < 0.0 for _, value in profile.points)
    return isinstance(profile, ConstantProfile) and profile.value < 0.0
