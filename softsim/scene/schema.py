"""The vocabulary of a scene: every key, its meaning, its unit, its default.

Quantities are written with units ("36 mm") and become SI floats; numbers without a dimension are
written bare. Unknown keys are refused.
"""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from softsim.scene.bodies import Body, RigidBody
from softsim.scene.cables import Cable
from softsim.scene.conditions import Condition
from softsim.scene.fibres import Fibre
from softsim.scene.layout import Layout
from softsim.scene.loads import Load
from softsim.scene.materials import Material
from softsim.scene.outputs import Expect, Output
from softsim.scene.part import Part
from softsim.scene.quantities import (
    AutoOrPositiveTime,
    Name,
    Number,
    PositiveDensity,
    PositiveLength,
    PositivePressure,
    PositiveTime,
    SetPattern,
    SetReference,
    Text,
    WholeNumber,
)
from softsim.scene.surroundings import Contact, Environment
from softsim.scene.terrain import Crossing
from softsim.scene.trailed import Trailed


class SteadyProbe(Part):
    """A probe at whose rest a static run may end."""

    probe: Text = Field(description="One of `output.probes`.")
    within: Number = Field(
        gt=0.0, lt=1.0, description="Share of its value within which it has stayed for the last "
        "half of the time since `end`. What decays, by itself or by its time, is nearer than that."
    )  # fmt: skip


class Reach(Part):
    """A column of the history at whose value a run ends."""

    column: Text = Field(description="As history.csv has it: pressure, frame_x, chamber_volume ...")
    above: Text | Number | None = Field(
        default=None, description='The run ends above this value: "20 kPa", or a bare number.'
    )
    below: Text | Number | None = Field(default=None, description="The run ends below this value.")

    @model_validator(mode="after")
    def _has_one_limit(self) -> "Reach":
        if (self.above is None) == (self.below is None):
            raise ValueError("give one limit: above or below")
        return self


class Time(Part):
    """How long, in which steps."""

    end: PositiveTime = Field(description="Simulated time at which the run ends.")
    cycles: Annotated[WholeNumber, Field(ge=1)] | None = Field(
        default=None, description="The run ends earlier than `end` where so many pressure cycles "
        "of the robot's chamber are done by then; by default it does not wait for cycles."
    )  # fmt: skip
    procedure: Literal["dynamic", "static"] = Field(
        default="dynamic", description="static: seeks equilibrium by dynamic relaxation. Loads "
        "follow their profiles up to `end`, then the run goes on until forces balance; inertia and "
        "rates mean nothing, materials have their long-term stiffness."
    )  # fmt: skip
    settle: PositiveTime | None = Field(
        default=None, description="Longest simulated time of relaxation to equilibrium. Of a "
        "dynamic run: before t = 0 all comes to rest under weight, contact and friction, with "
        "motors and pressures off; without it bodies start as they are meshed. Of a static run: "
        "after `end`; 10 s without it."
    )  # fmt: skip
    until: SteadyProbe | None = Field(
        default=None, description="A static run ends, too, when this probe is steady, which it may "
        "be long before forces balance."
    )  # fmt: skip
    reach: Reach | None = Field(
        default=None, description="The run ends earlier, too, with the first row of the history in "
        "which a column is above or below a value."
    )  # fmt: skip
    increment: AutoOrPositiveTime = Field(
        default="auto", description="Time step; auto: the stable one times solver.safety_factor."
    )


class MassScaling(Part):
    """Longer steps: motion within groups of nodes that lie close together is slowed, what a group
    does as a whole is not.
    """

    within: PositiveLength = Field(
        description="Largest distance between two nodes of a group: about the thickness of what is "
        "thin, and small against what bends. Groups are made of nearest neighbours at rest."
    )
    factor: Number = Field(
        default=4.0, gt=1.0, description="Inertia of motion within a group over what it is."
    )


class Solver(Part):
    """Settings of the explicit integrator."""

    safety_factor: Number = Field(
        default=0.9, gt=0.0, le=1.0, description="Time step over the stable one."
    )
    least_step: Number = Field(
        default=0.05,
        ge=0.0,
        lt=1.0,
        description="The run stops when the stable step falls below this share of that at rest, as "
        "it does when a skin balloons.",
    )
    bulk_viscosity: Number = Field(
        default=0.06,
        ge=0.0,
        le=1.0,
        description="Linear coefficient b1, as in ABAQUS/Explicit; "
        "a static procedure takes at least 0.06, without which it would not settle.",
    )
    mass_scaling: MassScaling | None = Field(
        default=None, description="For longer steps; by default masses are as they are."
    )
    energy_error_limit: Number = Field(
        default=0.05, gt=0.0, description="The run stops when the balance is off by more."
    )
    equilibrium_tolerance: Number = Field(
        default=1e-6, gt=0.0, lt=1.0, description="A static run ends when the unbalanced force is "
        "below this share of the inner forces, which in slender bodies are far above the loads."
    )  # fmt: skip


class Roles(Part):
    """Which part plays which role in what a run tells of its robot."""

    frame: Text | None = Field(
        default=None, description="Rigid body whose place and turn are told; by default the first."
    )
    chamber: Text | None = Field(
        default=None, description="Load whose pressure and cycles are told; by default the first "
        "that is a pressure."
    )  # fmt: skip
    rows: tuple[SetPattern, ...] = Field(
        default=(),
        description="Node sets of which it is told how many touch walls, by name or pattern: "
        '"skin.j*[0-9]" is j1, j2 ...',
    )
    track: Text | None = Field(
        default=None, description="Probe of kind displacement, in space, whose way over the ground "
        "is told: how tightly it turns, how fast it goes."
    )  # fmt: skip
    assumptions: tuple[Text, ...] = Field(
        default=(),
        description="Sentences on what the model of the robot assumes, and what experiments say of "
        "it; a verdict on a layout states them.",
    )


class Tie(Part):
    """Nodes that follow a surface whose mesh does not match theirs, as if they were glued to it.
    They are moved onto its facets before the start. Where meshes differ in size, tie the nodes of
    the finer one to the facets of the coarser one.
    """

    nodes: SetReference = Field(description='Node set that follows: "paper.top".')
    facets: SetReference = Field(description='Facet set that it follows: "finger.bottom".')
    tolerance: PositiveLength | None = Field(
        default=None, description="How far a node may lie off the facets; by default 5 % of their "
        "mean side."
    )  # fmt: skip


class Layer(Part):
    """A thin layer on the surface of a body, which it follows: paper, cloth, film. It resists
    stretching and not bending, by St. Venant and Kirchhoff's law, and is meant for small strains.
    Its thickness takes no room: what touches the body touches its facets.
    """

    facets: SetReference = Field(description='Facet set that it covers: "finger.bottom".')
    thickness: PositiveLength = Field(description="At rest.")
    youngs_modulus: PositivePressure = Field(description="Young's modulus.")
    poisson_ratio: Number = Field(
        default=0.3, ge=0.0, lt=0.5, description="Of strain across over strain along."
    )
    density: PositiveDensity = Field(description="Mass over volume.")


class Scene(Part):
    """One simulation."""

    title: Text = Field(default="", description="One line for people.")
    materials: dict[Name, Material] = Field(
        default={}, description="Materials by name, beside those of the library."
    )
    bodies: dict[Name, Body] = Field(
        min_length=1,
        description="Deformable bodies by name; a layout without a robot is for softsim assess.",
    )
    cables: dict[Name, Cable] = Field(default={}, description="Cables by name.")
    layers: dict[Name, Layer] = Field(default={}, description="Layers on surfaces by name.")
    fibres: dict[Name, Fibre] = Field(default={}, description="Fibres in bodies by name.")
    ties: dict[Name, Tie] = Field(default={}, description="Ties of nodes to surfaces by name.")
    rigid_bodies: dict[Name, RigidBody] = Field(default={}, description="Rigid bodies by name.")
    environment: Environment = Field(default_factory=Environment, description="Gravity and walls.")
    contact: Contact = Field(default_factory=Contact, description="Contact with the walls.")
    conditions: dict[Name, Condition] = Field(
        default={}, description="Conditions on node sets, by name."
    )
    loads: dict[Name, Load] = Field(default={}, description="Loads by name.")
    time: Time = Field(description="How long, in which steps.")
    solver: Solver = Field(default_factory=Solver, description="Settings of the integrator.")
    robot: Roles = Field(default_factory=Roles, description="Roles of its parts.")
    layout: Layout | None = Field(
        default=None,
        description="Whether the robot gets through a pipe_path; no question by default.",
    )
    trailed: Trailed | None = Field(
        default=None, description="What softsim reach lets the robot trail; no part of a run."
    )
    crossing: Crossing | None = Field(
        default=None, description="Whether a body gets over its ground; no question by default."
    )
    output: Output = Field(default_factory=Output, description="What is written, how often.")
    expect: Expect = Field(default_factory=Expect, description="Regression values of the scene.")


def scene_json_schema() -> dict[str, Any]:
    """JSON schema of a scene file, so that an editor completes and checks its keys."""
    schema = Scene.model_json_schema()
    schema["properties"]["include"] = {
        "description": "A file, or a list of them, that this one adds to; keys here win. "
        "Robots that ship with softsim go by name: robot:pfr.",
        "anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}],
    }
    of_a_step = {"type": "object", "properties": dict(schema["properties"])}
    schema["properties"]["steps"] = {
        "description": "Steps by name, one after another: what each says is merged over the scene "
        "of the step before, but for time and expect. A load or condition written as ~ is over.",
        "type": "object",
        "additionalProperties": of_a_step,
    }
    schema["required"].remove("time")
    schema["anyOf"] = [{"required": ["time"]}, {"required": ["steps"]}]
    return schema
