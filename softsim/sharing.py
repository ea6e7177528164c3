"""Per-scenario and shared data of a batch of scenarios.

A solver takes mesh, masses, materials, contact stiffnesses and the places of loads from the first
of its models. Dataclass fields of a type `Own[...]` are stored for each scenario.
"""

from dataclasses import Field, fields, is_dataclass
from typing import Annotated, Any, TypeVar, get_args, get_origin

import numpy as np

T = TypeVar("T")

OWN = "own"

Own = Annotated[T, OWN]
"""Type of per-scenario data."""


def alike(one: Any, other: Any) -> bool:
    """Return True if two parts of models are equal except for per-scenario data."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(alike, one, other))
    if is_dataclass(one):
        shared = [f.name for f in fields(one) if not is_own(f)]
        return all(alike(getattr(one, name), getattr(other, name)) for name in shared)
    return bool(one == other)


def is_own(field: Field[Any]) -> bool:
    """Return True if a dataclass field is per-scenario data."""
    return get_origin(field.type) is Annotated and OWN in get_args(field.type)


def compiles_alike(one: Any, other: Any) -> bool:
    """Return True if kernels that were compiled for one object of a solver serve the other as well.

    Numbers, texts and lengths of lists that a kernel reads from objects of the solver are compiled
    into it as constants; these must be equal. Fields are read at run time, arrays in Python only.
    Dataclasses are parts of models, of which kernels contain only the shared data.
    """
    return _compiles_alike(one, other, set())


def _compiles_alike(one: Any, other: Any, compared: set[int]) -> bool:
    if type(one) is not type(other):
        return False
    if isinstance(one, bool | int | float | str | np.generic):
        return bool(one == other)
    if id(one) in compared:
        return True
    compared.add(id(one))
    if is_dataclass(one):
        return alike(one, other)
    if isinstance(one, list | tuple):
        pairs = zip(one, other, strict=False)
        return len(one) == len(other) and all(_compiles_alike(*pair, compared) for pair in pairs)
    if isinstance(one, dict):
        known = one.keys() == other.keys()
        return known and all(_compiles_alike(one[key], other[key], compared) for key in one)
    if type(one).__module__.startswith("softsim."):
        return _compiles_alike(vars(one), vars(other), compared)
    return True
