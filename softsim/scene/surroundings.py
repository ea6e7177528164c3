"""What a robot stands in: gravity, walls, contact."""

from typing import Annotated, Literal

from pydantic import Field

from softsim.scene.gridded_walls import SurfaceWall
from softsim.scene.part import ORIGIN, Part
from softsim.scene.pipe_items import PipeItem
from softsim.scene.polylines import PolylineWall
from softsim.scene.profiles import FactorProfile
from softsim.scene.quantities import (
    AccelerationOrVector,
    AngleWithinTurn,
    AutoOrPositiveStiffness,
    Axis,
    Direction,
    Length,
    Name,
    NotNegativeTime,
    Number,
    Point,
    PositiveLength,
    Text,
    written,
)
from softsim.scene.terrain import RampWall, SemicircleWall, StepFieldWall


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


class SphereWall(Part):
    """A ball, in a section a disc, in an axisymmetric model a ball on the axis."""

    kind: Literal["sphere"] = Field(description="Kind of wall.")
    center: Point = Field(default=ORIGIN, description="Its centre.")
    diameter: PositiveLength = Field(description="Its diameter.")


class CylinderWall(Part):
    """A capped cylinder, solid inside; in a section a rectangle, in an axisymmetric model a
    cylinder about the axis y.
    """

    kind: Literal["cylinder"] = Field(description="Kind of wall.")
    center: Point = Field(default=ORIGIN, description="Its centre.")
    direction: Axis = Field(description="Of its axis.")
    diameter: PositiveLength = Field(description="Its diameter.")
    length: PositiveLength = Field(description="Along its axis.")


class PipePathWall(Part):
    """A pipe that leads along a path, and may branch: in a section two walls, in space round."""

    kind: Literal["pipe_path"] = Field(description="Kind of wall.")
    diameter: PositiveLength = Field(description="Inner diameter where it starts.")
    start: Point = Field(
        default=ORIGIN, description="Where its centre line starts, in the direction of +x."
    )
    closed: tuple[Text, ...] = Field(
        default=(),
        description="Ends that a flat wall closes: start, end, names of branches. The others lie "
        "in a flat face with free space before it; of pipes that branch they go straight on.",
    )
    pipe: tuple[PipeItem, ...] = Field(
        min_length=1,
        description="One after another: {straight: 120 mm}, {bend: 90 deg, radius: 60 mm}, "
        "{taper: 30 mm, to: 41 mm}, {step: 30 mm}, {tee: 90 mm, left: NAME}, {cross: 90 mm, "
        "left: NAME, right: OTHER}.",
    )
    branches: dict[Name, Annotated[tuple[PipeItem, ...], Field(min_length=1)]] = Field(
        default={},
        description="Pipes that tees and crosses lead to, by the name of the exit at their end: "
        "items as those of pipe.",
    )


Wall = Annotated[
    PipeWall
    | PlaneWall
    | SphereWall
    | CylinderWall
    | PipePathWall
    | PolylineWall
    | SurfaceWall
    | RampWall
    | SemicircleWall
    | StepFieldWall,
    Field(discriminator="kind"),
]


class Environment(Part):
    """Gravity and walls."""

    gravity: AccelerationOrVector = Field(
        default=written("9.81 m/s^2"),
        description="Acceleration of gravity, downwards; or as a vector: [0 m/s^2, -9.81 m/s^2], "
        "in space three components.",
    )
    gravity_profile: FactorProfile | None = Field(
        default=None,
        description="Factor of gravity over time, such as {kind: ramp, duration: 50 ms}; by "
        "default all of gravity acts from the start.",
    )
    inclination: AngleWithinTurn = Field(
        default=written("0 deg"), description="Of +x above the horizontal; 90 deg: +x points up."
    )
    roll: AngleWithinTurn = Field(
        default=written("0 deg"),
        description="Of +y about x, from the vertical plane through x; 90 deg: a section lies on "
        "its side and feels no weight across x.",
    )
    walls: dict[Name, Wall] = Field(
        default={}, description="By name; fixed, but for those that a condition wall_motion moves."
    )


class ContactPair(Part):
    """Two surfaces that may touch each other, with a friction of their own."""

    between: tuple[Text, Text] = Field(
        description="Bodies, or facet sets body.set: [finger.tip, cube.surface]; twice the same: a "
        "surface that may touch itself."
    )
    friction_coefficient: Number | None = Field(
        default=None, ge=0.0, description="Coulomb's mu between them; by default that of "
        "self_contact."
    )  # fmt: skip


class Contact(Part):
    """Penalty contact with Coulomb friction between surfaces and walls, and among surfaces."""

    friction_coefficient: Number = Field(default=0.5, ge=0.0, description="Coulomb's mu.")
    friction_memory: NotNegativeTime = Field(
        default=written("10 ms"), description="Time over which the limit of friction on walls and "
        "outlines follows the normal force at rest; 0 s: at once, Coulomb's law. Two periods of a "
        "body's slowest swing keep it from exciting itself as it slides."
    )  # fmt: skip
    friction_slip_length: PositiveLength = Field(
        default=written("30 um"), description="Slip over which a limit with a memory forgets: a "
        "fast node follows the normal force sooner."
    )  # fmt: skip
    penalty_stiffness: AutoOrPositiveStiffness = Field(
        default="auto", description="Of a node; auto: bulk modulus times thickness."
    )
    tangential_stiffness_ratio: Number = Field(
        default=1.0, gt=0.0, description="Stiffness while sticking, over penalty_stiffness."
    )
    damping_ratio: Number = Field(
        default=0.1, ge=0.0, le=1.0, description="Of the normal contact, of critical damping. More "
        "takes longer: a dashpot shortens the step of nodes that touch."
    )  # fmt: skip
    tangential_damping_fraction: Number = Field(
        default=1.0, ge=0.0, le=1.0, description="Of the dashpot along the surface, over that of "
        "the normal contact; it resists elastic slip only. ABAQUS/Explicit's tangent fraction."
    )  # fmt: skip
    interference_fit: tuple[Name, ...] = Field(
        default=(),
        description="Walls that may start inside bodies, such as a pipe narrower than its robot: "
        "they recede at first and close to their places in the first half of time.settle.",
    )
    self_contact: tuple[Text, ...] = Field(
        default=(),
        description="Bodies, or facet sets body.set, whose surfaces may touch themselves and each "
        "other. Faces in a plane of symmetry are left out.",
    )
    pairs: tuple[ContactPair, ...] = Field(
        default=(),
        description="Pairs of surfaces that may touch each other, beside those of self_contact, or "
        "pairs among these with a friction of their own. The last pair counts where several do.",
    )
    allowed_penetration: Number = Field(
        default=0.0025, gt=0.0, le=0.1, description="Of bodies into each other, over the size of "
        "their facets, where the softer body is compressed by a tenth; less takes shorter steps. "
        "Not used where penalty_stiffness is given."
    )  # fmt: skip
    self_friction_coefficient: Number | None = Field(
        default=None, ge=0.0, description="Coulomb's mu among them; as on walls by default."
    )
