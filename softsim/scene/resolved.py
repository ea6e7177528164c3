"""Scene with all values, including defaults, as YAML with the origin of each value.

Values keep the text they were given with, so that the file loads to exactly the same floats.
"""

from collections.abc import Iterator
from typing import Any

import yaml
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from softsim.errors import Location
from softsim.scene.tree import DISCRIMINATORS, Tree, child
from softsim.scene.yaml_reading import SceneLoader

DEFAULT = "default"
INDENT = "  "
LONGEST_LIST = 6


def resolved_text(scene: BaseModel, tree: Tree) -> str:
    """Return `scene` as YAML; `tree`: values as given, with their locations."""
    return "\n".join(_model(scene, tree)) + "\n"


def _model(model: BaseModel, tree: Tree | None) -> Iterator[str]:
    for name, field in type(model).model_fields.items():
        value, given = getattr(model, name), child(tree, name) if tree else None
        default = None if field.default is PydanticUndefined else field.default
        yield from _entry(f"{name}:", value, given, default)


def _entry(head: str, value: Any, given: Tree | None, default: Any) -> Iterator[str]:
    """Yield the lines of a key, or of the dash of a list entry, with its value."""
    if isinstance(value, BaseModel):
        yield head
        yield from (INDENT + line for line in _model(value, given))
    elif isinstance(value, dict) and value:
        yield head
        for name, entry in value.items():
            below = child(given, name) if given else None
            yield from (INDENT + line for line in _entry(f"{_text(name)}:", entry, below, None))
    elif isinstance(value, tuple) and given is not None and _has_parts(value):
        yield head
        for index, entry in enumerate(value):
            yield from _dashed(entry, child(given, index))
    else:
        yield f"{head} {flow_text(default if given is None else given)}  # {_origin(given)}"


def _has_parts(entries: tuple[Any, ...]) -> bool:
    return any(isinstance(entry, BaseModel | tuple) for entry in entries)


def _dashed(entry: Any, given: Tree | None) -> Iterator[str]:
    if not isinstance(entry, BaseModel):
        yield from _entry(f"{INDENT}-", entry, given, None)
        return
    dash = "- "
    for line in _model(entry, given):
        yield INDENT + dash + line
        dash = INDENT


def flow_text(value: Any) -> str:
    """Return a scalar, list or mapping, plain or a Tree, as YAML on one line."""
    if isinstance(value, Tree):
        if isinstance(value.value, list | dict | str | bool) or value.value is None:
            return flow_text(value.value)
        return value.text
    if isinstance(value, list | tuple):
        return f"[{', '.join(flow_text(entry) for entry in value)}]"
    if isinstance(value, dict):
        entries = (f"{_text(key)}: {flow_text(entry)}" for key, entry in value.items())
        return f"{{{', '.join(entries)}}}"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return _text(value) if isinstance(value, str) else repr(value)


def phrase(tree: Tree) -> str:
    """Return a part of a scene in one line of prose, as it was written: its kind, then its keys.

    The middle of long lists is left out.
    """
    if isinstance(tree.value, list) and len(tree.value) > LONGEST_LIST:
        first, last = (", ".join(map(phrase, part)) for part in (tree.value[:2], tree.value[-1:]))
        return f"[{first}, ... {last}]"
    if isinstance(tree.value, list):
        return f"[{', '.join(map(phrase, tree.value))}]"
    if not isinstance(tree.value, dict):
        return flow_text(tree)
    head = [phrase(tree.value[key]) for key in DISCRIMINATORS if key in tree.value]
    rest = [
        f"{key} ({phrase(value)})" if isinstance(value.value, dict) else f"{key} {phrase(value)}"
        for key, value in tree.value.items()
        if key not in DISCRIMINATORS
    ]
    return ", ".join(head + rest)


def _text(text: str) -> str:
    """Return a text as YAML, in quotes only where they are needed."""
    safe = text and text.isascii() and all(c.isalnum() or c in " ./*^+-_" for c in text)
    if safe and _reads_back(text):
        return text
    return yaml.safe_dump(
        text, default_style='"', allow_unicode=True, width=len(text) * 10 + 10
    ).rstrip("\n")


def _reads_back(text: str) -> bool:
    try:
        node = SceneLoader(f"- {text}\n").get_single_node()
    except yaml.YAMLError:
        return False
    entry = node.value[0] if isinstance(node, yaml.SequenceNode) else None
    return isinstance(entry, yaml.ScalarNode) and entry.tag.endswith(":str") and entry.value == text


def _origin(given: Tree | None) -> str:
    """Return the places in files that the scalars of `given` come from, each once."""
    if given is None:
        return DEFAULT
    if isinstance(given.value, list) and given.value:
        return ", ".join(dict.fromkeys(_origin(entry) for entry in given.value))
    return (
        f"{given.origin.file}:{given.origin.line}"
        if isinstance(given.origin, Location)
        else given.origin.text.partition(" ")[0]
    )
