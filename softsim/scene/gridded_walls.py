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
    """Closed surface from an STL file (3D)."""

    kind: Literal["surface"] = Field(description="Kind of wall.")
    file: Text = Field(
        description="Path of the STL file, relative to the file in which it is given."
    )
    length_unit: PositiveLength = Field(
        default=written("1 mm"), description="Length of one unit in the file."
    )
    position: Point = Field(default=ORIGIN, description="Position of the file's origin.")
    free_side: Literal["inside", "outside"] = Field(
        description="Side on which bodies are. inside: the surface bounds a cavity, such as the "
        "bore of a pipe. outside: it bounds a solid, which may have a bore."
    )
    spacing: AutoOrPositiveLength = Field(
        default="auto",
        description="Grid spacing of the distance field that represents the wall. auto: the "
        "median edge of the bodies' surface facets. Edges are rounded by about a third of the "
        "spacing; a surface of radius R is approximated within spacing^2 / (4 R).",
    )
