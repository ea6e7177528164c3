"""What a robot stands in: gravity, walls, contact."""

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator

from softsim.scene.part import ORIGIN, Part
from softsim.scene.quantities import (
    Angle,
    AutoOrPositiveLength,
    AutoOrPositiveStiffness,
    Direction,
    Length,
    Name,
    NotNegativeAcceleration,
    Number,
    Point,
    PositiveLength,
    Text,
    written,
)


class PipeWall(Part):
    """A straight pipe: in a section two walls along x, in space round and along x, in an
    axisymmetric model round about the axis y.
    """

    kind: Literal["pipe"] = Field(description="Kind of wall.")
    diameter: PositiveLength = Field(description="Inner diameter.")
    axis_height: Length = Field(
        default=written("0 mm"), description="y of the axis of a pipe along x."
    )


class PlaneWall(Part):
    """A half space, in a section a half plane."""

    kind: Literal["plane"] = Field(description="Kind of wall.")
    point: Point = Field(default=ORIGIN, description="A point on it.")
    normal: Direction = Field(
        default=(0.0, 1.0), description="Points out of the solid into the free side."
    )


class _GriddedWall(Part):
    spacing: AutoOrPositiveLength = Field(
        default="auto",
        description="Between the nodes of the grid of distances that stands for the wall; auto: "
        "the median edge of the bodies' surfaces, as their nodes feel nothing finer. The wall's "
        "edges are rounded off by about a third of it, a radius R is met within spacing^2 / (8 R) "
        "in the plane, twice that in space.",
    )


class PolylineWall(_GriddedWall):
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


class SurfaceWall(_GriddedWall):
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


Wall = Annotated[PipeWall | PlaneWall | PolylineWall | SurfaceWall, Field(discriminator="kind")]


class Environment(Part):
    """Gravity and walls."""

    gravity: NotNegativeAcceleration = Field(
        default=written("9.81 m/s^2"), description="Acceleration of gravity."
    )
    inclination: Angle = Field(
        default=written("0 deg"), description="Of +x above the horizontal; 90 deg: +x points up."
    )
    walls: dict[Name, Wall] = Field(default={}, description="Fixed walls, by name.")


class Contact(Part):
    """Penalty contact with Coulomb friction between surfaces and walls."""

    friction_coefficient: Number = Field(default=0.5, ge=0.0, description="Coulomb's mu.")
    penalty_stiffness: AutoOrPositiveStiffness = Field(
        default="auto", description="Of a node; auto: bulk modulus times thickness."
    )
    tangential_stiffness_ratio: Number = Field(
        default=1.0, gt=0.0, description="Stiffness while sticking, over penalty_stiffness."
    )
    damping_ratio: Number = Field(
        default=0.03, ge=0.0, le=1.0, description="Of the normal contact, of critical damping."
    )
