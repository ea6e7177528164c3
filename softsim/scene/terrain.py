"""Terrains (ramps, semicircles, step fields), and the test whether a body crosses them."""

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
        raise ValueError(
            f"{math.degrees(slope):.6g} deg: a slope must be greater than 0 and at most 90 deg"
        )
    return slope


class Terrain(Part):
    """Obstacle on level ground that extends without end on both sides. In 3D it is
    extruded along z.
    """

    kind: str
    foot: Point = Field(default=ORIGIN, description="Start of the obstacle.")

    @property
    @abstractmethod
    def crossed(self) -> float:
        """Distance [m] from the foot to the point where a body has crossed the terrain."""


class PrintedTerrain(Terrain):
    """Obstacle with the optional stair steps of a 3D print."""

    layers: PositiveLength | None = Field(
        default=None,
        description="Layer thickness of a 3D print, which gives the surface stair steps. Default: "
        "a smooth surface.",
    )


class RampWall(PrintedTerrain):
    """Ramp up to a plateau with a vertical end."""

    kind: Literal["ramp"] = Field(description="Kind of wall.")
    slope: Annotated[Angle, AfterValidator(_up_to_upright)] = Field(
        description="Angle of the ramp; 90 deg is a step."
    )
    height: PositiveLength = Field(description="Height of the plateau.")
    plateau: PositiveLength = Field(
        default=written("300 mm"),
        description="Length of the plateau, longer than the ramp is high.",
    )

    @property
    def crossed(self) -> float:
        """Distance [m] from the foot of the ramp to its upper edge."""
        return self.height / math.tan(self.slope) if self.slope < 0.5 * math.pi - 1e-9 else 0.0


class SemicircleWall(PrintedTerrain):
    """Semicircular obstacle: the upper half of a cylinder across the path."""

    kind: Literal["semicircle"] = Field(description="Kind of wall.")
    radius: PositiveLength = Field(description="Radius of the cylinder.")

    @property
    def crossed(self) -> float:
        """Distance [m] between both feet of the semicircle."""
        return 2.0 * self.radius


class StepFieldWall(Terrain):
    """Step field: blocks side by side, whose random heights are whole millimetres
    from 1 to 8.
    """

    kind: Literal["step_field"] = Field(description="Kind of wall.")
    rugosity: Number = Field(
        gt=0.0, description="Standard deviation of the block heights divided by 8 mm."
    )
    mean_height: PositiveLength = Field(
        default=written("4.66 mm"), description="Mean of the block heights."
    )
    blocks: WholeNumber = Field(default=70, ge=2, le=10_000, description="Number of blocks.")
    block_length: PositiveLength = Field(default=written("10 mm"), description="Length of a block.")
    seed: WholeNumber = Field(default=1, ge=0, description="Seed of the random heights.")

    @property
    def crossed(self) -> float:
        """Distance [m] from the foot to the end of the last block."""
        return self.blocks * self.block_length


class Crossing(Part):
    """Test whether a body crosses its terrain along x before `time.end`. The run ends as soon as
    the body has passed or is stuck.
    """

    body: Text | None = Field(default=None, description="Name of the body. Default: the first one.")
    goal: Length | None = Field(
        default=None,
        description="x coordinate that the rear end of the body must pass. Default: the upper "
        "edge of the ramp, the far foot of the semicircle or the end of the step field, if the "
        "scene has one of them.",
    )
    patience: PositiveTime | None = Field(
        default=None,
        description="The body counts as stuck, and the run ends, if its rear end advances less "
        "than 2 % of the body length in this time. Default: no limit before `time.end`.",
    )
