"""Drives of chambers: the stiffness that the time step is built on is -dp/dV of what the kernels
apply.
"""

import numpy as np
import pytest

from softsim.loads.drive import AddedGas, AddedVolume, GivenPressure
from softsim.loads.profile import Profile, constant

RAMP = Profile(np.array([0.0, 1.0]), np.array([0.0, 2e-6]))
DRIVES = {
    "liquid": AddedVolume(RAMP, 5e-6, 3e5),
    "gas": AddedGas(RAMP, 5e-6, 2e-6, 287.05 * 293.15, 101325.0),
    "given": GivenPressure(constant(1e3, 0.0), constant(1e3, 0.0)),
}


def pressures(drive, volumes, t):
    """Pressure [Pa] by the kernel's own function."""
    import taichi as ti

    from softsim import backend
    from softsim.loads.chamber import SOURCES

    source = SOURCES[type(drive)]([drive])

    @ti.data_oriented
    class Reading:
        def __init__(self):
            self.volume = ti.field(backend.real, shape=len(volumes))
            self.pressure = ti.field(backend.real, shape=len(volumes))

        @ti.kernel
        def read(self, time: ti.f64):
            for i in self.volume:
                self.pressure[i] = source.pressure(0, time, self.volume[i])

    reading = Reading()
    reading.volume.from_numpy(np.asarray(volumes, dtype=float))
    reading.read(t)
    return reading.pressure.to_numpy()


@pytest.mark.parametrize("name", list(DRIVES))
def test_stiffness_is_the_slope_of_the_pressure(cpu, name):
    """Central difference: error of order step^2, 1e-6 relative at a thousandth of the volume."""
    drive, volume, step = DRIVES[name], 6e-6, 6e-9
    low, high = pressures(drive, [volume - step, volume + step], 0.7)
    slope = (low - high) / (2.0 * step)
    assert drive.stiffness(volume, 0.7) == pytest.approx(slope, rel=1e-5, abs=1e-6)


def test_the_chamber_starts_at_ambient_pressure(cpu):
    for name in ("liquid", "gas"):
        assert pressures(DRIVES[name], [5e-6], 0.0)[0] == pytest.approx(0.0, abs=1e-9)


def test_twice_the_gas_in_the_same_room_has_twice_the_absolute_pressure(cpu):
    gas = DRIVES["gas"]
    doubled = Profile(np.array([0.0]), np.array([gas.initial_mass]))
    drive = AddedGas(doubled, 5e-6, 2e-6, gas.specific_energy, gas.ambient_pressure)
    assert pressures(drive, [5e-6], 0.0)[0] == pytest.approx(101325.0, rel=1e-12)
