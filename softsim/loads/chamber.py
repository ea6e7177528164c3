"""Pressure in a chamber from its drive, as Taichi computes it; equations in loads/drive.py."""

import dataclasses

import numpy as np
import taichi as ti

from softsim import fields
from softsim.fields import real_field
from softsim.loads.drive import AddedGas, AddedVolume, ControlledPressure, GivenPressure
from softsim.loads.pressure_control import Command
from softsim.loads.table import ProfileTable


@ti.data_oriented
class PressureFollowsProfile:
    """The pressure on the facets is given."""

    asks_volume = False

    def __init__(self, drives: list[GivenPressure]) -> None:
        self.table = ProfileTable([d.section_profile for d in drives])

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps: none, all is known beforehand."""
        return {}

    @ti.func
    def pressure(self, s, t, volume):
        """Pressure [Pa] at time t."""
        return self.table.at(s, t)


@ti.data_oriented
class PressureFollowsCommands:
    """p(t) = p_0 + r (t - t_0), between p_0 and where the command ends.

    One command a scenario; the host exchanges them between two blocks of increments.
    """

    asks_volume = False

    def __init__(self, drives: list[ControlledPressure]) -> None:
        first = columns([d.settings.first_command() for d in drives])
        self.in_force = {name: real_field(values) for name, values in first.items()}
        self.begin_pressure, self.begin_time = self.in_force["pressure"], self.in_force["time"]
        self.rate, self.target = self.in_force["rate"], self.in_force["target"]

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps: the commands in force."""
        return self.in_force

    def obey(self, scenario: int, command: Command) -> None:
        """Take a new command in a scenario."""
        for name, value in dataclasses.asdict(command).items():
            fields.write_row(self.in_force[name], scenario, value)

    @ti.func
    def pressure(self, s, t, volume):
        """Pressure [Pa] at time t."""
        begin, target = self.begin_pressure[s], self.target[s]
        value = begin + self.rate[s] * (t - self.begin_time[s])
        return ti.min(ti.max(value, ti.min(begin, target)), ti.max(begin, target))


@ti.data_oriented
class PressureOfLiquid:
    """p = kappa_f (V_0 + added - V) / V_0."""

    asks_volume = True

    def __init__(self, drives: list[AddedVolume]) -> None:
        self.table = ProfileTable([d.profile for d in drives])
        self.initial_volume = real_field(np.array([d.initial_volume for d in drives]))
        self.bulk_modulus = real_field(np.array([d.bulk_modulus for d in drives]))

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps: none, all is known beforehand."""
        return {}

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

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps: none, all is known beforehand."""
        return {}

    @ti.func
    def pressure(self, s, t, volume):
        """Pressure [Pa] over ambient at time t of a chamber of `volume` [m^3]."""
        mass = self.initial_mass[s] + self.table.at(s, t)
        return mass * self.specific_energy[s] / (volume + self.side_volume[s]) - self.ambient[s]


def columns(commands: list[Command]) -> dict[str, np.ndarray]:
    """What the commands say (scenarios,), by name."""
    names = [f.name for f in dataclasses.fields(Command)]
    return {name: np.array([getattr(c, name) for c in commands]) for name in names}


SOURCES = {
    GivenPressure: PressureFollowsProfile,
    ControlledPressure: PressureFollowsCommands,
    AddedVolume: PressureOfLiquid,
    AddedGas: PressureOfGas,
}
