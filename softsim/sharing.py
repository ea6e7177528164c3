"""Which data a scenario has for itself, and which it shares with the others of one structure.

A solver takes mesh, masses, materials, contact stiffnesses and the places of loads from the first
of its models. Of a dataclass field of a type `Own[...]` it keeps one for each scenario.
"""

from dataclasses import Field, fields, is_dataclass
from typing import Annotated, Any, TypeVar, get_args, get_origin

import numpy as np

T = TypeVar("T")

OWN = "own"

Own = Annotated[T, OWN]
"""The type of what each scenario has for itself."""


def alike(one: Any, other: Any) -> bool:
    """Whether two parts of models differ in nothing but what each scenario has for itself."""
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
    """Whether each scenario has a dataclass field for itself."""
    return get_origin(field.type) is Annotated and OWN in get_args(field.type)


def compiles_alike(one: Any, other: Any) -> bool:
    """Return True if kernels that were compiled for one object of a solver serve the other as well.

    A kernel holds as constants the numbers, texts and lengths of lists that it has read from
    objects of the solver; these must be equal. Fields are read when it runs, arrays by Python
    alone. Dataclasses are parts of models, of which kernels hold only what scenarios share.
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
