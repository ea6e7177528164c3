"""A chamber at the end of a tube: pump and valve, a sensor beside them, the tube, the robot.

Two volumes of an ideal gas at one temperature, with absolute pressures p:

    p_1 V_1 = m_1 R T     pump, valve, sensor, half of the tube; V_1 is constant
    p_2 V_2 = m_2 R T     the chamber, half of the tube; V_2 follows the mesh
    dm_1/dt = pump - valve - q,     dm_2/dt = q

    q     = K (p_1^2 - p_2^2),  K = pi d^4 / (256 mu L R T)
    valve = G (p_1^2 - p_a^2) while it is open
    pump  = m_0 (1 - (p_1 - p_a) / p_stall) while it runs, nothing backward

q is the laminar flow of a gas that expands on its way at one temperature: the law of Hagen and
Poiseuille on each piece of the tube, -dp/dx = 128 mu q R T / (pi d^4 p), taken along it.

Pump and valve are either on or off. While the wanted pressure rises, and stays after a rise, the
pump keeps the sensor, p_1, within `band` about it; while that falls, and stays after a fall, the
valve does. Before t = 0 the valve is open, and the gas at ambient pressure.

A short tube is stiff: it evens p_1 and p_2 out within microseconds. So each of the three flows is
solved exactly over an increment, one after another: half the tube's with the chamber as it was,
then the pump's or the valve's, then the other half of the tube's with the chamber as it is (Strang
1968). That is stable for any tube, and of second order in the increment (of first where the tube
evens out within one); what leaves one volume enters the other.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.errors import StabilityError
from softsim.fields import real_field
from softsim.loads.drive import ControlledPressure, GivenPressure
from softsim.loads.pressure_control import Command
from softsim.sharing import Own

Course = GivenPressure | ControlledPressure

PUMP, VALVE = 1.0, -1.0  # what is at work; 0: neither

LAMINAR = 2300.0
"""Reynolds number up to which flow in a tube is laminar (Reynolds 1883)."""


@dataclass(frozen=True)
class Tube:
    """length, bore [m], viscosity of the gas [Pa s]."""

    length: float
    bore: float
    viscosity: float

    def conductance(self, specific_energy: float) -> float:
        """K [kg/(s Pa^2)] for a gas of R T = `specific_energy` [J/kg]."""
        return math.pi * self.bore**4 / (256.0 * self.viscosity * self.length * specific_energy)

    @property
    def volume(self) -> float:
        """Of the gas in it [m^3]."""
        return 0.25 * math.pi * self.bore**2 * self.length

    def reynolds_number(self, flow: float) -> float:
        """4 m / (pi d mu) of a flow [kg/s]."""
        return 4.0 * flow / (math.pi * self.bore * self.viscosity)


@dataclass(frozen=True)
class AirLine:
    """What feeds a chamber through a tube; see above.

    course: what the sensor is to show. initial_volume [m^3]: of the model's chamber at the start;
    the gas has `volume_ratio` times as much room, and `side_volume` beside. line_volume: V_1.
    specific_energy: R T [J/kg]. valve: G [kg/(s Pa^2)]. pump_flow: m_0 [kg/s]. stall, band [Pa].
    """

    course: Course
    initial_volume: Own[float]
    volume_ratio: Own[float]
    side_volume: Own[float]
    line_volume: Own[float]
    specific_energy: Own[float]
    ambient_pressure: Own[float]
    tube: Own[Tube]
    valve: Own[float]
    pump_flow: Own[float]
    stall: Own[float]
    band: Own[float]

    asks_volume = True
    thinning_advice = (
        "the wall of a chamber becomes thinner as the chamber grows: lower the pressures of the "
        "profile"
    )
    stiffens = False  # its stiffness counts on the most that the pump can give
    columns: ClassVar[dict[str, str]] = {
        "wanted_pressure": "Pa",  # at the sensor, whose own is the column pressure
        "air_flow": "m^3/s",  # through the tube into the chamber, as ambient air
        "air_supply": "-",  # at this moment: 1 the pump runs, -1 the valve is open, 0 neither
    }

    @property
    def peak(self) -> str:
        """The highest pressure that the sensor is to show, and the volume of the chamber."""
        return f"{self.course.peak} at the sensor, chamber of {1e6 * self.initial_volume:.4g} ml"

    @property
    def tube_conductance(self) -> float:
        """K [kg/(s Pa^2)]."""
        return self.tube.conductance(self.specific_energy)

    @property
    def ambient_density(self) -> float:
        """Of the gas [kg/m^3]."""
        return self.ambient_pressure / self.specific_energy

    @property
    def last_change(self) -> float:
        """Time [s] at which the time course that is wanted ends."""
        return self.course.last_change

    @property
    def cycle_count(self) -> float:
        """Cycles that are wanted."""
        return self.course.cycle_count

    def cycle_end(self, number: int) -> float:
        """When a wanted cycle ends [s]; number: from 1 to `cycle_count`."""
        return self.course.cycle_end(number)

    def room(self, volume: float) -> float:
        """V_2 [m^3] of the gas where the model's chamber has `volume` [m^3]."""
        return self.volume_ratio * volume + self.side_volume

    def through_tube(self, inside: float, outside: float) -> float:
        """Flow [kg/s] from one overpressure [Pa] to another."""
        absolute = inside + self.ambient_pressure, outside + self.ambient_pressure
        return self.tube_conductance * (absolute[0] ** 2 - absolute[1] ** 2)

    def pumped(self, against: float) -> float:
        """Flow [kg/s] of the running pump against an overpressure [Pa]."""
        return self.pump_flow * max(1.0 - against / self.stall, 0.0)

    def released(self, inside: float) -> float:
        """Flow [kg/s] out of a chamber of this overpressure [Pa] through tube and open valve: K G /
        (K + G) (p^2 - p_a^2), for the squares of pressures are lost one after another.
        """
        return self.through_tube(inside, 0.0) * self.valve / (self.valve + self.tube_conductance)

    def stiffness(self, volume: float) -> float:
        """-dp/dV [Pa/m^3] of gas at the highest pressure that the pump can give."""
        highest = self.ambient_pressure + self.stall
        return self.volume_ratio * highest / self.room(volume)

    def time_scaled(self, factor: float) -> "AirLine":
        """Everything that flows `factor` times as fast, as through a thinner gas."""
        thinner = replace(self.tube, viscosity=self.tube.viscosity / factor)
        return replace(
            self, course=self.course.time_scaled(factor), tube=thinner,
            valve=self.valve * factor, pump_flow=self.pump_flow * factor,
        )  # fmt: skip

    def source(self, alike: Sequence["AirLine"]) -> "AirLineSource":
        """In kernels; alike: this drive in every scenario, this one first."""
        return AirLineSource(alike)


class AirLineSource:
    """The pressure in the chamber, after what has flowed since it was last asked for."""

    asks_volume = True

    def __init__(self, drives: Sequence[AirLine]) -> None:
        self.drives = drives
        courses: list[Any] = [d.course for d in drives]
        self.course: Any = courses[0].source(courses)
        self.volume_ratio = real_field(np.array([d.volume_ratio for d in drives]))
        self.side_volume = real_field(np.array([d.side_volume for d in drives]))
        self.line_volume = real_field(np.array([d.line_volume for d in drives]))
        self.specific_energy = real_field(np.array([d.specific_energy for d in drives]))
        self.ambient = real_field(np.array([d.ambient_pressure for d in drives]))
        self.tube = real_field(np.array([d.tube_conductance for d in drives]))
        self.valve = real_field(np.array([d.valve for d in drives]))
        self.pump_flow = real_field(np.array([d.pump_flow for d in drives]))
        self.stall = real_field(np.array([d.stall for d in drives]))
        self.band = real_field(np.array([d.band for d in drives]))
        density = np.array([d.ambient_density for d in drives])
        self.chamber_room = real_field(np.array([d.room(d.initial_volume) for d in drives]))
        rest = np.zeros(len(drives))
        self.line_mass = real_field(density * [d.line_volume for d in drives])
        self.chamber_mass = real_field(density * [d.room(d.initial_volume) for d in drives])
        self.time, self.wanted, self.falls = (real_field(rest) for _ in range(3))
        self.supply = real_field(rest)

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        own = {
            "line_mass": self.line_mass, "chamber_mass": self.chamber_mass,
            "chamber_room": self.chamber_room, "air_time": self.time, "wanted": self.wanted,
            "falls": self.falls, "supply": self.supply,
        }  # fmt: skip
        return own | self.course.state_fields()

    def follow(self, scenario: int, drive: AirLine) -> None:
        """Take another course in a scenario."""
        self.course.follow(scenario, drive.course)

    def obey(self, scenario: int, command: Command) -> None:
        """Take a new command for the sensor in a scenario, whose course is controlled."""
        self.course.obey(scenario, command)

    @ti.func
    def pressure(self, s, t, volume):
        """Pressure [Pa] over ambient in the chamber at time t; its surface encloses `volume` [m^3].

        A moment that comes twice passes once.
        """
        room = self.volume_ratio[s] * volume + self.side_volume[s]
        wanted = self.course.pressure(s, t, volume)
        if t <= 0.0:
            density = self.ambient[s] / self.specific_energy[s]
            self.line_mass[s] = density * self.line_volume[s]
            self.chamber_mass[s] = density * room
        elif t > self.time[s]:
            elapsed = t - self.time[s]
            self.switch(s, wanted)
            self.pass_tube(s, self.chamber_room[s], 0.5 * elapsed)
            self.pump_or_vent(s, elapsed)
            self.pass_tube(s, room, 0.5 * elapsed)
        self.chamber_room[s] = room
        self.time[s] = ti.max(self.time[s], t)
        return self.chamber_mass[s] * self.specific_energy[s] / room - self.ambient[s]

    @ti.func
    def line_pressure(self, s):
        """p_1 [Pa], absolute."""
        return self.line_mass[s] * self.specific_energy[s] / self.line_volume[s]

    @ti.func
    def switch(self, s, wanted):
        """Pump and valve, on and off at the bounds about the wanted pressure."""
        if wanted > self.wanted[s]:
            self.falls[s] = 0.0
        if wanted < self.wanted[s]:
            self.falls[s] = 1.0
        self.wanted[s] = wanted
        above = self.line_pressure(s) - self.ambient[s] - wanted
        if self.falls[s] == 1.0:
            self.supply[s] = ti.min(self.supply[s], 0.0)
            if above > self.band[s]:
                self.supply[s] = VALVE
            elif above < -self.band[s]:
                self.supply[s] = 0.0
        else:
            self.supply[s] = ti.max(self.supply[s], 0.0)
            if above < -self.band[s]:
                self.supply[s] = PUMP
            elif above > self.band[s]:
                self.supply[s] = 0.0

    @ti.func
    def pass_tube(self, s, room, h):
        """What flows from the line into the chamber within h [s]."""
        energy = self.specific_energy[s]
        line, chamber = energy / self.line_volume[s], energy / room
        inside = self.chamber_mass[s] * chamber
        mass = exchanged(self.tube[s], self.line_pressure(s), inside, line, chamber, h)
        self.line_mass[s] -= mass
        self.chamber_mass[s] += mass

    @ti.func
    def pump_or_vent(self, s, h):
        """What pump and valve change in the line within h [s].

        The pump alone: y = p_stall + p_a - p_1 decays as dy/dt = -(R T / V_1) m_0 y / p_stall.
        """
        line = self.specific_energy[s] / self.line_volume[s]
        if self.supply[s] == PUMP:
            left = ti.max(self.stall[s] + self.ambient[s] - self.line_pressure(s), 0.0)
            decay = 1.0 - ti.exp(-line * self.pump_flow[s] * h / self.stall[s])
            self.line_mass[s] += left * decay / line
        if self.supply[s] == VALVE:
            outside = self.ambient[s]
            released = exchanged(self.valve[s], self.line_pressure(s), outside, line, 0.0, h)
            self.line_mass[s] -= released

    def readings(self, scenario: int, section_pressure: float) -> dict[str, float]:
        """Columns of the history now: what the sensor shows, while `section_pressure` [Pa] acts on
        the skin, and what flows.

        Raises StabilityError where the gas has no room left.
        """
        drive = self.drives[scenario]
        if not section_pressure > -drive.ambient_pressure:
            raise StabilityError(
                "the volume for the gas of the air line has become zero: the chamber has collapsed",
                "its wall is turned inside out or crushed; set dead_volume or reduce "
                "excluded_volume, and look at the last frame",
            )
        mass, wanted, supply = (
            float(fields.read_row(field, scenario))
            for field in (self.line_mass, self.wanted, self.supply)
        )
        sensor = mass * drive.specific_energy / drive.line_volume - drive.ambient_pressure
        flow = drive.through_tube(sensor, section_pressure)
        return {
            "pressure": sensor,
            "wanted_pressure": wanted,
            "air_flow": flow / drive.ambient_density,
            "air_supply": supply,
        }


@ti.func
def exchanged(conductance, p_1, p_2, a_1, a_2, h):
    """Mass [kg] that flows from 1 to 2 within h [s] at C (p_1^2 - p_2^2), exactly.

    a = R T / V [Pa/kg], 0 of the outside. The difference D of the pressures follows Bernoulli's
    equation dD/dt = -D (l + k D) with l = 2 C P (a_1 + a_2), k = C (a_1 - a_2), where P is the
    pressure at which both end; so D(h) = D e / (1 + (k/l) D (1 - e)) with e = exp(-l h).
    """
    both = a_1 + a_2
    difference = p_1 - p_2
    final = (p_1 * a_2 + p_2 * a_1) / both
    decay = ti.exp(-2.0 * conductance * final * both * h)
    skew = (a_1 - a_2) / (2.0 * final * both)
    left = difference * decay / (1.0 + skew * difference * (1.0 - decay))
    return ti.cast((difference - left) / both, backend.real)
