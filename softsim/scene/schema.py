"""Schema of a scene: every key with its meaning, unit and default.

Quantities are written with units ("36 mm") and become SI floats; numbers without a dimension have
no unit. Unknown keys are errors.
"""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from softsim.scene.bodies import (
    BodySpec,
    CableSpec,
    Condition,
    FibreSpec,
    LayerSpec,
    RigidBody,
    Tie,
)
from softsim.scene.loads import Load
from softsim.scene.materials import Material
from softsim.scene.outputs import Expect, Output
from softsim.scene.pneumatics import Pneumatics
from softsim.scene.quantities import (
    AutoOrPositiveTime,
    Name,
    Number,
    PositiveLength,
    PositiveTime,
    SetPattern,
    Spec,
    Text,
    WholeNumber,
    json_schema,
    written,
)
from softsim.scene.walls import Contact, CrossingSpec, Environment, Trailed

# -------------------------------------------------------------------------------------------------
# Test whether a robot passes a layout of pipes.


class Layout(Spec):
    """Test whether a rigid body passes a pipe. The run ends as soon as it has
    passed or is stuck.
    """

    path: Name | None = Field(
        default=None, description="Wall of kind pipe_path. Default: the only one."
    )
    body: Text | None = Field(
        default=None, description="Rigid body that has to pass. Default: the first one."
    )
    goal: PositiveLength | None = Field(
        default=None,
        description="Arc length along the path that the body's centre must reach. Default: the "
        "body has passed when its outline lies entirely in the last segment or, if that is not "
        "longer than the outline, when its front is at the end of the path.",
    )
    patience: WholeNumber = Field(
        default=2,
        ge=1,
        description="Number of pressure cycles without progress after which the body counts as "
        "stuck.",
    )
    patience_time: PositiveTime = Field(
        default=written("3 s"),
        description="Time without progress after which the body counts as stuck, if the pressure "
        "has no cycles.",
    )
    least_progress: PositiveLength = Field(
        default=written("5 mm"),
        description="Distance that counts as progress. During deflation a robot is drawn back by "
        "1 to 2 mm and springs forward again.",
    )


class SteadyProbeSpec(Spec):
    """Criterion that ends a static run once a probe is steady."""

    probe: Text = Field(description="Name of the probe, one of `output.probes`.")
    within: Number = Field(
        gt=0.0,
        lt=1.0,
        description="Relative tolerance. The probe is steady when it changed by less than this "
        "fraction of its value during the last half of the time since `end`. The remaining change "
        "is then smaller than that.",
    )


class Reach(Spec):
    """Limit of a history column at which a run ends."""

    column: Text = Field(
        description="Name of a column of history.csv, such as pressure, frame_x or chamber_volume."
    )
    above: Text | Number | None = Field(
        default=None,
        description='The run ends when the column exceeds this value: "20 kPa", or a bare number '
        "if the column has no unit.",
    )
    below: Text | Number | None = Field(
        default=None, description="The run ends when the column falls below this value."
    )

    @model_validator(mode="after")
    def _has_one_limit(self) -> "Reach":
        if (self.above is None) == (self.below is None):
            raise ValueError("give one limit: above or below")
        return self


class TimeSpec(Spec):
    """Duration, procedure and time step of a run."""

    end: PositiveTime = Field(description="Simulated time at which the run ends.")
    cycles: Annotated[WholeNumber, Field(ge=1)] | None = Field(
        default=None,
        description="Number of pressure cycles of the robot's chamber after which the run ends, "
        "if that is before `end`. Default: no limit.",
    )
    procedure: Literal["dynamic", "static"] = Field(
        default="dynamic",
        description="dynamic: explicit time integration. static: equilibrium with the loads of "
        "each time up to `end`. In a static run velocities and inertia have no physical meaning, "
        "and materials have their long-term stiffness.",
    )
    method: Literal["newton", "relaxation"] | None = Field(
        default=None,
        description="How a static run finds equilibrium. newton: load steps by Newton's method. "
        "relaxation: damped motion, which also finds states far away, such as those after "
        "buckling. Default: newton, but relaxation with `settle` or `until`.",
    )
    control: Literal["load", "arc_length"] = Field(
        default="load",
        description="What leads a static run by Newton's method from one equilibrium to the next. "
        "load: the time of the loads. arc_length: the distance along the path of equilibria, which "
        "turns back where a pressure or a force has a limit point (snap-through); the run ends "
        "when the loads of `end` are reached, or those of the start again.",
    )
    settle: PositiveTime | None = Field(
        default=None,
        description="Longest simulated time of relaxation to equilibrium. Dynamic run: before t = "
        "0 the model comes to rest under weight, contact and friction, with motors and pressures "
        "off; by default bodies start as meshed. Static run: the relaxation after `end`, by "
        "default 10 s.",
    )
    until: SteadyProbeSpec | None = Field(
        default=None,
        description="A static run also ends when this probe is steady, which can happen long "
        "before the forces balance.",
    )
    reach: Reach | None = Field(
        default=None,
        description="The run also ends at the first history row in which this column exceeds, or "
        "falls below, its limit.",
    )
    increment: AutoOrPositiveTime = Field(
        default="auto",
        description="Time step. auto: the stable time step times `solver.safety_factor`.",
    )


class MassScalingSpec(Spec):
    """Selective mass scaling, for longer time steps. Nodes that lie close together form groups.
    Only relative motion within a group gets extra inertia; total mass, rigid motion of a group and
    static results do not change.
    """

    within: PositiveLength = Field(
        description="Largest distance between two nodes of a group, about the thickness of the "
        "thin parts and small against the lengths over which the body bends. Groups are formed of "
        "nearest neighbours at rest."
    )
    factor: Number = Field(
        default=4.0, gt=1.0, description="Multiplier of the inertia of motion within a group."
    )


class Solver(Spec):
    """Settings of the explicit time integration."""

    safety_factor: Number = Field(
        default=0.9, gt=0.0, le=1.0, description="Fraction of the stable time step that is used."
    )
    least_step: Number = Field(
        default=0.05,
        ge=0.0,
        lt=1.0,
        description="The run stops when the stable time step falls below this fraction of its "
        "value at rest, for example when a skin balloons.",
    )
    bulk_viscosity: Number = Field(
        default=0.06,
        ge=0.0,
        le=1.0,
        description="Linear bulk viscosity coefficient b1, as in ABAQUS/Explicit. A static run "
        "uses at least 0.06.",
    )
    mass_scaling: MassScalingSpec | None = Field(
        default=None, description="Selective mass scaling for longer time steps. Default: none."
    )
    energy_error_limit: Number = Field(
        default=0.05,
        gt=0.0,
        description="The run stops when the relative error of the energy balance exceeds this "
        "value.",
    )
    equilibrium_tolerance: Number = Field(
        default=1e-6,
        gt=0.0,
        lt=1.0,
        description="A static run ends when the unbalanced force is below this fraction of the "
        "internal forces. In slender bodies the internal forces are far larger than the loads.",
    )


class Roles(Spec):
    """Parts of the robot that the results refer to."""

    frame: Text | None = Field(
        default=None,
        description="Rigid body whose position and rotation are reported. Default: the first one.",
    )
    chamber: Text | None = Field(
        default=None,
        description="Pressure load whose pressure and cycles are reported. Default: the first one.",
    )
    rows: tuple[SetPattern, ...] = Field(
        default=(),
        description="Node sets that count as rows of spikes or limbs; the results give the number "
        'of rows in contact. Names or patterns: "skin.j*[0-9]" matches j1, j2 ...',
    )
    track: Text | None = Field(
        default=None,
        description="Displacement probe whose path over the ground is evaluated (curvature, "
        "turning rate, speed). 3D only.",
    )
    assumptions: tuple[Text, ...] = Field(
        default=(),
        description="Sentences on the assumptions of the robot's model and their validation, "
        "printed with the verdict on a layout.",
    )


class Scene(Spec):
    """One simulation."""

    title: Text = Field(default="", description="Title of the report, one line.")
    materials: dict[Name, Material] = Field(
        default={}, description="Materials by name, in addition to the library."
    )
    bodies: dict[Name, BodySpec] = Field(
        min_length=1,
        description="Deformable bodies by name. A layout without bodies is not a scene: run it "
        "with `softsim assess`.",
    )
    cables: dict[Name, CableSpec] = Field(default={}, description="Cables by name.")
    layers: dict[Name, LayerSpec] = Field(
        default={}, description="Thin layers on surfaces, by name."
    )
    fibres: dict[Name, FibreSpec] = Field(
        default={}, description="Fibres in or on bodies, by name."
    )
    ties: dict[Name, Tie] = Field(default={}, description="Ties of nodes to surfaces, by name.")
    rigid_bodies: dict[Name, RigidBody] = Field(default={}, description="Rigid bodies by name.")
    environment: Environment = Field(default_factory=Environment, description="Gravity and walls.")
    contact: Contact = Field(
        default_factory=Contact,
        description="Parameters of contact and friction, and the surfaces that may touch each "
        "other.",
    )
    conditions: dict[Name, Condition] = Field(
        default={}, description="Boundary and initial conditions by name."
    )
    loads: dict[Name, Load] = Field(default={}, description="Loads by name.")
    pneumatics: Pneumatics | None = Field(
        default=None,
        description="Network of sources, valves, tubes and vessels that feeds chambers. Default: "
        "none.",
    )
    time: TimeSpec = Field(description="Duration, procedure and time step of the run.")
    solver: Solver = Field(default_factory=Solver, description="Settings of the time integration.")
    robot: Roles = Field(
        default_factory=Roles, description="Parts of the robot that the results refer to."
    )
    layout: Layout | None = Field(
        default=None,
        description="Test whether the robot passes a `pipe_path`. Default: no test.",
    )
    trailed: Trailed | None = Field(
        default=None,
        description="Tether of the robot for `softsim reach`. It has no effect on a run.",
    )
    crossing: CrossingSpec | None = Field(
        default=None, description="Test whether a body crosses its terrain. Default: no test."
    )
    output: Output = Field(default_factory=Output, description="Results to write, and how often.")
    expect: Expect = Field(
        default_factory=Expect, description="Limits for results, checked at the end of the run."
    )


def scene_json_schema() -> dict[str, Any]:
    """Return the JSON schema of a scene file, for completion and checks in editors."""
    schema = json_schema(Scene)
    schema["properties"]["include"] = {
        "description": "File, or list of files, on which this one is based; keys here override it. "
        "Robots that ship with softsim are included by name: robot:pfr.",
        "anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}],
    }
    of_a_step = {"type": "object", "properties": dict(schema["properties"])}
    schema["properties"]["steps"] = {
        "description": "Steps by name, run in order. The keys of a step are merged into the scene "
        "of the previous step, except for time and expect. A load or condition set to ~ ends.",
        "type": "object",
        "additionalProperties": of_a_step,
    }
    schema["required"].remove("time")
    schema["anyOf"] = [{"required": ["time"]}, {"required": ["steps"]}]
    return schema
