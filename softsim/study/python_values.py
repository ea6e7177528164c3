"""A study that comes from Python: plain values as the tree that a file would give."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from softsim.errors import Option, SceneError
from softsim.scene.tree import Scalar, Tree


def tree_of(value: Any, place: str = "study") -> Tree:
    """The tree of mappings, lists, texts and numbers, also of numpy; each says as its place the
    keys that lead to it, "factors.rate.values[0]". SceneError: values of another type.
    """
    origin = Option(place)
    if isinstance(value, Mapping):
        below = {str(key): tree_of(held, _inside(place, str(key))) for key, held in value.items()}
        return Tree(below, origin, origin)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Sequence) and not isinstance(value, str):
        entries = [tree_of(held, f"{place}[{index}]") for index, held in enumerate(value)]
        return Tree(entries, origin, origin)
    scalar = _scalar(value, origin)
    return Tree(scalar, origin, origin, scalar if isinstance(scalar, str) else repr(scalar))


def _inside(place: str, key: str) -> str:
    return key if place == "study" else f"{place}.{key}"


def _scalar(value: Any, origin: Option) -> Scalar:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Path):
        return str(value)
    if value is None or isinstance(value, str | int | float):
        return value
    hint = "numbers, texts, lists and mappings of them can"
    raise SceneError(f"a {type(value).__name__} cannot be part of a study", hint, origin)
