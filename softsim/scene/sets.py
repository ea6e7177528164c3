"""Sets of a body that a scene defines: the first key of each names its kind."""

from typing import Annotated

from pydantic import Field, Tag

from softsim.scene.part import Part, told_by_key
from softsim.scene.quantities import Direction, Point, Text

SEVERAL = Field(min_length=1)


class BoxSet(Part):
    """What lies in a box, its sides included."""

    box: tuple[Point, Point] = Field(
        description="Two opposite corners, such as [[0 mm, 0 mm], [2 mm, 5 mm]]; in space of three "
        "coordinates each. In the scene's coordinates, after position and rotation."
    )


class Plane(Part):
    """A plane, in a section a line."""

    point: Point = Field(
        description="Of the plane, in the scene's coordinates, after position and rotation."
    )
    normal: Direction = Field(
        description="Points to the side that is meant; its length does not matter."
    )


class PlaneSet(Part):
    """What lies on one side of a plane, the plane included."""

    plane: Plane = Field(description="The plane: {point: [0 mm, 2 mm], normal: [0, 1]}.")


class UnionSet(Part):
    """What is in any of some sets."""

    union: Annotated[tuple[Text, ...], SEVERAL] = Field(
        description="Sets of this body, of its mesh or defined beside this one: [tips, upper]."
    )


class IntersectionSet(Part):
    """What is in all of some sets."""

    intersection: Annotated[tuple[Text, ...], SEVERAL] = Field(
        description="Sets of this body, of its mesh or defined beside this one: [surface, upper]."
    )


class DifferenceSet(Part):
    """What is in one set and not in another."""

    difference: tuple[Text, Text] = Field(
        description="Sets of this body, of its mesh or defined beside this one: [surface, tips] is "
        "the first without the second."
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
