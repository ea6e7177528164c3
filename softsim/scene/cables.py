"""Cables: tubes, wires, threads."""

from typing import Annotated

from pydantic import Field

from softsim.scene.part import Part
from softsim.scene.quantities import (
    NotNegativeBendingStiffness,
    NotNegativeForce,
    Number,
    Point,
    PositiveForce,
    PositiveLength,
    PositiveLineDensity,
    written,
)


class Cable(Part):
    """A cable that resists stretching and bending, not twist; straight where nothing bends it. It
    touches walls, no bodies. All that takes a node set takes its own: NAME.start and NAME.end, its
    ends; NAME.start_segment and NAME.end_segment, which hold an end's direction too where they are
    tied or fixed; NAME.all. The history gets a column NAME_tension, of the first segment that is
    not held.
    """

    points: Annotated[tuple[Point, ...], Field(min_length=2)] = Field(
        description="Corners of the line along which it lies at the start, unstretched."
    )
    segment_length: PositiveLength = Field(
        description="Between its nodes, about: there is a whole number of segments."
    )
    diameter: PositiveLength = Field(description="Of its outside, which touches walls.")
    mass_per_length: PositiveLineDensity = Field(description="Mass over length.")
    stretching_stiffness: PositiveForce = Field(description="E A: force over strain.")
    bending_stiffness: NotNegativeBendingStiffness = Field(
        description="E I: moment over curvature; of a tube E pi (D^4 - d^4) / 64."
    )
    friction_coefficient: Number | None = Field(
        default=None, ge=0.0, description="On walls; contact.friction_coefficient by default."
    )
    end_drag: NotNegativeForce = Field(
        default=written("0 N"),
        description="Coulomb friction on its end, along it, of what goes on beyond and is not "
        "simulated; at rest it holds up to this.",
    )
