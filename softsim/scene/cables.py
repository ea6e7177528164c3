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
    """Cable (tube, wire, thread) with stretching and bending stiffness, without torsional
    stiffness, stress-free when straight. It touches walls, but no bodies. Its node sets are
    NAME.start and NAME.end (the ends), NAME.start_segment and NAME.end_segment (two nodes, which
    also hold the direction of an end), and NAME.all. The history gets a column NAME_tension, the
    tension of the first segment that is not held.
    """

    points: Annotated[tuple[Point, ...], Field(min_length=2)] = Field(
        description="Vertices of the line along which the cable lies at the start, unstretched."
    )
    segment_length: PositiveLength = Field(
        description="Approximate distance between nodes; the number of segments is rounded."
    )
    diameter: PositiveLength = Field(description="Outer diameter, used for contact with walls.")
    mass_per_length: PositiveLineDensity = Field(description="Mass per length.")
    stretching_stiffness: PositiveForce = Field(description="Axial stiffness E A.")
    bending_stiffness: NotNegativeBendingStiffness = Field(
        description="Bending stiffness E I; for a tube E pi (D^4 - d^4) / 64."
    )
    friction_coefficient: Number | None = Field(
        default=None,
        ge=0.0,
        description="Friction coefficient on walls. Default: `contact.friction_coefficient`.",
    )
    end_drag: NotNegativeForce = Field(
        default=written("0 N"),
        description="Coulomb friction along the cable at its end, which represents a continuation "
        "that is not simulated. At rest it resists up to this force.",
    )
