"""Ramps as the kernel reads them: before they begin, on their way, at their target."""

import numpy as np
import pytest

from softsim.loads.pressure_control import ControlledPressure, EventCycles, PressureRamp

CYCLES = EventCycles(
    highest=8e3, lowest=2e3, inflation_rate=10e3, deflation_rate=5e3, start=0.1, hold=0.1,
    contact_rows=2, contact_force=1.0, contact_window=0.02, least_rows=1,
    motion_speed=20e-3, slip_speed=20e-3, motion_window=0.2, count=None,
)  # fmt: skip


@pytest.fixture
def kernel(fresh_taichi):
    """Of two scenarios."""

    return ControlledPressure(CYCLES).kernel([ControlledPressure(CYCLES)] * 2)


def pressures(kernel, scenario, times):
    """Pressure [Pa] by the kernel's own function."""
    import taichi as ti

    from softsim.compute.fields import read, real_field

    @ti.data_oriented
    class Reading:
        def __init__(self):
            self.time = real_field(np.array(times))
            self.pressure = real_field(np.zeros(len(times)))

        @ti.kernel
        def look(self, s: ti.i32):
            for i in self.time:
                self.pressure[i] = kernel.pressure(s, self.time[i], 0.0)

    reading = Reading()
    reading.look(scenario)
    return read(reading.pressure)


def test_the_first_inflation(kernel):
    """From nothing at 0.1 s, 10 kPa/s, up to 8 kPa."""
    found = pressures(kernel, 1, [0.0, 0.1, 0.2, 0.85, 0.9, 5.0])
    np.testing.assert_allclose(found, [0.0, 0.0, 1e3, 7.5e3, 8e3, 8e3], rtol=1e-12)


def test_each_scenario_follows_its_own_ramp(kernel):
    """A fall from 6 kPa that is held until 1 s; a pressure that stays."""
    kernel.set_ramp(0, PressureRamp(6e3, 1.0, -5e3, 2e3))
    kernel.set_ramp(1, PressureRamp(3e3, 0.5, 0.0, 3e3))
    times = [0.0, 1.0, 1.4, 1.8, 9.0]
    fall, rest = pressures(kernel, 0, times), pressures(kernel, 1, times)
    np.testing.assert_allclose(fall, [6e3, 6e3, 4e3, 2e3, 2e3], rtol=1e-12)
    assert (fall[0], fall[-1], set(rest)) == (6e3, 2e3, {3e3})  # to the last bit


def test_ramps_are_stored(kernel):
    from softsim.compute.fields import read

    kernel.set_ramp(0, PressureRamp(6e3, 1.0, -5e3, 2e3))
    kernel.set_ramp(1, PressureRamp(3e3, 0.5, 0.0, 4e3))
    kept = {name: read(field).tolist() for name, field in kernel.state_fields().items()}
    assert kept == {
        "command_pressure": [6e3, 3e3], "command_time": [1.0, 0.5],
        "command_rate": [-5e3, 0.0], "command_target": [2e3, 4e3],
    }  # fmt: skip
