"""Walls that go through a grid of distances: an STL surface in space."""

from typing import Literal

from pydantic import Field

from softsim.scene.part import ORIGIN, Part
from softsim.scene.quantities import (
    AutoOrPositiveLength,
    Point,
    PositiveLength,
    Text,
    written,
)


class SurfaceWall(Part):
    """A closed surface in space from an STL file."""

    kind: Literal["surface"] = Field(description="Kind of wall.")
    file: Text = Field(description="Path of the STL, relative to the file that says so.")
    length_unit: PositiveLength = Field(
        default=written("1 mm"), description="Length of one unit in the file."
    )
    position: Point = Field(default=ORIGIN, description="Where the file's origin is placed.")
    free_side: Literal["inside", "outside"] = Field(
        description="inside: the surface is that of the hollow, such as the bore of a pipe; "
        "outside: that of something solid, which may have a bore."
    )
    spacing: AutoOrPositiveLength = Field(
        default="auto",
        description="Between the nodes of the grid of distances that stands for the wall; auto: "
        "the median edge of the bodies' surfaces, as their nodes feel nothing finer. The wall's "
        "edges are rounded off by about a third of it, a radius R is met within "
        "spacing^2 / (4 R).",
    )
