"""Environment of a robot: gravity, walls and contact."""

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
    """Straight pipe. 2D: two walls along x. 3D: round, along x. Axisymmetric:
    round, about the y axis.
    """

    kind: Literal["pipe"] = Field(description="Kind of wall.")
    diameter: PositiveLength = Field(description="Inner diameter.")
    axis_height: Length = Field(
        default=written("0 mm"), description="y coordinate of the axis of a pipe along x."
    )


class PlaneWall(Part):
    """Half space; in 2D a half plane."""

    kind: Literal["plane"] = Field(description="Kind of wall.")
    point: Point = Field(default=ORIGIN, description="Point on the plane.")
    normal: Direction = Field(
        default=(0.0, 1.0), description="Normal that points out of the solid, towards the bodies."
    )


class SphereWall(Part):
    """Ball. 2D: a disc. Axisymmetric: a ball on the axis."""

    kind: Literal["sphere"] = Field(description="Kind of wall.")
    center: Point = Field(default=ORIGIN, description="Centre.")
    diameter: PositiveLength = Field(description="Diameter.")


class CylinderWall(Part):
    """Solid cylinder with flat ends. 2D: a rectangle. Axisymmetric: a cylinder
    about the y axis.
    """

    kind: Literal["cylinder"] = Field(description="Kind of wall.")
    center: Point = Field(default=ORIGIN, description="Centre.")
    direction: Axis = Field(description="Direction of the axis.")
    diameter: PositiveLength = Field(description="Diameter.")
    length: PositiveLength = Field(description="Length along the axis.")


class PipePathWall(Part):
    """Pipe along a path of straight pieces, bends, tapers, steps and branches. 2D:
    two walls. 3D: round.
    """

    kind: Literal["pipe_path"] = Field(description="Kind of wall.")
    diameter: PositiveLength = Field(description="Inner diameter at the start.")
    start: Point = Field(
        default=ORIGIN, description="Start of the centre line, which leads in the direction of +x."
    )
    closed: tuple[Text, ...] = Field(
        default=(),
        description="Ends closed by a flat wall: start, end, or names of branches. Other ends are "
        "open: a pipe without branches ends in a flat face with free space before it; branched "
        "pipes continue straight.",
    )
    pipe: tuple[PipeItem, ...] = Field(
        min_length=1,
        description="Items in order: {straight: 120 mm}, {bend: 90 deg, radius: 60 mm}, {taper: "
        "30 mm, to: 41 mm}, {step: 30 mm}, {tee: 90 mm, left: NAME}, {cross: 90 mm, left: NAME, "
        "right: OTHER}.",
    )
    branches: dict[Name, Annotated[tuple[PipeItem, ...], Field(min_length=1)]] = Field(
        default={},
        description="Branches of tees and crosses by name, with items as in `pipe`. The name is "
        "also that of the exit at the end of the branch.",
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
        description="Acceleration of gravity, downwards; or a vector: [0 m/s^2, -9.81 m/s^2], in "
        "3D with three components.",
    )
    gravity_profile: FactorProfile | None = Field(
        default=None,
        description="Factor of gravity over time, such as {kind: ramp, duration: 50 ms}. Default: "
        "1 from the start.",
    )
    inclination: AngleWithinTurn = Field(
        default=written("0 deg"),
        description="Angle of +x above the horizontal; 90 deg: +x points up.",
    )
    roll: AngleWithinTurn = Field(
        default=written("0 deg"),
        description="Rotation of +y about x, from the vertical plane through x; 90 deg: a 2D "
        "model lies on its side and has no weight across x.",
    )
    walls: dict[Name, Wall] = Field(
        default={},
        description="Walls by name. They are fixed unless a `wall_motion` condition moves them.",
    )


class ContactPair(Part):
    """Two surfaces that may touch each other, with their own friction coefficient."""

    between: tuple[Text, Text] = Field(
        description="Two bodies or facet sets BODY.SET: [finger.tip, cube.surface]. The same one "
        "twice: self-contact."
    )
    friction_coefficient: Number | None = Field(
        default=None,
        ge=0.0,
        description="Friction coefficient of the pair. Default: `self_friction_coefficient`.",
    )


class Contact(Part):
    """Penalty contact with Coulomb friction between bodies and walls, and between bodies."""

    friction_coefficient: Number = Field(
        default=0.5, ge=0.0, description="Coulomb friction coefficient on walls."
    )
    friction_memory: NotNegativeTime = Field(
        default=written("10 ms"),
        description="Time over which the friction limit follows the normal force on walls and "
        "outlines, for nodes at rest. 0 s: plain Coulomb friction. Two periods of a body's lowest "
        "vibration mode prevent self-excited vibration in sliding.",
    )
    friction_slip_length: PositiveLength = Field(
        default=written("30 um"),
        description="Slip over which the friction limit follows the normal force, if that is "
        "sooner than `friction_memory`.",
    )
    penalty_stiffness: AutoOrPositiveStiffness = Field(
        default="auto",
        description="Penalty stiffness of a node. auto: bulk modulus times thickness.",
    )
    tangential_stiffness_ratio: Number = Field(
        default=1.0,
        gt=0.0,
        description="Tangential stiffness in sticking contact divided by `penalty_stiffness`.",
    )
    damping_ratio: Number = Field(
        default=0.1,
        ge=0.0,
        le=1.0,
        description="Damping of normal contact as a fraction of critical damping. Larger values "
        "make runs slower, because damping reduces the stable time step of nodes in contact.",
    )
    tangential_damping_fraction: Number = Field(
        default=1.0,
        ge=0.0,
        le=1.0,
        description="Tangential damping divided by normal damping (ABAQUS/Explicit: TANGENT "
        "FRACTION). It acts on elastic slip only.",
    )
    interference_fit: tuple[Name, ...] = Field(
        default=(),
        description="Walls that may overlap bodies at the start, such as a pipe narrower than its "
        "robot. They are moved back at first and reach their places in the first half of "
        "`time.settle`.",
    )
    self_contact: tuple[Text, ...] = Field(
        default=(),
        description="Bodies, or facet sets BODY.SET, whose surfaces may touch themselves and each "
        "other. Facets in a plane of symmetry are excluded.",
    )
    pairs: tuple[ContactPair, ...] = Field(
        default=(),
        description="Pairs of surfaces that may touch each other, in addition to `self_contact`, "
        "or pairs of it with their own friction coefficient. If several apply, the last one is "
        "used.",
    )
    allowed_penetration: Number = Field(
        default=0.0025,
        gt=0.0,
        le=0.1,
        description="Penetration of bodies into each other, relative to their facet size, at "
        "which the softer body is compressed by 10 %. Smaller values need smaller time steps. Not "
        "used if `penalty_stiffness` is given.",
    )
    self_friction_coefficient: Number | None = Field(
        default=None,
        ge=0.0,
        description="Friction coefficient between bodies. Default: `friction_coefficient`.",
    )
