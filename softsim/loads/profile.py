"""Value over time as a table of points, linear in between and constant after the last."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute.fields import index_field, real_field, shape_of, write_row
from softsim.compute.term import PerScenario
from softsim.errors import SimulationError
from softsim.scene.names import Names
from softsim.scene.profiles import (
    Constant,
    CyclesProfile,
    NaturalDeflationProfile,
    PeriodicCycles,
    Ramp,
    Sine,
    SmoothStep,
    TableSpec,
)
from softsim.scene.quantities import Spec
from softsim.scene.text import Keys

# Points a time constant on an exponential: the chord is off by at most 1/(8 n^2), 2e-5 of it.
POINTS_PER_TIME_CONSTANT = 80
# Points of a period: the chord is off by at most (2 pi/n)^2/8, 5e-5 of the amplitude.
POINTS_PER_PERIOD = 320
# Of a period: corners of a cycle that are no farther apart are one.
ROUND_OFF = 1e-9
# Points of a smooth rise: the chord is off by at most 6/(8 n^2), 1e-5 of it.
RISE_POINTS = 257
# Distance of a parabola, which a ramp of velocity gives, from its chords, over the range of values.
CHORD_ERROR = 1e-5


@dataclass(frozen=True)
class Profile:
    """Piecewise linear function of time: increasing times [s] and the values there."""

    times: PerScenario[np.ndarray]
    values: PerScenario[np.ndarray]

    def at(self, t: float | np.ndarray) -> np.ndarray:
        """Return the value at time t [s]."""
        return np.interp(t, self.times, self.values)

    def time_scaled(self, factor: float) -> "Profile":
        """Return the same values, with all times divided by `factor`."""
        return Profile(self.times / factor, self.values)

    def delayed(self, by: float) -> "Profile":
        """Return the same values, later `by` a time [s]."""
        return Profile(self.times + by, self.values)

    def times_factor(self, factor: float) -> "Profile":
        """Return the profile with all values multiplied by a factor."""
        return Profile(self.times, factor * self.values)

    def integrated(self, end: float) -> "Profile":
        """Return the integral over time from zero at t = 0, up to `end` [s].

        It is exact at its points, which lie so close that chords are off by CHORD_ERROR of the
        whole range at most.
        """
        times = np.unique(np.concatenate([self.times, [0.0, end]]))
        way = self._areas(times)
        bulge = 0.125 * np.abs(np.diff(self.at(times))) * np.diff(times)
        allowed = CHORD_ERROR * np.ptp(way)
        parts = np.ones(len(bulge), dtype=int)
        if allowed > 0.0:
            parts = np.maximum(1, np.ceil(np.sqrt(bulge / allowed)).astype(int))
        piece = np.repeat(np.arange(len(parts)), parts)
        number = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
        within = times[piece] + np.diff(times)[piece] * number / parts[piece]
        fine = np.append(within, times[-1])
        return Profile(fine, self._areas(fine))

    def _areas(self, times: np.ndarray) -> np.ndarray:
        """Return the integral from times[0] to each of `times`, which hold all points between."""
        values = self.at(times)
        steps = 0.5 * (values[1:] + values[:-1]) * np.diff(times)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def translated(self, scale: np.ndarray) -> "Profile":
        """Return the profile with its values mapped by a piecewise linear scale (k, 2).

        The scale is a rising table of value and mapped value, extrapolated beyond its last two
        points. Times at which a point of the scale is passed are added.
        """
        here, there = scale.T
        times = [self.times]
        for value in here:
            before, after = self.values[:-1] - value, self.values[1:] - value
            passed = before * after < 0.0
            share = before[passed] / (before[passed] - after[passed])
            times.append(self.times[:-1][passed] + share * np.diff(self.times)[passed])
        at = np.sort(np.concatenate(times), kind="stable")
        values = self.at(at)
        slope = (there[-1] - there[-2]) / (here[-1] - here[-2])
        beyond = np.maximum(values - here[-1], 0.0)
        return Profile(at, np.interp(values, here, there) + slope * beyond)

    def reduced(self, factor: float, offset: float) -> "Profile":
        """Return factor times (value - offset), not below zero; adds the points where it starts."""
        excess = self.values - offset
        before, after = excess[:-1], excess[1:]
        crossed = before * after < 0.0
        share = before[crossed] / (before[crossed] - after[crossed])
        crossings = self.times[:-1][crossed] + share * np.diff(self.times)[crossed]
        times = np.concatenate([self.times, crossings])
        values = np.concatenate([factor * np.maximum(excess, 0.0), np.zeros(len(crossings))])
        order = np.argsort(times, kind="stable")
        return Profile(times[order], values[order])


def sine(
    amplitude: float, frequency: float, phase: float, mean: float | None, end: float
) -> Profile:
    """Return mean + amplitude sin(2 pi f t + phase) up to `end` [s]; phase [rad], no mean: 0."""
    t = np.linspace(0.0, end, 2 + int(POINTS_PER_PERIOD * frequency * end))
    return Profile(t, (mean or 0.0) + amplitude * np.sin(2.0 * np.pi * frequency * t + phase))


def constant(value: float, ramp: float) -> Profile:
    """Return the constant `value`, reached linearly within `ramp` [s].

    A ramp of zero is a jump at t = 0.
    """
    if ramp == 0.0:
        return Profile(np.array([0.0]), np.array([value]))
    return Profile(np.array([0.0, ramp]), np.array([0.0, value]))


def ramp(begin: float, start: float, duration: float, target: float) -> Profile:
    """Return `start` until `begin` [s], then a linear change to `target` within `duration` [s].

    With a duration of zero the value is `target` at all times.
    """
    if duration == 0.0:
        return Profile(np.array([begin]), np.array([target]))
    return Profile(np.array([begin, begin + duration]), np.array([start, target]))


def smooth_rise(ramp: float) -> Profile:
    """Return a rise from 0 to 1 within `ramp` [s] as u^2 (3 - 2 u), u = t / ramp.

    A ramp of zero is a jump.
    """
    if ramp == 0.0:
        return Profile(np.array([0.0]), np.array([1.0]))
    u = np.linspace(0.0, 1.0, RISE_POINTS)
    return Profile(ramp * u, u * u * (3.0 - 2.0 * u))


def cycles(
    highest: float,
    inflation_rate: float,
    hold: float,
    deflation_rate: float,
    lowest: float,
    rest: float,
    count: int,
    start: float,
) -> Profile:
    """Return `count` pressure cycles: inflate to `highest`, hold, deflate, rest.

    Pressures [Pa], times [s], rates [Pa/s]; `deflation_rate` is the average rate Df_r^a. The first
    inflation begins at 0 Pa at `start`.
    """
    points = [(0.0, 0.0), (start, 0.0)] if start > 0.0 else [(0.0, 0.0)]
    t, p = points[-1]
    for _ in range(count):
        t += (highest - p) / inflation_rate
        points.append((t, highest))
        if hold > 0.0:
            t += hold
            points.append((t, highest))
        t += (highest - lowest) / deflation_rate
        points.append((t, lowest))
        if rest > 0.0:
            t += rest
            points.append((t, lowest))
        p = lowest
    return Profile(*np.array(points).T)


def natural_deflation(
    highest: float,
    inflation_rate: float,
    hold: float,
    time_constant: float,
    lowest: float,
    count: int,
    start: float,
) -> Profile:
    """Return pressure cycles whose falls are p = highest exp(-t / time_constant), down to `lowest`.

    The other parameters are those of `cycles`.
    """
    points = [(0.0, 0.0), (start, 0.0)] if start > 0.0 else [(0.0, 0.0)]
    t, p = points[-1]
    fall_time = time_constant * np.log(highest / lowest)
    steps = int(np.ceil(POINTS_PER_TIME_CONSTANT * fall_time / time_constant))
    fall = np.linspace(0.0, fall_time, steps + 1)[1:]
    for _ in range(count):
        t += (highest - p) / inflation_rate
        points.append((t, highest))
        if hold > 0.0:
            t += hold
            points.append((t, highest))
        points.extend(zip(t + fall, highest * np.exp(-fall / time_constant), strict=True))
        t += fall_time
        p = lowest
    return Profile(*np.array(points).T)


def periodic_cycles(
    period: float,
    highest: float,
    lowest: float | None,
    rise: float,
    hold: float,
    fall: float,
    phase: float,
    count: int | None,
    end: float,
) -> Profile:
    """Return trapezoids that repeat, up to `end` [s] or for `count` periods.

    Times [s]; phase [rad]. A cycle begins at t = -phase / (2 pi) period; this is the first cycle if
    it is not before t = 0 or if `count` is given. A lowest value of None is 0.
    """
    low = lowest or 0.0
    begin = -phase / (2.0 * np.pi) * period
    first = 0 if begin >= 0.0 or count is not None else int(np.floor(-begin / period))
    last = count if count is not None else max(first + 1, int(np.ceil((end - begin) / period)))
    corners = np.array([0.0, rise, rise + hold, rise + hold + fall])
    times = (begin + period * np.arange(first, last)[:, None] + corners).ravel()
    values = np.tile([low, highest, highest, low], last - first)
    distinct = np.append(np.diff(times) > ROUND_OFF * period, True)
    times, values = times[distinct], values[distinct]
    at_zero = np.interp(0.0, times, values)
    later = times > 0.0
    return Profile(
        np.concatenate([[0.0], times[later]]), np.concatenate([[at_zero], values[later]])
    )


# -------------------------------------------------------------------------------------------------
# Cycles of a profile.
#
# A cycle ends where the value has fallen and is about to rise again: a rest at the lowest value
# belongs to the cycle before it.


@dataclass(frozen=True)
class Cycle:
    """Times [s] at which the pressure begins to fall, has fallen, and the cycle ends."""

    fall_begin: float
    fall_end: float
    end: float

    def has_ended(self, time: float) -> bool:
        """Return True if the cycle has ended at `time` [s]."""
        return self.end <= time * (1.0 + ROUND_OFF)


def cycles_of(profile: Profile) -> list[Cycle]:
    """Return the cycles of a profile, one for each fall."""
    slope = np.diff(profile.values)
    edges = np.diff(np.concatenate([[False], slope < 0.0, [False]]).astype(int))
    cycles = []
    for first, last in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
        end = last
        while end < len(slope) and slope[end] == 0.0:
            end += 1
        cycles.append(Cycle(*(float(profile.times[k]) for k in (first, last, end))))
    return cycles


# -------------------------------------------------------------------------------------------------
# Profiles in Taichi fields: values of a table of points over time.

LEAST_ROOM = 8
"""Minimum capacity of a table in points, enough for a ramp mapped by the scale of a gauge."""


class ProfileTable:
    """Profiles in fields, one per scenario.

    They are linear between points, constant after the last, and zero before t = 0, when bodies
    settle without loads.
    """

    def __init__(self, profiles: list[Profile]) -> None:
        longest = max(LEAST_ROOM, *(len(p.times) for p in profiles))
        self.points = index_field(np.array([len(p.times) for p in profiles]))
        self.time = real_field(np.array([padded(p.times, longest) for p in profiles]))
        self.value = real_field(np.array([padded(p.values, longest) for p in profiles]))

    def follow(self, scenario: int, profile: Profile) -> None:
        """Replace the profile of a scenario.

        Raises SimulationError if it has more points than fit.
        """
        room = shape_of(self.time)[1]
        if len(profile.times) > room:
            raise SimulationError(
                f"a time history of {len(profile.times)} points, but there is room for {room}",
                hint="reduce the number of points of the gauge scale, or write a longer table in "
                "the scene",
            )
        write_row(self.points, scenario, len(profile.times))
        write_row(self.time, scenario, padded(profile.times, room))
        write_row(self.value, scenario, padded(profile.values, room))

    @ti.func
    def at(self, s, t):
        """Return the value at time t, by bisection."""
        low = 0
        high = self.points[s] - 1
        while high - low > 1:
            middle = (low + high) // 2
            if self.time[s, middle] <= t:
                low = middle
            else:
                high = middle
        value = self.value[s, high]
        if t < self.time[s, high] and high > low:
            share = ti.max(0.0, (t - self.time[s, low]) / (self.time[s, high] - self.time[s, low]))
            value = self.value[s, low] + share * (self.value[s, high] - self.value[s, low])
        if t < 0.0:
            value = 0.0
        return value


def padded(values: np.ndarray, length: int) -> np.ndarray:
    """Return `values` with the last one repeated up to `length`."""
    return np.concatenate([values, np.full(length - len(values), values[-1])])


# -------------------------------------------------------------------------------------------------
# Profiles that a scene describes.


CURVES: dict[type, Callable[..., Profile]] = {
    Constant: lambda end, value, ramp: constant(value, ramp),
    Ramp: lambda end, value, duration: constant(value, duration),
    SmoothStep: lambda end, value, duration: smooth_rise(duration).times_factor(value),
    Sine: sine,
    TableSpec: lambda end, points: Profile(*np.array(points, dtype=float).T),
    PeriodicCycles: periodic_cycles,
    CyclesProfile: lambda end, **said: cycles(**said),
    NaturalDeflationProfile: lambda end, **said: natural_deflation(**said),
}


def built_profile(data: Spec, end: float) -> Profile:
    """Return the profile that a scene describes.

    Parameters
    ----------
    data : Spec
        Any profile of scene/profiles.py, except cycles by events.
    end : float
        Time [s] until which a profile without an end of its own is written out.
    """
    curve = next(CURVES[each] for each in type(data).__mro__ if each in CURVES)
    said = {name: getattr(data, name) for name in type(data).model_fields if name != "kind"}
    return curve(end=end, **said)


def over_the_run(names: Names, data: Spec, keys: Keys) -> Profile:
    """Return the profile over time [s] of the whole run, up to the end of its step."""
    start, time = names.beginning.of(keys), names.beginning.time
    return built_profile(data, time + names.scene.time.end - start).delayed(start)
