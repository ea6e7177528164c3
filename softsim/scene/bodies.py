"""Deformable and rigid bodies, structures on them, and conditions on nodes and rigid bodies."""

import math
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from softsim.scene.meshes import MeshSource
from softsim.scene.profiles import LengthProfile, VelocityProfile
from softsim.scene.quantities import (
    AT_REST,
    ORIGIN,
    Angle,
    AngularVelocity,
    AngularVelocityOrVector,
    AutoOrPositiveLength,
    Axis,
    Direction,
    Inertia,
    Name,
    NotNegativeBendingStiffness,
    NotNegativeForce,
    NotNegativeLength,
    Number,
    Point,
    PositiveDensity,
    PositiveForce,
    PositiveLength,
    PositiveLineDensity,
    PositiveMass,
    PositivePressure,
    SetReference,
    Spec,
    Text,
    VelocityVector,
    chosen_by_key,
    written,
)

# -------------------------------------------------------------------------------------------------
# Sets of a body that a scene defines; the first key of each names its kind.

SEVERAL = Field(min_length=1)


class BoxSet(Spec):
    """Everything inside a box, including its faces."""

    box: tuple[Point, Point] = Field(
        description="Two opposite corners, such as [[0 mm, 0 mm], [2 mm, 5 mm]], in 3D with three "
        "coordinates. In coordinates of the scene, after `position` and `rotation` of the body."
    )


class Plane(Spec):
    """Plane; in 2D a line."""

    point: Point = Field(
        description="Point on the plane in coordinates of the scene, after `position` and "
        "`rotation` of the body."
    )
    normal: Direction = Field(description="Normal that points to the selected side, of any length.")


class PlaneSet(Spec):
    """Everything on one side of a plane, including the plane."""

    plane: Plane = Field(description="Plane, such as {point: [0 mm, 2 mm], normal: [0, 1]}.")


class UnionSet(Spec):
    """Union of sets."""

    union: Annotated[tuple[Text, ...], SEVERAL] = Field(
        description="Sets of this body, from its mesh or from `sets`: [tips, upper]."
    )


class IntersectionSet(Spec):
    """Intersection of sets."""

    intersection: Annotated[tuple[Text, ...], SEVERAL] = Field(
        description="Sets of this body, from its mesh or from `sets`: [surface, upper]."
    )


class DifferenceSet(Spec):
    """Difference of two sets."""

    difference: tuple[Text, Text] = Field(
        description="Two sets of this body, from its mesh or from `sets`: [surface, tips] is the "
        "first without the second."
    )


DEFINITIONS: dict[str, type[Spec]] = {
    "box": BoxSet, "plane": PlaneSet, "union": UnionSet, "intersection": IntersectionSet,
    "difference": DifferenceSet,
}  # fmt: skip

SetDefinition = Annotated[
    Annotated[BoxSet, Tag("box")]
    | Annotated[PlaneSet, Tag("plane")]
    | Annotated[UnionSet, Tag("union")]
    | Annotated[IntersectionSet, Tag("intersection")]
    | Annotated[DifferenceSet, Tag("difference")],
    chosen_by_key(DEFINITIONS),
]


Formulation = Literal["plane_strain", "axisymmetric", "ring_section", "solid"]
Freedom = Literal["x", "y", "z", "rotation", "rotation_x", "rotation_y", "rotation_z"]


class RegionSpec(Spec):
    """Cell set with a material or thickness of its own. Anything not given is taken
    from the body.
    """

    material: Text | None = Field(
        default=None, description="Name of a material of the scene or the library."
    )
    thickness: PositiveLength | None = Field(
        default=None,
        description="Thickness of this region in a plane_strain or ring_section model.",
    )

    @model_validator(mode="after")
    def _differs(self) -> "RegionSpec":
        if self.material is None and self.thickness is None:
            raise ValueError("a region needs its own material or thickness")
        return self


class BodySpec(Spec):
    """Deformable body."""

    mesh: MeshSource = Field(description="Mesh from a generator or from a file.")
    formulation: Formulation = Field(
        description="Kinematics of the elements. plane_strain; axisymmetric (x is the radius, y "
        "the axis); ring_section (x is the axis; two strips on opposite sides of the same rings): "
        "triangles and quadrilaterals. solid (3D): tetrahedra and hexahedra."
    )
    thickness: PositiveLength | None = Field(
        default=None,
        validate_default=True,
        description="Out-of-plane depth of a plane_strain model; in a ring_section, that of the "
        "cells that do not go around the axis.",
    )
    sector: Angle | None = Field(
        default=None,
        validate_default=True,
        gt=0.0,
        le=math.pi,
        description="Angle of the circumference that each strip of a ring_section represents, at "
        "most 180 deg.",
    )
    rings: Text | None = Field(
        default=None,
        validate_default=True,
        description="Cell set of a ring_section that goes around the axis.",
    )
    material: Text = Field(description="Name of a material of the scene or the library.")
    regions: dict[Name, RegionSpec] = Field(
        default={},
        description="Cell sets with a material or thickness of their own, by name: {spikes: "
        "{material: dragon_skin_30}}. The sets come from the mesh (skin and spikes of the robots, "
        "gmsh's physical groups, ABAQUS's element sets) or from `sets`. They must not overlap; "
        "the other cells have the body's values.",
    )
    position: Point = Field(default=ORIGIN, description="Position of the mesh's origin.")
    rotation: Angle = Field(
        default=written("0 deg"),
        description="Rotation about the mesh's origin, applied before `position`.",
    )
    mirror: Axis | None = Field(
        default=None,
        description="Mirror the mesh across the plane through its origin normal to this axis, "
        "before the rotation.",
    )
    initial_velocity: VelocityVector = Field(
        default=AT_REST, description="Initial velocity of all nodes."
    )
    sets: dict[Name, SetDefinition] = Field(
        default={},
        description="Additional node, facet and cell sets of the body by name, used as BODY.SET: "
        "{tips: {box: [[0 mm, 0 mm], [2 mm, 5 mm]]}}. `box` and `plane` select the nodes inside, "
        "and the surface facets and cells with all nodes inside; `union`, `intersection` and "
        "`difference` combine other sets.",
    )
    fixed: tuple[Text, ...] = Field(
        default=(), description="Names of node sets of this body that are fixed in all directions."
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


class CylinderOutline(Spec):
    """Cylinder around the centre of a rigid body, along x (along y in an
    axisymmetric model). In 2D a rectangle.
    """

    length: PositiveLength = Field(description="Length along the axis.")
    height: PositiveLength = Field(description="Diameter.")


class BallOutline(Spec):
    """Ball around the centre of a rigid body. In 2D a disc."""

    radius: PositiveLength = Field(description="Radius.")


class RigidSurface(Spec):
    """Closed surface of a rigid body. It touches walls at its vertices, and touches the deformable
    bodies if it is listed in `contact.self_contact`.
    """

    file: Text | None = Field(
        default=None,
        description="STL file of a closed surface (3D), or a mesh (gmsh .msh, VTK .vtu, ABAQUS "
        ".inp) whose boundary is used, with straight edges. The path is relative to the file in "
        "which it is given.",
    )
    points: tuple[Point, ...] | None = Field(
        default=None,
        validate_default=True,
        description="Vertices of a polygon in order, instead of a file. 2D only.",
    )
    length_unit: PositiveLength = Field(
        default=written("1 mm"), description="Length of one unit in the file."
    )
    position: Point = Field(
        default=ORIGIN, description="Position of the origin of the file or the points."
    )
    rotation: Angle = Field(
        default=written("0 deg"),
        description="Rotation about that origin in the x-y plane, applied before `position`.",
    )
    element_size: AutoOrPositiveLength = Field(
        default="auto",
        description="Longest edge of a facet; longer edges are divided, because contact acts at "
        "points of the facets. auto: the median facet edge of the deformable bodies.",
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


class RigidBody(Spec):
    """Rigid body with three degrees of freedom in 2D and six in 3D."""

    mass: PositiveMass | None = Field(
        default=None, description="Mass without the nodes tied to it."
    )
    total_mass: PositiveMass | None = Field(
        default=None,
        description="Mass including the deformable bodies tied to it, instead of `mass`.",
    )
    inertia: Inertia = Field(
        description="Moment of inertia about the centre of mass, without tied nodes. 2D: about z. "
        "3D: three values about x, y and z, or one value for all."
    )
    center: Point = Field(default=ORIGIN, description="Position of the centre of mass.")
    tied: tuple[SetReference, ...] = Field(
        default=(), description='Node sets that move with the body: "skin.knots".'
    )
    outline: Outline | None = Field(
        default=None,
        description="Shape that touches walls: a cylinder (length, height) or a ball (radius). "
        "Default: none.",
    )
    surface: RigidSurface | None = Field(
        default=None,
        description="Closed surface that touches walls, from a file or points, instead of an "
        "outline.",
    )
    supports: tuple[SetReference, ...] = Field(
        default=(), description="Node sets that may touch the outline from outside."
    )
    support_friction_coefficient: Number = Field(
        default=0.0,
        ge=0.0,
        description="Friction coefficient between the `supports` and the outline.",
    )
    free: tuple[Freedom, ...] | None = Field(
        default=None,
        description="Free degrees of freedom. Default: all of the model. In 3D, rotation means "
        "rotation about every axis; rotation_x, rotation_y and rotation_z are the single ones.",
    )
    initial_velocity: VelocityVector = Field(
        default=AT_REST, description="Initial velocity of the centre of mass."
    )
    initial_angular_velocity: AngularVelocity = Field(
        default=written("0 rad/s"), description="Initial angular velocity about z."
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


# -------------------------------------------------------------------------------------------------
# Structures: cables, fibres, layers, ties. Pulled cables stand in scene/loads.py.


class CableSpec(Spec):
    """Cable (tube, wire, thread) with stretching and bending stiffness, without torsional
    stiffness, stress-free when straight. It touches walls, but no bodies. Its node sets are
    NAME.start and NAME.end (the ends), NAME.start_segment and NAME.end_segment (two nodes, which
    also hold the direction of an end), and NAME.all. The history gets a column NAME_tension, the
    tension of the first segment that is not held.
    """

    points: Annotated[tuple[Point, ...], Field(min_length=2)] = Field(
        description="Vertices of the line along which the cable lies at the start, unstretched."
    )
    segment_length: PositiveLength = Field(
        description="Approximate distance between nodes; the number of segments is rounded."
    )
    diameter: PositiveLength = Field(description="Outer diameter, used for contact with walls.")
    mass_per_length: PositiveLineDensity = Field(description="Mass per length.")
    stretching_stiffness: PositiveForce = Field(description="Axial stiffness E A.")
    bending_stiffness: NotNegativeBendingStiffness = Field(
        description="Bending stiffness E I; for a tube E pi (D^4 - d^4) / 64."
    )
    friction_coefficient: Number | None = Field(
        default=None,
        ge=0.0,
        description="Friction coefficient on walls. Default: `contact.friction_coefficient`.",
    )
    end_drag: NotNegativeForce = Field(
        default=written("0 N"),
        description="Coulomb friction along the cable at its end, which represents a continuation "
        "that is not simulated. At rest it resists up to this force.",
    )


# -------------------------------------------------------------------------------------------------
# Fibres in bodies: threads, wires.


class Helix(Spec):
    """Helix about an axis along x, y or z. With zero pitch it is a ring."""

    center: Point = Field(description="Point on the axis at which the helix starts.")
    direction: Axis = Field(description="Direction of the axis.")
    radius: PositiveLength = Field(description="Radius of the helix.")
    pitch: NotNegativeLength = Field(
        description="Advance along the axis per turn; 0 mm for a ring. The angle to the axis has "
        "the tangent 2 pi radius / pitch."
    )
    turns: Number = Field(gt=0.0, description="Number of turns, which need not be an integer.")
    handedness: Literal["right", "left"] = Field(
        default="right", description="right: right-handed, like a common screw. left: left-handed."
    )
    start_angle: Angle = Field(
        default=written("0 deg"),
        description="Angle of the start about the axis, measured from y if the axis is x, from z "
        "if it is y, from x if it is z.",
    )


class FibreSpec(Spec):
    """Fibre (thread, wire) embedded in a body or wound on it. It follows Hooke's law in the
    engineering strain, has no bending stiffness and by default goes slack under compression. The
    history gets a column NAME_tension, the largest tension along the fibre.
    """

    body: Name = Field(description="Body in which the fibre lies.")
    points: Annotated[tuple[Point, ...], Field(min_length=2)] | None = Field(
        default=None, description="Vertices of the line along which the fibre lies, unstretched."
    )
    helix: Helix | None = Field(
        default=None, description="Helix along which the fibre lies, instead of `points`."
    )
    spacing: PositiveLength = Field(
        description="Approximate distance between the points at which the fibre is attached to "
        "the elements; choose about half the element size. The number of segments is rounded."
    )
    tolerance: PositiveLength | None = Field(
        default=None,
        description="Largest distance of the fibre outside the body, onto which it is moved. "
        "Default: 5 % of the mean edge of the body's surface facets.",
    )
    diameter: PositiveLength = Field(
        description="Diameter of the circular cross section. It is ignored by contact."
    )
    youngs_modulus: PositivePressure = Field(description="Young's modulus.")
    density: PositiveDensity = Field(description="Mass density.")
    bears_compression: bool = Field(
        default=False,
        strict=True,
        description="True if the fibre also resists compression, like a wire that cannot buckle.",
    )

    @model_validator(mode="after")
    def _has_one_line(self) -> "FibreSpec":
        if (self.points is None) == (self.helix is None):
            raise ValueError("needs either points or a helix: give one of them")
        return self


# -------------------------------------------------------------------------------------------------
# Layers on surfaces, and ties.


class Tie(Spec):
    """Tie constraint between nodes and a surface with a non-matching mesh, as if glued. The nodes
    are moved onto the facets before the start. If the meshes differ in size, tie the nodes of the
    finer mesh to the facets of the coarser.
    """

    nodes: SetReference = Field(description='Node set that is tied: "paper.top".')
    facets: SetReference = Field(
        description='Facet set to which the nodes are tied: "finger.bottom".'
    )
    tolerance: PositiveLength | None = Field(
        default=None,
        description="Largest distance of a node from the facets. Default: 5 % of the mean facet "
        "edge.",
    )


class LayerSpec(Spec):
    """Thin layer (paper, cloth, film) bonded to the surface of a body. It is a membrane of St.
    Venant-Kirchhoff material for small strains, without bending stiffness. Its thickness is
    ignored by contact.
    """

    facets: SetReference = Field(description='Facet set that the layer covers: "finger.bottom".')
    thickness: PositiveLength = Field(description="Thickness at rest.")
    youngs_modulus: PositivePressure = Field(description="Young's modulus.")
    poisson_ratio: Number = Field(default=0.3, ge=0.0, lt=0.5, description="Poisson's ratio.")
    density: PositiveDensity = Field(description="Mass density.")


STRUCTURES = {
    "cables": "softsim.structures.cable:cables",
    "layers": "softsim.structures.layer:layers",
    "fibres": "softsim.structures.fibre:fibres",
}
"""Key of a scene -> entry point of the function that builds its structures.

The order is that of their forces in a sum.
"""


# -------------------------------------------------------------------------------------------------
# Conditions on node sets and rigid bodies.


class Fixed(Spec):
    """Fixed nodes."""

    kind: Literal["fixed"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "beam.left".')
    directions: tuple[Axis, ...] | None = Field(
        default=None, min_length=1, description="Fixed components. Default: all."
    )


class Symmetry(Spec):
    """Nodes on a plane of symmetry, which stay in the plane."""

    kind: Literal["symmetry"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "block.left".')
    normal: Axis = Field(description="Normal of the plane.")


class _Moved(Spec):
    """A motion along one direction, given by its displacement or by its velocity over time."""

    displacement: LengthProfile | None = Field(
        default=None, description="Displacement over time, starting at zero."
    )
    velocity: VelocityProfile | None = Field(
        default=None, description="Velocity over time, instead of the displacement."
    )

    @model_validator(mode="after")
    def _is_moved_once(self) -> "_Moved":
        if (self.displacement is None) == (self.velocity is None):
            raise ValueError("needs either a displacement or a velocity: give one of them")
        return self


class Prescribed(_Moved):
    """Prescribed motion of nodes along one direction."""

    kind: Literal["prescribed"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "block.right".')
    direction: Axis = Field(description="Component that is prescribed.")


class RigidMotionSpec(_Moved):
    """Prescribed motion of a rigid body's centre along one direction, for example of the plate of
    a press. The other degrees of freedom stay free.
    """

    kind: Literal["rigid_motion"] = Field(description="Kind of condition.")
    body: Text = Field(description="Name of the rigid body.")
    direction: Axis = Field(description="Direction of the motion.")


class WallMotion(_Moved):
    """Prescribed motion of a wall along one direction, for example of a press or a
    shaking ground.
    """

    kind: Literal["wall_motion"] = Field(description="Kind of condition.")
    wall: Text = Field(description="Name of the wall in `environment.walls`.")
    direction: Axis = Field(description="Direction of the motion.")


class PointMass(Spec):
    """Mass added to nodes in equal parts, without rotational inertia."""

    kind: Literal["point_mass"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "beam.tip".')
    mass: PositiveMass = Field(description="Total mass of the set.")


class InitialVelocity(Spec):
    """Initial velocity v + omega x (x - c) of nodes, as of a rigid motion. It
    replaces the initial velocity of their body.
    """

    kind: Literal["initial_velocity"] = Field(description="Kind of condition.")
    nodes: SetReference = Field(description='Node set, such as "bar.end".')
    velocity: VelocityVector = Field(default=AT_REST, description="Velocity v.")
    angular_velocity: AngularVelocityOrVector | None = Field(
        default=None,
        description="Angular velocity omega: about z, or in 3D a vector. Not in an axisymmetric "
        "model.",
    )
    about: Point | None = Field(
        default=None,
        description="Point c, which moves with v. Default: centre of mass of the set.",
    )

    @field_validator("about")
    @classmethod
    def _turns_about_it(
        cls, about: tuple[float, ...] | None, info: ValidationInfo
    ) -> tuple[float, ...] | None:
        if about is not None and info.data.get("angular_velocity", 0.0) is None:
            raise ValueError("has no effect without angular_velocity")
        return about

    @model_validator(mode="after")
    def _says_a_motion(self) -> "InitialVelocity":
        if not self.model_fields_set & {"velocity", "angular_velocity"}:
            raise ValueError("gives no motion: give velocity, angular_velocity or both")
        return self


Condition = Annotated[
    Fixed | Symmetry | Prescribed | RigidMotionSpec | WallMotion | PointMass | InitialVelocity,
    Field(discriminator="kind"),
]
