"""Pneumatic or hydraulic network: sources, valves, tubes and rigid volumes that feed chambers.

Each node k has a volume V_k, a pressure p_k and a content c_k:

    gas      c = V p / p_a                p absolute, c measured as ambient gas [m^3]
    liquid   c = V + V_0 p / kappa_f      p above ambient, c [m^3]

Contents change by the flows of edges from node i to node j and of supplies (regulators, pumps):

    edge     q = o(t) K (p_i |p_i| - p_j |p_j|)   gas: isothermal, laminar
             q = o(t) K (p_i - p_j)               liquid
    supply   q = r(t) Q clip((p_set(t) - p) / droop, least, most)
    dc_k/dt = sum of the flows into k

o is the opening of a valve, r the share at which a pump runs. The ideal gas has one temperature, so
temperature and gas constant cancel: K = pi d^4 / (256 mu L p_a) of a tube for gas, and K = pi d^4 /
(128 mu L) for a liquid (Hagen and Poiseuille).

The volumes of all chambers are known before pressures are needed. All contents are integrated
together over an increment h by the backward Euler method, c = c_0 + h f(p), at the new volumes. It
is of first order, stable for any conductance, and does not overshoot: no node comes to a pressure
above or below those that feed it, however small its volume is. Methods of second order do (a
regulator would overfill a junction behind a closed valve), and they would gain little: increments
are short against the times in which chambers fill.

The pressures are found by Newton's method with a line search. The matrix
dc/dp - h df/dp is dominated by the diagonal in each column, with off-diagonal terms that are not
positive, for any flow that falls with the pressure ahead of it: elimination needs no pivots. A flow
enters the contents of both ends with opposite signs, so that the total is conserved to round-off.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import index_field, real_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, PerScenario, Samples, Stage, Term
from softsim.errors import StabilityError
from softsim.loads.load import Load
from softsim.loads.pressure import (
    VOLUME_COLUMN,
    FollowerPressureTerm,
    PressureKernel,
    PressureSource,
)
from softsim.loads.profile import Cycle, Profile, ProfileTable
from softsim.rigid import RigidBodies
from softsim.scene.quantities import CHAMBER_PRESSURE

AMBIENT = "ambient"
"""Name of the surroundings, to which edges may lead."""

LINE_PRESSURE = "line_pressure_"
"""Prefix of the columns of the pressures of nodes that are no chambers."""

LEAST_VOLUME = 1e-10
"""Volume [m^3] of a node without a volume, a tenth of a cubic millimetre: less than any real one,
and large enough that round-off of the flows through it is far below a pascal."""

# Newton's method stops at a change of pressure [Pa] below this, whose square is the error left.
PRESSURE_TOLERANCE = 1e-4
# Largest difference [Pa] between the pressure found for a node and that of its content after the
# flows. Round-off reaches it where 10,000 m^3/s of gas can flow through a junction of 0.1 mm^3.
LARGEST_MISMATCH = 1.0
MOST_ITERATIONS = 50
MOST_HALVINGS = 40
# A residual below this share of the total content is round-off, whatever the line search finds.
ROUND_OFF = 1e-15


@dataclass(frozen=True)
class Fluid:
    """Gas or liquid of a network.

    ambient_pressure: p_a [Pa]. viscosity: mu [Pa s]. bulk_modulus: kappa_f of a liquid [Pa].
    """

    is_gas: bool
    ambient_pressure: PerScenario[float]
    viscosity: PerScenario[float]
    bulk_modulus: PerScenario[float] = np.inf

    @property
    def reference(self) -> float:
        """Pressure p [Pa] of the surroundings."""
        return self.ambient_pressure if self.is_gas else 0.0

    def tube_conductance(self, length: float, bore: float) -> float:
        """Return K of a tube [m^3/(s Pa^2)], for a liquid [m^3/(s Pa)]."""
        laminar = np.pi * bore**4 / (128.0 * self.viscosity * length)
        return laminar / (2.0 * self.ambient_pressure) if self.is_gas else laminar

    def valve_conductance(self, flow: float, pressure: float) -> float:
        """Return K of a valve that passes `flow` [m^3/s] from `pressure` [Pa] to the ambient."""
        if not self.is_gas:
            return flow / pressure
        absolute = self.ambient_pressure + pressure
        return flow / (absolute**2 - self.ambient_pressure**2)


@dataclass(frozen=True)
class Supply:
    """Regulator or pump: what it delivers into its node.

    flow: Q [m^3/s], of gas as ambient gas. set_pressure: p_set above ambient [Pa over s]. droop
    [Pa]: difference from p_set at which the whole flow is reached. least, most: bounds of the flow
    over Q; a negative one lets the fluid out. running: r over time.
    """

    flow: PerScenario[float]
    set_pressure: Profile
    droop: PerScenario[float]
    least: PerScenario[float]
    most: PerScenario[float]
    running: Profile

    def time_scaled(self, factor: float) -> "Supply":
        """Return the supply `factor` times as fast."""
        return replace(
            self, flow=self.flow * factor, set_pressure=self.set_pressure.time_scaled(factor),
            running=self.running.time_scaled(factor),
        )  # fmt: skip


@dataclass(frozen=True)
class NetworkNode:
    """Volume of a network with one pressure.

    volume [m^3]: without that of a chamber's surface, which the mesh adds. pressure: at the start,
    above ambient [Pa]. compliance: V_0 / kappa_f of a liquid [m^3/Pa]; 0 for a gas. supply: of a
    regulator or pump. displaced: the volume that a piston takes away [m^3 over s]. volume_ratio:
    true volume of a chamber over that of its surface.
    """

    name: PerScenario[str]
    volume: PerScenario[float]
    pressure: PerScenario[float] = 0.0
    compliance: PerScenario[float] = 0.0
    supply: Supply | None = None
    displaced: Profile | None = None
    volume_ratio: PerScenario[float] = 1.0

    @property
    def is_source(self) -> bool:
        """True if the node can raise or lower the pressure of the network."""
        return self.supply is not None or self.displaced is not None or self.pressure != 0.0

    @property
    def highest_pressure(self) -> float:
        """Largest pressure above ambient [Pa] at the start and from the supply, at least 0."""
        supplied = 0.0 if self.supply is None else float(self.supply.set_pressure.values.max())
        return max(0.0, self.pressure, supplied)

    @property
    def compression(self) -> float:
        """Largest ratio of two volumes that the piston gives to the node; 1 without one."""
        if self.displaced is None:
            return 1.0
        taken = self.displaced.values
        return float((self.volume - taken.min()) / (self.volume - taken.max()))

    @property
    def profiles(self) -> list[Profile]:
        """Everything that the node does over time."""
        found = [] if self.displaced is None else [self.displaced]
        if self.supply is not None:
            found += [self.supply.set_pressure, self.supply.running]
        return found

    def time_scaled(self, factor: float) -> "NetworkNode":
        """Return the node with its supply and piston `factor` times as fast."""
        return replace(
            self, supply=self.supply and self.supply.time_scaled(factor),
            displaced=self.displaced and self.displaced.time_scaled(factor),
        )  # fmt: skip


@dataclass(frozen=True)
class NetworkEdge:
    """Tube or valve between two nodes.

    ends: numbers of its nodes, that of the surroundings being the number of nodes. conductance: K.
    opening: o [0 to 1 over s]; with a pulse_frequency [Hz] it is the duty cycle of a valve that is
    either open or closed, else the frequency is 0.
    """

    name: PerScenario[str]
    ends: tuple[int, int]
    conductance: PerScenario[float]
    opening: PerScenario[Profile]
    pulse_frequency: PerScenario[float]

    def time_scaled(self, factor: float) -> "NetworkEdge":
        """Return the edge with its flow and opening `factor` times as fast."""
        return replace(
            self, conductance=self.conductance * factor,
            opening=self.opening.time_scaled(factor),
            pulse_frequency=self.pulse_frequency * factor,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Network(Load):
    """Nodes and edges of a network, and the chambers among its nodes.

    chamber_nodes: numbers of the nodes that are chambers; chamber_loads: names of their pressures
    among the loads of the model.
    """

    fluid: Fluid
    nodes: tuple[NetworkNode, ...]
    edges: tuple[NetworkEdge, ...]
    chamber_nodes: tuple[int, ...]
    chamber_loads: PerScenario[tuple[str, ...]]

    @property
    def columns(self) -> dict[str, str]:
        """Columns of each node and edge; contents and flows of a gas are those of ambient gas."""
        found: dict[str, str] = {}
        for k, node in enumerate(self.nodes):
            found |= {self.pressure_column(k): "Pa"}
            found |= {f"volume_{node.name}": "m^3", f"content_{node.name}": "m^3"}
            if k in self.supplies:
                found[f"supply_{node.name}"] = "m^3/s"  # mean since the last row
        return found | {f"flow_{edge.name}": "m^3/s" for edge in self.edges}  # the same

    def pressure_column(self, number: int) -> str:
        """Return the column of the pressure of a node; those of chambers are drawn as such."""
        prefix = CHAMBER_PRESSURE if number in self.chamber_nodes else LINE_PRESSURE
        return f"{prefix}{self.nodes[number].name}"

    @property
    def supplies(self) -> dict[int, Supply]:
        """Regulators and pumps by the numbers of their nodes."""
        return {k: n.supply for k, n in enumerate(self.nodes) if n.supply is not None}

    @property
    def pistons(self) -> dict[int, Profile]:
        """Volumes displaced by pistons [m^3 over s] by the numbers of their nodes."""
        return {k: n.displaced for k, n in enumerate(self.nodes) if n.displaced is not None}

    @property
    def last_change(self) -> float:
        profiles = [edge.opening for edge in self.edges]
        for node in self.nodes:
            profiles += node.profiles
        return max(float(profile.times[-1]) for profile in profiles)

    def time_scaled(self, factor: float) -> "Network":
        return replace(
            self, nodes=tuple(node.time_scaled(factor) for node in self.nodes),
            edges=tuple(edge.time_scaled(factor) for edge in self.edges),
        )  # fmt: skip

    def term(
        self, scenarios: Sequence["Network"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "NetworkTerm":
        return NetworkTerm(scenarios)


@dataclass(frozen=True)
class NetworkChamber(PressureSource):
    """Pressure source of a chamber that is a node of a network.

    initial_volume [m^3]: of the chamber's surface. highest: largest absolute pressure [Pa] of the
    gas in the run. sources: number of regulators, pumps, pistons and filled vessels of the network.
    """

    node: NetworkNode
    initial_volume: PerScenario[float]
    ambient_pressure: PerScenario[float]
    highest: PerScenario[float]
    sources: int

    needs_volume = True
    can_be_set = False
    thinning_advice = (
        "the wall of a chamber becomes thinner as the chamber grows: lower the pressures of the "
        "network"
    )
    last_change = 0.0
    cycle_count = 0.0

    @property
    def columns(self) -> dict[str, str]:
        return VOLUME_COLUMN

    @property
    def pressure_cycles(self) -> list[Cycle]:
        return []

    @property
    def gas_outside(self) -> float:
        return self.node.volume

    @property
    def peak(self) -> str:
        """Volume of the chamber, as text."""
        return f"chamber of {1e6 * self.initial_volume:.4g} ml in the network"

    @property
    def value_range(self) -> tuple[float, float]:
        """NaN: the pressure is not known in advance."""
        return np.nan, np.nan

    def cycle_end(self, number: int) -> float:
        return np.inf

    def cycles_done(self, time: float) -> int:
        return 0

    def value_at(self, time: float) -> float:
        """Return NaN: the pressure is not known in advance."""
        return np.nan

    def with_profile(self, profile: Profile) -> "NetworkChamber":
        """Raise TypeError: the network sets the pressure."""
        raise TypeError("the pressure of a chamber of a network cannot be set")

    def time_scaled(self, factor: float) -> "NetworkChamber":
        return self

    def stiffness(self, volume: float) -> float:
        """Return -dp/dV [Pa/m^3] of the chamber without its edges, at the highest pressure."""
        ratio = self.node.volume_ratio
        if self.node.compliance > 0.0:
            return ratio / self.node.compliance
        return ratio * self.highest / (ratio * volume + self.node.volume)

    def warnings(self) -> dict[str, str]:
        if self.sources:
            return {}
        return {
            "supply": "the network has no regulator, pump, syringe or filled vessel, so it is at "
            "ambient pressure until the body presses its chambers"
        }

    def kernel(self, scenarios: Sequence["NetworkChamber"]) -> "NetworkChamberKernel":
        return NetworkChamberKernel(len(scenarios))


class NetworkChamberKernel(PressureKernel):
    """Kernel class of a chamber's pressure, which its network writes into `above_ambient`."""

    def __init__(self, scenarios: int) -> None:
        self.above_ambient = real_field(np.zeros(scenarios))

    def follow(self, scenario: int, source: NetworkChamber) -> None:
        """Do nothing: a network cannot be replaced."""

    @ti.func
    def pressure(self, s, t, volume):
        """Return the pressure [Pa] above ambient."""
        return self.above_ambient[s]


class NetworkTerm(Term):
    """Kernel class that integrates the contents of a network.

    Rows of `pressure` are nodes and, last, the surroundings. Fields moved and supplied
    [m^3]: through edges and supplies since the last row of the history.
    """

    def __init__(self, scenarios: Sequence[Network]) -> None:
        first = scenarios[0]
        self.data = list(scenarios)
        self.node_count, self.edge_count = len(first.nodes), len(first.edges)
        self.is_gas = first.fluid.is_gas
        self.chambers: list[FollowerPressureTerm] = []
        self.chamber_nodes = list(first.chamber_nodes)
        self.supplied_nodes = list(first.supplies)
        self.piston_nodes = list(first.pistons)
        n, e, count = self.node_count, self.edge_count, len(scenarios)

        def of_nodes(name: str) -> ti.ScalarField:
            return real_field(np.array([[getattr(x, name) for x in d.nodes] for d in scenarios]))

        def of_supplies(name: str) -> ti.ScalarField:
            values = np.zeros((count, n))
            for s, network in enumerate(scenarios):
                for k, supply in network.supplies.items():
                    values[s, k] = getattr(supply, name)
            return real_field(values)

        self.rigid_volume = of_nodes("volume")
        self.starting_pressure = of_nodes("pressure")
        self.compliance = of_nodes("compliance")
        self.volume_ratio = of_nodes("volume_ratio")
        self.supply_flow = of_supplies("flow")
        self.droop = of_supplies("droop")
        self.least = of_supplies("least")
        self.most = of_supplies("most")
        self.set_pressure = [
            ProfileTable([d.supplies[k].set_pressure for d in scenarios])
            for k in self.supplied_nodes
        ]
        self.running = [
            ProfileTable([d.supplies[k].running for d in scenarios]) for k in self.supplied_nodes
        ]
        self.displaced = [
            ProfileTable([d.pistons[k] for d in scenarios]) for k in self.piston_nodes
        ]
        self.reference = real_field(np.array([d.fluid.reference for d in scenarios]))
        self.tail, self.head = (
            index_field(np.array([edge.ends[side] for edge in first.edges])) for side in range(2)
        )
        self.conductance = real_field(
            np.array([[edge.conductance for edge in d.edges] for d in scenarios])
        )
        self.pulse_frequency = real_field(
            np.array([[edge.pulse_frequency for edge in d.edges] for d in scenarios])
        )
        self.opening = [
            ProfileTable([d.edges[k].opening for d in scenarios]) for k in range(self.edge_count)
        ]
        # State.
        self.time = real_field(np.zeros(count))
        self.content, self.volume = (real_field(np.zeros((count, n))) for _ in range(2))
        self.pressure = real_field(
            np.array([[*(d.fluid.reference for _ in range(n + 1))] for d in scenarios])
        )
        self.moved, self.supplied = (
            real_field(np.zeros((count, e))),
            real_field(np.zeros((count, n))),
        )
        # Working fields of an increment.
        self.new_volume = real_field(np.zeros((count, n)))
        self.open_conductance = real_field(np.zeros((count, e)))
        self.target, self.running_flow = (real_field(np.zeros((count, n))) for _ in range(2))
        self.residual, self.change = (real_field(np.zeros((count, n))) for _ in range(2))
        self.matrix = real_field(np.zeros((count, n, n)))
        self.unsolved = real_field(np.zeros(count))  # 1: Newton's method has failed

    def connect(self, loads: Mapping[str, Term]) -> None:
        """Take the chambers among the terms of the loads."""
        for name in self.data[0].chamber_loads:
            chamber = loads[name]
            assert isinstance(chamber, FollowerPressureTerm)
            self.chambers.append(chamber)

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.SUPPLY: [Pass("loads", 1, (self.follow,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        return {
            "network_time": self.time, "content": self.content, "node_volume": self.volume,
            "node_pressure": self.pressure, "moved": self.moved, "supplied": self.supplied,
            "unsolved": self.unsolved,
        }  # fmt: skip

    def impulses(self) -> list[ti.Field]:
        return [self.moved, self.supplied]

    def refuse(self, scenario: int) -> None:
        if float(fields.read_row(self.unsolved, scenario)) != 0.0:
            raise StabilityError(
                "Newton's method did not find the pressures of the pneumatic network",
                "give junctions a volume, use less different conductances, or a smaller step: "
                "time.increment",
            )

    def sampled(self) -> list[ti.Field]:
        return [self.pressure, self.volume, self.content, self.moved, self.supplied]

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        network = self.data[samples.scenario]
        # A row for each node or edge.
        pressure, volume, content, moved, supplied = (
            samples.read(field).T for field in self.sampled()
        )
        now = {}
        for k, node in enumerate(network.nodes):
            now[network.pressure_column(k)] = pressure[k] - network.fluid.reference
            now[f"volume_{node.name}"] = volume[k]
            now[f"content_{node.name}"] = content[k]
            if k in self.supplied_nodes:
                now[f"supply_{node.name}"] = supplied[k] * samples.rates
        for k, edge in enumerate(network.edges):
            now[f"flow_{edge.name}"] = moved[k] * samples.rates
        return now

    @ti.func
    def follow(self, s, i, t, dt):
        """Integrate the contents up to time t and set the pressures of the chambers.

        A second evaluation at the same time does not integrate again.
        """
        for k in range(self.node_count):
            self.new_volume[s, k] = self.rigid_volume[s, k]
        for k, displaced in ti.static(zip(self.piston_nodes, self.displaced, strict=True)):
            self.new_volume[s, k] -= displaced.at(s, t)
        for k, chamber in ti.static(zip(self.chamber_nodes, self.chambers, strict=True)):
            self.new_volume[s, k] += self.volume_ratio[s, k] * chamber.enclosed_volume(s)
        if t <= 0.0:
            for k in range(self.node_count):
                p = self.reference[s] + self.starting_pressure[s, k]
                self.content[s, k] = self.content_at(s, k, self.new_volume[s, k], p)
            self.time[s] = 0.0
        elif t > self.time[s]:
            self.integrate(s, self.time[s], t - self.time[s])
        for k in range(self.node_count):
            self.volume[s, k] = self.new_volume[s, k]
            self.pressure[s, k] = self.pressure_at(s, k, self.new_volume[s, k])
        self.time[s] = ti.max(self.time[s], t)
        for k, chamber in ti.static(zip(self.chamber_nodes, self.chambers, strict=True)):
            chamber.kernel.above_ambient[s] = self.pressure[s, k] - self.reference[s]

    @ti.func
    def content_at(self, s, k, volume, p):
        """Return the content [m^3] of node k at pressure p [Pa]."""
        content = volume + self.compliance[s, k] * p
        if ti.static(self.is_gas):
            content = volume * p / self.reference[s]
        return content

    @ti.func
    def content_slope(self, s, k, volume):
        """Return the derivative of the content of node k by its pressure [m^3/Pa]."""
        slope = self.compliance[s, k]
        if ti.static(self.is_gas):
            slope = volume / self.reference[s]
        return slope

    @ti.func
    def pressure_at(self, s, k, volume):
        """Return the pressure [Pa] of the content of node k in a volume [m^3]."""
        nothing = self.content_at(s, k, volume, 0.0)
        return (self.content[s, k] - nothing) / self.content_slope(s, k, volume)

    @ti.func
    def potential(self, p):
        """Return p |p| for a gas and p for a liquid: flows are K times its difference."""
        value = p
        if ti.static(self.is_gas):
            value = p * ti.abs(p)
        return value

    @ti.func
    def potential_slope(self, p):
        """Return the derivative of `potential`."""
        slope = ti.cast(1.0, backend.real)
        if ti.static(self.is_gas):
            slope = 2.0 * ti.abs(p)
        return slope

    @ti.func
    def edge_flow(self, s, e):
        """Return the flow [m^3/s] through edge e."""
        behind, ahead = self.pressure[s, self.tail[e]], self.pressure[s, self.head[e]]
        return self.open_conductance[s, e] * (self.potential(behind) - self.potential(ahead))

    @ti.func
    def demand(self, s, k):
        """Return (p_set - p) / droop of the supply of node k."""
        return (self.target[s, k] - self.pressure[s, k]) / self.droop[s, k]

    @ti.func
    def supply(self, s, k):
        """Return the flow [m^3/s] of the supply of node k."""
        share = ti.min(ti.max(self.demand(s, k), self.least[s, k]), self.most[s, k])
        return self.running_flow[s, k] * share

    @ti.func
    def supply_slope(self, s, k):
        """Return minus the derivative of the flow of a supply by the pressure of its node."""
        slope = ti.cast(0.0, backend.real)
        if self.least[s, k] < self.demand(s, k) < self.most[s, k]:
            slope = self.running_flow[s, k] / self.droop[s, k]
        return slope

    @ti.func
    def set_controls(self, s, start, h):
        """Set valves, pumps and regulators to the end of an increment h [s] from `start`.

        A pulsed valve is open for the fraction of the increment that its pulses cover.
        """
        at = start + h
        for e, opening in ti.static(enumerate(self.opening)):
            value = opening.at(s, at)
            frequency = self.pulse_frequency[s, e]
            begun, ended = start * frequency, at * frequency
            if ended > begun:
                open_time = pulses(ended, value) - pulses(begun, value)
                value = ti.min(ti.max(open_time / (ended - begun), 0.0), 1.0)
            self.open_conductance[s, e] = self.conductance[s, e] * value
        for k, set_pressure, running in ti.static(
            zip(self.supplied_nodes, self.set_pressure, self.running, strict=True)
        ):
            self.target[s, k] = self.reference[s] + set_pressure.at(s, at)
            self.running_flow[s, k] = self.supply_flow[s, k] * running.at(s, at)

    @ti.func
    def integrate(self, s, start, h):
        """Integrate the contents over an increment h [s] at the new volumes."""
        self.set_controls(s, start, h)
        for k in range(self.node_count):
            self.pressure[s, k] = self.pressure_at(s, k, self.new_volume[s, k])
        self.solve(s, h)
        # After a failure nothing flows, so that all pressures are finite until a row reports it.
        if self.unsolved[s] == 0.0:
            self.transfer(s, h)

    @ti.func
    def transfer(self, s, h):
        """Move what flows within h [s] at the present pressures."""
        for e in range(self.edge_count):
            amount = h * self.edge_flow(s, e)
            self.moved[s, e] += amount
            if self.tail[e] < self.node_count:
                self.content[s, self.tail[e]] -= amount
            if self.head[e] < self.node_count:
                self.content[s, self.head[e]] += amount
        for k in ti.static(self.supplied_nodes):
            amount = h * self.supply(s, k)
            self.supplied[s, k] += amount
            self.content[s, k] += amount

    @ti.func
    def evaluate(self, s, h):
        """Compute c(p) - c - h f(p) of each node; return the sum of magnitudes [m^3]."""
        for k in range(self.node_count):
            there = self.content_at(s, k, self.new_volume[s, k], self.pressure[s, k])
            self.residual[s, k] = there - self.content[s, k]
        for e in range(self.edge_count):
            amount = h * self.edge_flow(s, e)
            if self.tail[e] < self.node_count:
                self.residual[s, self.tail[e]] += amount
            if self.head[e] < self.node_count:
                self.residual[s, self.head[e]] -= amount
        for k in ti.static(self.supplied_nodes):
            self.residual[s, k] -= h * self.supply(s, k)
        total = ti.cast(0.0, backend.real)
        for k in range(self.node_count):
            total += ti.abs(self.residual[s, k])
        return total

    @ti.func
    def assemble(self, s, h):
        """Compute the derivative of `residual` by the pressures."""
        for k in range(self.node_count):
            for j in range(self.node_count):
                self.matrix[s, k, j] = 0.0
            self.matrix[s, k, k] = self.content_slope(s, k, self.new_volume[s, k])
        for k in ti.static(self.supplied_nodes):
            self.matrix[s, k, k] += h * self.supply_slope(s, k)
        for e in range(self.edge_count):
            i, j = self.tail[e], self.head[e]
            conductance = h * self.open_conductance[s, e]
            if i < self.node_count:
                slope = conductance * self.potential_slope(self.pressure[s, i])
                self.matrix[s, i, i] += slope
                if j < self.node_count:
                    self.matrix[s, j, i] -= slope
            if j < self.node_count:
                slope = conductance * self.potential_slope(self.pressure[s, j])
                self.matrix[s, j, j] += slope
                if i < self.node_count:
                    self.matrix[s, i, j] -= slope

    @ti.func
    def eliminate(self, s):
        """Compute the Newton step `change` [Pa]; return its largest magnitude.

        A pivot is at least the slope of its node's content, which round-off may violate.
        """
        n = self.node_count
        for k in range(n):
            self.change[s, k] = -self.residual[s, k]
        for k in range(n):
            slope = self.content_slope(s, k, self.new_volume[s, k])
            self.matrix[s, k, k] = ti.max(self.matrix[s, k, k], slope)
            for r in range(k + 1, n):
                if self.matrix[s, r, k] != 0.0:
                    factor = self.matrix[s, r, k] / self.matrix[s, k, k]
                    for c in range(k + 1, n):
                        self.matrix[s, r, c] -= factor * self.matrix[s, k, c]
                    self.change[s, r] -= factor * self.change[s, k]
        largest = ti.cast(0.0, backend.real)
        for back in range(n):
            k = n - 1 - back
            value = self.change[s, k]
            for c in range(k + 1, n):
                value -= self.matrix[s, k, c] * self.change[s, c]
            self.change[s, k] = value / self.matrix[s, k, k]
            largest = ti.max(largest, ti.abs(self.change[s, k]))
        return largest

    @ti.func
    def solve(self, s, h):
        """Solve c(p) = c + h f(p) for the pressures of the nodes, from the present ones."""
        held = ti.cast(0.0, backend.real)
        for k in range(self.node_count):
            held += ti.abs(self.content[s, k])
        remaining = self.evaluate(s, h)
        for _ in range(MOST_ITERATIONS):
            self.assemble(s, h)
            largest = self.eliminate(s)
            for k in range(self.node_count):
                self.pressure[s, k] += self.change[s, k]
            share = ti.cast(1.0, backend.real)
            found = self.evaluate(s, h)
            if largest <= PRESSURE_TOLERANCE and self.mismatch(s) <= LARGEST_MISMATCH:
                break
            for _halving in range(MOST_HALVINGS):
                if found < remaining or found <= ROUND_OFF * held:
                    break
                share *= 0.5
                for k in range(self.node_count):
                    self.pressure[s, k] -= share * self.change[s, k]
                found = self.evaluate(s, h)
            remaining = found
        if self.mismatch(s) > LARGEST_MISMATCH:
            self.unsolved[s] = 1.0

    @ti.func
    def mismatch(self, s):
        """Return the largest change of a pressure [Pa] that the residual of its node amounts to."""
        largest = ti.cast(0.0, backend.real)
        for k in range(self.node_count):
            slope = self.content_slope(s, k, self.new_volume[s, k])
            largest = ti.max(largest, ti.abs(self.residual[s, k]) / slope)
        return largest


@ti.func
def pulses(periods, duty):
    """Return for how many periods a pulsed valve was open after `periods` of them."""
    whole = ti.floor(periods)
    return whole * duty + ti.min(periods - whole, duty)
