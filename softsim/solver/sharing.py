"""Which models are scenarios of one structure, and so can be computed side by side.

A solver takes mesh, masses, materials, contact stiffnesses and the places of loads from the first
of its models (solver/terms.py). What it keeps of each scenario is listed here.
"""

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from softsim.contact.distance_grid import DistanceGrid
from softsim.contact.half_spaces import HalfSpaces
from softsim.contact.pipe_path import PipePath
from softsim.contact.round_pipes import RoundPipes
from softsim.loads.drive import AddedGas, AddedVolume, ControlledPressure, GivenPressure
from softsim.loads.profile import Profile
from softsim.loads.vibration import RotorData
from softsim.model import (
    AxialReliefData,
    Body,
    ContactData,
    Model,
    NodalLoad,
    PressureData,
    RigidLoad,
    TendonData,
    TetherData,
)

WHOLLY = (
    Profile, RotorData, GivenPressure, AddedVolume, AddedGas, ControlledPressure, PipePath,
)  # fmt: skip
"""Of these only the kind counts."""

PARTLY: dict[type, set[str]] = {
    Model: {
        "velocity", "gravity", "end_time", "increment", "safety_factor", "energy_error_limit",
        "rows", "probes", "passage", "cycles", "friction_memory", "friction_slip_length",
    },
    Body: {"node_sets", "facet_sets", "remarks"},
    ContactData: {"friction_coefficient", "effective_mass"},
    PressureData: {"name"},
    NodalLoad: {"force"},
    RigidLoad: {"force"},
    AxialReliefData: {"mass"},
    TendonData: {"stiffness", "direction", "slack"},
    TetherData: {"point", "stiffness", "drag", "carried_mass", "turning_stiffness"},
    HalfSpaces: {"points", "normals"},
    RoundPipes: {"points", "axes", "radii"},
    DistanceGrid: {"name", "origin", "spacing", "values", "picture"},
}  # fmt: skip
"""Attributes that each scenario has for itself."""


def can_share(one: Model, other: Model) -> bool:
    """Whether two models can be scenarios of one solver. Not those of a static procedure, which
    ends when it ends.
    """
    dynamic = one.relaxation is None and other.relaxation is None
    return dynamic and alike(one, other)


def alike(one: Any, other: Any) -> bool:
    """Whether two parts of models differ in nothing but what each scenario has for itself."""
    if type(one) is not type(other):
        return False
    if isinstance(one, WHOLLY):
        return True
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(alike, one, other))
    if is_dataclass(one):
        own = PARTLY.get(type(one), set())
        names = [f.name for f in fields(one) if f.name not in own]
        return all(alike(getattr(one, name), getattr(other, name)) for name in names)
    return bool(one == other)
