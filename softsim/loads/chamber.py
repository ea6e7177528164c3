"""Pressure in a chamber from its drive, as Taichi computes it; equations in loads/drive.py."""

import numpy as np
import taichi as ti

from softsim.fields import real_field
from softsim.loads.drive import AddedGas, AddedVolume, GivenPressure
from softsim.loads.table import ProfileTable


@ti.data_oriented
class PressureFollowsProfile:
    """The pressure on the facets is given."""

    asks_volume = False

    def __init__(self, drives: list[GivenPressure]) -> None:
        self.table = ProfileTable([d.section_profile for d in drives])

    @ti.func
    def pressure(self, s, t, volume):
        """Pressure [Pa] at time t."""
        return self.table.at(s, t)


@ti.data_oriented
class PressureOfLiquid:
    """p = kappa_f (V_0 + added - V) / V_0."""

    asks_volume = True

    def __init__(self, drives: list[AddedVolume]) -> None:
        self.table = ProfileTable([d.profile for d in drives])
        self.initial_volume = real_field(np.array([d.initial_volume for d in drives]))
        self.bulk_modulus = real_field(np.array([d.bulk_modulus for d in drives]))

    @ti.func
    def pressure(self, s, t, volume):
        """Pressure [Pa] at time t of a chamber of `volume` [m^3]."""
        missing = self.initial_volume[s] + self.table.at(s, t) - volume
        return self.bulk_modulus[s] * missing / self.initial_volume[s]


@ti.data_oriented
class PressureOfGas:
    """p = m R T / (V + V_s) - p_a."""

    asks_volume = True

    def __init__(self, drives: list[AddedGas]) -> None:
        self.table = ProfileTable([d.profile for d in drives])
        self.initial_mass = real_field(np.array([d.initial_mass for d in drives]))
        self.side_volume = real_field(np.array([d.side_volume for d in drives]))
        self.specific_energy = real_field(np.array([d.specific_energy for d in drives]))
        self.ambient = real_field(np.array([d.ambient_pressure for d in drives]))

    @ti.func
    def pressure(self, s, t, volume):
        """Pressure [Pa] over ambient at time t of a chamber of `volume` [m^3]."""
        mass = self.initial_mass[s] + self.table.at(s, t)
        return mass * self.specific_energy[s] / (volume + self.side_volume[s]) - self.ambient[s]


SOURCES = {
    GivenPressure: PressureFollowsProfile,
    AddedVolume: PressureOfLiquid,
    AddedGas: PressureOfGas,
}
