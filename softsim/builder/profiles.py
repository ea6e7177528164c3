"""Profiles over time from what a scene says of them."""

from collections.abc import Callable
from typing import Any

import numpy as np

from softsim.builder.names import Names
from softsim.loads import profile as profiles
from softsim.loads.profile import Profile
from softsim.scene.profiles import (
    FixedProfile,
    FullShare,
    Ramp,
    RampedShare,
    SineShare,
    SmoothShare,
    SmoothStep,
    Table,
)
from softsim.scene.tree import Keys

Share = FullShare | RampedShare | SmoothShare | SineShare | Table[float]

CURVES: dict[str, Callable[..., Profile]] = {
    "cycles": profiles.cycles,
    "natural_deflation": profiles.natural_deflation,
    "constant": profiles.constant,
}

SHARES: dict[str, Callable[..., Profile]] = {
    "constant": lambda end: profiles.constant(1.0, 0.0),
    "ramp": lambda end, duration: profiles.constant(1.0, duration),
    "smooth_step": lambda end, duration: profiles.smooth_rise(duration),
    "sine": profiles.sine,
}


def pressure_profile(data: FixedProfile) -> Profile:
    """The profile [Pa over s] that a scene describes."""
    if isinstance(data, Table):
        return table_profile(data)
    return CURVES[data.kind](**data.model_dump(exclude={"kind"}))


def share_over_time(names: Names, data: Share, keys: Keys) -> Profile:
    """A share over time [s] of the whole run, up to the end of its step."""
    start, time = names.beginning.of(keys), names.beginning.time
    return share_profile(data, time + names.scene.time.end - start).delayed(start)


def rising_profile(data: Ramp[Any] | SmoothStep[Any] | Table[Any]) -> Profile:
    """A ramp, a smooth step or a table of any quantity, over time [s]."""
    if isinstance(data, Table):
        return table_profile(data)
    if isinstance(data, SmoothStep):
        rise = profiles.smooth_rise(data.duration)
        return Profile(rise.times, data.value * rise.values)
    return profiles.constant(data.value, data.duration)


def displacement(
    names: Names, data: Ramp[Any] | SmoothStep[Any] | Table[Any], keys: Keys
) -> Profile:
    """A displacement [m over s of the whole run], which starts from zero."""
    profile = rising_profile(data)
    if profile.values[0] != 0.0 or profile.times[0] != 0.0:
        raise names.loaded.error(
            keys,
            "the displacement must start with [0 s, 0 mm]",
            "a jump at the start would be an infinite velocity",
        )
    return profile.delayed(names.beginning.of(keys))


def share_profile(data: Share, end: float) -> Profile:
    """A share over time [s], up to `end` [s]."""
    if isinstance(data, Table):
        return table_profile(data)
    return SHARES[data.kind](end=end, **data.model_dump(exclude={"kind"}))


def table_profile(data: Table[Any]) -> Profile:
    """The points of a table."""
    return Profile(*np.array(data.points, dtype=float).T)
