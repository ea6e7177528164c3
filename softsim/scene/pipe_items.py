"""The items of the layout of a pipe: the first key of each names its kind."""

import math
from typing import Annotated

from pydantic import Field, Tag, field_validator, model_validator

from softsim.scene.part import Part, told_by_key
from softsim.scene.quantities import Angle, Name, PositiveLength, written

DIAMETER = Field(
    default=None, description="Of the pipe where it begins: the same as where the last item ended."
)


class StraightItem(Part):
    """Straight on."""

    straight: PositiveLength = Field(description="Its length.")
    diameter: PositiveLength | None = DIAMETER


class BendItem(Part):
    """An arc."""

    bend: Angle = Field(
        description="Angle by which the direction changes; positive to the left, towards +y where "
        "the path begins along +x."
    )
    radius: PositiveLength = Field(description="Of the centre line.")
    turned: Angle = Field(
        default=written("0 deg"),
        description="In space: about the direction of travel, from the left to where it bends.",
    )
    diameter: PositiveLength | None = DIAMETER

    @field_validator("bend")
    @classmethod
    def _less_than_a_turn(cls, bend: float) -> float:
        if bend == 0.0:
            raise ValueError("a bend must not be 0: write straight: instead")
        if abs(bend) >= 2.0 * math.pi:
            raise ValueError("a bend must be less than 360 deg: it would run into itself")
        return bend


class TaperItem(Part):
    """A cone to another diameter."""

    taper: PositiveLength = Field(description="Its length along the axis.")
    to: PositiveLength = Field(description="Diameter at its end.")
    diameter: PositiveLength | None = DIAMETER


class StepItem(Part):
    """A sudden change of the diameter, without length."""

    step: PositiveLength = Field(description="Diameter from here on.")
    diameter: PositiveLength | None = DIAMETER


LEAVING = Field(
    default=None,
    description="Diameter of the pipes to its sides: that of the pipe by default; at most that, or "
    "at least, where the pipe ends in a tee.",
)
FILLET = Field(default=written("2 mm"), description="Radius of the edges between the pipes' walls.")
TURNED = Field(
    default=written("0 deg"),
    description="In space: about the direction of travel, from the left to where left is.",
)


class TeeItem(Part):
    """A pipe leaves at a right angle in the middle of a straight fitting; or two to both sides,
    where this one ends.
    """

    tee: PositiveLength = Field(description="Length of the fitting, from end to end.")
    left: Name | None = Field(default=None, description="Branch that leaves to the left.")
    right: Name | None = Field(default=None, description="Branch that leaves to the right.")
    turned: Angle = TURNED
    to: PositiveLength | None = LEAVING
    fillet: PositiveLength = FILLET
    diameter: PositiveLength | None = DIAMETER

    @model_validator(mode="after")
    def _leads_somewhere(self) -> "TeeItem":
        if self.left is None and self.right is None:
            raise ValueError("a tee leads to a branch: write left: NAME, right: NAME or both")
        return self


class CrossItem(Part):
    """Two pipes leave at right angles in the middle of a straight fitting, which goes on."""

    cross: PositiveLength = Field(description="Length of the fitting, from end to end.")
    left: Name = Field(description="Branch that leaves to the left.")
    right: Name = Field(description="Branch that leaves to the right.")
    turned: Angle = TURNED
    to: PositiveLength | None = LEAVING
    fillet: PositiveLength = FILLET
    diameter: PositiveLength | None = DIAMETER


ITEMS: dict[str, type[Part]] = {
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
    told_by_key(ITEMS),
]
