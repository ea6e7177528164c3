"""Pneumatic and hydraulic networks, and the chambers that they feed."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from softsim.builder.conditions import over_the_run
from softsim.builder.loads import (
    LoadTargets,
    chamber_pressure,
    liquid_modulus,
    refuse_inverted,
    room_beside,
)
from softsim.builder.names import Names, close_names
from softsim.loads.load import Load
from softsim.loads.network import (
    AMBIENT,
    LEAST_VOLUME,
    NO_SUPPLY,
    NOTHING,
    Fluid,
    Network,
    NetworkChamber,
    NetworkEdge,
    NetworkNode,
    Supply,
)
from softsim.loads.pressure import ATMOSPHERE, FollowerPressure, PressureSource
from softsim.loads.profile import Profile, constant
from softsim.scene.outputs import probe_columns
from softsim.scene.pneumatics import (
    EdgeSpec,
    GasSpec,
    LiquidSpec,
    NetworkChamberSpec,
    NetworkPumpSpec,
    Pneumatics,
    RegulatorSpec,
    SyringeSpec,
    TubeSpec,
    ValveSpec,
    VesselSpec,
)
from softsim.scene.profiles import FactorProfile
from softsim.scene.quantities import Spec
from softsim.scene.text import Keys

PLACE = ("pneumatics",)
ALWAYS = constant(1.0, 0.0)


def built_network(loaded: LoadTargets, others: Mapping[str, Load]) -> dict[str, Load]:
    """Return the network of a scene and the pressures of its chambers by name; others: all loads.

    It is empty without a network.
    """
    names = loaded.names
    given = names.scene.pneumatics
    if given is None:
        return {}
    refuse_static(names)
    ends = {name: ends_of(names, given, name) for name in given.edges}
    refuse_isolated(names, given, ends)
    made = _Making(loaded, given, tube_volumes(given, ends))
    chambers = {
        f"pneumatics.{name}": made.chamber(name, node)
        for name, node in given.nodes.items()
        if isinstance(node, NetworkChamberSpec)
    }
    refuse_shared(names, chambers, others)
    nodes = tuple(made.node(name, chambers.get(f"pneumatics.{name}")) for name in given.nodes)
    edges = tuple(made.edge(name, edge, ends[name]) for name, edge in given.edges.items())
    numbers = tuple(list(given.nodes).index(chamber.name) for chamber in chambers.values())
    network = Network(made.fluid, nodes, edges, numbers, tuple(chambers))
    refuse_same_columns(names, network)
    return {**chambers, "pneumatics": network}


def refuse_static(names: Names) -> None:
    """Raise SceneError in a static procedure, which has no time for a flow."""
    if names.scene.time.procedure == "static":
        raise names.loaded.error(
            PLACE,
            "the flow in a network depends on time, which a static procedure does not have",
            "for equilibria, modes and responses load the chambers by follower_pressure, "
            "added_volume or added_gas; otherwise write time.procedure: dynamic",
        )


def ends_of(names: Names, given: Pneumatics, name: str) -> tuple[int, int]:
    """Return the numbers of the nodes of an edge; the surroundings come after all nodes."""
    keys, known = (*PLACE, "edges", name, "between"), [*given.nodes, AMBIENT]
    between = given.edges[name].between
    for k, end in enumerate(between):
        if end not in known:
            raise names.loaded.error(
                (*keys, k), f"there is no node '{end}'", close_names(end, known, "nodes")
            )
    if between[0] == between[1]:
        raise names.loaded.error(
            keys, f"edge '{name}' leads from '{between[0]}' to itself", "name two different nodes"
        )
    return known.index(between[0]), known.index(between[1])


def refuse_isolated(names: Names, given: Pneumatics, ends: Mapping[str, tuple[int, int]]) -> None:
    """Raise SceneError for nodes from which no path of edges leads to a chamber.

    The surroundings end a path: their pressure is constant.
    """
    reached = {
        k for k, node in enumerate(given.nodes.values()) if isinstance(node, NetworkChamberSpec)
    }
    known = list(given.nodes)
    if not reached:
        raise names.loaded.error(
            (*PLACE, "nodes"),
            "no node is a chamber, so the network acts on no body",
            "add a node {kind: chamber, facets: [BODY.SET]}",
        )
    joined = [pair for pair in ends.values() if max(pair) < len(known)]
    for k in sorted(reached):
        if not any(k in pair for pair in ends.values()):
            raise names.loaded.error(
                (*PLACE, "nodes", known[k]),
                f"no edge leads to chamber '{known[k]}'",
                "join it by a tube or valve, or load it by added_gas",
            )
    while more := {k for pair in joined if reached & set(pair) for k in pair} - reached:
        reached |= more
    for k, name in enumerate(known):
        if k not in reached:
            raise names.loaded.error(
                (*PLACE, "nodes", name),
                f"no path leads from '{name}' to a chamber, so it acts on no body",
                "join it to the network by a tube or valve, or leave it out",
            )


def refuse_same_columns(names: Names, network: Network) -> None:
    """Raise SceneError if a probe has the name of a column of the network."""
    for name, probe in names.scene.output.probes.items():
        for column in probe_columns(name, probe.kind, "xyz"):
            if column in network.columns:
                raise names.loaded.error(
                    ("output", "probes", name),
                    f"the network already has a column '{column}'",
                    "give the probe another name",
                )


def tube_volumes(given: Pneumatics, ends: Mapping[str, tuple[int, int]]) -> np.ndarray:
    """Return the volume [m^3] that half of each tube adds to the nodes (n + 1,)."""
    volumes = np.zeros(len(given.nodes) + 1)
    for name, edge in given.edges.items():
        if isinstance(edge, TubeSpec):
            volumes[list(ends[name])] += 0.125 * np.pi * edge.bore**2 * edge.length
    return volumes


def refuse_shared(
    names: Names, chambers: Mapping[str, FollowerPressure], others: Mapping[str, Load]
) -> None:
    """Raise SceneError if a chamber has the name of a load, or a facet with another pressure."""
    pressures = {k: load for k, load in others.items() if isinstance(load, FollowerPressure)}
    owners = {
        frozenset(facet): name for name, load in pressures.items() for facet in load.facets.tolist()
    }
    for chamber in chambers.values():
        keys = (*PLACE, "nodes", chamber.name)
        if chamber.name in others:
            raise names.loaded.error(
                keys, f"a load is also called '{chamber.name}'", "rename one of them"
            )
        for facet in map(frozenset, chamber.facets.tolist()):
            if facet in owners:
                raise names.loaded.error(
                    (*keys, "facets"),
                    f"a facet of '{chamber.name}' also belongs to '{owners[facet]}': two pressures "
                    "would act on it",
                    "name each facet in one chamber only",
                )
            owners[facet] = chamber.name


@dataclass(frozen=True)
class _Making:
    """Translation of the nodes and edges of a network; tubes: volumes by node [m^3]."""

    loaded: LoadTargets
    given: Pneumatics
    tubes: np.ndarray

    @property
    def names(self) -> Names:
        return self.loaded.names

    @property
    def fluid(self) -> Fluid:
        fluid = self.given.fluid or GasSpec(kind="gas")
        ambient = fluid.ambient_pressure if isinstance(fluid, GasSpec) else ATMOSPHERE
        return Fluid(isinstance(fluid, GasSpec), ambient, fluid.viscosity)

    def chamber(self, name: str, node: NetworkChamberSpec) -> FollowerPressure:
        """Return the pressure on the facets of a chamber."""
        keys = (*PLACE, "nodes", name)
        tube = self.tubes[list(self.given.nodes).index(name)]
        fluid, names = self.fluid, self.names

        def source(volume: float, nothing: float, compliance: float) -> PressureSource:
            refuse_inverted(names, volume, -nothing if fluid.is_gas else nothing, keys)
            filled = node.volume_ratio * volume
            side = room_beside(names, node, filled, node.dead_volume + tube, nothing, keys)
            elastic = 0.0
            if not fluid.is_gas:
                stiffest = self.loaded.stiffest
                elastic = filled / liquid_modulus(names, volume, stiffest, compliance, keys)
            return NetworkChamber(
                name, volume, side, fluid.ambient_pressure, self.highest, elastic, self.supplies,
                node.volume_ratio,
            )  # fmt: skip

        return chamber_pressure(self.loaded, node, source, keys)

    @property
    def highest(self) -> float:
        """Largest absolute pressure [Pa] that sources, vessels and pistons can produce."""
        ambient, compression = self.fluid.ambient_pressure, 1.0
        pressures = [0.0]
        for name, node in self.given.nodes.items():
            if isinstance(node, VesselSpec):
                pressures.append(node.pressure)
            if isinstance(node, RegulatorSpec):
                pressures.append(float(self.profile(node.profile, name, "profile").values.max()))
            if isinstance(node, NetworkPumpSpec):
                pressures.append(node.stall)
            if isinstance(node, SyringeSpec):
                displaced = self.displaced(name, node).values
                volumes = node.volume - displaced.min(), node.volume - displaced.max()
                compression = max(compression, volumes[0] / volumes[1])
        return (ambient + max(pressures)) * compression

    @property
    def supplies(self) -> int:
        """Number of nodes that can raise or lower the pressure."""
        sources = (RegulatorSpec, NetworkPumpSpec, SyringeSpec)
        nodes = self.given.nodes.values()
        return sum(
            isinstance(n, sources) or (isinstance(n, VesselSpec) and n.pressure != 0.0)
            for n in nodes
        )

    def profile(self, data: Spec, name: str, key: str) -> Profile:
        """Return a profile of a node over time [s] of the whole run."""
        return over_the_run(self.names, data, (*PLACE, "nodes", name, key))

    def displaced(self, name: str, node: SyringeSpec) -> Profile:
        """Return the volume that the piston of a syringe displaces."""
        found = self.profile(node.profile, name, "profile")
        most = float(found.values.max())
        if most >= node.volume:
            raise self.names.loaded.error(
                (*PLACE, "nodes", name, "profile"),
                f"the piston displaces {1e6 * most:.4g} ml, but the syringe holds "
                f"{1e6 * node.volume:.4g} ml at the start",
                "displace less than it holds, or make the syringe larger",
            )
        return found

    def node(self, name: str, chamber: FollowerPressure | None) -> NetworkNode:
        """Return a node; chamber: its pressure on facets, if it is one."""
        node = self.given.nodes[name]
        number = list(self.given.nodes).index(name)
        own = 0.0 if isinstance(node, NetworkChamberSpec) else node.volume
        volume = max(own + self.tubes[number], LEAST_VOLUME)
        compliance = 0.0
        if isinstance(self.given.fluid, LiquidSpec):
            compliance = volume / self.given.fluid.bulk_modulus
        volume_ratio = 1.0
        if chamber is not None:
            assert isinstance(chamber.source, NetworkChamber)
            volume, compliance = chamber.source.side_volume, chamber.source.compliance
            volume_ratio = chamber.source.volume_ratio
        supply = self.supply(name)
        piston = self.displaced(name, node) if isinstance(node, SyringeSpec) else None
        pressure = node.pressure if isinstance(node, VesselSpec) else 0.0
        self.refuse_below_vacuum(pressure, name, "pressure")
        return NetworkNode(
            name, volume, pressure, compliance, supply is not None, supply or NO_SUPPLY,
            piston is not None, piston or NOTHING, volume_ratio,
        )  # fmt: skip

    def refuse_below_vacuum(self, pressure: float, name: str, key: str) -> None:
        """Raise SceneError for a pressure [Pa] of a node that no fluid can have."""
        vacuum = -self.fluid.ambient_pressure
        if pressure <= vacuum:
            raise self.names.loaded.error(
                (*PLACE, "nodes", name, key),
                f"{1e-3 * pressure:.4g} kPa is below vacuum",
                f"write more than {1e-3 * vacuum:.4g} kPa",
            )

    def supply(self, name: str) -> Supply | None:
        """Return what a regulator or pump delivers; None for other nodes."""
        node = self.given.nodes[name]
        if isinstance(node, RegulatorSpec):
            wanted = self.profile(node.profile, name, "profile")
            self.refuse_below_vacuum(float(wanted.values.min()), name, "profile")
            least = -1.0 if node.relieving else 0.0
            return Supply(node.flow, wanted, node.droop, least, 1.0, ALWAYS)
        if isinstance(node, NetworkPumpSpec):
            self.refuse_below_vacuum(node.stall, name, "stall")
            keys = (*PLACE, "nodes", name, "running")
            running = self.fraction(node.running, keys)
            least, most = (0.0, 1.0) if node.stall > 0.0 else (-1.0, 0.0)
            stall = Profile(np.array([0.0]), np.array([node.stall]))
            return Supply(node.flow, stall, abs(node.stall), least, most, running)
        return None

    def fraction(self, data: FactorProfile | None, keys: Keys) -> Profile:
        """Return a fraction over time, 1 by default; raise SceneError if it is not within 0 to 1"""
        if data is None:
            return ALWAYS
        found = over_the_run(self.names, data, keys)
        low, high = float(found.values.min()), float(found.values.max())
        if low < 0.0 or high > 1.0:
            raise self.names.loaded.error(
                keys, f"varies between {low:.4g} and {high:.4g}", "use values between 0 and 1"
            )
        return found

    def edge(self, name: str, edge: EdgeSpec, ends: tuple[int, int]) -> NetworkEdge:
        """Return a tube or valve."""
        if isinstance(edge, ValveSpec):
            conductance = self.fluid.valve_conductance(edge.flow, edge.pressure)
            opening = self.fraction(edge.opening, (*PLACE, "edges", name, "opening"))
            return NetworkEdge(name, ends, conductance, opening, edge.pulses or 0.0)
        conductance = self.fluid.tube_conductance(edge.length, edge.bore)
        return NetworkEdge(name, ends, conductance, ALWAYS, 0.0)
