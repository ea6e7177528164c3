"""Deformable and rigid bodies."""

import math
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from softsim.scene.meshes import MeshSource
from softsim.scene.part import AT_REST, ORIGIN, Part
from softsim.scene.quantities import (
    Angle,
    AngularVelocity,
    AutoOrPositiveLength,
    Axis,
    Inertia,
    Name,
    Number,
    Point,
    PositiveLength,
    PositiveMass,
    SetReference,
    Text,
    VelocityVector,
    written,
)
from softsim.scene.sets import SetDefinition

Formulation = Literal["plane_strain", "axisymmetric", "ring_section", "solid"]
Freedom = Literal["x", "y", "z", "rotation", "rotation_x", "rotation_y", "rotation_z"]


class Region(Part):
    """Cells of a body that differ from the others; what is not given is as the body's."""

    material: Text | None = Field(
        default=None, description="A name of the scene's materials or of the library."
    )
    thickness: PositiveLength | None = Field(
        default=None, description="As the body's, of a plane_strain or ring_section model."
    )

    @model_validator(mode="after")
    def _differs(self) -> "Region":
        if self.material is None and self.thickness is None:
            raise ValueError("a region has a material or a thickness of its own: give either")
        return self


class Body(Part):
    """A deformable body."""

    mesh: MeshSource = Field(description="From a generator, or from a file.")
    formulation: Formulation = Field(
        description="Kinematics of the elements: plane_strain, axisymmetric (x is the radius, y "
        "the axis) and ring_section (x is the axis; two strips, opposite sides of the same rings) "
        "take triangles and quadrilaterals, solid takes tetrahedra and hexahedra."
    )
    thickness: PositiveLength | None = Field(
        default=None,
        validate_default=True,
        description="Depth of a plane_strain model; in a ring_section of what does not go around.",
    )
    sector: Angle | None = Field(
        default=None,
        validate_default=True,
        gt=0.0,
        le=math.pi,
        description="Part of the circumference that each strip of a ring_section stands for, "
        "at most 180 deg.",
    )
    rings: Text | None = Field(
        default=None,
        validate_default=True,
        description="Cell set of a ring_section that goes around the axis.",
    )
    material: Text = Field(description="A name of the scene's materials or of the library.")
    regions: dict[Name, Region] = Field(
        default={},
        description="Cell sets with a material or a thickness of their own, by name: "
        "{spikes: {material: dragon_skin_30}}. Sets of the mesh (the robots' skin and spikes, "
        "gmsh's physical groups, ABAQUS's element sets) or of `sets`. Cells in none are as the "
        "body says; none is in two.",
    )
    position: Point = Field(default=ORIGIN, description="Where the mesh's origin is placed.")
    rotation: Angle = Field(
        default=written("0 deg"), description="Turn about the mesh's origin, before that."
    )
    mirror: Axis | None = Field(
        default=None,
        description="Mirrored across the plane through the mesh's origin at right angles to this "
        "axis, before it is turned.",
    )
    initial_velocity: VelocityVector = Field(default=AT_REST, description="Of all its nodes.")
    sets: dict[Name, SetDefinition] = Field(
        default={},
        description="Further node, facet and cell sets of the body, by name, for all that takes "
        "body.set: {tips: {box: [[0 mm, 0 mm], [2 mm, 5 mm]]}}. A box or a side of a plane has the "
        "nodes there, and the facets of the surface and the cells with all corners there; union, "
        "intersection and difference act on the nodes of sets, on their facets and on their cells.",
    )
    fixed: tuple[Text, ...] = Field(
        default=(), description="Its node sets held in place, in every direction."
    )

    @field_validator("thickness", "sector", "rings")
    @classmethod
    def _given_where_it_means_something(cls, value: Any, info: ValidationInfo) -> Any:
        formulation = info.data.get("formulation")
        meant = {"thickness": ("plane_strain", "ring_section")}
        having = meant.get(info.field_name or "", ("ring_section",))
        if formulation in having and value is None:
            needed = {"rings": "the name of its rings"}.get(
                info.field_name or "", f"a {info.field_name}"
            )
            raise ValueError(f"a {formulation} body needs {needed}")
        if formulation not in (*having, None) and value is not None:
            raise ValueError(f"has no meaning for a body that is {formulation}: leave it out")
        return value


class CylinderOutline(Part):
    """A cylinder around a rigid body's centre, along x (along the axis y where the model is
    axisymmetric); in a section a rectangle.
    """

    length: PositiveLength = Field(description="Along its axis.")
    height: PositiveLength = Field(description="Its diameter.")


class BallOutline(Part):
    """A ball around a rigid body's centre; in a section a disc."""

    radius: PositiveLength = Field(description="Its radius.")


class RigidSurface(Part):
    """The closed surface of a rigid body, which touches walls at its corners and, where
    `contact.self_contact` names it, the surfaces of deformable bodies.
    """

    file: Text | None = Field(
        default=None,
        description="STL file of a closed surface in space, or a mesh (gmsh .msh, VTK .vtu, ABAQUS "
        ".inp) whose boundary is the surface, with straight sides between the corners of its "
        "cells; relative to the file that says so.",
    )
    points: tuple[Point, ...] | None = Field(
        default=None,
        validate_default=True,
        description="In a section, instead of a file: corners of a polygon, one after the other.",
    )
    length_unit: PositiveLength = Field(
        default=written("1 mm"), description="Length of one unit in the file."
    )
    position: Point = Field(
        default=ORIGIN, description="Where the origin of the file or of the points is placed."
    )
    rotation: Angle = Field(
        default=written("0 deg"), description="Turn about that origin, in the x-y plane, before it."
    )
    element_size: AutoOrPositiveLength = Field(
        default="auto",
        description="Longest side of its facets: longer ones are divided, as contact acts at "
        "single points of facets. auto: the median side of the deformable bodies' facets.",
    )

    @field_validator("points")
    @classmethod
    def _file_or_points(
        cls, points: tuple[Any, ...] | None, info: ValidationInfo
    ) -> tuple[Any, ...] | None:
        if (points is None) == (info.data.get("file") is None):
            raise ValueError("a surface has either a file or points: give one of them")
        return points


def _outline_kind(value: Any) -> str:
    ball = "radius" in value if isinstance(value, dict) else isinstance(value, BallOutline)
    return "ball" if ball else "cylinder"


Outline = Annotated[
    Annotated[CylinderOutline, Tag("cylinder")] | Annotated[BallOutline, Tag("ball")],
    Discriminator(_outline_kind),
]


class RigidBody(Part):
    """A rigid body with mass, inertia and three degrees of freedom, in space six."""

    mass: PositiveMass | None = Field(default=None, description="Without the nodes tied to it.")
    total_mass: PositiveMass | None = Field(
        default=None, description="Instead of mass: with the deformable bodies tied to it."
    )
    inertia: Inertia = Field(
        description="About its centre, without tied nodes: about z, or in space about x, y and z "
        "(one number there: the same about all)."
    )
    center: Point = Field(default=ORIGIN, description="Centre of mass.")
    tied: tuple[SetReference, ...] = Field(
        default=(), description='Node sets that move with it: "skin.knots".'
    )
    outline: Outline | None = Field(default=None, description="What touches walls.")
    surface: RigidSurface | None = Field(
        default=None, description="Instead of an outline: a closed surface from a file."
    )
    supports: tuple[SetReference, ...] = Field(
        default=(), description="Node sets that may lie against the outline from outside."
    )
    support_friction_coefficient: Number = Field(
        default=0.0, ge=0.0, description="Friction between those and the outline."
    )
    free: tuple[Freedom, ...] | None = Field(
        default=None,
        description="Degrees of freedom that may move; all that the model has by default. "
        "rotation: in space about every axis; else rotation_x, rotation_y, rotation_z.",
    )
    initial_velocity: VelocityVector = Field(default=AT_REST, description="Of its centre.")
    initial_angular_velocity: AngularVelocity = Field(
        default=written("0 rad/s"), description="Turning speed, about z."
    )

    @model_validator(mode="after")
    def _has_one_mass(self) -> "RigidBody":
        if (self.mass is None) == (self.total_mass is None):
            raise ValueError("has either mass or total_mass: give one of them")
        return self

    @model_validator(mode="after")
    def _has_one_shape(self) -> "RigidBody":
        if self.outline is not None and self.surface is not None:
            raise ValueError("has either an outline or a surface: give one of them")
        return self

    @field_validator("supports")
    @classmethod
    def _supports_need_an_outline(
        cls, supports: tuple[str, ...], info: ValidationInfo
    ) -> tuple[str, ...]:
        if supports and info.data.get("outline") is None:
            raise ValueError("need an outline to lie against: give outline too")
        return supports
