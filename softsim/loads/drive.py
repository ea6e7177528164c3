"""What drives a chamber: a given pressure, one that is controlled, an added volume of liquid, or an
added mass of gas.

Under a given pressure an inflated skin runs away where its pressure curve falls with the volume.
A chamber driven by volume or by mass stays stable there: its pressure falls as the skin gives way.
"""

import math
from dataclasses import dataclass, replace
from typing import TypeVar

from softsim.loads.cycles import cycles_of
from softsim.loads.pressure_control import EventCycles
from softsim.loads.profile import Profile
from softsim.sharing import Own

S = TypeVar("S", bound="_Scheduled")

AIR_GAS_CONSTANT = 287.05  # J/(kg K), dry air


@dataclass(frozen=True)
class _Scheduled:
    """A drive of which all is known beforehand."""

    profile: Own[Profile]

    @property
    def cycle_count(self) -> int:
        """Cycles of the profile; 0 of one that never falls."""
        return len(cycles_of(self.profile))

    def cycle_end(self, number: int) -> float:
        """When a cycle of the profile ends [s]; number: from 1 to `cycle_count`."""
        return cycles_of(self.profile)[number - 1].end

    def cycles_done(self, time: float) -> int:
        """Cycles of the profile that have ended at `time` [s]; 0 of one that never falls."""
        return sum(cycle.has_ended(time) for cycle in cycles_of(self.profile))

    def hastened(self: S, factor: float) -> S:
        """The drive played `factor` times as fast."""
        return replace(self, profile=self.profile.sooner(factor))


@dataclass(frozen=True)
class GivenPressure(_Scheduled):
    """profile: what a gauge shows; section_profile: what acts on the plane model [Pa over s]."""

    section_profile: Own[Profile]

    asks_volume = False

    def stiffness(self, volume: float) -> float:
        """-dp/dV [Pa/m^3]: none, the pressure does not ask for the volume."""
        return 0.0

    def hastened(self, factor: float) -> "GivenPressure":
        """The drive played `factor` times as fast."""
        return replace(
            self,
            profile=self.profile.sooner(factor),
            section_profile=self.section_profile.sooner(factor),
        )


@dataclass(frozen=True)
class AddedVolume(_Scheduled):
    """A liquid of which `profile` [m^3 over s] is pumped into the chamber.

    p = bulk_modulus (V_0 + added - V) / V_0, as a hydrostatic fluid cavity: the liquid is so stiff
    that V follows the pump, but not so stiff that it shortens the time step.
    initial_volume: V_0 [m^3].
    """

    initial_volume: Own[float]
    bulk_modulus: Own[float]

    asks_volume = True

    def stiffness(self, volume: float) -> float:
        """-dp/dV [Pa/m^3]."""
        return self.bulk_modulus / self.initial_volume


@dataclass(frozen=True)
class AddedGas(_Scheduled):
    """A gas of which `profile` [kg over s] is let into the chamber, ideal and isothermal.

    p + p_a = (m_0 + added) R T / (V + V_s); m_0 fills the chamber at ambient pressure p_a.
    initial_volume: V of the chamber's surface at the start. side_volume: V_s, of the line, less
    what stands inside the chamber [m^3]. specific_energy: R T [J/kg]. ambient_pressure [Pa].
    """

    initial_volume: Own[float]
    side_volume: Own[float]
    specific_energy: Own[float]
    ambient_pressure: Own[float]

    asks_volume = True

    @property
    def initial_mass(self) -> float:
        """m_0 [kg]."""
        return (
            self.ambient_pressure * (self.initial_volume + self.side_volume) / self.specific_energy
        )

    def stiffness(self, volume: float) -> float:
        """-dp/dV [Pa/m^3], with as much gas in the chamber as there ever is."""
        mass = self.initial_mass + float(self.profile.values.max())
        return mass * self.specific_energy / (volume + self.side_volume) ** 2


@dataclass(frozen=True)
class ControlledPressure:
    """The pressure on the facets follows commands; see loads/pressure_control.py."""

    settings: Own[EventCycles]

    asks_volume = False

    @property
    def cycle_count(self) -> float:
        """Most cycles that it makes; infinite where it goes on as long as the run."""
        return math.inf if self.settings.count is None else self.settings.count

    def cycle_end(self, number: int) -> float:
        """Infinite: nobody knows beforehand when the robot ends its cycles."""
        return math.inf

    def hastened(self, factor: float) -> "ControlledPressure":
        """The drive played `factor` times as fast."""
        return ControlledPressure(self.settings.hastened(factor))

    def stiffness(self, volume: float) -> float:
        """-dp/dV [Pa/m^3]: none, the pressure does not ask for the volume."""
        return 0.0


Scheduled = GivenPressure | AddedVolume | AddedGas
Drive = Scheduled | ControlledPressure
