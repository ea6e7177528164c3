"""Values over time."""

import math
from itertools import pairwise
from typing import Annotated, Generic, Literal, TypeVar

from pydantic import Field, ValidationInfo, field_validator

from softsim.scene.part import Part
from softsim.scene.quantities import (
    Length,
    Mass,
    NotNegativePressure,
    NotNegativeTime,
    PositivePressure,
    PositivePressureRate,
    PositiveTime,
    Volume,
    WholeNumber,
    written,
)

Q = TypeVar("Q")


class ConstantProfile(Part):
    """A constant pressure."""

    kind: Literal["constant"] = Field(description="Kind of profile.")
    value: NotNegativePressure = Field(description="The pressure.")
    ramp: NotNegativeTime = Field(
        default=written("0 s"), description="Time in which it rises from zero."
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


LengthProfile = Annotated[
    Ramp[Length] | SmoothStep[Length] | Table[Length], Field(discriminator="kind")
]
VolumeProfile = Annotated[
    Ramp[Volume] | SmoothStep[Volume] | Table[Volume], Field(discriminator="kind")
]
MassProfile = Annotated[Ramp[Mass] | SmoothStep[Mass] | Table[Mass], Field(discriminator="kind")]


class _Cycle(Part):
    highest: PositivePressure = Field(description="Highest pressure.")
    inflation_rate: PositivePressureRate = Field(description="Rise of pressure.")
    hold: NotNegativeTime = Field(
        default=written("0 s"), description="Time at the highest pressure."
    )
    lowest: NotNegativePressure = Field(description="Where the next inflation begins (P_M3^S).")
    count: WholeNumber = Field(default=1, ge=1, le=100000, description="Number of cycles.")
    start: NotNegativeTime = Field(
        default=written("0 s"), description="When the first inflation begins."
    )

    @field_validator("lowest")
    @classmethod
    def _lowest_is_lower(cls, lowest: float, info: ValidationInfo) -> float:
        if lowest >= info.data.get("highest", math.inf):
            raise ValueError("must be below highest")
        return lowest


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


PressureProfile = Annotated[
    ConstantProfile | Table[NotNegativePressure] | CyclesProfile | NaturalDeflationProfile,
    Field(discriminator="kind"),
]
