"""Chamber fed through a tube by a pump, with a valve and a pressure sensor at the pump's end.

The model has two volumes of an ideal gas at one temperature, with absolute pressures p:

    p_1 V_1 = m_1 R T     pump, valve, sensor, half of the tube; V_1 is constant
    p_2 V_2 = m_2 R T     the chamber, half of the tube; V_2 follows the mesh
    dm_1/dt = pump - valve - q,     dm_2/dt = q

    q     = K (p_1^2 - p_2^2),  K = pi d^4 / (256 mu L R T)
    valve = G (p_1^2 - p_a^2) while it is open
    pump  = m_0 (1 - (p_1 - p_a) / p_stall) while it runs, never backwards

q is the laminar flow of a gas that expands isothermally along the tube: the law of Hagen and
Poiseuille for each piece of the tube, -dp/dx = 128 mu q R T / (pi d^4 p), integrated over its
length.

Pump and valve are either on or off. While the wanted pressure rises, and after a rise, the pump
keeps the sensor pressure p_1 within `band` of it; while it falls, and after a fall, the valve does.
Before t = 0 the valve is open and the gas is at ambient pressure.

A short tube is stiff: it equalises p_1 and p_2 within microseconds. Each of the three flows is
therefore solved exactly over an increment, in a symmetric splitting: half of the tube's flow with
the previous volume of the chamber, then the flow of the pump or the valve, then the other half of
the tube's flow with the present volume (Strang 1968). The scheme is stable for any tube and of
second order in the increment (of first order where the tube equalises within one increment); mass
is conserved.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import real_field
from softsim.compute.term import PerScenario, Samples
from softsim.errors import StabilityError
from softsim.loads.pressure import VOLUME_COLUMN, PrescribedPressure, PressureKernel, PressureSource
from softsim.loads.pressure_control import ControlledPressure, EventCycles, PressureRamp
from softsim.loads.profile import Cycle, Profile

Quantity = TypeVar("Quantity", float, np.ndarray)
SetPoint = PrescribedPressure | ControlledPressure

PUMP, VALVE = 1.0, -1.0  # what is at work; 0: neither

LAMINAR = 2300.0
"""Reynolds number up to which flow in a tube is laminar (Reynolds 1883)."""


@dataclass(frozen=True)
class Tube:
    """Tube with its length and bore [m] and the viscosity of the gas [Pa s]."""

    length: float
    bore: float
    viscosity: float

    def conductance(self, specific_energy: float) -> float:
        """Return K [kg/(s Pa^2)] for a gas of R T = `specific_energy` [J/kg]."""
        return math.pi * self.bore**4 / (256.0 * self.viscosity * self.length * specific_energy)

    @property
    def volume(self) -> float:
        """Volume of the gas in the tube [m^3]."""
        return 0.25 * math.pi * self.bore**2 * self.length

    def reynolds_number(self, flow: float) -> float:
        """Return the Reynolds number 4 m / (pi d mu) of a mass flow m [kg/s]."""
        return 4.0 * flow / (math.pi * self.bore * self.viscosity)


@dataclass(frozen=True)
class AirLine(PressureSource):
    """Air supply of a chamber through a tube; the module docstring states the equations.

    set_point: pressure that the sensor should show, over time. initial_volume [m^3]: volume
    of the model's chamber at the start; the gas fills `volume_ratio` times the chamber volume plus
    `side_volume` [m^3]. line_volume: V_1 [m^3]. specific_energy: R T [J/kg]. valve: G [kg/(s
    Pa^2)]. pump_flow: m_0 [kg/s]. stall, band [Pa].
    """

    set_point: SetPoint
    initial_volume: PerScenario[float]
    volume_ratio: PerScenario[float]
    side_volume: PerScenario[float]
    line_volume: PerScenario[float]
    specific_energy: PerScenario[float]
    ambient_pressure: PerScenario[float]
    tube: PerScenario[Tube]
    valve: PerScenario[float]
    pump_flow: PerScenario[float]
    stall: PerScenario[float]
    band: PerScenario[float]

    needs_volume = True
    thinning_advice = (
        "the wall of a chamber becomes thinner as the chamber grows: lower the pressures of the "
        "profile"
    )

    @property
    def columns(self) -> dict[str, str]:
        return (
            self.set_point.columns
            | VOLUME_COLUMN
            | {
                "wanted_pressure": "Pa",  # at the sensor, whose own is the column pressure
                "air_flow": "m^3/s",  # through the tube into the chamber, as ambient air
                "air_supply": "-",  # 1: the pump runs, -1: the valve is open, 0: neither
            }
        )

    @property
    def control(self) -> EventCycles | None:
        return self.set_point.control

    @property
    def pressure_cycles(self) -> list[Cycle]:
        return self.set_point.pressure_cycles

    @property
    def gas_outside(self) -> float:
        return self.side_volume + self.line_volume

    @property
    def peak(self) -> str:
        """Highest pressure that the sensor should show, and the volume of the chamber, as text."""
        return f"{self.set_point.peak} at the sensor, chamber of {1e6 * self.initial_volume:.4g} ml"

    @property
    def tube_conductance(self) -> float:
        """Conductance K of the tube [kg/(s Pa^2)]."""
        return self.tube.conductance(self.specific_energy)

    @property
    def ambient_density(self) -> float:
        """Density of the gas at ambient pressure [kg/m^3]."""
        return self.ambient_pressure / self.specific_energy

    @property
    def value_range(self) -> tuple[float, float]:
        return self.set_point.value_range

    @property
    def last_change(self) -> float:
        return self.set_point.last_change

    @property
    def cycle_count(self) -> float:
        return self.set_point.cycle_count

    def cycle_end(self, number: int) -> float:
        return self.set_point.cycle_end(number)

    def cycles_done(self, time: float) -> int:
        return self.set_point.cycles_done(time)

    def value_at(self, time: float) -> float:
        return self.set_point.value_at(time)

    def with_profile(self, profile: Profile) -> "AirLine":
        return replace(self, set_point=self.set_point.with_profile(profile))

    def room(self, volume: float) -> float:
        """Return the gas volume V_2 [m^3] for a `volume` [m^3] of the model's chamber."""
        return self.volume_ratio * volume + self.side_volume

    def through_tube(self, inside: Quantity, outside: Quantity) -> Quantity:
        """Return the flow [kg/s] through the tube from one overpressure [Pa] to another."""
        absolute = inside + self.ambient_pressure, outside + self.ambient_pressure
        return self.tube_conductance * (absolute[0] ** 2 - absolute[1] ** 2)

    def pumped(self, against: float) -> float:
        """Return the flow [kg/s] of the running pump against an overpressure [Pa]."""
        return self.pump_flow * max(1.0 - against / self.stall, 0.0)

    def released(self, inside: float) -> float:
        """Return the flow [kg/s] out of a chamber of this overpressure [Pa].

        It passes the tube and the open valve and is K G / (K + G) (p^2 - p_a^2): the differences of
        squared pressures across tube and valve add up.
        """
        return self.through_tube(inside, 0.0) * self.valve / (self.valve + self.tube_conductance)

    def stiffness(self, volume: float) -> float:
        """Return -dp/dV [Pa/m^3] of the gas at the highest pressure that the pump can reach."""
        highest = self.ambient_pressure + self.stall
        return self.volume_ratio * highest / self.room(volume)

    def time_scaled(self, factor: float) -> "AirLine":
        """Return the line with all flows `factor` times as fast, as with a less viscous gas."""
        thinner = replace(self.tube, viscosity=self.tube.viscosity / factor)
        return replace(
            self, set_point=self.set_point.time_scaled(factor), tube=thinner,
            valve=self.valve * factor, pump_flow=self.pump_flow * factor,
        )  # fmt: skip

    def warnings(self) -> dict[str, str]:
        return dict(line_warnings(self))

    def kernel(self, scenarios: Sequence["AirLine"]) -> "AirLineKernel":
        return AirLineKernel(scenarios)


class AirLineKernel(PressureKernel):
    """Kernel class of an air line: it integrates the flows since its last evaluation."""

    def __init__(self, sources: Sequence[AirLine]) -> None:
        set_points: list[Any] = [one.set_point for one in sources]
        self.set_point: Any = set_points[0].kernel(set_points)
        self.volume_ratio = real_field(np.array([one.volume_ratio for one in sources]))
        self.side_volume = real_field(np.array([one.side_volume for one in sources]))
        self.line_volume = real_field(np.array([one.line_volume for one in sources]))
        self.specific_energy = real_field(np.array([one.specific_energy for one in sources]))
        self.ambient = real_field(np.array([one.ambient_pressure for one in sources]))
        self.tube = real_field(np.array([one.tube_conductance for one in sources]))
        self.valve = real_field(np.array([one.valve for one in sources]))
        self.pump_flow = real_field(np.array([one.pump_flow for one in sources]))
        self.stall = real_field(np.array([one.stall for one in sources]))
        self.band = real_field(np.array([one.band for one in sources]))
        density = np.array([one.ambient_density for one in sources])
        self.chamber_room = real_field(np.array([one.room(one.initial_volume) for one in sources]))
        rest = np.zeros(len(sources))
        self.line_mass = real_field(density * [one.line_volume for one in sources])
        self.chamber_mass = real_field(density * [one.room(one.initial_volume) for one in sources])
        self.time, self.wanted, self.falls = (real_field(rest) for _ in range(3))
        self.supply = real_field(rest)

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        own = {
            "line_mass": self.line_mass, "chamber_mass": self.chamber_mass,
            "chamber_room": self.chamber_room, "air_time": self.time, "wanted": self.wanted,
            "falls": self.falls, "supply": self.supply,
        }  # fmt: skip
        return own | self.set_point.state_fields()

    def follow(self, scenario: int, source: AirLine) -> None:
        """Replace the profile of the set point of a scenario."""
        self.set_point.follow(scenario, source.set_point)

    def set_ramp(self, scenario: int, ramp: PressureRamp) -> None:
        """Replace the ramp of the set point of a scenario that is controlled by events."""
        self.set_point.set_ramp(scenario, ramp)

    @ti.func
    def pressure(self, s, t, volume):
        """Return the pressure [Pa] above ambient in a chamber of `volume` [m^3] at time t.

        A second evaluation at the same time does not integrate the flows again.
        """
        room = self.volume_ratio[s] * volume + self.side_volume[s]
        wanted = self.set_point.pressure(s, t, volume)
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
        """Return the absolute pressure p_1 [Pa]."""
        return self.line_mass[s] * self.specific_energy[s] / self.line_volume[s]

    @ti.func
    def switch(self, s, wanted):
        """Switch pump and valve on or off at the bounds around the wanted pressure."""
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
        """Move the mass that flows from the line into the chamber within h [s]."""
        energy = self.specific_energy[s]
        line, chamber = energy / self.line_volume[s], energy / room
        inside = self.chamber_mass[s] * chamber
        mass = exchanged(self.tube[s], self.line_pressure(s), inside, line, chamber, h)
        self.line_mass[s] -= mass
        self.chamber_mass[s] += mass

    @ti.func
    def pump_or_vent(self, s, h):
        """Update the mass in the line by the flow of the pump or the valve within h [s].

        With the pump alone y = p_stall + p_a - p_1 decays as dy/dt = -(R T / V_1) m_0 y / p_stall.
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

    def refuse(self, source: PressureSource, section_pressure: float) -> None:
        """Raise StabilityError if no volume is left for the gas."""
        if not section_pressure > -source.ambient_pressure:
            raise StabilityError(
                "the volume for the gas of the air line has become zero: the chamber has collapsed",
                "its wall is turned inside out or crushed; set dead_volume or reduce "
                "excluded_volume, and look at the last frame",
            )

    def sampled(self) -> list[ti.Field]:
        return [self.line_mass, self.wanted, self.supply]

    def readings(
        self, samples: Samples, source: PressureSource, section_pressure: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Return the history columns (rows,) of the line.

        These are the sensor and the wanted pressure, the air flow, and the state of pump and valve,
        while `section_pressure` (rows,) [Pa] acts on the skin.
        """
        assert isinstance(source, AirLine)
        mass, wanted, supply = map(samples.read, self.sampled())
        sensor = mass * source.specific_energy / source.line_volume - source.ambient_pressure
        flow = source.through_tube(sensor, section_pressure)
        return {
            "pressure": sensor,
            "wanted_pressure": wanted,
            "air_flow": flow / source.ambient_density,
            "air_supply": supply,
        }


def line_warnings(line: AirLine) -> Iterator[tuple[str, str]]:
    """Return the kind and text of each warning of an air line: too little or turbulent flow."""
    ml = 1e6 / line.ambient_density  # kg to ml of ambient air
    reynolds = line.tube.reynolds_number(line.pump_flow)
    if reynolds > LAMINAR:
        yield (
            "flow",
            f"at {ml * line.pump_flow:.3g} ml/s the flow in the tube has a Reynolds number of "
            f"{reynolds:.0f}; above {LAMINAR:.0f} it is no longer laminar, and the real "
            "pressure loss is larger than the computed one",
        )
    highest, fall, lowest = line.set_point.extremes
    passed, pumped = line.through_tube(highest, 0.0), line.pumped(highest)
    if passed < pumped:
        yield (
            "pump",
            f"at {1e-3 * highest:.4g} kPa the tube passes {ml * passed:.3g} ml/s into an empty "
            f"chamber, and the pump delivers {ml * pumped:.3g} ml/s: the sensor reaches the "
            "highest pressure long before the chamber does, and the pump switches on and "
            "off; use a wider or shorter tube, or a smaller pump",
        )
    least = fall * line.room(line.initial_volume) / line.specific_energy
    released = line.released(lowest + line.band)
    if released < least:
        yield (
            "valve",
            f"a fall of {1e-3 * fall:.3g} kPa/s needs at least {ml * least:.3g} ml/s, but at "
            f"{1e-3 * lowest:.4g} kPa the tube and the open valve release {ml * released:.3g} "
            "ml/s: the pressure will fall more slowly, with the valve open",
        )


@ti.func
def exchanged(conductance, p_1, p_2, a_1, a_2, h):
    """Return the exact mass [kg] that flows from 1 to 2 within h [s] at the rate C (p_1^2 - p_2^2).

    a = R T / V [Pa/kg], 0 for the surroundings. The pressure difference D follows Bernoulli's
    equation dD/dt = -D (l + k D) with l = 2 C P (a_1 + a_2), k = C (a_1 - a_2), where P is the
    final common pressure; so D(h) = D e / (1 + (k/l) D (1 - e)) with e = exp(-l h).
    """
    both = a_1 + a_2
    difference = p_1 - p_2
    final = (p_1 * a_2 + p_2 * a_1) / both
    decay = ti.exp(-2.0 * conductance * final * both * h)
    skew = (a_1 - a_2) / (2.0 * final * both)
    left = difference * decay / (1.0 + skew * difference * (1.0 - decay))
    return ti.cast((difference - left) / both, backend.real)
