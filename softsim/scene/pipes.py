"""Items of the layout of a pipe; the first key of each names its kind."""

import math
from typing import Annotated

from pydantic import AfterValidator, Field, Tag, field_validator, model_validator

from softsim.scene.quantities import (
    Angle,
    Name,
    Number,
    PositiveLength,
    PositiveLineDensity,
    Spec,
    chosen_by_key,
    written,
)

DIAMETER = Field(
    default=None,
    description="Diameter of the pipe at the start of this item, which must equal that at the "
    "end of the previous item. It can be left out.",
)


class StraightItem(Spec):
    """Straight pipe."""

    straight: PositiveLength = Field(description="Length.")
    diameter: PositiveLength | None = DIAMETER


class BendItem(Spec):
    """Bend along a circular arc."""

    bend: Angle = Field(
        description="Angle of the bend; positive to the left (towards +y for a path that starts "
        "along +x)."
    )
    radius: PositiveLength = Field(description="Radius of the centre line.")
    turned: Angle = Field(
        default=written("0 deg"),
        description="In 3D: rotation of the plane of the bend about the direction of travel, "
        "measured from the left.",
    )
    diameter: PositiveLength | None = DIAMETER

    @field_validator("bend")
    @classmethod
    def _less_than_a_turn(cls, bend: float) -> float:
        if bend == 0.0:
            raise ValueError("a bend must not be 0: use straight instead")
        if abs(bend) >= 2.0 * math.pi:
            raise ValueError("a bend must be less than 360 deg, or it would cross itself")
        return bend


class TaperItem(Spec):
    """Conical transition to another diameter."""

    taper: PositiveLength = Field(description="Length along the axis.")
    to: PositiveLength = Field(description="Diameter at the end.")
    diameter: PositiveLength | None = DIAMETER


class StepItem(Spec):
    """Sudden change of the diameter."""

    step: PositiveLength = Field(description="New diameter.")
    diameter: PositiveLength | None = DIAMETER


LEAVING = Field(
    default=None,
    description="Diameter of the branches. Default: that of the pipe. It must not be larger, "
    "or, for a tee at which the pipe ends, not smaller.",
)
FILLET = Field(
    default=written("2 mm"), description="Radius of the edges between the walls of the pipes."
)
TURNED = Field(
    default=written("0 deg"),
    description="In 3D: rotation of the branches about the direction of travel, measured from "
    "the left.",
)


class TeeItem(Spec):
    """Tee: one branch leaves at a right angle from the middle of a straight fitting, or two
    branches leave to both sides and the pipe ends.
    """

    tee: PositiveLength = Field(description="Length of the fitting from end to end.")
    left: Name | None = Field(default=None, description="Name of the branch to the left.")
    right: Name | None = Field(default=None, description="Name of the branch to the right.")
    turned: Angle = TURNED
    to: PositiveLength | None = LEAVING
    fillet: PositiveLength = FILLET
    diameter: PositiveLength | None = DIAMETER

    @model_validator(mode="after")
    def _leads_somewhere(self) -> "TeeItem":
        if self.left is None and self.right is None:
            raise ValueError("a tee leads to a branch: write left: NAME, right: NAME or both")
        return self


class CrossItem(Spec):
    """Cross: two branches leave at right angles from the middle of a straight
    fitting, and the pipe continues.
    """

    cross: PositiveLength = Field(description="Length of the fitting from end to end.")
    left: Name = Field(description="Name of the branch to the left.")
    right: Name = Field(description="Name of the branch to the right.")
    turned: Angle = TURNED
    to: PositiveLength | None = LEAVING
    fillet: PositiveLength = FILLET
    diameter: PositiveLength | None = DIAMETER


ITEMS: dict[str, type[Spec]] = {
    "straight": StraightItem, "bend": BendItem, "taper": TaperItem, "step": StepItem,
    "tee": TeeItem, "cross": CrossItem,
}  # fmt: skip


PipeItem = Annotated[
    Annotated[StraightItem, Tag("straight")]
    | Annotated[BendItem, Tag("bend")]
    | Annotated[TaperItem, Tag("taper")]
    | Annotated[StepItem, Tag("step")]
    | Annotated[TeeItem, Tag("tee")]
    | Annotated[CrossItem, Tag("cross")],
    chosen_by_key(ITEMS),
]


# -------------------------------------------------------------------------------------------------
# Tether that a robot trails behind it through a layout.


def _rising(limits: tuple[float, float]) -> tuple[float, float]:
    if limits[0] > limits[1]:
        raise ValueError(f"the lower limit must come first: [{limits[1]:g}, {limits[0]:g}]")
    return limits


FrictionCoefficient = Annotated[Number, Field(ge=0.0)]
Limits = Annotated[tuple[FrictionCoefficient, FrictionCoefficient], AfterValidator(_rising)]


class Trailed(Spec):
    """Tether for `softsim reach`, which computes how far a robot gets through a layout with it.

    The defaults are the PufferFace Robot's air line, a polyurethane tube of 2 mm with a bore of
    1.2 mm and wires of 0.6 g/m (assumed), on acrylic (thesis, 6.5).
    """

    mass_per_length: PositiveLineDensity = Field(
        default=written("3 g/m"), description="Mass per length of tube and wires together."
    )
    friction_coefficient: Limits = Field(
        default=(0.5, 0.75),
        description="Lower and upper limit of the friction coefficient on the pipe.",
    )
