"""Tether that a robot trails behind it through a layout."""

from typing import Annotated

from pydantic import AfterValidator, Field

from softsim.scene.part import Part
from softsim.scene.quantities import Number, PositiveLineDensity, written


def _rising(limits: tuple[float, float]) -> tuple[float, float]:
    if limits[0] > limits[1]:
        raise ValueError(f"the lower limit must come first: [{limits[1]:g}, {limits[0]:g}]")
    return limits


FrictionCoefficient = Annotated[Number, Field(ge=0.0)]
Limits = Annotated[tuple[FrictionCoefficient, FrictionCoefficient], AfterValidator(_rising)]


class Trailed(Part):
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
