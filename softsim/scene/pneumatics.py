"""Pneumatic and hydraulic networks: chambers, vessels and sources, joined by tubes and valves."""

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from softsim.scene.loads import ChamberSpec
from softsim.scene.profiles import FactorProfile, FixedProfile, VolumeProfile
from softsim.scene.quantities import (
    Name,
    NotNegativeVolume,
    Number,
    PositiveFrequency,
    PositiveLength,
    PositivePressure,
    PositiveViscosity,
    PositiveVolume,
    PositiveVolumeFlow,
    Pressure,
    Spec,
    written,
)

# -------------------------------------------------------------------------------------------------
# The fluid.


class GasSpec(Spec):
    """Ideal gas at constant temperature."""

    kind: Literal["gas"] = Field(default="gas", description="Kind of fluid.")
    viscosity: PositiveViscosity = Field(
        default=written("1.81e-5 Pa*s"),
        description="Dynamic viscosity. Default: air at 20 degrees Celsius.",
    )
    ambient_pressure: PositivePressure = Field(
        default=written("101325 Pa"), description="Absolute ambient pressure."
    )


class LiquidSpec(Spec):
    """Liquid, nearly incompressible."""

    kind: Literal["liquid"] = Field(description="Kind of fluid.")
    viscosity: PositiveViscosity = Field(
        default=written("1 mPa*s"),
        description="Dynamic viscosity. Default: water at 20 degrees Celsius.",
    )
    bulk_modulus: PositivePressure = Field(
        default=written("2.2 GPa"),
        description="Bulk modulus in vessels and syringes. Default: water. In a chamber it is as "
        "large as the time step allows.",
    )


FluidSpec = Annotated[GasSpec | LiquidSpec, Field(discriminator="kind")]

# -------------------------------------------------------------------------------------------------
# Nodes.


class NetworkChamberSpec(ChamberSpec):
    """Chamber of a body."""

    kind: Literal["chamber"] = Field(description="Kind of node.")
    dead_volume: NotNegativeVolume = Field(
        default=written("0 ml"), description="Volume beside the chamber, filled like it."
    )
    excluded_volume: NotNegativeVolume = Field(
        default=written("0 ml"),
        description="Volume of objects inside the chamber, such as a frame.",
    )
    volume_ratio: Number = Field(
        default=1.0,
        gt=0.0,
        description="True volume of the chamber divided by that of the model: 2 for a half model. "
        "dead_volume and excluded_volume are true volumes.",
    )


class VesselSpec(Spec):
    """Rigid volume: a gas bottle if it starts under pressure, a manifold, or a junction."""

    kind: Literal["vessel"] = Field(description="Kind of node.")
    volume: NotNegativeVolume = Field(
        default=written("0 ml"), description="Volume. Without it, a junction."
    )
    pressure: Pressure = Field(default=written("0 kPa"), description="Gauge pressure at the start.")


class RegulatorSpec(Spec):
    """Pressure regulator at its outlet: it delivers up to `flow` below its set pressure."""

    kind: Literal["regulator"] = Field(description="Kind of node.")
    profile: FixedProfile = Field(
        discriminator="kind", description="Set pressure over time, as gauge pressure."
    )
    flow: PositiveVolumeFlow = Field(description="Largest flow; of a gas, measured as ambient gas.")
    droop: PositivePressure = Field(
        default=written("0.5 kPa"),
        description="Difference below the set pressure at which the largest flow is reached. The "
        "flow is proportional to the difference up to there.",
    )
    relieving: bool = Field(
        default=False,
        description="true: above the set pressure it lets the fluid out in the same way.",
    )
    volume: NotNegativeVolume = Field(
        default=written("0 ml"), description="Volume between the regulator and its edges."
    )


class NetworkPumpSpec(Spec):
    """Pump at its outlet. Its flow decreases linearly with its back pressure and never reverses."""

    kind: Literal["pump"] = Field(description="Kind of node.")
    flow: PositiveVolumeFlow = Field(
        description="Flow at ambient pressure; of a gas, measured as ambient gas."
    )
    stall: Pressure = Field(
        description="Gauge pressure at which the flow is zero. Negative: a vacuum pump, which "
        "draws the fluid out of its node."
    )
    running: FactorProfile | None = Field(
        default=None, description="Fraction of its flow over time, 0 to 1. Default: always 1."
    )
    volume: NotNegativeVolume = Field(
        default=written("0 ml"), description="Volume between the pump and its edges."
    )

    @field_validator("stall")
    @classmethod
    def _stalls_somewhere(cls, stall: float) -> float:
        if stall == 0.0:
            raise ValueError("must not be zero: the pump would never deliver anything")
        return stall


class SyringeSpec(Spec):
    """Syringe, whose piston displaces a given volume."""

    kind: Literal["syringe"] = Field(description="Kind of node.")
    volume: PositiveVolume = Field(description="Volume at the start, at ambient pressure.")
    profile: VolumeProfile = Field(
        description="Volume that the piston has displaced since the start, over time. Negative: "
        "drawn."
    )


NodeSpec = Annotated[
    NetworkChamberSpec | VesselSpec | RegulatorSpec | NetworkPumpSpec | SyringeSpec,
    Field(discriminator="kind"),
]

# -------------------------------------------------------------------------------------------------
# Edges.

BETWEEN = (
    "Names of the two nodes; `ambient` is the surroundings. Flow from the first to the second is "
    "positive."
)


class TubeSpec(Spec):
    """Tube with laminar flow. Half of its volume is added to each end."""

    kind: Literal["tube"] = Field(description="Kind of edge.")
    between: tuple[Name, Name] = Field(description=BETWEEN)
    length: PositiveLength = Field(description="Length.")
    bore: PositiveLength = Field(description="Inner diameter.")


class ValveSpec(Spec):
    """Valve or orifice. Its flow is C (p1^2 - p2^2) with absolute pressures for a gas, and
    C (p1 - p2) for a liquid.
    """

    kind: Literal["valve"] = Field(description="Kind of edge.")
    between: tuple[Name, Name] = Field(description=BETWEEN)
    flow: PositiveVolumeFlow = Field(
        description="Flow through the open valve from `pressure` to the ambient; of a gas, "
        "measured as ambient gas."
    )
    pressure: PositivePressure = Field(
        description="Gauge pressure before the valve at which `flow` is given."
    )
    opening: FactorProfile | None = Field(
        default=None,
        description="Fraction of the open flow over time, 0 to 1. Default: always open.",
    )
    pulses: PositiveFrequency | None = Field(
        default=None,
        description="Frequency of pulse width modulation: the valve is either open or closed, and "
        "`opening` is the fraction of each period for which it is open. Default: none.",
    )


EdgeSpec = Annotated[TubeSpec | ValveSpec, Field(discriminator="kind")]


class Pneumatics(Spec):
    """Network of sources, vessels and chambers, joined by tubes and valves. The history has the
    columns pressure_NODE (line_pressure_NODE if it is no chamber), volume_NODE, content_NODE (of a
    gas, measured as ambient gas), supply_NODE of regulators and pumps, and flow_EDGE; flows are
    means since the last row.
    """

    fluid: FluidSpec = Field(
        default_factory=GasSpec, description="Gas or liquid. Default: air, {kind: gas}."
    )
    nodes: dict[Name, NodeSpec] = Field(min_length=1, description="Nodes by name.")
    edges: dict[Name, EdgeSpec] = Field(min_length=1, description="Edges by name.")

    @field_validator("nodes")
    @classmethod
    def _ambient_is_reserved(cls, nodes: dict[str, Any]) -> dict[str, Any]:
        if "ambient" in nodes:
            raise ValueError("'ambient' is the surroundings, which every network has: rename it")
        return nodes
