"""Field types of the schema: quantities with a unit, numbers, names, references to sets."""

import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    StringConstraints,
    WithJsonSchema,
)
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from softsim import units

Bound = Literal["any", "positive", "not negative", "within a turn"]
IN_RANGE = 1e-40, 1e40
"""Smallest and largest magnitude of a quantity in SI units that a model may have."""
TURN = 2.0 * math.pi * (1.0 + 1e-12)
"""Whole turn [rad], with a margin for the round-off of 360 deg."""
SQUARABLE = 1e-140, 1e140
"""Range of numbers whose squares and sums of squares a float holds in full precision."""
NAME = r"[A-Za-z_][A-Za-z0-9_-]*"


@dataclass(frozen=True)
class Quantity:
    """Annotation of a float, read from text such as "36 mm" and stored in the SI unit `unit`.

    `word` is a text that is allowed instead and stored unchanged, such as "auto".
    """

    unit: str
    bound: Bound = "any"
    word: str | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        examples = [units.KINDS[self.unit].example, *([self.word] if self.word else [])]
        return {"type": "string", "examples": examples}

    def read(self, value: Any) -> float | str:
        """Return `value` in SI units. Raises PydanticCustomError if it is not such a quantity."""
        if self.word is not None and value == self.word:
            return self.word
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise self._refusal("must be a text with a number and a unit")
        try:
            number = units.parse(str(value), self.unit)
        except ValueError as error:
            raise self._refusal(str(error)) from None
        zero = f"0 {units.unit_of(str(value))}"
        if self.bound == "positive" and not number > 0.0:
            raise self._refusal(f"{value!r} must be greater than {zero}")
        if self.bound == "not negative" and number < 0.0:
            raise self._refusal(f"{value!r} must not be less than {zero}")
        if self.bound == "within a turn" and abs(number) > TURN:
            raise self._refusal(f"{value!r} is more than one turn")
        if (self.bound == "positive" and number < IN_RANGE[0]) or abs(number) > IN_RANGE[1]:
            size = "small" if abs(number) < 1.0 else "large"
            raise self._refusal(f"{value!r} is too {size} to be represented")
        return number

    def _refusal(self, problem: str) -> PydanticCustomError:
        kind = units.KINDS[self.unit]
        example = f'"{kind.example}"'
        ways = [] if example in problem else [f"{kind.name} such as {example}"]
        hint = ", or ".join([*ways, *([self.word] if self.word else [])])
        return PydanticCustomError("quantity", "{problem}", {"problem": problem, "hint": hint})


@dataclass(frozen=True)
class QuantityOrVector(Quantity):
    """Annotation of a quantity, or of a list of two or three components of any sign."""

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        one = super().__get_pydantic_json_schema__(schema, handler)
        return {"anyOf": [one, {"type": "array", "items": one, "minItems": 2, "maxItems": 3}]}

    def read(self, value: Any) -> Any:
        """Return `value` in SI units, a float or a tuple. Raises PydanticCustomError otherwise."""
        if not isinstance(value, list | tuple):
            return super().read(value)
        if not 2 <= len(value) <= 3:
            raise self._refusal(f"must have 2 or 3 components, not {len(value)}")
        component = Quantity(self.unit)
        return tuple(component.read(entry) for entry in value)


def written(*texts: str) -> Any:
    """Return a default as a user would write it, which the schema validates like a given value."""
    return texts[0] if len(texts) == 1 else texts


Length = Annotated[float, Quantity("m")]
PositiveLength = Annotated[float, Quantity("m", "positive")]
AutoOrPositiveLength = Annotated[float | Literal["auto"], Quantity("m", "positive", "auto")]
NotNegativeLength = Annotated[float, Quantity("m", "not negative")]
PositiveTime = Annotated[float, Quantity("s", "positive")]
NotNegativeTime = Annotated[float, Quantity("s", "not negative")]
AutoOrPositiveTime = Annotated[float | Literal["auto"], Quantity("s", "positive", "auto")]
PositiveMass = Annotated[float, Quantity("kg", "positive")]
PositiveLineDensity = Annotated[float, Quantity("kg/m", "positive")]
PositiveInertia = Annotated[float, Quantity("kg*m^2", "positive")]
PositiveDensity = Annotated[float, Quantity("kg/m^3", "positive")]
Angle = Annotated[float, Quantity("rad")]
AngleWithinTurn = Annotated[float, Quantity("rad", "within a turn")]
AngularVelocity = Annotated[float, Quantity("rad/s")]
AngularVelocityOrVector = Annotated[float | tuple[float, ...], QuantityOrVector("rad/s")]
Velocity = Annotated[float, Quantity("m/s")]
PositiveVelocity = Annotated[float, Quantity("m/s", "positive")]
AccelerationOrVector = Annotated[
    float | tuple[float, ...], QuantityOrVector("m/s^2", "not negative")
]
PositiveFrequency = Annotated[float, Quantity("Hz", "positive")]
Force = Annotated[float, Quantity("N")]
NotNegativeForce = Annotated[float, Quantity("N", "not negative")]
PositiveForce = Annotated[float, Quantity("N", "positive")]
ForceDensity = Annotated[float, Quantity("N/m^3")]
Pressure = Annotated[float, Quantity("Pa")]
PositiveEnergyPerArea = Annotated[float, Quantity("J/m^2", "positive")]
PositivePressure = Annotated[float, Quantity("Pa", "positive")]
NotNegativePressure = Annotated[float, Quantity("Pa", "not negative")]
PositivePressureRate = Annotated[float, Quantity("Pa/s", "positive")]
PositiveCompressibility = Annotated[float, Quantity("1/Pa", "positive")]
Mass = Annotated[float, Quantity("kg")]
Volume = Annotated[float, Quantity("m^3")]
NotNegativeVolume = Annotated[float, Quantity("m^3", "not negative")]
PositiveVolume = Annotated[float, Quantity("m^3", "positive")]
PositiveVolumeFlow = Annotated[float, Quantity("m^3/s", "positive")]
PositiveViscosity = Annotated[float, Quantity("Pa*s", "positive")]
PositiveStiffness = Annotated[float, Quantity("N/m", "positive")]
AutoOrPositiveStiffness = Annotated[float | Literal["auto"], Quantity("N/m", "positive", "auto")]
NotNegativeDamping = Annotated[float, Quantity("N*s/m", "not negative")]
NotNegativeGravity = Annotated[float, Quantity("m/s^2", "not negative")]
NotNegativeTurningStiffness = Annotated[float, Quantity("N*m/rad", "not negative")]
NotNegativeBendingStiffness = Annotated[float, Quantity("N*m^2", "not negative")]

TWO_OR_THREE = Field(min_length=2, max_length=3)
# In space a third component that is left out is zero.
Point = Annotated[tuple[Length, ...], TWO_OR_THREE]
VelocityVector = Annotated[tuple[Velocity, ...], TWO_OR_THREE]
ForceVector = Annotated[tuple[Force, ...], TWO_OR_THREE]
StressVector = Annotated[tuple[Pressure, ...], TWO_OR_THREE]
ForceDensityVector = Annotated[tuple[ForceDensity, ...], TWO_OR_THREE]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
WholeNumber = Annotated[int, Field(strict=True)]
Text = Annotated[str, Field(strict=True)]
Name = Annotated[str, StringConstraints(strict=True, pattern=f"^{NAME}$")]
SetReference = Annotated[
    str,
    StringConstraints(strict=True, pattern=rf"^{NAME}\.{NAME}$"),
    Field(examples=["skin.chamber_top"]),
]


SetPattern = Annotated[
    str,
    StringConstraints(strict=True, pattern=rf"^{NAME}\.[A-Za-z0-9_*?\[\]-]+$"),
    Field(examples=["skin.j*[0-9]"]),
]


def _listed(value: Any) -> Any:
    """Return a list unchanged, and any other value as a list of one."""
    return value if isinstance(value, list | tuple) else [value]


def _one_or_three(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(values) == 2:
        raise ValueError("must have one value, or three: about x, y and z")
    return values


Inertia = Annotated[
    tuple[PositiveInertia, ...],
    Field(min_length=1, max_length=3),
    BeforeValidator(_listed),
    AfterValidator(_one_or_three),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "examples": ["0.5 kg*mm^2"]},
                {
                    "type": "array",
                    "items": {"type": "string", "examples": ["0.5 kg*mm^2"]},
                    "minItems": 3,
                    "maxItems": 3,
                },
            ]
        }
    ),
]


def _not_zero(direction: tuple[float, ...]) -> tuple[float, ...]:
    """Return the direction, scaled if the square of its length would overflow or underflow."""
    largest = max(abs(component) for component in direction)
    if largest == 0.0:
        raise ValueError(f"a direction must not be {list(direction)}")
    if SQUARABLE[0] < largest < SQUARABLE[1]:
        return direction
    return tuple(component / largest for component in direction)


Axis = Literal["x", "y", "z"]
Direction = Annotated[tuple[Number, ...], TWO_OR_THREE, AfterValidator(_not_zero)]
AXES: dict[Any, tuple[float, ...]] = {
    "x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)
}  # fmt: skip


def _axis_vector(value: Any) -> Any:
    """Return the direction of an axis x, y or z; values that are not texts are unchanged."""
    if not isinstance(value, str):
        return value
    if value not in AXES:
        raise ValueError(
            f"{value!r} is not an axis: write x, y, z or three numbers, such as [1, 0, 1]"
        )
    return AXES[value]


# Of space, in a section too.
AxisVector = Annotated[
    tuple[Number, Number, Number],
    BeforeValidator(_axis_vector),
    AfterValidator(_not_zero),
    WithJsonSchema(
        {
            "anyOf": [
                {"enum": list(AXES)},
                {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
            ]
        }
    ),
]


# -------------------------------------------------------------------------------------------------
# Columns of a history. Probes must not have their names.

ROW_FORCE, SIDE_FORCE = "row_force_", "side_force_"
"""Prefixes of the columns of rows of spikes and of sides of the robot."""

CHAMBER_PRESSURE = "pressure_"
"""Prefix of the columns of chambers, for a robot with several of them."""


@dataclass(frozen=True)
class Column:
    """Column of a history: its SI unit, "-" for a bare number, and its meaning as Markdown.

    has_derivative: False for counts, errors, and sums over the load steps.
    """

    unit: str
    about: str
    has_derivative: bool = True


COLUMNS = {
    "time": Column("s", "simulated time", False),
    "pressure": Column("Pa", "gauge pressure of the robot's chamber"),
    "section_pressure": Column("Pa", "pressure that acts on a plane model, after its `factor`"),
    "chamber_volume": Column("m^3", "volume of a chamber driven by volume, gas or an air line"),
    "cycles_done": Column("-", "number of complete pressure cycles", False),
    "cycle": Column("-", "number of the present cycle of an event-driven pressure"),
    "phase": Column("-", "phase of that cycle: 0 rest, 1 inflation, 2 hold, 3 deflation"),
    **dict.fromkeys(
        (f"frame_{axis}" for axis in "xyz"), Column("m", "position of the robot's frame")
    ),
    "frame_angle": Column("rad", "rotation of the robot's frame about z"),
    **dict.fromkeys(
        (f"frame_rotation_{axis}" for axis in "xyz"),
        Column("rad", "rotation vector of the robot's frame, in 3D"),
    ),
    **dict.fromkeys(
        (f"body_{axis}" for axis in "xyz"),
        Column(
            "m", "centre of mass of the meshed bodies; axisymmetric: `body_x` is the mean radius"
        ),
    ),
    "contact_count": Column("-", "number of nodes and wall corners in contact now", False),
    "contact_area": Column("m^2", "area of the undeformed surface that touched walls", False),
    "rows_in_contact": Column("-", "number of rows of spikes that touched walls", False),
    **dict.fromkeys(
        (f"wall_force_{axis}" for axis in "xyz"),
        Column("N", "force of all walls on the robot, adhesion included"),
    ),
    "wall_force_normal": Column("N", "sum of the pressing forces of all walls"),
    "slip_share": Column("-", "fraction of the normal impulse on slipping nodes", False),
    "pull": Column("N", "tension of the first tendon"),
    "tether_drag": Column("N", "drag of the tether"),
    "internal_energy": Column(
        "J", "energy of laws, Maxwell springs, cables, layers, fibres and hourglass modes"
    ),
    "hourglass_energy": Column("J", "its part in hourglass modes of quadrilaterals and hexahedra"),
    "kinetic_energy": Column("J", "kinetic energy", False),
    "external_work": Column("J", "work of pressure, motors, forces and gravity", False),
    "friction_dissipation": Column("J", "energy lost to friction", False),
    "viscous_dissipation": Column("J", "lost to dashpots, bulk viscosity and damping", False),
    "damage_dissipation": Column(
        "J", "lost to the [softening](../how_to/materials.md#softening) of materials", False
    ),
    "contact_energy": Column("J", "energy stored in penalty springs, less that of adhesion"),
    "energy_error": Column("-", "error of the energy balance over the largest energy", False),
    "unbalanced_share": Column(
        "-", "unbalanced force over the internal forces, in a static procedure", False
    ),
    "load_time": Column("s", "time at which loads are taken, on a path of equilibria"),
    "unstable_modes": Column("-", "negative eigenvalues of the tangent stiffness on such a path"),
    **dict.fromkeys(("rear_x", "front_x"), Column("m", "ends of the body, with `crossing`")),
    "arc_length": Column("m", "position of the body's centre along the pipe, with `layout`"),
    "branch": Column("-", "number of the branch of that position; 0 is `pipe`"),
    "clearance": Column("m", "smallest gap between frame and wall now"),
    "frame_wall_force": Column("N", "force of the walls on the frame: sum of magnitudes"),
    "frame_pinch": Column("N", "half of the part of that sum that cancels"),
    "frame_drag": Column("N", "part of the frame's wall force against the direction of travel"),
    "thrust": Column("N", "force of the walls that pushes the robot forward along the path"),
    "drag": Column("N", "force of the walls that pushes it backward"),
    "narrowing_drag": Column("N", "part of `drag` where the pipe narrows"),
}
"""Columns by name, except those that are called after rows, chambers, loads, walls or probes."""


def is_probe(column: str) -> bool:
    """Return True if a column of a history belongs to a probe."""
    own = (ROW_FORCE, SIDE_FORCE, CHAMBER_PRESSURE)
    return column not in COLUMNS and not column.startswith(own)


# -------------------------------------------------------------------------------------------------
# Base class of the parts of a scene, and choice between classes of parts.

ORIGIN = written("0 mm", "0 mm")
AT_REST = written("0 mm/s", "0 mm/s")


def schema_title(model: type) -> str:
    """Return the name of a class in JSON schemas: `Layer` for `LayerSpec`."""
    return model.__name__.removesuffix("Spec")


class Spec(BaseModel):
    """Base class of all parts of a scene or study: frozen, and strict about its keys."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, validate_default=True, model_title_generator=schema_title
    )


def json_schema(model: type[BaseModel]) -> dict[str, Any]:
    """Return the JSON schema of a class, with short names of classes such as `PressureTable`."""
    schema = model.model_json_schema()
    text = json.dumps(schema)
    for name, definition in schema["$defs"].items():
        text = text.replace(f'#/$defs/{name}"', f'#/$defs/{definition["title"]}"')
    read: dict[str, Any] = json.loads(text)

    def order(named: tuple[str, Any]) -> str:
        name, definition = named
        is_generic = "_" in name  # classes of one profile stay together
        return name.replace("Spec_", "_") if is_generic else str(definition["title"])

    definitions = sorted(read["$defs"].items(), key=order)
    read["$defs"] = {definition["title"]: definition for _, definition in definitions}
    return read


def chosen_by_key(classes: Mapping[str, type[Spec]]) -> Discriminator:
    """Return a discriminator that selects a class by the first key of a mapping in `classes`."""

    def tag(value: Any) -> str | None:
        if isinstance(value, dict):
            return next((key for key in value if key in classes), None)
        return next((key for key, each in classes.items() if isinstance(value, each)), None)

    return Discriminator(tag)


def chosen_by_presence(tag: str, keys: Collection[str], otherwise: str) -> Discriminator:
    """Return a discriminator between two spellings of one kind.

    It selects `tag` if a mapping has any of `keys`, and `otherwise` if it has none.
    """

    def chosen(value: Any) -> str:
        if isinstance(value, Mapping):
            return tag if any(key in value for key in keys) else otherwise
        return tag if any(hasattr(value, key) for key in keys) else otherwise

    return Discriminator(chosen)
