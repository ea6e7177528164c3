"""Content of scene files before validation: values with the location of each in its file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any

from softsim.errors import Location, Option

Key = str | int
Keys = tuple[Key, ...]
Origin = Location | Option
Scalar = str | int | float | bool | None
DISCRIMINATORS = ("law", "kind", "generator")


@dataclass(frozen=True, eq=False)
class Tree:
    """Scalar, mapping or list with its location; `text` is a scalar as it was written.

    `origin` is the location of the value, `key_origin` that of its key or list entry.
    """

    value: "Scalar | dict[str, Tree] | list[Tree]"
    origin: Origin
    key_origin: Origin
    text: str = ""


def plain(tree: Tree) -> Any:
    """Return the values without their locations."""
    if isinstance(tree.value, dict):
        return {key: plain(child) for key, child in tree.value.items()}
    if isinstance(tree.value, list):
        return [plain(child) for child in tree.value]
    return tree.value


def tree_of(value: Any, origin: Origin) -> Tree:
    """Return the tree of plain values, all with the same origin."""
    if isinstance(value, Mapping):
        held = {str(key): tree_of(entry, origin) for key, entry in value.items()}
        return Tree(held, origin, origin)
    if isinstance(value, list | tuple):
        return Tree([tree_of(entry, origin) for entry in value], origin, origin)
    if isinstance(value, PurePath):
        value = str(value)
    return Tree(value, origin, origin, str(value))


def child(tree: Tree, key: Key) -> Tree | None:
    """Return the entry of a mapping or list, or None if there is none."""
    if isinstance(tree.value, dict) and isinstance(key, str):
        return tree.value.get(key)
    if isinstance(tree.value, list) and isinstance(key, int) and 0 <= key < len(tree.value):
        return tree.value[key]
    return None


def nearest(tree: Tree, keys: Sequence[Key]) -> tuple[Tree, int]:
    """Return the deepest existing tree along `keys`, and the number of keys that lead to it."""
    for depth, key in enumerate(keys):
        following = child(tree, key)
        if following is None:
            return tree, depth
        tree = following
    return tree, len(keys)


def entries(tree: Tree, *keys: Key) -> Mapping[str, Tree]:
    """Return the mapping at `keys`, empty if there is none."""
    held, depth = nearest(tree, keys)
    return held.value if depth == len(keys) and isinstance(held.value, dict) else {}


def listed(tree: Tree, *keys: Key) -> Sequence[Tree]:
    """Return the list at `keys`, empty if there is none."""
    held, depth = nearest(tree, keys)
    return held.value if depth == len(keys) and isinstance(held.value, list) else ()


def merged(lower: Tree, upper: Tree) -> Tree:
    """Return `upper` merged over `lower`: mappings key by key, else `upper`.

    A mapping of another law, kind or generator replaces the lower one completely: keys of a
    constant pressure have no meaning in a table.
    """
    if not (isinstance(lower.value, dict) and isinstance(upper.value, dict)):
        return upper
    if any(_differ(lower.value.get(key), upper.value.get(key)) for key in DISCRIMINATORS):
        return upper
    entries = dict(lower.value)
    for key, value in upper.value.items():
        entries[key] = merged(entries[key], value) if key in entries else value
    return replace(upper, value=entries)


def _differ(one: Tree | None, other: Tree | None) -> bool:
    return one is not None and other is not None and plain(one) != plain(other)


def replaced(tree: Tree, keys: Sequence[Key], new: Tree) -> Tree:
    """Return `tree` with `new` at `keys`; missing mappings are created with the origin of `new`."""
    if not keys:
        return new
    key, rest = keys[0], keys[1:]
    if isinstance(tree.value, list) and isinstance(key, int):
        entries = list(tree.value)
        entries[key] = replaced(entries[key], rest, new)
        return replace(tree, value=entries)
    mapping = dict(tree.value) if isinstance(tree.value, dict) else {}
    held = mapping.get(str(key), Tree({}, new.origin, new.key_origin))
    mapping[str(key)] = replaced(held, rest, new)
    return replace(tree, value=mapping)
