"""Values over time: one family of profiles for every load and condition, in the unit of each.

`constant`, `ramp`, `smooth_step`, `sine`, `table` and `cycles` with a period exist for any
quantity Q. Loads that are given as a full value take the same family as factors, plain numbers
that are 1 by default. Pressures also have cycles told by rates, natural deflation and cycles by
events.
"""

import math
from itertools import pairwise
from typing import Annotated, Any, Generic, Literal, TypeVar

from pydantic import Field, Tag, ValidationInfo, field_validator, model_validator

from softsim.scene.part import Part, told_by_presence
from softsim.scene.quantities import (
    Angle,
    Force,
    ForceDensity,
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
    Velocity,
    Volume,
    WholeNumber,
    written,
)

Q = TypeVar("Q")


class Constant(Part, Generic[Q]):
    """A constant value, reached at once or by a linear rise from zero."""

    kind: Literal["constant"] = Field(description="Kind of profile.")
    value: Q = Field(description="The value, which may be negative (of a pressure: suction).")
    ramp: NotNegativeTime = Field(
        default=written("0 s"), description="Time of the linear rise from zero; 0 s: at once."
    )

    @property
    def turns(self) -> tuple[Q | float, ...]:
        """Values between which the profile is monotonic, in their order."""
        return (0.0, self.value) if self.ramp > 0.0 else (self.value,)


class Ramp(Part, Generic[Q]):
    """A linear rise from zero, then constant."""

    kind: Literal["ramp"] = Field(description="Kind of profile.")
    value: Q = Field(description="Value at the end of the rise, and after it.")
    duration: PositiveTime = Field(description="Time of the rise.")

    @property
    def turns(self) -> tuple[Q | float, ...]:
        """Values between which the profile is monotonic, in their order."""
        return (0.0, self.value)


class SmoothStep(Part, Generic[Q]):
    """A rise from zero as u^2 (3 - 2 u), u = time / duration, then constant: the rate has no jump,
    so that little vibrates (as with ABAQUS's amplitude SMOOTH STEP).
    """

    kind: Literal["smooth_step"] = Field(description="Kind of profile.")
    value: Q = Field(description="Value at the end of the rise, and after it.")
    duration: PositiveTime = Field(description="Time of the rise.")

    @property
    def turns(self) -> tuple[Q | float, ...]:
        """Values between which the profile is monotonic, in their order."""
        return (0.0, self.value)


class Sine(Part, Generic[Q]):
    """mean + amplitude sin(2 pi f t + phase), for as long as the run lasts."""

    kind: Literal["sine"] = Field(description="Kind of profile.")
    amplitude: Q = Field(description="Half of the difference of the highest and lowest values.")
    frequency: PositiveFrequency = Field(description="f.")
    phase: Angle = Field(default=written("0 deg"), description="Angle at t = 0.")
    mean: Q | None = Field(
        default=None, description="Value about which it oscillates; 0 by default."
    )

    @property
    def turns(self) -> tuple[Any, ...]:
        """Values between which the profile is monotonic, in their order."""
        mean: Any = self.mean or 0.0
        return (mean + self.amplitude, mean - self.amplitude)


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

    @property
    def turns(self) -> tuple[Q, ...]:
        """Values between which the profile is monotonic, in their order."""
        return tuple(value for _, value in self.points)


class PeriodicCycles(Part, Generic[Q]):
    """Trapezoids that repeat: rise, hold, fall, rest at the lowest value for the remainder of the
    period.
    """

    kind: Literal["cycles"] = Field(description="Kind of profile.")
    period: PositiveTime = Field(description="Time from the beginning of a cycle to the next.")
    highest: Q = Field(description="Highest value.")
    lowest: Q | None = Field(
        default=None, description="Lowest value, at which cycles begin; 0 by default."
    )
    rise: PositiveTime = Field(description="Time from the lowest to the highest value.")
    hold: NotNegativeTime = Field(default=written("0 s"), description="Time at the highest value.")
    fall: PositiveTime = Field(description="Time from the highest to the lowest value.")
    phase: Angle = Field(
        default=written("0 deg"),
        description="Angle at t = 0, of 360 deg in a period. Negative: the first cycle begins "
        "later by that part of a period, and until then the value is the lowest.",
    )
    count: Annotated[WholeNumber, Field(ge=1, le=100000)] | None = Field(
        default=None, description="Number of cycles; by default they last as long as the run."
    )

    @field_validator("lowest")
    @classmethod
    def _lowest_is_lower(cls, lowest: Any, info: ValidationInfo) -> Any:
        if (lowest or 0.0) >= info.data.get("highest", math.inf):
            raise ValueError("must be below highest")
        return lowest

    @model_validator(mode="after")
    def _a_cycle_fits(self) -> "PeriodicCycles[Q]":
        taken = self.rise + self.hold + self.fall
        if taken > self.period * (1.0 + 1e-9):
            raise ValueError(
                f"rise, hold and fall take {taken:.6g} s, more than the period, {self.period:.6g} s"
            )
        return self

    @property
    def turns(self) -> tuple[Q | float, ...]:
        """Values between which the profile is monotonic, in their order."""
        return (self.lowest or 0.0, self.highest, self.lowest or 0.0)


# Where values with units go, for those who give one where a factor is due.
PLAIN = (
    "a plain number. Values with units go with `direction` in place of a force, with "
    "`pull_profile` or `tension_profile` of a cable."
)


class ConstantFactor(Constant[Number]):
    """A constant factor."""

    value: Number = Field(default=1.0, description=f"The factor, {PLAIN}")


class RampedFactor(Ramp[Number]):
    """A factor with a linear rise from zero, then constant."""

    value: Number = Field(default=1.0, description=f"Factor after the rise, {PLAIN}")


class SmoothFactor(SmoothStep[Number]):
    """A factor that rises from zero as u^2 (3 - 2 u), u = time / duration, then is constant."""

    value: Number = Field(default=1.0, description=f"Factor after the rise, {PLAIN}")


class SineFactor(Sine[Number]):
    """mean + amplitude sin(2 pi f t + phase), for as long as the run lasts."""

    amplitude: Number = Field(default=1.0, description=f"Factor at the peaks, {PLAIN}")


class PeriodicFactor(PeriodicCycles[Number]):
    """A factor that repeats: rise, hold, fall, rest."""

    highest: Number = Field(default=1.0, description=f"Highest factor, {PLAIN}")


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

    @property
    def turns(self) -> tuple[float, ...]:
        """Values between which the profile is monotonic, in their order."""
        return (0.0, self.highest, self.lowest)


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


CyclesOfPressure = Annotated[
    Annotated[CyclesProfile, Tag("rates")] | Annotated[PeriodicCycles[Pressure], Tag("period")],
    told_by_presence("rates", ("inflation_rate", "deflation_rate"), otherwise="period"),
]
FixedProfile = (
    Constant[Pressure] | Ramp[Pressure] | SmoothStep[Pressure] | Sine[Pressure] | Table[Pressure]
    | CyclesOfPressure | NaturalDeflationProfile
)  # fmt: skip
PressureProfile = Annotated[FixedProfile | EventCyclesProfile, Field(discriminator="kind")]

LengthProfile = Annotated[
    Constant[Length]
    | Ramp[Length]
    | SmoothStep[Length]
    | Sine[Length]
    | Table[Length]
    | PeriodicCycles[Length],
    Field(discriminator="kind"),
]
VelocityProfile = Annotated[
    Constant[Velocity]
    | Ramp[Velocity]
    | SmoothStep[Velocity]
    | Sine[Velocity]
    | Table[Velocity]
    | PeriodicCycles[Velocity],
    Field(discriminator="kind"),
]
VolumeProfile = Annotated[
    Constant[Volume]
    | Ramp[Volume]
    | SmoothStep[Volume]
    | Sine[Volume]
    | Table[Volume]
    | PeriodicCycles[Volume],
    Field(discriminator="kind"),
]
MassProfile = Annotated[
    Constant[Mass]
    | Ramp[Mass]
    | SmoothStep[Mass]
    | Sine[Mass]
    | Table[Mass]
    | PeriodicCycles[Mass],
    Field(discriminator="kind"),
]
ForceProfile = Annotated[
    Constant[Force]
    | Ramp[Force]
    | SmoothStep[Force]
    | Sine[Force]
    | Table[Force]
    | PeriodicCycles[Force],
    Field(discriminator="kind"),
]
StressProfile = Annotated[
    Constant[Pressure]
    | Ramp[Pressure]
    | SmoothStep[Pressure]
    | Sine[Pressure]
    | Table[Pressure]
    | PeriodicCycles[Pressure],
    Field(discriminator="kind"),
]
ForceDensityProfile = Annotated[
    Constant[ForceDensity]
    | Ramp[ForceDensity]
    | SmoothStep[ForceDensity]
    | Sine[ForceDensity]
    | Table[ForceDensity]
    | PeriodicCycles[ForceDensity],
    Field(discriminator="kind"),
]
FactorProfile = Annotated[
    ConstantFactor | RampedFactor | SmoothFactor | SineFactor | Table[Number] | PeriodicFactor,
    Field(discriminator="kind"),
]


def is_ever_negative(profile: FixedProfile | EventCyclesProfile) -> bool:
    """Return True if a pressure over time is negative at any time: suction."""
    return any(value < 0.0 for value in profile.turns)


def ever_falls(profile: FixedProfile | EventCyclesProfile) -> bool:
    """Return True if a pressure over time falls at any time."""
    return any(later < earlier for earlier, later in pairwise(profile.turns))
