"""Walls that come as points or triangles: a polyline in a section, an STL surface in space."""

from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from softsim.scene.part import ORIGIN, Part
from softsim.scene.quantities import (
    AutoOrPositiveLength,
    Point,
    PositiveLength,
    Text,
    written,
)


class GriddedWall(Part):
    """A wall that goes through a grid of distances."""

    spacing: AutoOrPositiveLength = Field(
        default="auto",
        description="Between the nodes of the grid of distances that stands for the wall; auto: "
        "the median edge of the bodies' surfaces, as their nodes feel nothing finer. The wall's "
        "edges are rounded off by about a third of it, a radius R is met within spacing^2 / (8 R) "
        "in the plane, twice that in space.",
    )


class PolylineWall(GriddedWall):
    """A terrain, or the outline of a pipe, in a section: straight between points. The free side is
    on the left when walking along them: points towards +x are a ground.
    """

    kind: Literal["polyline"] = Field(description="Kind of wall.")
    points: tuple[Point, ...] | None = Field(
        default=None, description="One after the other; or give a file."
    )
    file: Text | None = Field(
        default=None,
        validate_default=True,
        description="Text table of the points, x and y in a line, relative to the file that says "
        "so.",
    )
    length_unit: PositiveLength = Field(
        default=written("1 mm"), description="Length of one unit in the file."
    )
    closed: bool = Field(
        default=False,
        strict=True,
        description="Whether the last point is joined to the first; otherwise the first and the "
        "last piece go on straight beyond them, without an end.",
    )

    @field_validator("file")
    @classmethod
    def _points_or_file(cls, file: str | None, info: ValidationInfo) -> str | None:
        points = info.data.get("points", ())
        if points is None and file is None:
            raise ValueError("a polyline needs points, or a file that has them")
        if points and file is not None:
            raise ValueError("has its points already: give points or a file")
        return file


class SurfaceWall(GriddedWall):
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
