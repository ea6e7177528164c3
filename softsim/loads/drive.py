"""Pressure sources without a tube: given or controlled pressure, added volume or added gas.

Air through a tube is in loads/air_line.py. Under a given pressure an inflated skin is unstable
where its pressure-volume curve falls. A chamber driven by volume or by mass stays stable there: its
pressure falls as the skin yields.

Each kind has a data class, such as `AddedGas`, and a class that kernels evaluate, such as
`AddedGasSource`.
"""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, TypeVar

import numpy as np
import taichi as ti

from softsim.compute import fields
from softsim.compute.fields import real_field
from softsim.compute.term import PerScenario
from softsim.loads.pressure_control import Command, EventCycles
from softsim.loads.profile import Cycle, Profile, ProfileTable, cycles_of

C = TypeVar("C", bound="_Immediate")
S = TypeVar("S", bound="_Scheduled")

AIR_GAS_CONSTANT = 287.05  # J/(kg K), dry air


ATMOSPHERE = 101_325.0
"""Absolute ambient pressure [Pa] of a chamber where the scene gives none."""
BALLOONING = (
    "under a prescribed pressure above its limit point a wall balloons and becomes thinner: "
    "lower the pressure, or drive the chamber by added_volume"
)


class _Immediate:
    """Pressure source without a tube between gauge and chamber."""

    columns: ClassVar[dict[str, str]] = {}
    """Additional columns of the history -> unit."""

    @property
    def course(self: C) -> C:
        """Time history at the gauge, which defines the cycles: the source itself."""
        return self


@dataclass(frozen=True)
class _Scheduled(_Immediate):
    """Pressure source whose time history is known in advance."""

    profile: PerScenario[Profile]

    stiffens: ClassVar[bool] = False
    """True if the stiffness of the chamber increases with the value of its profile."""

    @cached_property
    def cycles(self) -> list[Cycle]:
        """Cycles of the profile; empty for a profile that never falls."""
        return cycles_of(self.profile)

    @property
    def last_change(self) -> float:
        """Time [s] at which the profile ends."""
        return float(self.profile.times[-1])

    @property
    def cycle_count(self) -> int:
        """Number of cycles of the profile."""
        return len(self.cycles)

    def cycle_end(self, number: int) -> float:
        """Return the time [s] at which a cycle ends; number: from 1 to `cycle_count`."""
        return self.cycles[number - 1].end

    def cycles_done(self, time: float) -> int:
        """Return the number of cycles of the profile that have ended at `time` [s]."""
        return sum(cycle.has_ended(time) for cycle in self.cycles)

    def time_scaled(self: S, factor: float) -> S:
        """Return the pressure source with its profile `factor` times as fast."""
        return replace(self, profile=self.profile.time_scaled(factor))


@dataclass(frozen=True)
class GivenPressure(_Scheduled):
    """Prescribed pressure.

    profile: pressure that a gauge shows. section_profile: pressure on the facets of the plane model
    [Pa over s].
    """

    section_profile: PerScenario[Profile]

    asks_volume = False
    thinning_advice = BALLOONING

    @property
    def peak(self) -> str:
        """Highest and, if it is negative, lowest pressure that a gauge shows, as text."""
        low, high = 1e-3 * self.profile.values.min(), 1e-3 * self.profile.values.max()
        return f"{low:.4g} to {high:.4g} kPa" if low < 0.0 else f"up to {high:.4g} kPa"

    def stiffness(self, volume: float) -> float:
        """Return -dp/dV [Pa/m^3]: 0, because the pressure does not depend on the volume."""
        return 0.0

    def time_scaled(self, factor: float) -> "GivenPressure":
        return replace(
            self,
            profile=self.profile.time_scaled(factor),
            section_profile=self.section_profile.time_scaled(factor),
        )

    def source(self, alike: Sequence["GivenPressure"]) -> "GivenPressureSource":
        """Return the pressure source for kernels.

        alike: this source in every scenario, this one first.
        """
        return GivenPressureSource(alike)


class GivenPressureSource:
    """Pressure source for kernels: a given pressure on the facets."""

    asks_volume = False

    def __init__(self, drives: Sequence[GivenPressure]) -> None:
        self.table = ProfileTable([d.section_profile for d in drives])

    def follow(self, scenario: int, drive: GivenPressure) -> None:
        """Replace the time history of a scenario."""
        self.table.follow(scenario, drive.section_profile)

    def state_fields(self) -> dict[str, ti.Field]:
        """Return no fields: the time history is not part of a checkpoint."""
        return {}

    @ti.func
    def pressure(self, s, t, volume):
        """Return the pressure [Pa] at time t."""
        return self.table.at(s, t)


@dataclass(frozen=True)
class AddedVolume(_Scheduled):
    """Liquid of which `profile` [m^3 over s] is pumped into the chamber.

    p = bulk_modulus (V_0 + added - V) / V_0, as in a hydrostatic fluid cavity: the bulk modulus is
    so large that V follows the pump, but not so large that it shortens the time step.
    initial_volume: V_0 [m^3].
    """

    initial_volume: PerScenario[float]
    bulk_modulus: PerScenario[float]

    ambient_pressure: ClassVar[float] = ATMOSPHERE
    asks_volume = True
    thinning_advice = "the wall of a chamber becomes thinner as the chamber grows: add less volume"

    @property
    def content(self) -> float:
        """Volume [m^3] in the chamber at the start."""
        return self.initial_volume

    @property
    def peak(self) -> str:
        """Largest added volume, and the volume of the chamber, as text."""
        added, volume = 1e6 * self.profile.values.max(), 1e6 * self.initial_volume
        return f"up to {added:.4g} ml into a chamber of {volume:.4g} ml"

    def stiffness(self, volume: float) -> float:
        """Return -dp/dV [Pa/m^3]."""
        return self.bulk_modulus / self.initial_volume

    def source(self, alike: Sequence["AddedVolume"]) -> "AddedVolumeSource":
        """Return the pressure source for kernels.

        alike: this source in every scenario, this one first.
        """
        return AddedVolumeSource(alike)


class AddedVolumeSource:
    """Pressure source for kernels: p = kappa_f (V_0 + added - V) / V_0."""

    asks_volume = True

    def __init__(self, drives: Sequence[AddedVolume]) -> None:
        self.table = ProfileTable([d.profile for d in drives])
        self.initial_volume = real_field(np.array([d.initial_volume for d in drives]))
        self.bulk_modulus = real_field(np.array([d.bulk_modulus for d in drives]))

    def follow(self, scenario: int, drive: AddedVolume) -> None:
        """Replace the time history of a scenario."""
        self.table.follow(scenario, drive.profile)

    def state_fields(self) -> dict[str, ti.Field]:
        """Return no fields: the time history is not part of a checkpoint."""
        return {}

    @ti.func
    def pressure(self, s, t, volume):
        """Return the pressure [Pa] at time t in a chamber of `volume` [m^3]."""
        missing = self.initial_volume[s] + self.table.at(s, t) - volume
        return self.bulk_modulus[s] * missing / self.initial_volume[s]


@dataclass(frozen=True)
class AddedGas(_Scheduled):
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

    asks_volume = True
    stiffens = True
    thinning_advice = "the wall of a chamber becomes thinner as the chamber grows: add less gas"

    @property
    def content(self) -> float:
        """Mass [kg] in the chamber at the start."""
        return self.initial_mass

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
        mass = self.initial_mass + float(self.profile.values.max())
        return mass * self.specific_energy / (volume + self.side_volume) ** 2

    def source(self, alike: Sequence["AddedGas"]) -> "AddedGasSource":
        """Return the pressure source for kernels.

        alike: this source in every scenario, this one first.
        """
        return AddedGasSource(alike)


class AddedGasSource:
    """Pressure source for kernels: p = m R T / (V + V_s) - p_a."""

    asks_volume = True

    def __init__(self, drives: Sequence[AddedGas]) -> None:
        self.table = ProfileTable([d.profile for d in drives])
        self.initial_mass = real_field(np.array([d.initial_mass for d in drives]))
        self.side_volume = real_field(np.array([d.side_volume for d in drives]))
        self.specific_energy = real_field(np.array([d.specific_energy for d in drives]))
        self.ambient = real_field(np.array([d.ambient_pressure for d in drives]))

    def follow(self, scenario: int, drive: AddedGas) -> None:
        """Replace the time history of a scenario."""
        self.table.follow(scenario, drive.profile)

    def state_fields(self) -> dict[str, ti.Field]:
        """Return no fields: the time history is not part of a checkpoint."""
        return {}

    @ti.func
    def pressure(self, s, t, volume):
        """Return the pressure [Pa] above ambient at time t in a chamber of `volume` [m^3]."""
        mass = self.initial_mass[s] + self.table.at(s, t)
        return mass * self.specific_energy[s] / (volume + self.side_volume[s]) - self.ambient[s]


@dataclass(frozen=True)
class ControlledPressure(_Immediate):
    """Pressure on the facets that follows commands; see loads/pressure_control.py."""

    settings: PerScenario[EventCycles]

    asks_volume = False
    thinning_advice = BALLOONING

    @property
    def peak(self) -> str:
        """Highest pressure of the control, as text."""
        return f"up to {1e-3 * self.settings.highest:.4g} kPa"

    @property
    def last_change(self) -> float:
        """Time [s] at which the first cycle has ended at the latest."""
        rules = self.settings
        rise = rules.highest / rules.inflation_rate
        fall = (rules.highest - rules.lowest) / rules.deflation_rate
        return rules.start + rise + rules.hold + fall

    @property
    def cycle_count(self) -> float:
        """Largest number of cycles; infinite if the control continues as long as the run."""
        return math.inf if self.settings.count is None else self.settings.count

    def cycle_end(self, number: int) -> float:
        """Return infinity: the end of a cycle is not known in advance."""
        return math.inf

    def time_scaled(self, factor: float) -> "ControlledPressure":
        """Return the control `factor` times as fast."""
        return ControlledPressure(self.settings.time_scaled(factor))

    def stiffness(self, volume: float) -> float:
        """Return -dp/dV [Pa/m^3]: 0, because the pressure does not depend on the volume."""
        return 0.0

    def source(self, alike: Sequence["ControlledPressure"]) -> "ControlledPressureSource":
        """Return the pressure source for kernels.

        alike: this source in every scenario, this one first.
        """
        return ControlledPressureSource(alike)


class ControlledPressureSource:
    """Pressure source for kernels that follows commands.

    p(t) = p_0 + r (t - t_0), between p_0 and the target of the command.

    Each scenario has one command; the host replaces it between two blocks of increments.
    """

    asks_volume = False

    def __init__(self, drives: Sequence[ControlledPressure]) -> None:
        first = columns([d.settings.first_command() for d in drives])
        self.in_force = {name: real_field(values) for name, values in first.items()}
        self.begin_pressure, self.begin_time = self.in_force["pressure"], self.in_force["time"]
        self.rate, self.target = self.in_force["rate"], self.in_force["target"]

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores: the commands in force."""
        return {f"command_{name}": field for name, field in self.in_force.items()}

    def obey(self, scenario: int, command: Command) -> None:
        """Replace the command of a scenario."""
        for name, value in dataclasses.asdict(command).items():
            fields.write_row(self.in_force[name], scenario, value)

    @ti.func
    def pressure(self, s, t, volume):
        """Return the pressure [Pa] at time t."""
        begin, target = self.begin_pressure[s], self.target[s]
        value = begin + self.rate[s] * (t - self.begin_time[s])
        return ti.min(ti.max(value, ti.min(begin, target)), ti.max(begin, target))


def columns(commands: list[Command]) -> dict[str, np.ndarray]:
    """Return the values (scenarios,) of each field of the commands, by the name of the field."""
    names = [f.name for f in dataclasses.fields(Command)]
    return {name: np.array([getattr(c, name) for c in commands]) for name in names}


Scheduled = GivenPressure | AddedVolume | AddedGas
