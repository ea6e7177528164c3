"""File of a chain: keys with meaning, unit and default; loading by path or name."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, ConfigDict, Field

from softsim.errors import Option, SceneError
from softsim.scene.loading import LIBRARY, Loaded, overridden, read_scene, validated_as
from softsim.scene.measures import FORCE, FREQUENCY, LENGTH, NODES, NUMBER, SPEED, TIME, Measure
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
    Spec,
    Text,
    WholeNumber,
    written,
)
from softsim.scene.reporting import did_you_mean
from softsim.scene.text import Keys, Tree, is_file, replaced


def _at_most_upright(slope: float) -> float:
    if abs(slope) > math.radians(90.0) * (1.0 + 1e-12):
        raise ValueError(
            f"{math.degrees(slope):.6g} deg is beyond a wall: a slope is from -90 to 90 deg"
        )
    return slope


class Backbone(Spec):
    """Strip that carries the limbs."""

    length: PositiveLength = Field(description="Length. All rows must fit on it.")
    width: PositiveLength = Field(description="Width across the robot.")
    thickness: PositiveLength = Field(description="Thickness.")
    density: PositiveDensity = Field(
        description="Density of its silicone. The node masses must not be less than the "
        "backbone's mass."
    )
    bending_stiffness: NotNegativeTurningStiffness = Field(
        description="Rotational stiffness of each link or joint."
    )
    bending: Literal["tilt", "joint"] = Field(
        default="tilt",
        description="tilt: a moment resists the angle of each link to the ground. joint: it "
        "resists the angle between neighbouring links.",
    )


class RowsSpec(Spec):
    """Rows of limbs."""

    count: WholeNumber = Field(ge=2, le=200, description="Number of rows.")
    pitch: PositiveLength = Field(description="Distance between rows.")
    limbs: WholeNumber = Field(default=2, ge=1, description="Number of limbs in a row.")
    under_head: WholeNumber = Field(
        default=1,
        ge=1,
        description="Number of rows that are lumped into the head node, which lies in their "
        "middle.",
    )


class Masses(Spec):
    """Masses of the nodes."""

    head: PositiveMass = Field(
        description="Mass of the head node, with the motor and the rows below the head."
    )
    node: PositiveMass = Field(description="Mass of each other node.")


class LimbsSpec(Spec):
    """Contact of the limbs with the ground."""

    stiffness: PositiveStiffness = Field(description="Vertical stiffness of one limb.")
    damping: NotNegativeDamping = Field(
        description="Damping coefficient of the vertical motion of each node."
    )
    damped: Literal["always", "contact"] = Field(
        default="always",
        description="always: nodes are damped at all times. contact: only while they touch the "
        "ground.",
    )
    thrust_ratio: Number = Field(
        default=0.5,
        ge=0.0,
        description="Forward force of a compressed limb divided by its upward force.",
    )
    thrust: Literal["head", "all"] = Field(
        default="head", description="Limbs that push forward: only those of the head, or all."
    )


class Friction(Spec):
    """Friction between limbs and ground."""

    coefficient: Number = Field(ge=0.0, description="Coefficient of sliding friction.")
    load: Literal["weight", "normal_force"] = Field(
        default="weight",
        description="Normal load of the friction law. weight: the weight of a touching node. "
        "normal_force: the force of its limbs.",
    )
    full_speed: PositiveVelocity = Field(
        default=written("1 mm/s"),
        description="Velocity scale of the regularised friction law; friction is fully developed "
        "at three times this speed.",
    )


class Motor(Spec):
    """Eccentric-mass motor on the head."""

    place: Literal["front", "middle", "rear"] = Field(
        default="front",
        description="Position of the head, the node with the motor, along the robot.",
    )
    eccentric_mass: PositiveMass = Field(description="Eccentric mass.")
    eccentricity: NotNegativeLength = Field(
        description="Distance of the eccentric mass from the axis; 0 mm: the motor is off."
    )
    frequency: PositiveFrequency = Field(description="Rotation frequency.")
    further: dict[Name, PositiveFrequency] = Field(
        default={}, description="Further frequencies by name, for which the speed is also computed."
    )
    rotation: Literal["counterclockwise", "clockwise"] = Field(
        default="counterclockwise",
        description="Sense of rotation, seen with forward to the right. It starts at the lowest "
        "point.",
    )
    weight: Literal["in_head", "added"] = Field(
        default="in_head",
        description="Weight of the eccentric mass. in_head: included in the head's mass. added: "
        "added to it, as in 3.2 of the thesis.",
    )


class Side(Spec):
    """Values of one side that differ from the file's."""

    frequency: PositiveFrequency | None = Field(
        default=None, description="Frequency of this side's motor. Default: `motor.frequency`."
    )
    motor_share: Number = Field(
        default=1.0,
        ge=0.0,
        description="Multiplier of the force of this side's motor at its frequency.",
    )
    limb_share: Number = Field(
        default=1.0, gt=0.0, description="Multiplier of the stiffness of this side's limbs."
    )
    friction_share: Number = Field(
        default=1.0, ge=0.0, description="Multiplier of this side's friction coefficient."
    )


class Sides(Spec):
    """Two chains side by side (3D), each with a motor."""

    distance: PositiveLength = Field(
        description="Distance between the nodes of the left and the right chain."
    )
    running: Literal["both", "left", "right"] = Field(
        default="both", description="Motors that run."
    )
    left: Side = Field(
        default_factory=Side, description="Values of the left side that differ from the file's."
    )
    right: Side = Field(
        default_factory=Side, description="Values of the right side that differ from the file's."
    )


class ChainTimeSpec(Spec):
    """Duration and time steps."""

    model_config = ConfigDict(title="Time")

    end: PositiveTime = Field(default=written("2 s"), description="Simulated time.")
    increment: PositiveTime = Field(
        default=written("0.2 ms"),
        description="Time step. With the adaptive integrator: interval at which the motion is "
        "stored.",
    )
    integrator: Literal["fixed", "adaptive"] = Field(
        default="fixed",
        description="fixed: fourth-order Runge-Kutta method. adaptive: that of MATLAB's ode45, "
        "for chains with little contact.",
    )
    row_interval: PositiveTime = Field(
        default=written("0.2 ms"), description="Simulated time between rows of history.csv."
    )


class ChainScene(Spec):
    """Robot modelled as a chain of masses and springs on a slope."""

    title: Text = Field(default="", description="Title of the report, one line.")
    backbone: Backbone = Field(description="Strip that carries the limbs.")
    rows: RowsSpec = Field(description="Rows of limbs.")
    masses: Masses = Field(description="Masses of the nodes.")
    limbs: LimbsSpec = Field(description="Contact of the limbs with the ground.")
    friction: Friction = Field(description="Friction between limbs and ground.")
    motor: Motor = Field(description="Eccentric-mass motor on the head.")
    sides: Sides | None = Field(
        default=None,
        description="Two chains side by side (3D); the rest of the file describes one of them. "
        "Default: one chain in the plane.",
    )
    drag: NotNegativeDamping = Field(
        default=written("0 N*s/m"),
        description="Damping coefficient of the head's motion along the ground.",
    )
    wave_tension: NotNegativeForce = Field(
        default=written("0 N"),
        description="Tension of the wave along the backbone, which pulls each node up if the node "
        "in front is higher.",
    )
    slope: Annotated[Angle, AfterValidator(_at_most_upright)] = Field(
        default=written("0 deg"), description="Slope of the ground; positive is uphill."
    )
    gravity: NotNegativeGravity = Field(
        default=written("9.81 m/s^2"), description="Acceleration of gravity."
    )
    constraint_time: PositiveTime = Field(
        default=written("0.5 ms"),
        description="Time constant in which errors of the link lengths decay.",
    )
    time: ChainTimeSpec = Field(
        default_factory=ChainTimeSpec, description="Duration and time steps."
    )

    @property
    def node_count(self) -> int:
        """Number of nodes of one line: the head and the rows not under it."""
        return self.rows.count - self.rows.under_head + 1

    @property
    def lines(self) -> tuple[Side, ...]:
        """Sides of the chain, a single one for a chain in the plane."""
        return (Side(),) if self.sides is None else (self.sides.left, self.sides.right)

    @property
    def running(self) -> tuple[bool, ...]:
        """True for each line whose motor runs."""
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
"""Further measures in the summary of a chain with two sides."""


def produced_by_chain(scene: ChainScene) -> dict[str, Measure]:
    """Return the measures in the summary of a chain by name, such as "further_speeds.fast"."""
    further = {f"further_speeds.{name}": SPEED for name in scene.motor.further}
    return OF_CHAINS | (OF_TRACKS if scene.sides is not None else {}) | further


# -------------------------------------------------------------------------------------------------
# Loading of chains from files, or by the names of those that ship with softsim.

CHAINS = LIBRARY / "chain"


LoadedChain = Loaded[ChainScene]


def chain_names() -> list[str]:
    """Return the names of the chains that ship with softsim."""
    return sorted(file.stem for file in CHAINS.glob("*.yaml"))


def load_chain(
    name: str | Path, overrides: Sequence[str] = (), options: Mapping[str, tuple[Keys, str]] = {}
) -> LoadedChain:
    """Read, merge and validate a chain.

    Parameters
    ----------
    name : Path or str
        Path of a file, or name of a chain that ships with softsim, such as "leafbot5".
    overrides : sequence of str
        Values that override those of the file: "motor.frequency=142 Hz", as for `load_scene`.
    options : mapping
        Options of the command line: name -> keys and value. They override everything else.

    Returns
    -------
    LoadedChain
        The validated chain, which `run_chain` accepts.

    Raises
    ------
    SceneError
        The file is not a valid chain. The error holds all problems found.

    Examples
    --------
    >>> from softsim.apps.chain.scene import load_chain
    >>> loaded = load_chain("leafbot5", ["time.end=0.1 s"])
    >>> loaded.scene.rows.count, loaded.scene.time.end  # [s]
    (5, 0.1)
    """
    path = _file(Path(name))
    tree = read_scene(path)
    for override in overrides:
        tree = overridden(tree, override, ChainScene)
    for flag, (keys, text) in options.items():
        origin = Option(f"{flag} {text}")
        tree = replaced(tree, keys, Tree(text, origin, origin, text))
    return validated_as(ChainScene, tree, path)


def _file(name: Path) -> Path:
    if is_file(name):
        return name
    shipped = CHAINS / f"{name}.yaml"
    if str(name) in chain_names():
        return shipped
    raise SceneError(
        f"there is no file and no built-in chain {str(name)!r}",
        did_you_mean(str(name), chain_names()),
    )
