"""Pressure cycle controlled by events, like the closed loop of the robot.

A robot in a pipe stands still while it is pressed against the wall, walks while the pressure falls
from P_M3^B to P_M3^S, and stops there, where the next inflation begins (thesis 4.2.1, 6.3). Both
pressures depend on the pipe, so no fixed profile serves a path whose diameter changes. The phases
are

    inflation  until the wall presses back (at least `contact_rows` rows of spikes touch and the
               walls' normal force is at least `contact_force`), at most up to `highest`;
    hold       for a given time;
    deflation  until motion has stopped (forward faster than `motion_speed` before, slower now),
               or the robot slips back at `slip_speed`, or contact is lost (`least_rows` rows
               touched before, fewer do now), at most down to `lowest`.

A deflation ends when motion or contact that existed earlier in the same deflation is lost; a robot
that stands still at its beginning, or never had contact, does not end it. A robot that never moves
is inflated again at `lowest`. Contact ends an inflation only above `lowest`, so that the deflation
after it has a range. Forward is the direction of the frame's own axis, which turns with the robot
in a bend.

A motor shakes the robot 100 to 200 times a second, so no decision depends on a single instant. Over
`contact_window` the force is averaged and the largest number of rows counts. The velocity is taken
over `motion_window` as the slope of a straight line fitted to the positions,

    v = sum (t - mean t) x / sum (t - mean t)^2,

which averages the vibration; its component along the axis counts. Windows restart with each phase.
"""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any

import numpy as np
import taichi as ti

from softsim.compute import fields
from softsim.compute.fields import real_field
from softsim.compute.term import PerScenario
from softsim.loads.pressure import PressureKernel, PressureSource
from softsim.loads.profile import Profile


class Phase(IntEnum):
    """Phase of the pressure cycle; the value is the number in the history."""

    REST = 0  # before the first inflation, and after the last cycle
    INFLATION = 1
    HOLD = 2
    DEFLATION = 3


@dataclass(frozen=True)
class PressureRamp:
    """Pressure ramp p(t) = pressure + rate (t - time).

    It is constant before `time` and after reaching `target`. Units: pressure, target [Pa], time
    [s], rate [Pa/s].
    """

    pressure: float
    time: float
    rate: float
    target: float


@dataclass(frozen=True)
class EventCycles:
    """Settings: pressures [Pa], rates [Pa/s], times and windows [s], force [N], speed [m/s].

    count: number of cycles, after which the pressure stays constant; None: no limit.
    """

    highest: float
    lowest: float
    inflation_rate: float
    deflation_rate: float
    start: float
    hold: float
    contact_rows: int
    contact_force: float
    contact_window: float
    least_rows: int
    motion_speed: float
    slip_speed: float
    motion_window: float
    count: int | None

    def first_ramp(self) -> PressureRamp:
        """Return the ramp of the first inflation, from 0 Pa."""
        return PressureRamp(0.0, self.start, self.inflation_rate, self.highest)

    def time_scaled(self, factor: float) -> "EventCycles":
        """Return the settings `factor` times as fast.

        The speeds of the robot are unchanged.
        """
        return replace(
            self,
            inflation_rate=self.inflation_rate * factor,
            deflation_rate=self.deflation_rate * factor,
            start=self.start / factor,
            hold=self.hold / factor,
            contact_window=self.contact_window / factor,
            motion_window=self.motion_window / factor,
        )


@dataclass(frozen=True)
class ControlledPressure(PressureSource):
    """Pressure on the facets that a control by events sets."""

    settings: PerScenario[EventCycles]

    @property
    def columns(self) -> dict[str, str]:
        return {"cycle": "-", "phase": "-"}  # from 1; loads/pressure_control.Phase

    @property
    def control(self) -> EventCycles:
        return self.settings

    @property
    def extremes(self) -> tuple[float, float, float]:
        """Highest pressure [Pa], steepest fall [Pa/s] and the pressure at its end [Pa]."""
        return self.settings.highest, self.settings.deflation_rate, self.settings.lowest

    @property
    def highest(self) -> float:
        """Highest pressure [Pa] that a gauge should ever show."""
        return self.settings.highest

    @property
    def peak(self) -> str:
        """Highest pressure of the control, as text."""
        return f"up to {1e-3 * self.settings.highest:.4g} kPa"

    @property
    def value_range(self) -> tuple[float, float]:
        return self.settings.lowest, self.settings.highest

    @property
    def last_change(self) -> float:
        rules = self.settings
        rise = rules.highest / rules.inflation_rate
        fall = (rules.highest - rules.lowest) / rules.deflation_rate
        return rules.start + rise + rules.hold + fall

    @property
    def cycle_count(self) -> float:
        return math.inf if self.settings.count is None else self.settings.count

    def cycle_end(self, number: int) -> float:
        return math.inf

    def cycles_done(self, time: float) -> int:
        """Return 0: the control counts its cycles (run/control.py)."""
        return 0

    def value_at(self, time: float) -> float:
        """Return NaN: the pressure is not known in advance."""
        return math.nan

    def with_profile(self, profile: Profile) -> "ControlledPressure":
        """Return the source itself: ramps (`set_ramp`) change its pressure."""
        return self

    def time_scaled(self, factor: float) -> "ControlledPressure":
        return ControlledPressure(self.settings.time_scaled(factor))

    def kernel(self, scenarios: Sequence["ControlledPressure"]) -> "ControlledPressureKernel":
        return ControlledPressureKernel(scenarios)


class ControlledPressureKernel(PressureKernel):
    """Kernel class of a controlled pressure.

    p(t) = p_0 + r (t - t_0), between p_0 and the target of the ramp.

    Each scenario has one ramp; the host replaces it between two blocks of increments.
    """

    def __init__(self, sources: Sequence[ControlledPressure]) -> None:
        first = columns([one.settings.first_ramp() for one in sources])
        self.ramp = {name: real_field(values) for name, values in first.items()}
        self.begin_pressure, self.begin_time = self.ramp["pressure"], self.ramp["time"]
        self.rate, self.target = self.ramp["rate"], self.ramp["target"]

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores: the ramps."""
        return {f"command_{name}": field for name, field in self.ramp.items()}

    def follow(self, scenario: int, source: ControlledPressure) -> None:
        """Do nothing: the ramp of a scenario is part of the state."""

    def set_ramp(self, scenario: int, ramp: PressureRamp) -> None:
        """Replace the ramp of a scenario."""
        for name, value in dataclasses.asdict(ramp).items():
            fields.write_row(self.ramp[name], scenario, value)

    @ti.func
    def pressure(self, s, t, volume):
        """Return the pressure [Pa] at time t."""
        begin, target = self.begin_pressure[s], self.target[s]
        value = begin + self.rate[s] * (t - self.begin_time[s])
        return ti.min(ti.max(value, ti.min(begin, target)), ti.max(begin, target))


def columns(ramps: list[PressureRamp]) -> dict[str, np.ndarray]:
    """Return the values (scenarios,) of each field of the ramps, by the name of the field."""
    names = [f.name for f in dataclasses.fields(PressureRamp)]
    return {name: np.array([getattr(r, name) for r in ramps]) for name in names}


@dataclass(frozen=True)
class Sensed:
    """Measured state of the robot at `time` [s].

    pressure [Pa]: present value. rows: number of rows of spikes that touched, and wall_force [N]:
    mean normal force of the walls, both since the last measurement. place [m]: position of the
    frame. axis: unit vector along its axis, forward.
    """

    time: float
    pressure: float
    rows: float
    wall_force: float
    place: tuple[float, ...]
    axis: tuple[float, ...]


@dataclass(frozen=True)
class Decision:
    """New ramp and the reason for it, as text."""

    ramp: PressureRamp
    reason: str


@dataclass
class ControlState:
    """State of a pressure control.

    phase: INFLATION, DEFLATION or, after the last cycle, REST; it begins at `since` [s], which may
    be in the future. felt: measurements of this phase, over the longest window. has_moved,
    has_touched: in this deflation.
    """

    phase: Phase
    since: float
    cycles_done: int = 0
    has_moved: bool = False
    has_touched: bool = False
    felt: list[Sensed] = field(default_factory=list)

    @classmethod
    def written(cls, numbers: dict[str, Any]) -> "ControlState":
        """Return the state from the dictionary that `dataclasses.asdict` and JSON made of it."""
        felt = [
            Sensed(**{**s, "place": tuple(s["place"]), "axis": tuple(s["axis"])})
            for s in numbers["felt"]
        ]
        return cls(**{**numbers, "phase": Phase(numbers["phase"]), "felt": felt})


class PressureControl:
    """Controller that decides on the next phase of the pressure.

    state: changed in place; by default the state at the start.
    """

    def __init__(self, settings: EventCycles, state: ControlState | None = None) -> None:
        self.settings = settings
        self.state = state or ControlState(Phase.INFLATION, settings.start)

    def phase_at(self, time: float) -> Phase:
        """Return the phase at `time` [s], which is not before the last decision."""
        if time >= self.state.since:
            return self.state.phase
        return Phase.HOLD if self.state.phase is Phase.DEFLATION else Phase.REST

    @property
    def cycle(self) -> int:
        """Number of the present cycle, from 1; that of the last one once all are done."""
        return self.state.cycles_done + (self.state.phase is not Phase.REST)

    def sense(self, now: Sensed) -> Decision | None:
        """Record a measurement; return a decision if it changes the pressure ramp, else None."""
        if now.time < self.state.since:
            return None
        self._remember(now)
        if self.state.phase is Phase.INFLATION:
            return self._while_inflating(now)
        if self.state.phase is Phase.DEFLATION:
            return self._while_deflating(now)
        return None

    def _while_inflating(self, now: Sensed) -> Decision | None:
        if now.pressure > self.settings.lowest and self._contact_is_made():
            return self._deflate(now, "contact is made")
        if now.pressure >= self.settings.highest:
            return self._deflate(now, "the pressure is the highest")
        return None

    def _while_deflating(self, now: Sensed) -> Decision | None:
        speed = self._forward_speed()
        if speed <= -self.settings.slip_speed:
            return self._end_cycle(now, "it slips back")
        if self._motion_has_stopped(speed):
            return self._end_cycle(now, "motion has stopped")
        if self._contact_is_lost():
            return self._end_cycle(now, "contact is lost")
        if now.pressure <= self.settings.lowest:
            return self._end_cycle(now, "the pressure is the lowest")
        return None

    def _contact_is_made(self) -> bool:
        felt = self._since(self.settings.contact_window)[1:]
        if not felt:
            return False
        force = sum(s.wall_force for s in felt) / len(felt)
        rows = max(s.rows for s in felt)
        return rows >= self.settings.contact_rows and force >= self.settings.contact_force

    def _contact_is_lost(self) -> bool:
        least = self.settings.least_rows
        self.state.has_touched |= self.state.felt[-1].rows >= least
        felt = self._since(self.settings.contact_window)[1:]
        return self.state.has_touched and bool(felt) and max(s.rows for s in felt) < least

    def _forward_speed(self) -> float:
        """Return the forward speed over the motion window [m/s]; 0 while the phase is younger."""
        felt = self._since(self.settings.motion_window)
        return forward_speed(felt) if felt else 0.0

    def _motion_has_stopped(self, speed: float) -> bool:
        moves = speed >= self.settings.motion_speed
        self.state.has_moved |= moves
        return self.state.has_moved and not moves

    def _deflate(self, now: Sensed, reason: str) -> Decision:
        begin = now.time + self.settings.hold
        rate = -self.settings.deflation_rate
        self._enter(Phase.DEFLATION, begin)
        return Decision(PressureRamp(now.pressure, begin, rate, self.settings.lowest), reason)

    def _end_cycle(self, now: Sensed, reason: str) -> Decision:
        self.state.cycles_done += 1
        if self.state.cycles_done == self.settings.count:
            self._enter(Phase.REST, now.time)
            return Decision(PressureRamp(now.pressure, now.time, 0.0, now.pressure), reason)
        self._enter(Phase.INFLATION, now.time)
        rate = self.settings.inflation_rate
        return Decision(PressureRamp(now.pressure, now.time, rate, self.settings.highest), reason)

    def _enter(self, phase: Phase, since: float) -> None:
        state = self.state
        state.phase, state.since = phase, since
        state.has_moved = state.has_touched = False
        state.felt.clear()

    def _remember(self, now: Sensed) -> None:
        """Store the measurement, and drop those that the longest window does not need.

        The last one before the window is kept.
        """
        felt = self.state.felt
        felt.append(now)
        begin = now.time - max(self.settings.contact_window, self.settings.motion_window)
        while len(felt) > 1 and felt[1].time <= begin:
            felt.pop(0)

    def _since(self, window: float) -> list[Sensed]:
        """Return the measurements of the last `window` [s], preceded by the last one before it.

        The list is empty while the phase is younger than the window.
        """
        felt = self.state.felt
        before = [k for k, s in enumerate(felt) if s.time <= felt[-1].time - window]
        return felt[before[-1] :] if before else []


def forward_speed(felt: Sequence[Sensed]) -> float:
    """Return the mean velocity [m/s] along the axis of the last measurement, by least squares.

    felt: two measurements or more.
    """
    middle = sum(s.time for s in felt) / len(felt)
    spread = sum((s.time - middle) ** 2 for s in felt)
    moments = (
        (s.time - middle) * place * along
        for s in felt
        for place, along in zip(s.place, felt[-1].axis, strict=True)
    )
    return sum(moments) / spread
