"""Pressure sources: the stiffness that the time step is built on is -dp/dV of what kernels apply
when the chamber is fullest; and cycles that are over.
"""

import numpy as np
import pytest

from softsim.loads.pressure import AddedGas, AddedVolume, GaugeScale, PrescribedPressure
from softsim.loads.profile import Profile, constant, cycles

FULLEST = 0.7
RAMP = Profile(np.array([0.0, FULLEST, 1.0]), np.array([0.0, 2e-6, 1e-6]))
SOURCES = {
    "liquid": AddedVolume(RAMP, 5e-6, 3e5),
    "gas": AddedGas(RAMP, 5e-6, 2e-6, 287.05 * 293.15, 101325.0),
    "prescribed": PrescribedPressure.at_gauge(constant(1e3, 0.0)),
}


def pressures(source, volumes, t):
    """Pressure [Pa] by the kernel's own function."""
    import taichi as ti

    from softsim.compute import backend

    kernel = source.kernel([source])

    @ti.data_oriented
    class Reading:
        def __init__(self):
            self.volume = ti.field(backend.real, shape=len(volumes))
            self.pressure = ti.field(backend.real, shape=len(volumes))

        @ti.kernel
        def read(self, time: ti.f64):
            for i in self.volume:
                self.pressure[i] = kernel.pressure(0, time, self.volume[i])

    reading = Reading()
    reading.volume.from_numpy(np.asarray(volumes, dtype=float))
    reading.read(t)
    return reading.pressure.to_numpy()


@pytest.mark.parametrize("name", list(SOURCES))
def test_stiffness_is_the_slope_of_the_pressure(fresh_taichi, name):
    """Central difference: error of order step^2, 1e-6 relative at a thousandth of the volume."""
    source, volume, step = SOURCES[name], 6e-6, 6e-9
    low, high = pressures(source, [volume - step, volume + step], FULLEST)
    slope = (low - high) / (2.0 * step)
    assert source.stiffness(volume) == pytest.approx(slope, rel=1e-5, abs=1e-6)


def test_the_chamber_starts_at_ambient_pressure(fresh_taichi):
    for name in ("liquid", "gas"):
        assert pressures(SOURCES[name], [5e-6], 0.0)[0] == pytest.approx(0.0, abs=1e-9)


def test_twice_the_gas_in_the_same_room_has_twice_the_absolute_pressure(fresh_taichi):
    gas = SOURCES["gas"]
    doubled = Profile(np.array([0.0]), np.array([gas.initial_mass]))
    source = AddedGas(doubled, 5e-6, 2e-6, gas.specific_energy, gas.ambient_pressure)
    assert pressures(source, [5e-6], 0.0)[0] == pytest.approx(101325.0, rel=1e-12)


def test_cycles_done():
    """Rises of 1 and 0.5 s, falls of 5 s: over at 6, 11.5 s; a constant pressure has no cycle."""
    profile = cycles(10e3, 10e3, 0.0, 1e3, 5e3, 0.0, 2, 0.0)
    source = PrescribedPressure.at_gauge(profile, GaugeScale(factor=0.5))
    assert [source.cycles_done(t) for t in (0.0, 5.999, 6.0, 11.4, 11.5, 99.0)] == [
        0,
        0,
        1,
        1,
        2,
        2,
    ]
    assert [source.time_scaled(4.0).cycles_done(t) for t in (1.49, 1.5, 2.875)] == [0, 1, 2]
    assert SOURCES["prescribed"].cycles_done(99.0) == 0
