"""YAML as a tree of values that remember where they stand.

Stricter than YAML 1.1: only true and false are booleans, 1e-6 is a number, tags that construct
objects, repeated keys and texts that unfold to a huge tree are refused.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from softsim.errors import Location, SceneError

LARGEST_FILE = 2**20  # bytes
LARGEST_TREE = 20_000  # values, aliases unfolded

PathKey = tuple[str | int, ...]


class _Loader(yaml.SafeLoader):
    yaml_implicit_resolvers: dict = {}


_TAG = "tag:yaml.org,2002:"
for _name, _pattern, _first in (
    ("bool", r"^(true|True|false|False)$", "tTfF"),
    ("null", r"^(null|~|)$", ["n", "~", ""]),
    ("int", r"^[-+]?[0-9]+$", "-+0123456789"),
    ("float", r"^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?$", "-+.0123456789"),
):
    _Loader.add_implicit_resolver(_TAG + _name, re.compile(_pattern), list(_first))

_SCALARS: dict[str, Any] = {
    _TAG + "str": str,
    _TAG + "int": int,
    _TAG + "float": float,
    _TAG + "bool": lambda text: text.lower() == "true",
    _TAG + "null": lambda text: None,
}


@dataclass(frozen=True)
class Entry:
    """A value: a dict or a list of entries, or a scalar. location: where it stands.

    key_location: where its key stands, for the value of a mapping.
    """

    value: Any
    location: Location
    key_location: Location | None = None

    def plain(self) -> Any:
        """The value without its places."""
        if isinstance(self.value, dict):
            return {key: entry.plain() for key, entry in self.value.items()}
        if isinstance(self.value, list):
            return [entry.plain() for entry in self.value]
        return self.value

    def child(self, key: str | int) -> "Entry | None":
        """The entry under a key of a mapping or an index of a list, or None."""
        if isinstance(self.value, dict):
            return self.value.get(key)
        if isinstance(self.value, list) and isinstance(key, int) and 0 <= key < len(self.value):
            return self.value[key]
        return None

    def nearest(self, path: PathKey) -> "Entry":
        """The entry at `path`, or its nearest ancestor that is there."""
        entry = self
        for key in path:
            below = entry.child(key)
            if below is None:
                break
            entry = below
        return entry


def merged(below: Entry, above: Entry) -> Entry:
    """Mappings joined key by key, `above` winning; anything else replaced."""
    if not (isinstance(below.value, dict) and isinstance(above.value, dict)):
        return above
    joined = dict(below.value)
    for key, entry in above.value.items():
        joined[key] = merged(joined[key], entry) if key in joined else entry
    return Entry(joined, above.location, above.key_location)


def read_tree(path: Path, shown: str) -> Entry:
    """The tree of a file; `shown` is how messages call it.

    Raises SceneError for a file that is missing, no text, too large or no YAML mapping.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise SceneError(f"cannot read {shown}: {error.strerror}") from error
    if len(data) > LARGEST_FILE:
        raise SceneError(f"{shown} is larger than {LARGEST_FILE} bytes: no scene is")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SceneError(f"{shown} is no text file", "a scene is YAML, written in UTF-8") from error
    tree = parse_tree(text, shown)
    if not isinstance(tree.value, dict):
        raise SceneError("a scene is a mapping of keys to values", "begin with: title: ...",
                         tree.location)  # fmt: skip
    return tree


def parse_tree(text: str, shown: str) -> Entry:
    """The tree of one YAML text."""
    lines = text.splitlines() or [""]
    loader = None
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        location = None if mark is None else _location(mark, shown, lines)
        problem = error.problem or error.context or "not readable"
        raise SceneError(f"no YAML: {problem}", "check indentation, colons and brackets",
                         location) from error  # fmt: skip
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise SceneError(f"{shown} is no YAML: {str(error).splitlines()[0]}") from error
    finally:
        if loader is not None:
            loader.dispose()
    if node is None:
        raise SceneError(f"{shown} is empty", "a scene needs bodies and time")
    return _Unfolding(shown, lines).entry(node, None)


class _Unfolding:
    """Turns YAML nodes into entries, counting them: an alias bomb is refused, not unfolded."""

    def __init__(self, shown: str, lines: list[str]) -> None:
        self.shown, self.lines = shown, lines
        self.count = 0
        self.open: set[int] = set()

    def entry(self, node: yaml.Node, key_location: Location | None) -> Entry:
        location = _location(node.start_mark, self.shown, self.lines)
        self.count += 1
        if self.count > LARGEST_TREE or id(node) in self.open or len(self.open) > 60:
            raise SceneError("this unfolds to more values than a scene can have",
                             "write values out instead of aliases", location)  # fmt: skip
        self.open.add(id(node))
        value = self.value(node, location)
        self.open.discard(id(node))
        return Entry(value, location, key_location)

    def value(self, node: yaml.Node, location: Location) -> Any:
        if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
            return dict(self.items(node))
        if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
            return [self.entry(item, None) for item in node.value]
        if isinstance(node, yaml.ScalarNode) and node.tag in _SCALARS:
            try:
                return _SCALARS[node.tag](node.value)
            except ValueError:
                pass
        raise SceneError(f"the tag {node.tag} is not allowed in a scene",
                         "write plain values", location)  # fmt: skip

    def items(self, node: yaml.MappingNode) -> Iterator[tuple[str, Entry]]:
        seen: dict[str, Location] = {}
        for key_node, value_node in node.value:
            location = _location(key_node.start_mark, self.shown, self.lines)
            if not isinstance(key_node, yaml.ScalarNode):
                raise SceneError("a key must be a name", "", location)
            name = str(key_node.value)
            if name in seen:
                raise SceneError(f"the key '{name}' stands twice, first in line {seen[name].line}",
                                 "keep one of them", location)  # fmt: skip
            seen[name] = location
            yield name, self.entry(value_node, location)


def _location(mark: Any, shown: str, lines: list[str]) -> Location:
    text = lines[mark.line] if mark.line < len(lines) else ""
    return Location(shown, mark.line + 1, mark.column + 1, text)
