"""Sets of a body that a scene defines; the first key of each names its kind."""

from typing import Annotated

from pydantic import Field, Tag

from softsim.scene.part import Part, told_by_key
from softsim.scene.quantities import Direction, Point, Text

SEVERAL = Field(min_length=1)


class BoxSet(Part):
    """Everything inside a box, including its faces."""

    box: tuple[Point, Point] = Field(
        description="Two opposite corners, such as [[0 mm, 0 mm], [2 mm, 5 mm]], in 3D with three "
        "coordinates. In coordinates of the scene, after `position` and `rotation` of the body."
    )


class Plane(Part):
    """Plane; in 2D a line."""

    point: Point = Field(
        description="Point on the plane in coordinates of the scene, after `position` and "
        "`rotation` of the body."
    )
    normal: Direction = Field(description="Normal that points to the selected side, of any length.")


class PlaneSet(Part):
    """Everything on one side of a plane, including the plane."""

    plane: Plane = Field(description="Plane, such as {point: [0 mm, 2 mm], normal: [0, 1]}.")


class UnionSet(Part):
    """Union of sets."""

    union: Annotated[tuple[Text, ...], SEVERAL] = Field(
        description="Sets of this body, from its mesh or from `sets`: [tips, upper]."
    )


class IntersectionSet(Part):
    """Intersection of sets."""

    intersection: Annotated[tuple[Text, ...], SEVERAL] = Field(
        description="Sets of this body, from its mesh or from `sets`: [surface, upper]."
    )


class DifferenceSet(Part):
    """Difference of two sets."""

    difference: tuple[Text, Text] = Field(
        description="Two sets of this body, from its mesh or from `sets`: [surface, tips] is the "
        "first without the second."
    )


DEFINITIONS: dict[str, type[Part]] = {
    "box": BoxSet, "plane": PlaneSet, "union": UnionSet, "intersection": IntersectionSet,
    "difference": DifferenceSet,
}  # fmt: skip

SetDefinition = Annotated[
    Annotated[BoxSet, Tag("box")]
    | Annotated[PlaneSet, Tag("plane")]
    | Annotated[UnionSet, Tag("union")]
    | Annotated[IntersectionSet, Tag("intersection")]
    | Annotated[DifferenceSet, Tag("difference")],
    told_by_key(DEFINITIONS),
]
