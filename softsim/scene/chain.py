"""The vocabulary of a chain's file: every key, its meaning, its unit, its default."""

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from softsim.scene.measures import FORCE, FREQUENCY, LENGTH, NODES, NUMBER, SPEED, TIME, Measure
from softsim.scene.part import Part
from softsim.scene.quantities import (
    Angle,
    Name,
    NotNegativeDamping,
    NotNegativeForce,
    NotNegativeGravity,
    NotNegativeLength,
    NotNegativeTurningStiffness,
    Number,
    PositiveDensity,
    PositiveFrequency,
    PositiveLength,
    PositiveMass,
    PositiveStiffness,
    PositiveTime,
    PositiveVelocity,
    Text,
    WholeNumber,
    written,
)


def _at_most_upright(slope: float) -> float:
    if abs(slope) > math.radians(90.0) * (1.0 + 1e-12):
        raise ValueError(
            f"{math.degrees(slope):.6g} deg is beyond a wall: a slope is from -90 to 90 deg"
        )
    return slope


class Backbone(Part):
    """The strip that holds all limbs."""

    length: PositiveLength = Field(description="Along the robot: all rows must fit on it.")
    width: PositiveLength = Field(description="Across the robot.")
    thickness: PositiveLength = Field(description="Of the strip.")
    density: PositiveDensity = Field(description="Of its silicone: nodes weigh no less than it.")
    bending_stiffness: NotNegativeTurningStiffness = Field(description="Of one link or joint.")
    bending: Literal["tilt", "joint"] = Field(
        default="tilt", description="tilt: each link resists its angle against the ground; joint: "
        "the angle between links is resisted."
    )  # fmt: skip


class Rows(Part):
    """Where limbs are."""

    count: WholeNumber = Field(ge=2, le=200, description="Rows of limbs.")
    pitch: PositiveLength = Field(description="From row to row.")
    limbs: WholeNumber = Field(default=2, ge=1, description="Limbs of a row.")
    under_head: WholeNumber = Field(
        default=1, ge=1, description="So many rows are merged into the head, in their middle."
    )


class Masses(Part):
    """Of the nodes."""

    head: PositiveMass = Field(description="With its motor and the rows under it.")
    node: PositiveMass = Field(description="Of each of the rows behind the head.")


class Limbs(Part):
    """What a limb does on the ground."""

    stiffness: PositiveStiffness = Field(description="Of one limb, upwards.")
    damping: NotNegativeDamping = Field(description="Of the vertical motion of each node.")
    damped: Literal["always", "contact"] = Field(
        default="always", description="When nodes are damped: always, or where they touch the "
        "ground."
    )  # fmt: skip
    thrust_ratio: Number = Field(
        default=0.5, ge=0.0, description="Forward force of a pressed limb over its upward force."
    )
    thrust: Literal["head", "all"] = Field(
        default="head", description="Limbs that push forward: of the head alone, or all."
    )


class Friction(Part):
    """Between limbs and ground."""

    coefficient: Number = Field(ge=0.0, description="Sliding friction.")
    load: Literal["weight", "normal_force"] = Field(
        default="weight", description="What it is a share of: a touching node's weight, or what "
        "its limbs press with."
    )  # fmt: skip
    full_speed: PositiveVelocity = Field(
        default=written("1 mm/s"), description="At three times this speed friction is full."
    )


class Motor(Part):
    """An eccentric mass on the head."""

    place: Literal["front", "middle", "rear"] = Field(
        default="front", description="Where along the robot the head is: the node with the motor "
        "and the rows under it."
    )  # fmt: skip
    eccentric_mass: PositiveMass = Field(description="That turns.")
    eccentricity: NotNegativeLength = Field(
        description="Its distance from the axis; 0 mm where the motor is off."
    )
    frequency: PositiveFrequency = Field(description="Turns a second.")
    further: dict[Name, PositiveFrequency] = Field(
        default={}, description="Further frequencies, by name, at which the speed is found too."
    )
    rotation: Literal["counterclockwise", "clockwise"] = Field(
        default="counterclockwise", description="Seen with forward to the right; it begins at the "
        "lowest point."
    )  # fmt: skip
    weight: Literal["in_head", "added"] = Field(
        default="in_head", description="Of the eccentric mass: part of the head's mass, or once "
        "more beside it, as the thesis's 3.2 prints it."
    )  # fmt: skip


class Side(Part):
    """What one side has of its own."""

    frequency: PositiveFrequency | None = Field(
        default=None, description="Of its motor; default: that of the file."
    )
    motor_share: Number = Field(
        default=1.0, ge=0.0, description="Its motor's force over that of the file's motor at its "
        "frequency."
    )  # fmt: skip
    limb_share: Number = Field(
        default=1.0, gt=0.0, description="Stiffness of its limbs over the file's."
    )
    friction_share: Number = Field(
        default=1.0, ge=0.0, description="Its friction coefficient over the file's."
    )


class Sides(Part):
    """Two such chains side by side, a motor on each, in space."""

    distance: PositiveLength = Field(description="Of the left nodes, with theirs, from the right.")
    running: Literal["both", "left", "right"] = Field(
        default="both", description="Which motors run."
    )
    left: Side = Field(default_factory=Side, description="What the left side has of its own.")
    right: Side = Field(default_factory=Side, description="What the right side has of its own.")


class Time(Part):
    """How long, in which steps."""

    end: PositiveTime = Field(default=written("2 s"), description="Simulated time.")
    increment: PositiveTime = Field(
        default=written("0.2 ms"), description="Time step; of the adaptive integrator, the times "
        "at which it tells the motion."
    )  # fmt: skip
    integrator: Literal["fixed", "adaptive"] = Field(
        default="fixed", description="fixed: Runge and Kutta's method of order 4; adaptive: "
        "MATLAB's ode45, for chains that hardly touch."
    )  # fmt: skip
    row_interval: PositiveTime = Field(
        default=written("0.2 ms"), description="Between rows of history.csv."
    )


class ChainScene(Part):
    """A robot as a chain of masses on springs, on a slope."""

    title: Text = Field(default="", description="One line for people.")
    backbone: Backbone = Field(description="The strip that holds all limbs.")
    rows: Rows = Field(description="Where limbs are.")
    masses: Masses = Field(description="Of the nodes.")
    limbs: Limbs = Field(description="What a limb does on the ground.")
    friction: Friction = Field(description="Between limbs and ground.")
    motor: Motor = Field(description="An eccentric mass on the head.")
    sides: Sides | None = Field(
        default=None, description="Two such chains side by side, in space: all else in the file is "
        "of one of them. Default: one chain, in the plane."
    )  # fmt: skip
    drag: NotNegativeDamping = Field(
        default=written("0 N*s/m"), description="Of the head's motion along the ground."
    )
    wave_tension: NotNegativeForce = Field(
        default=written("0 N"), description="Tension of the wave along the backbone, which pulls "
        "each node up where the one in front is higher."
    )  # fmt: skip
    slope: Annotated[Angle, AfterValidator(_at_most_upright)] = Field(
        default=written("0 deg"), description="Of the ground; upwards where positive."
    )
    gravity: NotNegativeGravity = Field(
        default=written("9.81 m/s^2"), description="Acceleration of free fall."
    )
    constraint_time: PositiveTime = Field(
        default=written("0.5 ms"), description="In which errors of the links' lengths die out."
    )
    time: Time = Field(default_factory=Time, description="How long, in which steps.")

    @property
    def node_count(self) -> int:
        """Of one line, from the front to the rear: the head and the rows not under it."""
        return self.rows.count - self.rows.under_head + 1

    @property
    def lines(self) -> tuple[Side, ...]:
        """The sides; one where the chain moves in the plane."""
        return (Side(),) if self.sides is None else (self.sides.left, self.sides.right)

    @property
    def running(self) -> tuple[bool, ...]:
        """Whether the motor of each line runs."""
        if self.sides is None:
            return (True,)
        return self.sides.running != "right", self.sides.running != "left"


OF_CHAINS = {
    "speed": SPEED,
    "least_speed": SPEED,
    "greatest_speed": SPEED,
    "settling_time": TIME,
    "contact_shares": Measure(listed=NODES),
    "dominant_frequencies": Measure("Hz", listed=NODES),
    "motor_force": FORCE,
    "motor_frequency": FREQUENCY,
    "head_displacement": LENGTH,
    "head_height": LENGTH,
    "head_depth": LENGTH,
    "energy_error": NUMBER,
    "length_error": LENGTH,
    "node_count": NUMBER,
    "heads": Measure(listed="motor"),
    "increments": NUMBER,
    "time_increment": TIME,
    "simulated_time": TIME,
    "wall_time": TIME,
}


OF_TRACKS = {
    "curvature": Measure("1/m"),
    "turning_rate": Measure("rad/s"),
    "forward_displacement": LENGTH,
    "sideways_displacement": LENGTH,
}
"""What two sides tell besides."""


def produced_by_chain(scene: ChainScene) -> dict[str, Measure]:
    """What a run of a chain tells, by name, dotted into mappings: "further_speeds.fast"."""
    further = {f"further_speeds.{name}": SPEED for name in scene.motor.further}
    return OF_CHAINS | (OF_TRACKS if scene.sides is not None else {}) | further


def chain_json_schema() -> dict[str, Any]:
    """JSON schema of a chain's file, so that an editor completes and checks its keys."""
    return ChainScene.model_json_schema()
