"""Environment of a robot: gravity, walls and contact."""

import math
from abc import abstractmethod
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field, Tag, ValidationInfo, field_validator, model_validator

from softsim.scene.profiles import FactorProfile
from softsim.scene.quantities import (
    ORIGIN,
    AccelerationOrVector,
    Angle,
    AngleWithinTurn,
    AutoOrPositiveLength,
    AutoOrPositiveStiffness,
    Axis,
    Direction,
    Length,
    Name,
    NotNegativeTime,
    Number,
    Point,
    PositiveEnergyPerArea,
    PositiveLength,
    PositiveLineDensity,
    PositivePressure,
    PositiveTime,
    PositiveVelocity,
    Spec,
    Text,
    WholeNumber,
    chosen_by_key,
    written,
)

# -------------------------------------------------------------------------------------------------
# Items of the layout of a pipe; the first key of each names its kind.

DIAMETER = Field(
    default=None,
    description="Diameter of the pipe at the start of this item, which must equal that at the "
    "end of the previous item. It can be left out.",
)


class StraightItem(Spec):
    """Straight pipe."""

    straight: PositiveLength = Field(description="Length.")
    diameter: PositiveLength | None = DIAMETER


class BendItem(Spec):
    """Bend along a circular arc."""

    bend: Angle = Field(
        description="Angle of the bend; positive to the left (towards +y for a path that starts "
        "along +x)."
    )
    radius: PositiveLength = Field(description="Radius of the centre line.")
    turned: Angle = Field(
        default=written("0 deg"),
        description="In 3D: rotation of the plane of the bend about the direction of travel, "
        "measured from the left.",
    )
    diameter: PositiveLength | None = DIAMETER

    @field_validator("bend")
    @classmethod
    def _less_than_a_turn(cls, bend: float) -> float:
        if bend == 0.0:
            raise ValueError("a bend must not be 0: use straight instead")
        if abs(bend) >= 2.0 * math.pi:
            raise ValueError("a bend must be less than 360 deg, or it would cross itself")
        return bend


class TaperItem(Spec):
    """Conical transition to another diameter."""

    taper: PositiveLength = Field(description="Length along the axis.")
    to: PositiveLength = Field(description="Diameter at the end.")
    diameter: PositiveLength | None = DIAMETER


class StepItem(Spec):
    """Sudden change of the diameter."""

    step: PositiveLength = Field(description="New diameter.")
    diameter: PositiveLength | None = DIAMETER


LEAVING = Field(
    default=None,
    description="Diameter of the branches. Default: that of the pipe. It must not be larger, "
    "or, for a tee at which the pipe ends, not smaller.",
)
FILLET = Field(
    default=written("2 mm"), description="Radius of the edges between the walls of the pipes."
)
TURNED = Field(
    default=written("0 deg"),
    description="In 3D: rotation of the branches about the direction of travel, measured from "
    "the left.",
)


class TeeItem(Spec):
    """Tee: one branch leaves at a right angle from the middle of a straight fitting, or two
    branches leave to both sides and the pipe ends.
    """

    tee: PositiveLength = Field(description="Length of the fitting from end to end.")
    left: Name | None = Field(default=None, description="Name of the branch to the left.")
    right: Name | None = Field(default=None, description="Name of the branch to the right.")
    turned: Angle = TURNED
    to: PositiveLength | None = LEAVING
    fillet: PositiveLength = FILLET
    diameter: PositiveLength | None = DIAMETER

    @model_validator(mode="after")
    def _leads_somewhere(self) -> "TeeItem":
        if self.left is None and self.right is None:
            raise ValueError("a tee leads to a branch: write left: NAME, right: NAME or both")
        return self


class CrossItem(Spec):
    """Cross: two branches leave at right angles from the middle of a straight
    fitting, and the pipe continues.
    """

    cross: PositiveLength = Field(description="Length of the fitting from end to end.")
    left: Name = Field(description="Name of the branch to the left.")
    right: Name = Field(description="Name of the branch to the right.")
    turned: Angle = TURNED
    to: PositiveLength | None = LEAVING
    fillet: PositiveLength = FILLET
    diameter: PositiveLength | None = DIAMETER


ITEMS: dict[str, type[Spec]] = {
    "straight": StraightItem, "bend": BendItem, "taper": TaperItem, "step": StepItem,
    "tee": TeeItem, "cross": CrossItem,
}  # fmt: skip


PipeItem = Annotated[
    Annotated[StraightItem, Tag("straight")]
    | Annotated[BendItem, Tag("bend")]
    | Annotated[TaperItem, Tag("taper")]
    | Annotated[StepItem, Tag("step")]
    | Annotated[TeeItem, Tag("tee")]
    | Annotated[CrossItem, Tag("cross")],
    chosen_by_key(ITEMS),
]


# -------------------------------------------------------------------------------------------------
# Tether that a robot trails behind it through a layout.


def _rising(limits: tuple[float, float]) -> tuple[float, float]:
    if limits[0] > limits[1]:
        raise ValueError(f"the lower limit must come first: [{limits[1]:g}, {limits[0]:g}]")
    return limits


FrictionCoefficient = Annotated[Number, Field(ge=0.0)]
Limits = Annotated[tuple[FrictionCoefficient, FrictionCoefficient], AfterValidator(_rising)]


class Trailed(Spec):
    """Tether for `softsim reach`, which computes how far a robot gets through a layout with it.

    The defaults are the PufferFace Robot's air line, a polyurethane tube of 2 mm with a bore of
    1.2 mm and wires of 0.6 g/m (assumed), on acrylic (thesis, 6.5).
    """

    mass_per_length: PositiveLineDensity = Field(
        default=written("3 g/m"), description="Mass per length of tube and wires together."
    )
    friction_coefficient: Limits = Field(
        default=(0.5, 0.75),
        description="Lower and upper limit of the friction coefficient on the pipe.",
    )


# -------------------------------------------------------------------------------------------------
# Walls that go through a grid of distances: an STL surface in space.


class WallSpec(Spec):
    """Wall; placed_by: key at which an error says that bodies start inside it."""

    placed_by: ClassVar[str] = "kind"


class SurfaceWall(WallSpec):
    """Closed surface from an STL file (3D)."""

    kind: Literal["surface"] = Field(description="Kind of wall.")
    file: Text = Field(
        description="Path of the STL file, relative to the file in which it is given."
    )
    length_unit: PositiveLength = Field(
        default=written("1 mm"), description="Length of one unit in the file."
    )
    position: Point = Field(default=ORIGIN, description="Position of the file's origin.")
    free_side: Literal["inside", "outside"] = Field(
        description="Side on which bodies are. inside: the surface bounds a cavity, such as the "
        "bore of a pipe. outside: it bounds a solid, which may have a bore."
    )
    spacing: AutoOrPositiveLength = Field(
        default="auto",
        description="Grid spacing of the distance field that represents the wall. auto: the "
        "median edge of the bodies' surface facets. Edges are rounded by about a third of the "
        "spacing; a surface of radius R is approximated within spacing^2 / (4 R).",
    )


# -------------------------------------------------------------------------------------------------
# Walls along a polyline, sharp at its corners.


class PolylineWallSpec(WallSpec):
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


# -------------------------------------------------------------------------------------------------
# Terrains (ramps, semicircles, step fields), and the test whether a body crosses them.


def _up_to_upright(slope: float) -> float:
    if not 0.0 < slope <= math.radians(90.0) * (1.0 + 1e-12):
        raise ValueError(
            f"{math.degrees(slope):.6g} deg: a slope must be greater than 0 and at most 90 deg"
        )
    return slope


class Terrain(WallSpec):
    """Obstacle on level ground that extends without end on both sides. In 3D it is
    extruded along z.
    """

    placed_by: ClassVar[str] = "foot"
    kind: str
    foot: Point = Field(default=ORIGIN, description="Start of the obstacle.")

    @property
    @abstractmethod
    def crossed(self) -> float:
        """Distance [m] from the foot to the point where a body has crossed the terrain."""


class PrintedTerrain(Terrain):
    """Obstacle with the optional stair steps of a 3D print."""

    layers: PositiveLength | None = Field(
        default=None,
        description="Layer thickness of a 3D print, which gives the surface stair steps. Default: "
        "a smooth surface.",
    )


class RampWall(PrintedTerrain):
    """Ramp up to a plateau with a vertical end."""

    kind: Literal["ramp"] = Field(description="Kind of wall.")
    slope: Annotated[Angle, AfterValidator(_up_to_upright)] = Field(
        description="Angle of the ramp; 90 deg is a step."
    )
    height: PositiveLength = Field(description="Height of the plateau.")
    plateau: PositiveLength = Field(
        default=written("300 mm"),
        description="Length of the plateau, longer than the ramp is high.",
    )

    @property
    def crossed(self) -> float:
        """Distance [m] from the foot of the ramp to its upper edge."""
        return self.height / math.tan(self.slope) if self.slope < 0.5 * math.pi - 1e-9 else 0.0


class SemicircleWall(PrintedTerrain):
    """Semicircular obstacle: the upper half of a cylinder across the path."""

    kind: Literal["semicircle"] = Field(description="Kind of wall.")
    radius: PositiveLength = Field(description="Radius of the cylinder.")

    @property
    def crossed(self) -> float:
        """Distance [m] between both feet of the semicircle."""
        return 2.0 * self.radius


class StepFieldWall(Terrain):
    """Step field: blocks side by side, whose random heights are whole millimetres
    from 1 to 8.
    """

    kind: Literal["step_field"] = Field(description="Kind of wall.")
    rugosity: Number = Field(
        gt=0.0, description="Standard deviation of the block heights divided by 8 mm."
    )
    mean_height: PositiveLength = Field(
        default=written("4.66 mm"), description="Mean of the block heights."
    )
    blocks: WholeNumber = Field(default=70, ge=2, le=10_000, description="Number of blocks.")
    block_length: PositiveLength = Field(default=written("10 mm"), description="Length of a block.")
    seed: WholeNumber = Field(default=1, ge=0, description="Seed of the random heights.")

    @property
    def crossed(self) -> float:
        """Distance [m] from the foot to the end of the last block."""
        return self.blocks * self.block_length


class CrossingSpec(Spec):
    """Test whether a body crosses its terrain along x before `time.end`. The run ends as soon as
    the body has passed or is stuck.
    """

    body: Text | None = Field(default=None, description="Name of the body. Default: the first one.")
    goal: Length | None = Field(
        default=None,
        description="x coordinate that the rear end of the body must pass. Default: the upper "
        "edge of the ramp, the far foot of the semicircle or the end of the step field, if the "
        "scene has one of them.",
    )
    patience: PositiveTime | None = Field(
        default=None,
        description="The body counts as stuck, and the run ends, if its rear end advances less "
        "than 2 % of the body length in this time. Default: no limit before `time.end`.",
    )


class PipeWall(WallSpec):
    """Straight pipe. 2D: two walls along x. 3D: round, along x. Axisymmetric:
    round, about the y axis.
    """

    kind: Literal["pipe"] = Field(description="Kind of wall.")
    diameter: PositiveLength = Field(description="Inner diameter.")
    axis_height: Length = Field(
        default=written("0 mm"), description="y coordinate of the axis of a pipe along x."
    )


class PlaneWall(WallSpec):
    """Half space; in 2D a half plane."""

    placed_by: ClassVar[str] = "point"
    kind: Literal["plane"] = Field(description="Kind of wall.")
    point: Point = Field(default=ORIGIN, description="Point on the plane.")
    normal: Direction = Field(
        default=(0.0, 1.0), description="Normal that points out of the solid, towards the bodies."
    )


class SphereWall(WallSpec):
    """Ball. 2D: a disc. Axisymmetric: a ball on the axis."""

    placed_by: ClassVar[str] = "center"
    kind: Literal["sphere"] = Field(description="Kind of wall.")
    center: Point = Field(default=ORIGIN, description="Centre.")
    diameter: PositiveLength = Field(description="Diameter.")


class CylinderWall(WallSpec):
    """Solid cylinder with flat ends. 2D: a rectangle. Axisymmetric: a cylinder
    about the y axis.
    """

    placed_by: ClassVar[str] = "center"
    kind: Literal["cylinder"] = Field(description="Kind of wall.")
    center: Point = Field(default=ORIGIN, description="Centre.")
    direction: Axis = Field(description="Direction of the axis.")
    diameter: PositiveLength = Field(description="Diameter.")
    length: PositiveLength = Field(description="Length along the axis.")


class PipePathWall(WallSpec):
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
    | PolylineWallSpec
    | SurfaceWall
    | RampWall
    | SemicircleWall
    | StepFieldWall,
    Field(discriminator="kind"),
]


WALLS = (
    "softsim.contact.simple_walls:flat_walls",
    "softsim.contact.simple_walls:round_pipes",
    "softsim.contact.simple_walls:spheres",
    "softsim.contact.simple_walls:cylinders",
    "softsim.builder.walls:pipe_networks",
    "softsim.contact.grid:surface_walls",
    "softsim.contact.terrain:polyline_walls",
    "softsim.contact.terrain:terrains",
)
"""Entry points of the functions that build walls, in the order of their contact.

They take the names of a scene and those of its walls that move.
"""


class Environment(Spec):
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


class ContactPair(Spec):
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


class AdhesionRateSpec(Spec):
    """Dependence of the work of adhesion w on the speed v of separation: w = w0 (1 + (v / v0)^n).

    w0 is `work_of_adhesion`. Static procedures use w0.
    """

    speed: PositiveVelocity = Field(
        description="Speed v0 of separation that doubles the work of adhesion."
    )
    exponent: Number = Field(gt=0.0, le=2.0, description="Exponent n.")
    fastest: PositiveVelocity | None = Field(
        default=None,
        description="Speed above which the work of adhesion no longer grows. Default: 1000 times "
        "`speed`.",
    )


class AdhesionSpec(Spec):
    """Adhesion of surfaces to walls or to each other, by a cohesive law with linear softening.

    Give either `pull_off_stress` or `range`.
    """

    work_of_adhesion: PositiveEnergyPerArea = Field(
        description="Energy per area that separates a surface from a wall, or two surfaces."
    )
    pull_off_stress: PositivePressure | None = Field(
        default=None, description="Largest tensile stress between the two."
    )
    range: PositiveLength | None = Field(
        default=None, description="Gap at which the attraction vanishes."
    )
    shear_strength: PositivePressure | None = Field(
        default=None,
        description="Largest friction stress of the adhering area, in addition to the friction "
        "coefficient times the load. Default: the friction coefficient times the pull-off stress.",
    )
    rate: AdhesionRateSpec | None = Field(
        default=None,
        description="Dependence of the work of adhesion on the speed of separation. Default: none.",
    )
    surfaces: tuple[Text, ...] = Field(
        default=(),
        description="Deformable bodies or facet sets BODY.SET that adhere. Default: all.",
    )
    walls: tuple[Name, ...] = Field(
        default=(), description="Walls to which they adhere. Default: all walls."
    )
    between: tuple[Text, Text] | None = Field(
        default=None,
        description="Instead of `surfaces` and `walls`: two bodies or facet sets BODY.SET that "
        "adhere to each other, of a pair in `pairs` or in `self_contact`.",
    )

    @field_validator("range")
    @classmethod
    def one_of_two(cls, value: float | None, info: ValidationInfo) -> float | None:
        """Require exactly one of pull-off stress and range."""
        is_valid = "pull_off_stress" in info.data  # otherwise it has an error of its own
        if is_valid and (value is None) == (info.data["pull_off_stress"] is None):
            raise ValueError("give either pull_off_stress or range")
        return value

    @field_validator("between")
    @classmethod
    def only_bodies(
        cls, value: tuple[str, str] | None, info: ValidationInfo
    ) -> tuple[str, str] | None:
        """Refuse keys of adhesion to walls beside two surfaces of bodies."""
        if value is not None and (info.data.get("surfaces") or info.data.get("walls")):
            raise ValueError("give either between, or surfaces and walls")
        if value is not None and info.data.get("rate") is not None:
            raise ValueError("adhesion between bodies does not depend on the rate: leave out rate")
        return value


class Contact(Spec):
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
    adhesion: dict[Name, AdhesionSpec] = Field(
        default={},
        description="Adhesion of surfaces to walls or to each other, by a name of your choice. "
        "Where several apply, the last one is used.",
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
