"""The vocabulary of a scene: every key, its meaning, its unit, its default.

Quantities are written with units ("36 mm") and become SI floats; numbers without a dimension are
written bare. Unknown keys are refused.
"""

import math
from itertools import pairwise
from typing import Annotated, Any, Literal, Union

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationInfo,
    field_validator,
    model_validator,
)

from softsim.scene.quantities import (
    Angle,
    AngularVelocity,
    AutoOrPositiveStiffness,
    AutoOrPositiveTime,
    Direction,
    Force,
    Length,
    Name,
    NotNegativeAcceleration,
    NotNegativePressure,
    NotNegativeTime,
    Number,
    Point,
    PositiveCompressibility,
    PositiveDensity,
    PositiveForce,
    PositiveFrequency,
    PositiveInertia,
    PositiveLength,
    PositiveMass,
    PositivePressure,
    PositivePressureRate,
    PositiveTime,
    Pressure,
    SetReference,
    Text,
    Velocity,
    WholeNumber,
    written,
)

ORIGIN = written("0 mm", "0 mm")
AT_REST = written("0 mm/s", "0 mm/s")


class Part(BaseModel):
    """Anything in a scene: frozen, and strict about its keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True)


class PronyTerm(Part):
    """One term of a Prony series."""

    g: Number = Field(
        gt=0.0, lt=1.0, description="Share of the instantaneous shear modulus that relaxes."
    )
    relaxation_time: PositiveTime = Field(description="Time in which it falls to 1/e.")


class YeohMaterial(Part):
    """A Yeoh solid: W = C10 k + C20 k^2 + C30 k^3, k = I1_bar - 3, long-term constants."""

    law: Literal["yeoh"] = Field(description="The strain-energy law.")
    C10: PositivePressure = Field(description="First constant; the shear modulus is 2 C10.")
    C20: Pressure = Field(default=written("0 Pa"), description="Second constant.")
    C30: Pressure = Field(default=written("0 Pa"), description="Third constant.")
    density: PositiveDensity = Field(description="Mass density.")
    bulk_modulus: PositivePressure | None = Field(
        default=None, description="kappa in (kappa/2) (J - 1)^2. Give at most one of bulk_modulus, "
        "D1, poisson_ratio; without any, kappa = 20 times the shear modulus, as ABAQUS/Explicit."
    )  # fmt: skip
    D1: PositiveCompressibility | None = Field(
        default=None, description="ABAQUS's compressibility, kappa = 2 / D1."
    )
    poisson_ratio: Number | None = Field(
        default=None, ge=0.0, lt=0.5, description="Poisson's ratio at small strain."
    )
    prony: tuple[PronyTerm, ...] = Field(default=(), description="Viscoelastic shear relaxation.")
    source: Text = Field(default="", description="Where the constants come from.")
    strain_range: Number | None = Field(
        default=None, gt=0.0, description="Largest engineering strain that they were fitted on."
    )

    @field_validator("D1", "poisson_ratio")
    @classmethod
    def _one_compressibility(cls, value: float | None, info: ValidationInfo) -> float | None:
        earlier = [n for n in ("bulk_modulus", "D1") if info.data.get(n) is not None]
        if value is not None and earlier:
            raise ValueError(f"says the same thing as {earlier[0]}: give one of them")
        return value

    @field_validator("prony")
    @classmethod
    def _something_remains(cls, prony: tuple[PronyTerm, ...]) -> tuple[PronyTerm, ...]:
        total = sum(term.g for term in prony)
        if total >= 1.0:
            raise ValueError(f"the g of all terms add up to {total:g}: must stay below 1")
        return prony


class BlockMesh(Part):
    """A rectangle; sets bottom, top, left, right, surface."""

    generator: Literal["block"] = Field(description="Which generator makes the mesh.")
    length: PositiveLength = Field(description="Size along x.")
    height: PositiveLength = Field(description="Size along y, from y = 0 upwards.")
    element_size: PositiveLength = Field(description="Edge length of the triangles.")


class PfrSectionMesh(Part):
    """The PufferFace Robot's section along its axis: two skin strips with curved spikes."""

    generator: Literal["pfr_section"] = Field(description="Which generator makes the mesh.")
    inner_diameter: PositiveLength = Field(default=written("15 mm"), description="Of the skin.")
    outer_diameter: PositiveLength = Field(
        default=written("17 mm"), description="Of the skin, no spikes."
    )
    free_length: PositiveLength = Field(
        default=written("30 mm"), description="Skin between the knots."
    )
    spikes_per_strip: WholeNumber = Field(default=5, ge=0, le=100, description="Rows of spikes.")
    spike_pitch: PositiveLength = Field(
        default=written("6 mm"), description="Distance between rows."
    )
    spike_height: PositiveLength = Field(default=written("5 mm"), description="Above the skin.")
    front_radius: PositiveLength = Field(
        default=written("5 mm"), description="Of the spike's front edge."
    )
    rear_radius: PositiveLength = Field(
        default=written("3.5 mm"), description="Of the spike's rear edge."
    )
    root_thickness: PositiveLength = Field(
        default=written("3 mm"), description="Spike at its root, along x; a broad root matches "
        "the measured stiffness better than a thin arc."
    )  # fmt: skip
    tip_thickness: PositiveLength = Field(default=written("1 mm"), description="Spike at its tip.")
    lean: Length = Field(
        default=written("2.5 mm"), description="How far the tip lies behind the root."
    )
    element_size: PositiveLength = Field(
        default=written("0.35 mm"), description="Edge length of the triangles, about."
    )


class FileMesh(Part):
    """A mesh of linear triangles from a file (gmsh .msh, VTK .vtu, ABAQUS .inp)."""

    file: Text = Field(description="Path, relative to the file that says so.")
    length_unit: PositiveLength = Field(
        default=written("1 mm"), description="Length of one unit in the file."
    )


def _mesh_kind(value: Any) -> str | None:
    if isinstance(value, FileMesh) or (isinstance(value, dict) and "file" in value):
        return "file"
    if isinstance(value, dict):
        value = value.get("generator")
        return value if isinstance(value, str) else None
    return getattr(value, "generator", None)


MeshSource = Annotated[
    Union[  # noqa: UP007 - pydantic reads tags from Annotated members of a Union
        Annotated[BlockMesh, Tag("block")],
        Annotated[PfrSectionMesh, Tag("pfr_section")],
        Annotated[FileMesh, Tag("file")],
    ],
    Discriminator(_mesh_kind),
]


class Body(Part):
    """A deformable body."""

    mesh: MeshSource = Field(description="From a generator, or from a file.")
    formulation: Literal["plane_strain"] = Field(description="Kinematics of the elements.")
    thickness: PositiveLength = Field(description="Depth of the plane model.")
    material: Text = Field(description="A name of the scene's materials or of the library.")
    position: Point = Field(default=ORIGIN, description="Where the mesh's origin is placed.")
    rotation: Angle = Field(
        default=written("0 deg"), description="Turn about the mesh's origin, before that."
    )
    initial_velocity: tuple[Velocity, Velocity] = Field(
        default=AT_REST, description="Of all its nodes."
    )
    fixed: tuple[Text, ...] = Field(default=(), description="Its node sets held in place.")


class OutlineBox(Part):
    """A rectangle around a rigid body's centre."""

    length: PositiveLength = Field(description="Along x.")
    height: PositiveLength = Field(description="Along y.")


class RigidBody(Part):
    """A rigid body with mass, inertia and three degrees of freedom."""

    mass: PositiveMass = Field(description="Without the nodes tied to it.")
    inertia: PositiveInertia = Field(description="About its centre, without tied nodes.")
    center: Point = Field(default=ORIGIN, description="Centre of mass.")
    tied: tuple[SetReference, ...] = Field(
        default=(), description='Node sets that move with it: "skin.knots".'
    )
    outline: OutlineBox | None = Field(default=None, description="What touches walls.")
    supports: tuple[SetReference, ...] = Field(
        default=(), description="Node sets that may lie against the outline from outside."
    )
    support_friction_coefficient: Number = Field(
        default=0.0, ge=0.0, description="Friction between those and the outline."
    )
    free: tuple[Literal["x", "y", "rotation"], ...] = Field(
        default=("x", "y", "rotation"), description="Degrees of freedom that may move."
    )
    initial_velocity: tuple[Velocity, Velocity] = Field(
        default=AT_REST, description="Of its centre."
    )
    initial_angular_velocity: AngularVelocity = Field(
        default=written("0 rad/s"), description="Turning speed."
    )

    @field_validator("supports")
    @classmethod
    def _supports_need_an_outline(
        cls, supports: tuple[str, ...], info: ValidationInfo
    ) -> tuple[str, ...]:
        if supports and info.data.get("outline") is None:
            raise ValueError("need an outline to lie against: give outline too")
        return supports


class PipeWall(Part):
    """Two straight walls, one diameter apart, along x."""

    kind: Literal["pipe"] = Field(description="Kind of wall.")
    diameter: PositiveLength = Field(description="Inner diameter.")
    axis_height: Length = Field(default=written("0 mm"), description="y of the pipe's axis.")


class PlaneWall(Part):
    """A half plane."""

    kind: Literal["plane"] = Field(description="Kind of wall.")
    point: Point = Field(default=ORIGIN, description="A point on it.")
    normal: Direction = Field(
        default=(0.0, 1.0), description="Points out of the solid into the free side."
    )


Wall = Annotated[PipeWall | PlaneWall, Field(discriminator="kind")]


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


class ConstantProfile(Part):
    """A constant pressure."""

    kind: Literal["constant"] = Field(description="Kind of profile.")
    value: NotNegativePressure = Field(description="The pressure.")
    ramp: NotNegativeTime = Field(
        default=written("0 s"), description="Time in which it rises from zero."
    )


class TableProfile(Part):
    """Straight lines between points."""

    kind: Literal["table"] = Field(description="Kind of profile.")
    points: tuple[tuple[NotNegativeTime, NotNegativePressure], ...] = Field(
        min_length=2, description="[time, pressure] pairs, times rising."
    )

    @field_validator("points")
    @classmethod
    def _times_rise(
        cls, points: tuple[tuple[float, float], ...]
    ) -> tuple[tuple[float, float], ...]:
        for number, (one, following) in enumerate(pairwise(points)):
            if following[0] <= one[0]:
                raise ValueError(f"point {number + 1} must come later than point {number}")
        return points


class _Cycle(Part):
    highest: PositivePressure = Field(description="Highest pressure.")
    inflation_rate: PositivePressureRate = Field(description="Rise of pressure.")
    hold: NotNegativeTime = Field(
        default=written("0 s"), description="Time at the highest pressure."
    )
    lowest: NotNegativePressure = Field(description="Where the next inflation begins (P_M3^S).")
    count: WholeNumber = Field(default=1, ge=1, le=100000, description="Number of cycles.")
    start: NotNegativeTime = Field(
        default=written("0 s"), description="When the first inflation begins."
    )

    @field_validator("lowest")
    @classmethod
    def _lowest_is_lower(cls, lowest: float, info: ValidationInfo) -> float:
        if lowest >= info.data.get("highest", math.inf):
            raise ValueError("must be below highest")
        return lowest


class CyclesProfile(_Cycle):
    """Inflate, hold, deflate at a given average rate, rest; again."""

    kind: Literal["cycles"] = Field(description="Kind of profile.")
    deflation_rate: PositivePressureRate = Field(description="Average deflation rate (Df_r^a).")
    rest: NotNegativeTime = Field(
        default=written("0 s"), description="Time at the lowest pressure."
    )


class NaturalDeflationProfile(_Cycle):
    """Inflate, hold, let the air out: an exponential fall."""

    kind: Literal["natural_deflation"] = Field(description="Kind of profile.")
    time_constant: PositiveTime = Field(description="Time in which the pressure falls to 1/e.")

    @field_validator("lowest")
    @classmethod
    def _lowest_is_reached(cls, lowest: float) -> float:
        if lowest == 0.0:
            raise ValueError("must be greater than 0 Pa: an exponential never reaches zero")
        return lowest


PressureProfile = Annotated[
    ConstantProfile | TableProfile | CyclesProfile | NaturalDeflationProfile,
    Field(discriminator="kind"),
]


class FollowerPressure(Part):
    """Pressure on facets that follows the deformation."""

    kind: Literal["follower_pressure"] = Field(description="Kind of load.")
    facets: tuple[SetReference, ...] = Field(
        min_length=1, description='Facet sets: "skin.chamber_top".'
    )
    reacts_on: Text | None = Field(
        default=None, description="Rigid body that closes the chamber and feels the reaction."
    )
    profile: PressureProfile = Field(description="Pressure over time.")
    factor: Number = Field(
        default=1.0, gt=0.0, description="Pressure on the plane model over that of the profile."
    )
    offset: NotNegativePressure = Field(
        default=written("0 Pa"),
        description="Part of the profile that acts on nothing in the plane model, such as what "
        "hoop tension carries: on the facets acts factor times (profile - offset), never below 0.",
    )


class EccentricMass(Part):
    """A vibration motor: force m_e r_e omega^2, rotating."""

    kind: Literal["eccentric_mass"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body that carries the motor.")
    eccentric_mass: PositiveMass = Field(description="m_e; its weight is part of the body's.")
    radius: PositiveLength = Field(description="r_e, of the mass from the motor's axis.")
    frequency: PositiveFrequency = Field(description="Turns in a second.")
    rotation_axis: Literal["x", "z"] = Field(
        default="x", description="x: turns across the pipe, the section sees the y part; z: turns "
        "in the section."
    )  # fmt: skip
    factor: Number = Field(
        default=1.0, gt=0.0, description="Force on the plane model over the motor's."
    )
    spin_up: NotNegativeTime = Field(
        default=written("50 ms"), description="Time to full speed, smooth."
    )
    phase: Angle = Field(default=written("0 deg"), description="Angle at the start.")


class SinusoidalForce(Part):
    """A force of given amplitude along a fixed direction."""

    kind: Literal["sinusoidal_force"] = Field(description="Kind of load.")
    acts_on: Text = Field(description="Rigid body that it acts on, at the centre of mass.")
    amplitude: PositiveForce = Field(description="Largest force.")
    direction: Direction = Field(
        default=(0.0, 1.0), description="Direction; its length does not matter."
    )
    frequency: PositiveFrequency = Field(description="Frequency.")
    spin_up: NotNegativeTime = Field(
        default=written("50 ms"), description="Time to full speed, smooth."
    )
    phase: Angle = Field(default=written("0 deg"), description="Angle at the start.")


class NodalForce(Part):
    """A force on a node set, shared by mass."""

    kind: Literal["nodal_force"] = Field(description="Kind of load.")
    nodes: SetReference = Field(description='Node set: "block.top".')
    force: tuple[Force, Force] = Field(description="Total force on the set.")
    ramp: NotNegativeTime = Field(
        default=written("0 s"), description="Time to the full force, smooth."
    )


Load = Annotated[
    FollowerPressure | EccentricMass | SinusoidalForce | NodalForce, Field(discriminator="kind")
]


class Time(Part):
    """How long, in which steps."""

    end: PositiveTime = Field(description="Simulated time at which the run ends.")
    increment: AutoOrPositiveTime = Field(
        default="auto", description="Time step; auto: the stable one times solver.safety_factor."
    )


class Solver(Part):
    """Settings of the explicit integrator."""

    safety_factor: Number = Field(
        default=0.9, gt=0.0, le=1.0, description="Time step over the stable one."
    )
    bulk_viscosity: Number = Field(
        default=0.06, ge=0.0, le=1.0, description="Linear coefficient b1, as in ABAQUS/Explicit."
    )
    energy_error_limit: Number = Field(
        default=0.05, gt=0.0, description="The run stops when the balance is off by more."
    )


class Output(Part):
    """What is written, how often."""

    history_interval: PositiveTime = Field(
        default=written("2 ms"), description="Between history rows."
    )
    frame_interval: PositiveTime = Field(
        default=written("100 ms"), description="Between stored fields."
    )
    checkpoint_interval: PositiveTime = Field(
        default=written("30 s"), description="Between checkpoints, of wall time."
    )
    snapshot_field: Literal["displacement", "pressure", "stretch", "von_mises"] = Field(
        default="stretch", description="What colours the snapshots."
    )


class _Range(Part):
    @model_validator(mode="after")
    def _limits_leave_room(self) -> "_Range":
        least, most = getattr(self, "min", None), getattr(self, "max", None)
        if least is None and most is None:
            raise ValueError("gives no limit: give min, max or both")
        if least is not None and most is not None and least > most:
            raise ValueError("min must not be above max")
        return self


class LengthRange(_Range):
    """Limits of a length."""

    min: Length | None = Field(default=None, description="Smallest allowed value.")
    max: Length | None = Field(default=None, description="Largest allowed value.")


class VelocityRange(_Range):
    """Limits of a velocity."""

    min: Velocity | None = Field(default=None, description="Smallest allowed value.")
    max: Velocity | None = Field(default=None, description="Largest allowed value.")


class NumberRange(_Range):
    """Limits of a number."""

    min: Number | None = Field(default=None, description="Smallest allowed value.")
    max: Number | None = Field(default=None, description="Largest allowed value.")


class Expect(Part):
    """Values the scene expects of its own run; outside them the run ends with exit code 5."""

    frame_displacement: LengthRange | None = Field(
        default=None, description="Of the first rigid body along x, from start to end."
    )
    displacement_per_cycle: LengthRange | None = Field(
        default=None, description="The same for every pressure cycle."
    )
    body_displacement: LengthRange | None = Field(
        default=None, description="Of the meshed bodies' centre of mass along x."
    )
    body_speed: VelocityRange | None = Field(
        default=None, description="Of that, mean over the last tenth of the run."
    )
    rows_in_contact: NumberRange | None = Field(
        default=None, description="Most rows of spikes that touched at a time."
    )
    energy_error: NumberRange | None = Field(
        default=None, description="Largest error of the energy balance."
    )


class Scene(Part):
    """One simulation."""

    title: Text = Field(default="", description="One line for people.")
    materials: dict[Name, YeohMaterial] = Field(
        default={}, description="Materials by name, beside those of the library."
    )
    bodies: dict[Name, Body] = Field(min_length=1, description="Deformable bodies by name.")
    rigid_bodies: dict[Name, RigidBody] = Field(default={}, description="Rigid bodies by name.")
    environment: Environment = Field(default_factory=Environment, description="Gravity and walls.")
    contact: Contact = Field(default_factory=Contact, description="Contact with the walls.")
    loads: dict[Name, Load] = Field(default={}, description="Loads by name.")
    time: Time = Field(description="How long, in which steps.")
    solver: Solver = Field(default_factory=Solver, description="Settings of the integrator.")
    output: Output = Field(default_factory=Output, description="What is written, how often.")
    expect: Expect = Field(default_factory=Expect, description="Regression values of the scene.")


def scene_json_schema() -> dict[str, Any]:
    """JSON schema of a scene file, so that an editor completes and checks its keys."""
    schema = Scene.model_json_schema()
    schema["properties"]["include"] = {
        "description": "A file, or a list of them, that this one adds to; keys here win.",
        "anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}],
    }
    return schema
