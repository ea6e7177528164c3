"""Profiles: values over time for every load and condition, in the unit of each.

`constant`, `ramp`, `smooth_step`, `sine`, `table` and `cycles` with a period exist for any
quantity Q. Loads that are given as a full value take the same profiles as factors, plain numbers
that are 1 by default. Pressures also have cycles with given rates, cycles with natural deflation
and cycles by events.
"""

import math
from itertools import pairwise
from typing import Annotated, Any, Generic, Literal, TypeVar, get_args

from pydantic import Field, Tag, ValidationInfo, field_validator, model_validator

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
    Quantity,
    Spec,
    Velocity,
    Volume,
    WholeNumber,
    chosen_by_presence,
    schema_title,
    written,
)

Q = TypeVar("Q")
NAME_OF_UNIT = {
    "m": "Length", "m/s": "Velocity", "Pa": "Pressure", "N": "Force", "N/m^3": "ForceDensity",
    "kg": "Mass", "m^3": "Volume",
}  # fmt: skip


class ProfileSpec(Spec, Generic[Q]):
    """Values over time of the type Q."""

    @classmethod
    def __pydantic_init_subclass__(cls, **arguments: Any) -> None:
        """Set the description of a class of a quantity to that of its profile."""
        super().__pydantic_init_subclass__(**arguments)
        cls.__doc__ = cls.__doc__ or (cls.__base__ or cls).__doc__

    @classmethod
    def model_parametrized_name(cls, params: tuple[Any, ...]) -> str:
        """Return the name of the class of a quantity: PressureTable for TableSpec[Pressure]."""
        notes = get_args(params[0])[1:]
        units = [NAME_OF_UNIT[note.unit] for note in notes if isinstance(note, Quantity)]
        return f"{(units or ['Factor'])[0]}{schema_title(cls)}"


class Constant(ProfileSpec[Q]):
    """Constant value, reached at once or by a linear ramp from zero."""

    kind: Literal["constant"] = Field(description="Kind of profile.")
    value: Q = Field(description="The value. It may be negative (a negative pressure is suction).")
    ramp: NotNegativeTime = Field(
        default=written("0 s"), description="Duration of the linear ramp from zero; 0 s: no ramp."
    )

    @property
    def turns(self) -> tuple[Q | float, ...]:
        """Values between which the profile is monotonic, in their order."""
        return (0.0, self.value) if self.ramp > 0.0 else (self.value,)


class Ramp(ProfileSpec[Q]):
    """Linear ramp from zero, constant afterwards."""

    kind: Literal["ramp"] = Field(description="Kind of profile.")
    value: Q = Field(description="Value at the end of the ramp and afterwards.")
    duration: PositiveTime = Field(description="Duration of the ramp.")

    @property
    def turns(self) -> tuple[Q | float, ...]:
        """Values between which the profile is monotonic, in their order."""
        return (0.0, self.value)


class SmoothStep(ProfileSpec[Q]):
    """Smooth step from zero, value times u^2 (3 - 2 u) with u = time / duration, constant
    afterwards. The rate is continuous, so that little vibration is excited (compare ABAQUS's
    amplitude SMOOTH STEP).
    """

    kind: Literal["smooth_step"] = Field(description="Kind of profile.")
    value: Q = Field(description="Value at the end of the step and afterwards.")
    duration: PositiveTime = Field(description="Duration of the step.")

    @property
    def turns(self) -> tuple[Q | float, ...]:
        """Values between which the profile is monotonic, in their order."""
        return (0.0, self.value)


class Sine(ProfileSpec[Q]):
    """Sine wave: mean + amplitude sin(2 pi frequency t + phase)."""

    kind: Literal["sine"] = Field(description="Kind of profile.")
    amplitude: Q = Field(
        description="Amplitude: half the difference between the highest and the lowest value."
    )
    frequency: PositiveFrequency = Field(description="Frequency.")
    phase: Angle = Field(default=written("0 deg"), description="Phase angle at t = 0.")
    mean: Q | None = Field(default=None, description="Mean value. Default: 0.")

    @property
    def turns(self) -> tuple[Any, ...]:
        """Values between which the profile is monotonic, in their order."""
        mean: Any = self.mean or 0.0
        return (mean + self.amplitude, mean - self.amplitude)


class TableSpec(ProfileSpec[Q]):
    """Piecewise linear interpolation between points, constant after the last point."""

    kind: Literal["table"] = Field(description="Kind of profile.")
    points: tuple[tuple[NotNegativeTime, Q], ...] = Field(
        min_length=2, description="[time, value] pairs with increasing times."
    )

    @field_validator("points")
    @classmethod
    def _times_rise(cls, points: tuple[tuple[float, Q], ...]) -> tuple[tuple[float, Q], ...]:
        for number, (one, following) in enumerate(pairwise(points)):
            if following[0] <= one[0]:
                raise ValueError(f"point {number + 1} must be later than point {number}")
        return points

    @property
    def turns(self) -> tuple[Q, ...]:
        """Values between which the profile is monotonic, in their order."""
        return tuple(value for _, value in self.points)


class PeriodicCycles(ProfileSpec[Q]):
    """Periodic trapezoids: rise, hold, fall, and rest at the lowest value for the
    remainder of the period.
    """

    kind: Literal["cycles"] = Field(description="Kind of profile.")
    period: PositiveTime = Field(
        description="Time from the start of one cycle to the start of the next."
    )
    highest: Q = Field(description="Highest value.")
    lowest: Q | None = Field(
        default=None, description="Lowest value, at which cycles start. Default: 0."
    )
    rise: PositiveTime = Field(description="Time from the lowest to the highest value.")
    hold: NotNegativeTime = Field(default=written("0 s"), description="Time at the highest value.")
    fall: PositiveTime = Field(description="Time from the highest to the lowest value.")
    phase: Angle = Field(
        default=written("0 deg"),
        description="Phase angle at t = 0 (360 deg = one period). Negative: the first cycle "
        "starts later by this fraction of a period, and the value is the lowest one until then.",
    )
    count: Annotated[WholeNumber, Field(ge=1, le=100000)] | None = Field(
        default=None, description="Number of cycles. Default: as many as the run lasts."
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


# Hint for users who give a value with a unit.
PLAIN = (
    "a number without unit. For values with units give `direction` instead of a force, or "
    "`pull_profile` or `tension_profile` of a cable."
)


class FactorConstant(Constant[Number]):
    """Constant factor, reached at once or by a linear ramp from zero."""

    value: Number = Field(default=1.0, description=f"Factor, {PLAIN}")


class FactorRamp(Ramp[Number]):
    """Factor with a linear ramp from zero, constant afterwards."""

    value: Number = Field(default=1.0, description=f"Final factor, {PLAIN}")


class FactorSmoothStep(SmoothStep[Number]):
    """Factor with a smooth step from zero, value times u^2 (3 - 2 u) with u = time
    / duration, constant afterwards.
    """

    value: Number = Field(default=1.0, description=f"Final factor, {PLAIN}")


class FactorSine(Sine[Number]):
    """Factor as a sine wave: mean + amplitude sin(2 pi frequency t + phase)."""

    amplitude: Number = Field(default=1.0, description=f"Amplitude of the factor, {PLAIN}")


class FactorPeriodicCycles(PeriodicCycles[Number]):
    """Factor with periodic trapezoids: rise, hold, fall, rest."""

    highest: Number = Field(default=1.0, description=f"Highest factor, {PLAIN}")


class _Swing(Spec):
    highest: PositivePressure = Field(description="Highest pressure.")
    inflation_rate: PositivePressureRate = Field(
        description="Rate of pressure increase during inflation."
    )
    lowest: NotNegativePressure = Field(
        description="Pressure at which deflation ends and the next inflation starts (P_M3^S in "
        "the thesis)."
    )
    start: NotNegativeTime = Field(
        default=written("0 s"), description="Time at which the first inflation starts."
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
    """Pressure cycles with given rates: inflation, hold, deflation, rest."""

    kind: Literal["cycles"] = Field(description="Kind of profile.")
    deflation_rate: PositivePressureRate = Field(
        description="Average rate of pressure decrease during deflation (Df_r^a in the thesis)."
    )
    rest: NotNegativeTime = Field(
        default=written("0 s"), description="Time at the lowest pressure."
    )


class NaturalDeflationProfile(_Cycle):
    """Pressure cycles with natural deflation: inflation, hold, exponential decay."""

    kind: Literal["natural_deflation"] = Field(description="Kind of profile.")
    time_constant: PositiveTime = Field(
        description="Time constant of the decay, in which the pressure falls to 1/e."
    )

    @field_validator("lowest")
    @classmethod
    def _lowest_is_reached(cls, lowest: float) -> float:
        if lowest == 0.0:
            raise ValueError("must be greater than 0 Pa: an exponential never reaches zero")
        return lowest


class EventCyclesProfile(_Swing):
    """Pressure cycles in closed loop: inflate until the robot touches the wall, hold, deflate
    until its motion stops, repeat. The pressures are those at the skin; for a `pneumatic` load,
    those at its sensor. Events are evaluated at the rows of the history.
    """

    kind: Literal["event_cycles"] = Field(description="Kind of profile.")
    lowest: NotNegativePressure = Field(
        description="Lower limit of the pressure: deflation ends there at the latest, and contact "
        "ends an inflation only above it."
    )
    hold: NotNegativeTime = Field(
        default=written("0 s"), description="Time between inflation and deflation."
    )
    contact_force: PositiveForce = Field(
        description="Inflation ends when the normal force of the walls (history column "
        "wall_force_normal) is at least this. Choose a value well above the force of weight and "
        "motor."
    )
    contact_rows: WholeNumber = Field(
        default=1,
        ge=0,
        description="Inflation ends only when at least this many rows of spikes touch the wall.",
    )
    contact_window: PositiveTime = Field(
        default=written("20 ms"),
        description="Time over which the force is averaged and the rows in contact are counted; "
        "choose several motor periods.",
    )
    deflation_rate: PositivePressureRate = Field(
        description="Rate of pressure decrease during deflation (Df_r^a in the thesis)."
    )
    motion_speed: PositiveVelocity = Field(
        default=written("20 mm/s"),
        description="The robot counts as moving when the mean forward speed of its frame, along "
        "its own axis, exceeds this value. Deflation ends when the robot has moved and then "
        "stops. Choose a value above the creep speed of the robot.",
    )
    slip_speed: PositiveVelocity = Field(
        default=written("5 mm/s"),
        description="Deflation also ends when the robot slips back at this mean speed. Choose a "
        "value above the speed at which deflation itself draws the robot back (1 to 2 mm in all).",
    )
    motion_window: PositiveTime = Field(
        default=written("200 ms"), description="Time over which the mean speed is computed."
    )
    least_rows: WholeNumber = Field(
        default=1,
        ge=0,
        description="Deflation also ends when this many rows of spikes have touched the wall and "
        "fewer do now. 0: never.",
    )
    count: Annotated[WholeNumber, Field(ge=1)] | None = Field(
        default=None,
        description="Number of cycles, after which the pressure stays constant. Default: no limit.",
    )

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
    """Return the time [s] between lowest and highest pressure; infinite if a value is unknown."""
    known = info.data
    if not {"highest", "lowest", rate} <= known.keys():
        return math.inf
    return float((known["highest"] - known["lowest"]) / known[rate])


CyclesOfPressure = Annotated[
    Annotated[CyclesProfile, Tag("rates")] | Annotated[PeriodicCycles[Pressure], Tag("period")],
    chosen_by_presence("rates", ("inflation_rate", "deflation_rate"), otherwise="period"),
]
FixedProfile = (
    Constant[Pressure] | Ramp[Pressure] | SmoothStep[Pressure] | Sine[Pressure]
    | TableSpec[Pressure] | CyclesOfPressure | NaturalDeflationProfile
)  # fmt: skip
PressureProfile = Annotated[FixedProfile | EventCyclesProfile, Field(discriminator="kind")]

LengthProfile = Annotated[
    Constant[Length]
    | Ramp[Length]
    | SmoothStep[Length]
    | Sine[Length]
    | TableSpec[Length]
    | PeriodicCycles[Length],
    Field(discriminator="kind"),
]
VelocityProfile = Annotated[
    Constant[Velocity]
    | Ramp[Velocity]
    | SmoothStep[Velocity]
    | Sine[Velocity]
    | TableSpec[Velocity]
    | PeriodicCycles[Velocity],
    Field(discriminator="kind"),
]
VolumeProfile = Annotated[
    Constant[Volume]
    | Ramp[Volume]
    | SmoothStep[Volume]
    | Sine[Volume]
    | TableSpec[Volume]
    | PeriodicCycles[Volume],
    Field(discriminator="kind"),
]
MassProfile = Annotated[
    Constant[Mass]
    | Ramp[Mass]
    | SmoothStep[Mass]
    | Sine[Mass]
    | TableSpec[Mass]
    | PeriodicCycles[Mass],
    Field(discriminator="kind"),
]
ForceProfile = Annotated[
    Constant[Force]
    | Ramp[Force]
    | SmoothStep[Force]
    | Sine[Force]
    | TableSpec[Force]
    | PeriodicCycles[Force],
    Field(discriminator="kind"),
]
StressProfile = Annotated[
    Constant[Pressure]
    | Ramp[Pressure]
    | SmoothStep[Pressure]
    | Sine[Pressure]
    | TableSpec[Pressure]
    | PeriodicCycles[Pressure],
    Field(discriminator="kind"),
]
ForceDensityProfile = Annotated[
    Constant[ForceDensity]
    | Ramp[ForceDensity]
    | SmoothStep[ForceDensity]
    | Sine[ForceDensity]
    | TableSpec[ForceDensity]
    | PeriodicCycles[ForceDensity],
    Field(discriminator="kind"),
]
FactorProfile = Annotated[
    FactorConstant
    | FactorRamp
    | FactorSmoothStep
    | FactorSine
    | TableSpec[Number]
    | FactorPeriodicCycles,
    Field(discriminator="kind"),
]


def is_ever_negative(profile: FixedProfile | EventCyclesProfile) -> bool:
    """Return True if a pressure over time is negative at any time: suction."""
    return any(value < 0.0 for value in profile.turns)


def ever_falls(profile: FixedProfile | EventCyclesProfile) -> bool:
    """Return True if a pressure over time falls at any time."""
    return any(later < earlier for earlier, later in pairwise(profile.turns))
