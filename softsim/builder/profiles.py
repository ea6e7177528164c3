"""Profiles over time that a scene describes."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from softsim.builder.names import Names
from softsim.loads import profile as profiles
from softsim.loads.profile import Profile
from softsim.model import Body
from softsim.scene.conditions import Prescribed, RigidMotionSpec, WallMotion
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
from softsim.solver.stable_step import element_frequencies

CURVES: dict[type, Callable[..., Profile]] = {
    Constant: lambda end, value, ramp: profiles.constant(value, ramp),
    Ramp: lambda end, value, duration: profiles.constant(value, duration),
    SmoothStep: lambda end, value, duration: profiles.smooth_rise(duration).times_factor(value),
    Sine: profiles.sine,
    TableSpec: lambda end, points: Profile(*np.array(points, dtype=float).T),
    PeriodicCycles: profiles.periodic_cycles,
    CyclesProfile: lambda end, **said: profiles.cycles(**said),
    NaturalDeflationProfile: lambda end, **said: profiles.natural_deflation(**said),
}


def built_profile(data: Spec, end: float) -> Profile:
    """Return the profile that a scene describes.

    Parameters
    ----------
    data : Part
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


def displacement(
    names: Names, motion: Prescribed | RigidMotionSpec | WallMotion, keys: Keys
) -> Profile:
    """Return a displacement [m over s of the whole run], which starts from zero."""
    if motion.displacement is None:
        return _integrated_velocity(names, motion.velocity, keys)
    profile = over_the_run(names, motion.displacement, keys)
    if profile.values[0] != 0.0 or profile.times[0] != names.beginning.of(keys):
        raise names.loaded.error(
            (*keys, "displacement"),
            "the displacement must start with [0 s, 0 mm]",
            "a jump at the start would mean an infinite velocity",
        )
    return profile


def _integrated_velocity(names: Names, velocity: Any, keys: Keys) -> Profile:
    """Return the displacement [m over s of the whole run] of a velocity."""
    start, time = names.beginning.of(keys), names.beginning.time
    end = time + names.scene.time.end - start
    return built_profile(velocity, end).integrated(end).delayed(start)


# -------------------------------------------------------------------------------------------------
# Data of the model that the builders of loads need.


@dataclass(frozen=True)
class LoadTargets:
    """Bodies and nodes on which loads act.

    points (n, d) [m], mass (n,) [kg] and is_free (n, d): of all nodes. tied: nodes tied to each
    rigid body. total_mass [kg]: of everything in the model.
    """

    names: Names
    bodies: tuple[Body, ...]
    points: np.ndarray
    mass: np.ndarray
    is_free: np.ndarray
    tied: list[np.ndarray]
    total_mass: float

    @cached_property
    def stiffest(self) -> float:
        """Largest omega^2 [1/s^2] of an element at rest."""
        regions = (region for body in self.bodies for region in body.regions)
        return max(float(element_frequencies(region).max()) for region in regions)
