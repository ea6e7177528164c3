"""What drives a chamber: a given pressure, an added volume of liquid, or an added mass of gas.

Under a given pressure an inflated skin runs away where its pressure curve falls with the volume.
A chamber driven by volume or by mass stays stable there: its pressure falls as the skin gives way.
"""

from dataclasses import dataclass

import numpy as np

from softsim.loads.profile import Profile

AIR_GAS_CONSTANT = 287.05  # J/(kg K), dry air


def highest(profile: Profile) -> float:
    """Time [s] at which a profile is highest."""
    return float(profile.times[np.argmax(profile.values)])


@dataclass(frozen=True)
class GivenPressure:
    """profile: what a gauge shows; section_profile: what acts on the plane model [Pa over s]."""

    profile: Profile
    section_profile: Profile

    @property
    def fullest(self) -> float:
        """Time [s] at which the profile is highest."""
        return highest(self.profile)

    def stiffness(self, volume: float, time: float) -> float:
        """-dp/dV [Pa/m^3]: none, the pressure does not ask for the volume."""
        return 0.0


@dataclass(frozen=True)
class AddedVolume:
    """A liquid of which `profile` [m^3 over s] is pumped into the chamber.

    p = bulk_modulus (V_0 + added - V) / V_0, as a hydrostatic fluid cavity: the liquid is so stiff
    that V follows the pump, but not so stiff that it shortens the time step.
    initial_volume: V_0 [m^3].
    """

    profile: Profile
    initial_volume: float
    bulk_modulus: float

    @property
    def fullest(self) -> float:
        """Time [s] at which the profile is highest."""
        return highest(self.profile)

    def stiffness(self, volume: float, time: float) -> float:
        """-dp/dV [Pa/m^3]."""
        return self.bulk_modulus / self.initial_volume


@dataclass(frozen=True)
class AddedGas:
    """A gas of which `profile` [kg over s] is let into the chamber, ideal and isothermal.

    p + p_a = (m_0 + added) R T / (V + V_s); m_0 fills the chamber at ambient pressure p_a.
    initial_volume: V of the chamber's surface at the start. side_volume: V_s, of the line, less
    what stands inside the chamber [m^3]. specific_energy: R T [J/kg]. ambient_pressure [Pa].
    """

    profile: Profile
    initial_volume: float
    side_volume: float
    specific_energy: float
    ambient_pressure: float

    @property
    def fullest(self) -> float:
        """Time [s] at which the profile is highest."""
        return highest(self.profile)

    @property
    def initial_mass(self) -> float:
        """m_0 [kg]."""
        return (
            self.ambient_pressure * (self.initial_volume + self.side_volume) / self.specific_energy
        )

    def stiffness(self, volume: float, time: float) -> float:
        """-dp/dV [Pa/m^3]."""
        mass = self.initial_mass + float(np.asarray(self.profile.at(time)))
        return mass * self.specific_energy / (volume + self.side_volume) ** 2


Drive = GivenPressure | AddedVolume | AddedGas
