"""Fibres in bodies: threads, wires."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from softsim.scene.part import Part
from softsim.scene.quantities import (
    Angle,
    Axis,
    Name,
    NotNegativeLength,
    Number,
    Point,
    PositiveDensity,
    PositiveLength,
    PositivePressure,
    written,
)


class Helix(Part):
    """A line wound about an axis, on which it advances along x, y or z; without a pitch a ring."""

    center: Point = Field(description="Where it starts on its axis.")
    direction: Axis = Field(description="Of its axis.")
    radius: PositiveLength = Field(description="Of the cylinder that it is wound on.")
    pitch: NotNegativeLength = Field(
        description="Along the axis in one turn; of a ring 0 mm. Its angle with the axis has the "
        "tangent 2 pi radius / pitch."
    )
    turns: Number = Field(gt=0.0, description="How many, not only whole ones.")
    handedness: Literal["right", "left"] = Field(
        default="right", description="right: as a common screw, turning about its direction."
    )
    start_angle: Angle = Field(
        default=written("0 deg"),
        description="Where it starts, about its direction: from y if that is x, from z if it is y, "
        "from x if it is z.",
    )


class Fibre(Part):
    """A thread or wire in a body or wound on it, which follows it everywhere. It resists
    stretching, by Hooke's law and its engineering strain, and not bending; it goes slack when
    pressed. The history gets a column NAME_tension, of the place with the largest one.
    """

    body: Name = Field(description="That it lies in.")
    points: Annotated[tuple[Point, ...], Field(min_length=2)] | None = Field(
        default=None, description="Corners of the line along which it lies, unstretched."
    )
    helix: Helix | None = Field(default=None, description="Instead of points: a line that winds.")
    spacing: PositiveLength = Field(
        description="Between its places that elements hold, about: there is a whole number of bars "
        "from corner to corner. About half an element."
    )
    tolerance: PositiveLength | None = Field(
        default=None,
        description="How far it may lie outside the body, onto which it is moved; by default 5 % "
        "of the mean side of the facets of its surface.",
    )
    diameter: PositiveLength = Field(description="Of its round section; it takes no room.")
    youngs_modulus: PositivePressure = Field(description="Young's modulus.")
    density: PositiveDensity = Field(description="Mass over volume.")
    bears_compression: bool = Field(
        default=False, strict=True, description="Whether it pushes when it is pressed, as a wire "
        "that cannot buckle does."
    )  # fmt: skip

    @model_validator(mode="after")
    def _has_one_line(self) -> "Fibre":
        if (self.points is None) == (self.helix is None):
            raise ValueError("lies along either points or a helix: give one of them")
        return self
