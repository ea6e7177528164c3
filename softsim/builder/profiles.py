"""Profiles over time from what a scene says of them."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from softsim.loads import profile as profiles
from softsim.loads.profile import Profile
from softsim.scene.profiles import (
    FixedProfile,
    Ramp,
    RampedShare,
    SmoothShare,
    SmoothStep,
    Table,
)

CURVES: dict[str, Callable[..., Profile]] = {
    "cycles": profiles.cycles,
    "natural_deflation": profiles.natural_deflation,
    "constant": profiles.constant,
}

SHARES: dict[str, Callable[[float], Profile]] = {
    "ramp": partial(profiles.constant, 1.0),
    "smooth_step": profiles.smooth_rise,
}


def pressure_profile(data: FixedProfile) -> Profile:
    """The profile [Pa over s] that a scene describes."""
    if isinstance(data, Table):
        return table_profile(data)
    return CURVES[data.kind](**data.model_dump(exclude={"kind"}))


def rising_profile(data: Ramp[Any] | SmoothStep[Any] | Table[Any]) -> Profile:
    """A ramp, a smooth step or a table of any quantity, over time [s]."""
    if isinstance(data, Table):
        return table_profile(data)
    if isinstance(data, SmoothStep):
        rise = profiles.smooth_rise(data.duration)
        return Profile(rise.times, data.value * rise.values)
    return profiles.constant(data.value, data.duration)


def share_profile(data: RampedShare | SmoothShare) -> Profile:
    """A share that rises from 0 to 1, over time [s]."""
    return SHARES[data.kind](data.duration)


def table_profile(data: Table[Any]) -> Profile:
    """The points of a table."""
    return Profile(*np.array(data.points, dtype=float).T)
