"""Pneumatic and hydraulic networks, and the chambers that they feed."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from softsim.builder.chambers import RestingChamber, Targets, chamber_pressure
from softsim.loads.load import Load
from softsim.loads.network import (
    AMBIENT,
    LEAST_VOLUME,
    Fluid,
    Network,
    NetworkChamber,
    NetworkEdge,
    NetworkNode,
    Supply,
)
from softsim.loads.pressure import ATMOSPHERE, FollowerPressure
from softsim.loads.profile import Profile, constant, over_the_run
from softsim.scene.names import Names, close_names
from softsim.scene.outputs import probe_columns
from softsim.scene.pneumatics import (
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


def built_network(loaded: Targets, others: Mapping[str, Load]) -> dict[str, Load]:
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
    made = _Making(loaded, FLUIDS[type(given.fluid)](given.fluid))
    nodes = {name: NODES[type(spec)](made, name, spec) for name, spec in given.nodes.items()}
    edges = tuple(EDGES[type(e)](made, name, e, ends[name]) for name, e in given.edges.items())
    tubes = tube_volumes(given, ends)
    chambers = {
        f"pneumatics.{name}": made.chamber_pressure(name, spec, tubes[name], nodes.values())
        for name, spec in given.nodes.items()
        if isinstance(spec, NetworkChamberSpec)
    }
    refuse_shared(names, chambers, others)
    for name, node in nodes.items():
        volume = max(node.volume + tubes[name], LEAST_VOLUME)
        nodes[name] = replace(node, volume=volume, compliance=volume / made.fluid.bulk_modulus)
    for chamber in chambers.values():
        assert isinstance(chamber.source, NetworkChamber)
        nodes[chamber.name] = chamber.source.node
    numbers = tuple(list(nodes).index(chamber.name) for chamber in chambers.values())
    network = Network(made.fluid, tuple(nodes.values()), edges, numbers, tuple(chambers))
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


def tube_volumes(given: Pneumatics, ends: Mapping[str, tuple[int, int]]) -> dict[str, float]:
    """Return the volume [m^3] that half of each tube adds to the nodes, by name."""
    volumes = np.zeros(len(given.nodes) + 1)
    for name, edge in given.edges.items():
        if isinstance(edge, TubeSpec):
            volumes[list(ends[name])] += 0.125 * np.pi * edge.bore**2 * edge.length
    return dict(zip(given.nodes, volumes.tolist(), strict=False))  # without the surroundings


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


def gas(spec: GasSpec) -> Fluid:
    """Return a gas."""
    return Fluid(True, spec.ambient_pressure, spec.viscosity)


def liquid(spec: LiquidSpec) -> Fluid:
    """Return a liquid."""
    return Fluid(False, ATMOSPHERE, spec.viscosity, spec.bulk_modulus)


@dataclass(frozen=True)
class _Making:
    """Translation of the nodes and edges of a network."""

    loaded: Targets
    fluid: Fluid

    @property
    def names(self) -> Names:
        return self.loaded.names

    def chamber(self, name: str, spec: NetworkChamberSpec) -> NetworkNode:
        """Return a chamber without what depends on its mesh and on the other nodes."""
        return NetworkNode(name, spec.dead_volume, volume_ratio=spec.volume_ratio)

    def vessel(self, name: str, spec: VesselSpec) -> NetworkNode:
        """Return a rigid volume."""
        self.refuse_below_vacuum(spec.pressure, name, "pressure")
        return NetworkNode(name, spec.volume, spec.pressure)

    def regulator(self, name: str, spec: RegulatorSpec) -> NetworkNode:
        """Return a regulator, which delivers below its set pressure."""
        wanted = self.profile(spec.profile, name, "profile")
        self.refuse_below_vacuum(float(wanted.values.min()), name, "profile")
        least = -1.0 if spec.relieving else 0.0
        supply = Supply(spec.flow, wanted, spec.droop, least, 1.0, ALWAYS)
        return NetworkNode(name, spec.volume, supply=supply)

    def pump(self, name: str, spec: NetworkPumpSpec) -> NetworkNode:
        """Return a pump, whose flow falls from that at ambient pressure to zero at its stall."""
        self.refuse_below_vacuum(spec.stall, name, "stall")
        running = self.fraction(spec.running, (*PLACE, "nodes", name, "running"))
        least, most = (0.0, 1.0) if spec.stall > 0.0 else (-1.0, 0.0)
        stall = Profile(np.array([0.0]), np.array([spec.stall]))
        supply = Supply(spec.flow, stall, abs(spec.stall), least, most, running)
        return NetworkNode(name, spec.volume, supply=supply)

    def syringe(self, name: str, spec: SyringeSpec) -> NetworkNode:
        """Return a syringe, whose piston displaces less than its volume."""
        displaced = self.profile(spec.profile, name, "profile")
        most = float(displaced.values.max())
        if most >= spec.volume:
            raise self.names.loaded.error(
                (*PLACE, "nodes", name, "profile"),
                f"the piston displaces {1e6 * most:.4g} ml, but the syringe holds "
                f"{1e6 * spec.volume:.4g} ml at the start",
                "displace less than it holds, or make the syringe larger",
            )
        return NetworkNode(name, spec.volume, displaced=displaced)

    def tube(self, name: str, spec: TubeSpec, ends: tuple[int, int]) -> NetworkEdge:
        """Return a tube, which is always open."""
        conductance = self.fluid.tube_conductance(spec.length, spec.bore)
        return NetworkEdge(name, ends, conductance, ALWAYS, 0.0)

    def valve(self, name: str, spec: ValveSpec, ends: tuple[int, int]) -> NetworkEdge:
        """Return a valve."""
        conductance = self.fluid.valve_conductance(spec.flow, spec.pressure)
        opening = self.fraction(spec.opening, (*PLACE, "edges", name, "opening"))
        return NetworkEdge(name, ends, conductance, opening, spec.pulses or 0.0)

    def chamber_pressure(
        self, name: str, spec: NetworkChamberSpec, tubes: float, nodes: Collection[NetworkNode]
    ) -> FollowerPressure:
        """Return the pressure on the facets of a chamber.

        tubes [m^3]: volume that the tubes at it add. nodes: all nodes of the network.
        """
        fluid, sources = self.fluid, sum(node.is_source for node in nodes)
        highest = fluid.ambient_pressure + max(node.highest_pressure for node in nodes)
        highest *= max(node.compression for node in nodes)

        def source(chamber: RestingChamber) -> NetworkChamber:
            chamber.refuse_inverted(-chamber.nothing if fluid.is_gas else chamber.nothing)
            filled = spec.volume_ratio * chamber.volume
            side = chamber.room_beside(filled, spec.dead_volume + tubes, spec.excluded_volume)
            elastic = 0.0 if fluid.is_gas else filled / chamber.liquid_modulus()
            node = NetworkNode(name, side, compliance=elastic, volume_ratio=spec.volume_ratio)
            return NetworkChamber(node, chamber.volume, fluid.ambient_pressure, highest, sources)

        return chamber_pressure(self.loaded, spec, source, (*PLACE, "nodes", name))

    def profile(self, data: Spec, name: str, key: str) -> Profile:
        """Return a profile of a node over time [s] of the whole run."""
        return over_the_run(self.names, data, (*PLACE, "nodes", name, key))

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

    def refuse_below_vacuum(self, pressure: float, name: str, key: str) -> None:
        """Raise SceneError for a pressure [Pa] of a node that no fluid can have."""
        vacuum = -self.fluid.ambient_pressure
        if pressure <= vacuum:
            raise self.names.loaded.error(
                (*PLACE, "nodes", name, key),
                f"{1e-3 * pressure:.4g} kPa is below vacuum",
                f"write more than {1e-3 * vacuum:.4g} kPa",
            )


FLUIDS: dict[type, Callable[[Any], Fluid]] = {GasSpec: gas, LiquidSpec: liquid}
NODES: dict[type, Callable[[_Making, str, Any], NetworkNode]] = {
    NetworkChamberSpec: _Making.chamber,
    VesselSpec: _Making.vessel,
    RegulatorSpec: _Making.regulator,
    NetworkPumpSpec: _Making.pump,
    SyringeSpec: _Making.syringe,
}
EDGES: dict[type, Callable[[_Making, str, Any, tuple[int, int]], NetworkEdge]] = {
    TubeSpec: _Making.tube,
    ValveSpec: _Making.valve,
}
