"""Walls along a polyline, sharp at its corners."""

from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from softsim.scene.part import Part
from softsim.scene.quantities import Point, PositiveLength, Text, written


class PolylineWall(Part):
    """Polyline with sharp corners: a terrain, or the outline of a pipe. The free side is on the
    left in the direction of the points, so that points towards +x form a ground. In 3D it is
    extruded along z.
    """

    kind: Literal["polyline"] = Field(description="Kind of wall.")
    points: tuple[Point, ...] | None = Field(
        default=None, description="Points in order. Give either points or a file."
    )
    file: Text | None = Field(
        default=None,
        validate_default=True,
        description="Text file with x and y of a point in each line. The path is relative to the "
        "file in which it is given.",
    )
    length_unit: PositiveLength = Field(
        default=written("1 mm"), description="Length of one unit in the file."
    )
    closed: bool = Field(
        default=False,
        strict=True,
        description="True joins the last point to the first. Otherwise the first and the last "
        "segment are extended without end.",
    )

    @field_validator("file")
    @classmethod
    def _points_or_file(cls, file: str | None, info: ValidationInfo) -> str | None:
        points = info.data.get("points", ())
        if points is None and file is None:
            raise ValueError("a polyline needs points, or a file with points")
        if points and file is not None:
            raise ValueError("already has points: give points or a file")
        return file
