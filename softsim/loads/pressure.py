"""Follower pressure on facets, and the pressure sources that set it.

Corner forces are p times the gradient of the enclosed volume (elements/geometry.py). On a closed
chamber the resultant force and moment vanish; a body that closes the chamber receives the opposite
of the forces on the facets.

A `PressureSource` holds the data of what sets p: a prescribed pressure, an added volume or an added
gas; the controlled pressure is in loads/pressure_control.py, the air line in loads/air_line.py and
the chamber of a network in loads/network.py.
Its `kernel` returns its kernel class. Under a prescribed pressure an inflated skin is unstable
where its pressure-volume curve falls. A chamber with a prescribed volume or mass stays
stable there: its pressure falls as the skin yields.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, TypeVar

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import index_field, real_field
from softsim.compute.nodes import PARTS, Nodes, parts_of
from softsim.compute.term import Pass, PerScenario, Samples, Stage, WorkingTerm
from softsim.elements.geometry import Facets, Geometry
from softsim.loads.load import Load
from softsim.loads.profile import Cycle, Profile, ProfileTable, cycles_of
from softsim.rigid import RigidBodies

S = TypeVar("S", bound="ProfileSource")

AIR_GAS_CONSTANT = 287.05  # J/(kg K), dry air

ATMOSPHERE = 101_325.0
"""Absolute ambient pressure [Pa] of a chamber where the scene gives none."""
BALLOONING = (
    "under a prescribed pressure above its limit point a wall balloons and becomes thinner: "
    "lower the pressure, or drive the chamber by added_volume"
)

OPEN = -1

VOLUME_COLUMN = {"chamber_volume": "m^3"}  # enclosed by the surface of the robot's chamber


class PressureSource(ABC):
    """Data of one scenario that set the pressure of a chamber.

    The defaults are those of a pressure that does not depend on the volume of the chamber.
    """

    needs_volume: ClassVar[bool] = False
    """True if the pressure depends on the volume of the chamber."""
    can_be_set: ClassVar[bool] = True
    """True if another profile can replace that of the source during a run."""
    unit: ClassVar[str] = "Pa"
    """SI unit of the values of its profile or control."""
    thinning_advice: ClassVar[str] = BALLOONING
    """Advice to users on elements that become too thin."""
    initial_volume: float
    """Volume [m^3] of the chamber at the start, if the pressure depends on the volume."""
    ambient_pressure: float
    """Absolute ambient pressure [Pa], if the pressure depends on the volume."""

    @property
    def stiffest_value(self) -> float:
        """Value of the profile above which the chamber is stiffer than `stiffness`."""
        return np.inf

    @property
    def gas_outside(self) -> float:
        """Volume [m^3] of the gas outside the chamber."""
        return 0.0

    @property
    def filling_ratio(self) -> float:
        """Largest volume or mass that is added, divided by the content at the start."""
        return 0.0

    @property
    def columns(self) -> dict[str, str]:
        """Columns of the history besides the pressures -> unit."""
        return {}

    @property
    def control(self) -> Any:
        """Settings of a control by events (loads/pressure_control.py); None for a profile."""
        return None

    @property
    def pressure_cycles(self) -> list[Cycle]:
        """Cycles of a prescribed pressure; none if the pressure is not known in advance."""
        return []

    @property
    def pressure_values(self) -> np.ndarray | None:
        """Values [Pa] between which a prescribed pressure on the facets varies, or None."""
        return None

    @property
    @abstractmethod
    def peak(self) -> str:
        """Largest value of the source, as text."""

    @property
    @abstractmethod
    def value_range(self) -> tuple[float, float]:
        """Smallest and largest value of its profile or control."""

    @property
    @abstractmethod
    def last_change(self) -> float:
        """Time [s] at which the profile ends, or the first controlled cycle at the latest."""

    @property
    @abstractmethod
    def cycle_count(self) -> float:
        """Largest number of cycles; infinite for a control that lasts as long as the run."""

    @abstractmethod
    def cycle_end(self, number: int) -> float:
        """Return the time [s] at which a cycle ends; number: from 1 to `cycle_count`.

        It is infinite if it is not known in advance.
        """

    @abstractmethod
    def cycles_done(self, time: float) -> int:
        """Return the number of cycles of the profile that have ended at `time` [s]."""

    @abstractmethod
    def value_at(self, time: float) -> float:
        """Return the value of the profile at `time` [s]: pressure, added volume or added mass."""

    @abstractmethod
    def with_profile(self, profile: Profile) -> "PressureSource":
        """Return the source with another profile [Pa, m^3 or kg over s]."""

    @abstractmethod
    def time_scaled(self, factor: float) -> "PressureSource":
        """Return the source with its profile or control `factor` times as fast."""

    @abstractmethod
    def kernel(self, scenarios: Sequence[Any]) -> Any:
        """Return the kernel class of the source.

        scenarios: this source in every scenario, this one first.
        """

    def stiffness(self, volume: float) -> float:
        """Return -dp/dV [Pa/m^3] at `volume` [m^3], at most in the run."""
        return 0.0

    def gauge_pressure(
        self, times: np.ndarray, section_pressure: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the pressures [Pa] that a gauge shows and that act on the facets at `times` [s].

        section_pressure: the one on the facets after the last increment before each time.
        """
        return section_pressure, section_pressure

    def warnings(self) -> dict[str, str]:
        """Return the warnings about the data of the source (kind -> text)."""
        return {}


@dataclass(frozen=True)
class ProfileSource(PressureSource):
    """Pressure source with a profile over time."""

    profile: PerScenario[Profile]

    @cached_property
    def cycles(self) -> list[Cycle]:
        """Cycles of the profile; empty for a profile that never falls."""
        return cycles_of(self.profile)

    @property
    def value_range(self) -> tuple[float, float]:
        return float(self.profile.values.min()), float(self.profile.values.max())

    @property
    def last_change(self) -> float:
        return float(self.profile.times[-1])

    @property
    def cycle_count(self) -> int:
        return len(self.cycles)

    def cycle_end(self, number: int) -> float:
        return self.cycles[number - 1].end

    def cycles_done(self, time: float) -> int:
        return sum(cycle.has_ended(time) for cycle in self.cycles)

    def value_at(self, time: float) -> float:
        return float(self.profile.at(time))

    def with_profile(self: S, profile: Profile) -> S:
        return replace(self, profile=profile)

    def time_scaled(self: S, factor: float) -> S:
        return replace(self, profile=self.profile.time_scaled(factor))


@dataclass(frozen=True)
class GaugeScale:
    """Relation between the pressure that a gauge shows and the one on the facets.

    on_skin: rising pairs of both pressures [Pa]; empty: they are equal. factor, offset [Pa]: the
    facets of a plane model carry factor times (pressure - offset), not less than 0.
    """

    on_skin: tuple[tuple[float, float], ...] = ()
    factor: float = 1.0
    offset: float = 0.0

    def on_facets(self, profile: Profile) -> Profile:
        """Return the pressure on the facets while a gauge shows `profile` [Pa over s]."""
        if self == GaugeScale():
            return profile
        on_skin = profile.translated(np.array(self.on_skin)) if self.on_skin else profile
        return on_skin.reduced(self.factor, self.offset)


@dataclass(frozen=True)
class PrescribedPressure(ProfileSource):
    """Pressure with a prescribed profile.

    profile: pressure that a gauge shows. facet_profile: pressure on the facets, by `scale` [Pa over
    s]; `at_gauge` computes it.
    """

    facet_profile: PerScenario[Profile]
    scale: PerScenario[GaugeScale] = GaugeScale()

    @classmethod
    def at_gauge(cls, profile: Profile, scale: GaugeScale | None = None) -> "PrescribedPressure":
        """Return the source for a pressure at the gauge; without a scale it is on the facets."""
        scale = scale or GaugeScale()
        return cls(profile, scale.on_facets(profile), scale)

    @property
    def peak(self) -> str:
        """Highest and, if it is negative, lowest pressure that a gauge shows, as text."""
        low, high = 1e-3 * self.profile.values.min(), 1e-3 * self.profile.values.max()
        return f"{low:.4g} to {high:.4g} kPa" if low < 0.0 else f"up to {high:.4g} kPa"

    @property
    def pressure_cycles(self) -> list[Cycle]:
        return self.cycles

    @property
    def pressure_values(self) -> np.ndarray:
        return self.facet_profile.values

    @property
    def extremes(self) -> tuple[float, float, float]:
        """Highest pressure [Pa], steepest fall [Pa/s] and the pressure at its end [Pa]."""
        times, values = self.profile.times, self.profile.values
        rates = -np.diff(values) / np.diff(times)
        if not (rates > 0.0).any():
            return float(values.max()), 0.0, float(values[-1])
        steepest = int(np.argmax(rates))
        return float(values.max()), float(rates[steepest]), float(values[steepest + 1])

    @property
    def highest(self) -> float:
        """Highest pressure [Pa] that a gauge should ever show."""
        return float(self.profile.values.max())

    def with_profile(self, profile: Profile) -> "PrescribedPressure":
        return self.at_gauge(profile, self.scale)

    def time_scaled(self, factor: float) -> "PrescribedPressure":
        return replace(
            self,
            profile=self.profile.time_scaled(factor),
            facet_profile=self.facet_profile.time_scaled(factor),
        )

    def gauge_pressure(
        self, times: np.ndarray, section_pressure: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        return self.profile.at(times), self.facet_profile.at(times)

    def kernel(self, scenarios: Sequence["PrescribedPressure"]) -> "PrescribedPressureKernel":
        return PrescribedPressureKernel([one.facet_profile for one in scenarios])


class PressureKernel:
    """Base class of the kernel classes of pressure sources."""

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores; the profile is not one of them."""
        return {}

    def refuse(self, source: PressureSource, section_pressure: float) -> None:
        """Raise StabilityError if the chamber cannot have `section_pressure` [Pa]."""

    def sampled(self) -> list[ti.Field]:
        """Return the fields that `readings` reads."""
        return []

    def readings(
        self, samples: Samples, source: PressureSource, section_pressure: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Return columns of the history (rows,), while `section_pressure` [Pa] acts on facets."""
        return {}


class ProfileKernel(PressureKernel):
    """Base class of the kernel classes of pressure sources with a profile."""

    def __init__(self, profiles: list[Profile]) -> None:
        self.table = ProfileTable(profiles)

    def follow(self, scenario: int, source: Any) -> None:
        """Replace the profile of a scenario by that of a source."""
        self.table.follow(scenario, source.profile)


class PrescribedPressureKernel(ProfileKernel):
    """Kernel class of a prescribed pressure on the facets."""

    def follow(self, scenario: int, source: PrescribedPressure) -> None:
        """Replace the profile of a scenario."""
        self.table.follow(scenario, source.facet_profile)

    @ti.func
    def pressure(self, s, t, volume):
        """Return the pressure [Pa] at time t."""
        return self.table.at(s, t)


class AddedContent(ProfileSource):
    """Base class of sources that add `profile` to the content of a chamber."""

    needs_volume = True

    @property
    @abstractmethod
    def content(self) -> float:
        """Volume [m^3] or mass [kg] in the chamber at the start."""

    @property
    def columns(self) -> dict[str, str]:
        return VOLUME_COLUMN

    @property
    def filling_ratio(self) -> float:
        largest = float(self.profile.values.max())
        return largest / self.content if self.content > 0.0 else 0.0


@dataclass(frozen=True)
class AddedVolume(AddedContent):
    """Liquid of which `profile` [m^3 over s] is pumped into the chamber.

    p = bulk_modulus (V_0 + added - V) / V_0, as in a hydrostatic fluid cavity: the bulk modulus is
    so large that V follows the pump, but not so large that it shortens the time step.
    initial_volume: V_0 [m^3].
    """

    initial_volume: PerScenario[float]
    bulk_modulus: PerScenario[float]

    ambient_pressure = ATMOSPHERE
    unit = "m^3"
    thinning_advice = "the wall of a chamber becomes thinner as the chamber grows: add less volume"

    @property
    def content(self) -> float:
        return self.initial_volume

    @property
    def peak(self) -> str:
        """Largest added volume, and the volume of the chamber, as text."""
        added, volume = 1e6 * self.profile.values.max(), 1e6 * self.initial_volume
        return f"up to {added:.4g} ml into a chamber of {volume:.4g} ml"

    def stiffness(self, volume: float) -> float:
        """Return -dp/dV [Pa/m^3]."""
        return self.bulk_modulus / self.initial_volume

    def kernel(self, scenarios: Sequence["AddedVolume"]) -> "AddedVolumeKernel":
        return AddedVolumeKernel(scenarios)


class AddedVolumeKernel(ProfileKernel):
    """Kernel class of an added volume: p = kappa_f (V_0 + added - V) / V_0."""

    def __init__(self, sources: Sequence[AddedVolume]) -> None:
        super().__init__([one.profile for one in sources])
        self.initial_volume = real_field(np.array([one.initial_volume for one in sources]))
        self.bulk_modulus = real_field(np.array([one.bulk_modulus for one in sources]))

    @ti.func
    def pressure(self, s, t, volume):
        """Return the pressure [Pa] at time t in a chamber of `volume` [m^3]."""
        missing = self.initial_volume[s] + self.table.at(s, t) - volume
        return self.bulk_modulus[s] * missing / self.initial_volume[s]


@dataclass(frozen=True)
class AddedGas(AddedContent):
    """Ideal, isothermal gas of which `profile` [kg over s] is let into the chamber.

    p + p_a = (m_0 + added) R T / (V + V_s); m_0 fills the chamber at ambient pressure p_a.
    initial_volume: V of the chamber's surface at the start [m^3]. side_volume: V_s [m^3], the
    volume of the line minus that of parts inside the chamber. specific_energy: R T [J/kg].
    ambient_pressure [Pa].
    """

    initial_volume: PerScenario[float]
    side_volume: PerScenario[float]
    specific_energy: PerScenario[float]
    ambient_pressure: PerScenario[float]

    unit = "kg"
    thinning_advice = "the wall of a chamber becomes thinner as the chamber grows: add less gas"

    @property
    def content(self) -> float:
        return self.initial_mass

    @property
    def stiffest_value(self) -> float:
        return float(self.profile.values.max())

    @property
    def gas_outside(self) -> float:
        return self.side_volume

    @property
    def peak(self) -> str:
        """Largest added mass, and the volume of the chamber, as text."""
        added, volume = 1e6 * self.profile.values.max(), 1e6 * self.initial_volume
        return f"up to {added:.4g} mg into a chamber of {volume:.4g} ml"

    @property
    def initial_mass(self) -> float:
        """Mass m_0 [kg] at ambient pressure."""
        return (
            self.ambient_pressure * (self.initial_volume + self.side_volume) / self.specific_energy
        )

    def stiffness(self, volume: float) -> float:
        """Return -dp/dV [Pa/m^3] at `volume` [m^3] for the largest mass of gas in the run."""
        mass = self.initial_mass + self.stiffest_value
        return mass * self.specific_energy / (volume + self.side_volume) ** 2

    def kernel(self, scenarios: Sequence["AddedGas"]) -> "AddedGasKernel":
        return AddedGasKernel(scenarios)


class AddedGasKernel(ProfileKernel):
    """Kernel class of an added gas: p = m R T / (V + V_s) - p_a."""

    def __init__(self, sources: Sequence[AddedGas]) -> None:
        super().__init__([one.profile for one in sources])
        self.initial_mass = real_field(np.array([one.initial_mass for one in sources]))
        self.side_volume = real_field(np.array([one.side_volume for one in sources]))
        self.specific_energy = real_field(np.array([one.specific_energy for one in sources]))
        self.ambient = real_field(np.array([one.ambient_pressure for one in sources]))

    @ti.func
    def pressure(self, s, t, volume):
        """Return the pressure [Pa] above ambient at time t in a chamber of `volume` [m^3]."""
        mass = self.initial_mass[s] + self.table.at(s, t)
        return mass * self.specific_energy[s] / (volume + self.side_volume[s]) - self.ambient[s]


@dataclass(frozen=True, eq=False)
class FollowerPressure(Load):
    """Follower pressure on `facets` (k, corners).

    lids: further facets, without pressure, that close the surface. body: number of the rigid body
    that closes the chamber, or None. geometry: of the facets. area: of the facets at rest [m^2].
    """

    name: PerScenario[str]
    facets: np.ndarray
    lids: np.ndarray
    geometry: Geometry
    source: PressureSource
    body: int | None
    area: PerScenario[float]

    def term(
        self, scenarios: Sequence["FollowerPressure"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "FollowerPressureTerm":
        facets, lids = (self.geometry.facets(nodes, f) for f in (self.facets, self.lids))
        sources = [load.source for load in scenarios]
        body = OPEN if self.body is None else self.body
        return FollowerPressureTerm(nodes, rigid_bodies, facets, lids, sources, body)

    @property
    def last_change(self) -> float:
        return self.source.last_change

    def time_scaled(self, factor: float) -> "FollowerPressure":
        return replace(self, source=self.source.time_scaled(factor))

    def remark(self, points: np.ndarray) -> str:
        """Return the highest value of the pressure source and the area at rest on which it acts."""
        return f"{self.source.peak}, on {1e6 * self.area:.4g} mm^2 at rest"

    def volume(self, x: np.ndarray) -> float:
        """Return the enclosed volume [m^3] with all nodes at x (n, d)."""
        return self.geometry.enclosed_volume(x, np.concatenate([self.facets, self.lids]))


class FollowerPressureTerm(WorkingTerm):
    """Kernel class that applies a follower pressure to facets.

    facets: of elements/geometry.py. lids: further facets, without pressure, that close the surface
    to a volume. sources: pressure source of each scenario. body: number of the rigid body that
    closes the chamber, or `OPEN`.

    Fields (scenarios,): pressure p [Pa]; source_pressure [Pa], that of the source at this volume; p
    follows it unless is_held is 1, which equilibrium with p as an unknown asks for; volume [m^3].
    """

    def __init__(
        self,
        nodes: Nodes,
        rigid_bodies: RigidBodies,
        facets: Facets,
        lids: Facets,
        sources: list[PressureSource],
        body: int = OPEN,
    ) -> None:
        self.nodes, self.rigid_bodies, self.body = nodes, rigid_bodies, body
        self.facets, self.lids = facets, lids
        self.sources, self.kernel = sources, sources[0].kernel(sources)
        self.needs_volume = sources[0].needs_volume
        super().__init__(nodes.scenarios, facets.count)
        self.corners = facets.corners
        self.pressure = real_field(np.zeros(nodes.scenarios))
        self.source_pressure = real_field(np.zeros(nodes.scenarios))
        self.is_held = index_field(np.zeros(nodes.scenarios))
        self.volume = real_field(np.zeros(nodes.scenarios))
        self.volume_part = real_field(np.zeros((nodes.scenarios, PARTS)))
        self.facet_part = index_field(parts_of([facets.count]))
        self.lid_part = index_field(parts_of([lids.count]))
        self.first_slot = nodes.corner_forces.reserve(facets.corner_nodes)
        if body != OPEN:
            rigid_bodies.react(body, self.first_slot, facets.corner_nodes.ravel())

    def follow(self, scenario: int, source: PressureSource) -> None:
        """Replace the pressure source of a scenario by another of the same kind."""
        self.kernel.follow(scenario, source)
        self.sources[scenario] = source

    def refuse(self, scenario: int) -> None:
        on_facets = float(fields.read_row(self.pressure, scenario))
        self.kernel.refuse(self.sources[scenario], on_facets)

    def sampled(self) -> list[ti.Field]:
        """Return the fields that `chamber_readings` reads."""
        return [self.pressure, self.volume, *self.kernel.sampled()]

    def chamber_readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the pressures (rows,) of the chamber, its volume and columns of its source.

        These are columns of the history if the chamber is that of the robot.
        """
        source = self.sources[samples.scenario]
        shown, acting = source.gauge_pressure(samples.load_times, samples.read(self.pressure))
        now = {"pressure": shown, "section_pressure": acting}
        if self.needs_volume:
            now["chamber_volume"] = samples.read(self.volume)
        return now | self.kernel.readings(samples, source, acting)

    def passes(self) -> dict[Stage, list[Pass]]:
        parts = PARTS if self.needs_volume else 0
        return {
            Stage.MOVE: [Pass("loads", parts, (self.measure_volume,))],
            Stage.PRESS: [Pass("loads", 1, (self.follow_source,))],
            Stage.STRESS: [Pass("loads", int(self.count), (self.push_facets,))],
        }

    def state_fields(self) -> dict[str, ti.Field]:
        of_chamber = {"pressure": self.pressure, "volume": self.volume}
        return super().state_fields() | of_chamber | self.kernel.state_fields()

    @ti.func
    def measure_volume(self, s, part, t, dt):
        """Compute the volume enclosed by a part of the facets and the lids."""
        volume = ti.cast(0.0, backend.real)
        for k in range(self.facet_part[part], self.facet_part[part + 1]):
            volume += self.facets.volume(s, k)
        for k in range(self.lid_part[part], self.lid_part[part + 1]):
            volume += self.lids.volume(s, k)
        self.volume_part[s, part] = volume

    @ti.func
    def enclosed_volume(self, s):
        """Return the enclosed volume [m^3], the sum of its parts."""
        volume = ti.cast(0.0, backend.real)
        for part in range(PARTS):
            volume += self.volume_part[s, part]
        return volume

    @ti.func
    def follow_source(self, s, i, t, dt):
        """Update the pressure, which may depend on the enclosed volume."""
        if ti.static(self.needs_volume):
            self.volume[s] = self.enclosed_volume(s)
        self.source_pressure[s] = self.kernel.pressure(s, t, self.volume[s])
        if self.is_held[s] == 0:
            self.pressure[s] = self.source_pressure[s]

    @ti.func
    def push_facets(self, s, i, t, dt):
        """Write p dV/dx on each corner of facet i and add the work of this increment."""
        forces = self.pressure[s] * self.facets.unit_forces(s, i)
        for c in ti.static(range(self.corners)):
            a = self.facets.node[i, c]
            force = ti.Vector.zero(backend.real, self.nodes.dimension)
            for k in ti.static(range(self.nodes.dimension)):
                force[k] = forces[c, k]
            # The slot still holds the force of the last increment: work by the trapezoidal rule.
            slot = self.first_slot + self.corners * i + c
            before = self.nodes.corner_forces.read(s, slot)
            self.nodes.corner_forces.write(s, slot, force)
            velocity = self.nodes.velocity[s, a]
            if ti.static(self.body != OPEN):
                velocity -= self.rigid_bodies.velocity_at(s, self.body, self.nodes.position[s, a])
            self.work[s, i] = self.work[s, i] + 0.5 * dt * (before + force).dot(velocity)
