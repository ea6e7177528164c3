"""The air line on chambers that are rigid, or move as they are told, without a mesh."""

import numpy as np
import pytest

from softsim.compute import fields
from softsim.compute.term import present
from softsim.errors import StabilityError
from softsim.loads.air_line import AirLine, Tube
from softsim.loads.pressure import PrescribedPressure
from softsim.loads.profile import Profile

ENERGY = 287.05 * 293.15
AMBIENT = 101325.0
DENSITY = AMBIENT / ENERGY
VISCOSITY = 1.81e-5
LONG = Tube(2.0, 1.2e-3, VISCOSITY)
SHORT = Tube(1e-3, 3e-3, VISCOSITY)
VALVE = DENSITY * 30e-6 / ((AMBIENT + 20e3) ** 2 - AMBIENT**2)


def line(tube, *points, volume=5e-6, line_volume=2e-6, pump=10e-6, stall=1e9):
    """An air line whose sensor is to show what `points` [s, Pa] say; pump: [m^3/s]."""
    profile = Profile(*np.array(points).T)
    return AirLine(
        set_point=PrescribedPressure.at_gauge(profile), initial_volume=volume, volume_ratio=1.0,
        side_volume=0.0, line_volume=line_volume, specific_energy=ENERGY,
        ambient_pressure=AMBIENT, tube=tube, valve=VALVE, pump_flow=DENSITY * pump,
        stall=stall, band=100.0,
    )  # fmt: skip


@pytest.fixture
def course(fresh_taichi):
    """Makes an air line go through increments; `breath` [m^3]: amplitude of the chamber at 5 Hz."""
    import taichi as ti

    from softsim.compute import backend

    @ti.data_oriented
    class Course:
        def __init__(self, source, breath=0.0):
            self.source, self.breath = source, breath
            self.kernel = source.kernel([source])
            self.shown = ti.field(backend.real, shape=())

        @ti.kernel
        def _go(self, first: ti.i32, count: ti.i32, dt: ti.f64, rest: ti.f64, breath: ti.f64):
            ti.loop_config(serialize=True)
            for k in range(first, first + count):
                t = (k + 1) * dt
                volume = rest + breath * ti.sin(31.415926535897932 * t)
                self.shown[None] = self.kernel.pressure(0, t, volume)

        def go(self, count, dt, first=0):
            """Pressure in the chamber [Pa] after `count` increments of `dt` [s]."""
            self._go(first, count, dt, self.source.initial_volume, self.breath)
            return self.shown[None]

        def sensor(self):
            now = present(0, self.kernel.sampled())
            shown = np.array([self.shown[None]])
            return float(self.kernel.readings(now, self.source, shown)["pressure"][0])

        def gas(self):
            masses = (self.kernel.line_mass, self.kernel.chamber_mass)
            return sum(float(fields.read(mass)[0]) for mass in masses)

        def state(self):
            return {name: fields.read(f).copy() for name, f in self.kernel.state_fields().items()}

        def take(self, state):
            for name, field in self.kernel.state_fields().items():
                fields.write(field, state[name])

    return Course


def test_loss_of_hagen_and_poiseuille(course):
    """10 ml/s into a room of 100 l, steady but for its slow rise: the loss is 128 mu L Q / (pi d^4)
    with Q at the mean pressure, 7 kPa over 2 m.
    """
    run = course(line(LONG, (0.0, 50e3), volume=0.1))
    inside = run.go(100_000, 1e-5)
    loss = run.sensor() - inside
    mean = AMBIENT + inside + 0.5 * loss
    flow = 10e-6 * AMBIENT / mean
    assert loss == pytest.approx(128 * VISCOSITY * 2.0 * flow / (np.pi * 1.2e-3**4), rel=1e-4)
    assert loss == pytest.approx(7e3, rel=0.1)


def test_discharge_of_a_rigid_volume(course):
    """Behind a tube that resists nothing, m' = -G (p^2 - p_a^2): p = p_a coth(p_a G R T t / V + c).

    The tube of 1 mm evens out within 2 us, a tenth of the shorter increment, so the error is of
    first order: in each increment the valve sees the line alone, which holds 2 of 7 ml.
    """
    errors = []
    for dt in (4e-5, 2e-5):
        run = course(line(SHORT, (0.0, 20e3), (0.4, 20e3), (0.4001, 0.0)))
        begin, count = round(0.4004 / dt), round(0.1 / dt)
        before = AMBIENT + run.go(begin, dt)
        after = AMBIENT + run.go(count, dt, first=begin)
        rate = AMBIENT * VALVE * ENERGY / 7e-6
        exact = AMBIENT / np.tanh(rate * 0.1 + np.arctanh(AMBIENT / before))
        assert 1e3 < exact - AMBIENT < 0.5 * (before - AMBIENT)
        errors.append((after - exact) / (exact - AMBIENT))
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)
    assert abs(errors[1]) < 2e-3


def test_gas_is_kept(course):
    """Pump off, valve closed, a chamber that breathes: 200,000 increments of round-off."""
    run = course(line(LONG, (0.0, 20e3)), breath=0.5e-6)
    fields.write(run.kernel.line_mass, 3.0 * DENSITY * 2e-6)
    before = run.gas()
    run.go(200_000, 1e-5)
    assert run.gas() == pytest.approx(before, rel=1e-12)


def test_second_order_in_the_increment(course):
    """While the pump runs and the chamber breathes, until 0.1 s."""
    reference, *others = [
        course(line(LONG, (0.0, 90e3)), breath=1e-6).go(count, 0.1 / count)
        for count in (64_000, 500, 1000)
    ]
    coarse, fine = (abs(p - reference) for p in others)
    assert coarse / fine == pytest.approx(4.0, rel=0.1)
    assert fine < 1e-4 * reference


@pytest.mark.parametrize("tube", [LONG, SHORT])
def test_a_moment_goes_on_to_the_same_bits(course, tube):
    """Pump, bounds, valve; stopped where the pump is at work."""
    points = ((0.0, 0.0), (0.3, 10e3), (0.5, 2e3))
    whole = course(line(tube, *points), breath=0.5e-6)
    whole.go(2_000, 1e-4)
    state = whole.state()
    resumed = course(line(tube, *points), breath=0.5e-6)
    resumed.take(state)
    assert resumed.go(4_000, 1e-4, first=2_000) == whole.go(4_000, 1e-4, first=2_000)
    assert resumed.state() == whole.state()


def test_the_sensor_is_kept_within_its_bounds(course):
    """The pump at 10 kPa, the valve down 8 kPa/s; the skin is below the sensor, then above it."""
    run = course(line(LONG, (0.0, 10e3), (1.0, 10e3), (2.0, 2e3)))
    skin = run.go(3_000, 1e-4)
    assert skin < run.sensor() < 10.1e3 + 10.0
    run.go(9_000, 1e-4, first=3_000)
    seen = []
    for first in range(12_000, 20_000, 100):
        run.go(100, 1e-4, first=first)
        seen.append(run.sensor() - run.source.set_point.profile.at(1e-4 * (first + 100)))
    assert max(map(abs, seen)) < 150.0
    assert run.shown[None] > run.sensor()


def test_a_moment_that_comes_twice_passes_once(course):
    run = course(line(LONG, (0.0, 10e3)))
    assert run.go(100, 1e-4) == run.go(1, 1e-4, first=99)


def test_a_chamber_without_room_is_told(course):
    run = course(line(LONG, (0.0, 10e3)))
    with pytest.raises(StabilityError, match="has become zero"):
        run.kernel.refuse(run.source, -AMBIENT - 1.0)
