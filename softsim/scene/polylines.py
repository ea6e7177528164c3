"""Walls along a polyline, sharp at its corners."""

from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from softsim.scene.part import Part
from softsim.scene.quantities import Point, PositiveLength, Text, written


class PolylineWall(Part):
    """A terrain, or the outline of a pipe: straight between points, its corners sharp. The free
    side is on the left when walking along them: points towards +x are a ground. In space it is the
    same at every z.
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
