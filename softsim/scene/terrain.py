"""Grounds of known shape: ramps, half rounds, fields of steps; the question whether a
body crosses them.
"""

import math
from abc import abstractmethod
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from softsim.scene.part import ORIGIN, Part
from softsim.scene.quantities import (
    Angle,
    Length,
    Number,
    Point,
    PositiveLength,
    PositiveTime,
    Text,
    WholeNumber,
    written,
)


def _up_to_upright(slope: float) -> float:
    if not 0.0 < slope <= math.radians(90.0) * (1.0 + 1e-12):
        raise ValueError(f"{math.degrees(slope):.6g} deg: a slope is above 0 and up to 90 deg")
    return slope


class Terrain(Part):
    """What stands on level ground, which goes on without an end on both sides of it; in space it is
    the same at every z.
    """

    kind: str
    foot: Point = Field(default=ORIGIN, description="Where it begins.")

    @property
    @abstractmethod
    def crossed(self) -> float:
        """From the foot to where a body is over [m]."""


class PrintedTerrain(Terrain):
    """One that is printed, in layers where these are told."""

    layers: PositiveLength | None = Field(
        default=None, description="Thickness of the layers of a print; by default it is smooth."
    )


class RampWall(PrintedTerrain):
    """Up by a slope, along a plateau, and down at once."""

    kind: Literal["ramp"] = Field(description="Kind of wall.")
    slope: Annotated[Angle, AfterValidator(_up_to_upright)] = Field(
        description="Of its way up; 90 deg is a step."
    )
    height: PositiveLength = Field(description="Of the plateau.")
    plateau: PositiveLength = Field(
        default=written("300 mm"), description="Its length, longer than the ramp is high."
    )

    @property
    def crossed(self) -> float:
        """From the foot to the upper edge [m]."""
        return self.height / math.tan(self.slope) if self.slope < 0.5 * math.pi - 1e-9 else 0.0


class SemicircleWall(PrintedTerrain):
    """The upper half of a cylinder that lies across the way."""

    kind: Literal["semicircle"] = Field(description="Kind of wall.")
    radius: PositiveLength = Field(description="Of the cylinder.")

    @property
    def crossed(self) -> float:
        """From the foot to the far one [m]."""
        return 2.0 * self.radius


class StepFieldWall(Terrain):
    """Blocks of whole millimetres, 1 to 8, side by side: as rough as they are told to be."""

    kind: Literal["step_field"] = Field(description="Kind of wall.")
    rugosity: Number = Field(
        gt=0.0, description="Standard deviation of the blocks' heights over 8 mm."
    )
    mean_height: PositiveLength = Field(
        default=written("4.66 mm"), description="Mean of the blocks' heights."
    )
    blocks: WholeNumber = Field(default=70, ge=2, le=10_000, description="How many.")
    block_length: PositiveLength = Field(default=written("10 mm"), description="Of each.")
    seed: WholeNumber = Field(default=1, ge=0, description="Of the draw: another shuffle.")

    @property
    def crossed(self) -> float:
        """From the foot to the end of the last block [m]."""
        return self.blocks * self.block_length


class Crossing(Part):
    """Asks whether a body gets over its ground, along x, before `time.end`. The run ends when it
    has, or has lost patience.
    """

    body: Text | None = Field(default=None, description="Which; the first by default.")
    goal: Length | None = Field(
        default=None,
        description="x that its rear end must be past; by default the upper edge of a ramp, the "
        "far foot of a semicircle, the end of a field of steps, where the scene has one of them.",
    )
    patience: PositiveTime | None = Field(
        default=None,
        description="Time after which a body is stuck whose rear end came no farther by 2 % of its "
        "length: the run ends. By default it goes on until `time.end`.",
    )
