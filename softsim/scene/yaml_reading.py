"""Reading of YAML as a tree with locations: safe part of YAML 1.2, limited in size and depth."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from softsim.errors import Location, SceneError
from softsim.scene.tree import Origin, Scalar, Tree

LARGEST_FILE = 1_000_000  # bytes
MOST_NODES = 200_000  # counted after aliases are followed
DEEPEST = 40
LINE_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")  # as YAML counts lines

TAG = "tag:yaml.org,2002:"
NULL = re.compile(r"~|null|Null|NULL|")
BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")
INT = re.compile(r"[-+]?[0-9]+")
FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")

HINTS = {
    "mapping values are not allowed here": 'put a text that contains ": " in quotes',
    "'\\t' that cannot start any token": "indent with spaces, not with tabs",
    "could not find expected ':'": 'write ": " after a key, and indent the keys below it',
    "expected <block end>": "keys of one mapping must have the same indentation",
    "expected a single document": "one file holds one scene: remove the --- between them",
    "undefined alias": "an anchor (&name) must come before its alias (*name)",
}


Place = Callable[[int, int], Origin]  # of a line and a column, both from 0


class SceneLoader(yaml.SafeLoader):
    """YAML loader that reads null, true, false and numbers (1e-6 too); on, no, 1:30 are text."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 - yaml's own name for it

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.depth = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        self.depth += 1
        if self.depth > DEEPEST:
            raise yaml.MarkedYAMLError(
                problem=f"nested deeper than {DEEPEST} levels",
                problem_mark=self.peek_event().start_mark,
            )
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


for _name, _pattern, _first in (
    ("null", NULL, ["~", "n", "N", ""]),
    ("bool", BOOL, list("tTfF")),
    ("int", INT, list("-+0123456789")),
    ("float", FLOAT, list("-+.0123456789")),
):
    SceneLoader.add_implicit_resolver(TAG + _name, re.compile(rf"(?:{_pattern.pattern})$"), _first)


def is_file(path: Path) -> bool:
    """Return True if `path` is a file; False also for a name that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def read_file(path: Path, kind: str = "scene") -> Tree:
    """Return the mapping in a file; `kind` is "scene" or "study", for messages.

    Raises
    ------
    SceneError
        The file is missing, too large, not UTF-8 text, not YAML, or not a mapping.
    """
    try:
        if path.is_dir():
            raise SceneError(f"{path} is a folder", f"a {kind} is a YAML file")
        if not is_file(path):
            raise SceneError(f"{path}: no such file")
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        raise SceneError(f"{str(path)!r} cannot be read: {error}") from None
    if len(content) > LARGEST_FILE:
        raise SceneError(
            f"{path}: is larger than {LARGEST_FILE // 1000000} MB, too large for a {kind}",
            hint="give a mesh by name: file: mesh.msh",
        )
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise SceneError(
            f"{path}: is not UTF-8 text",
            hint=f"a {kind} is a YAML file; give a mesh as mesh: file: in a scene",
        ) from None
    lines = LINE_BREAK.split(text)

    def place(line: int, column: int) -> Location:
        return Location(path, line + 1, column + 1, lines[line] if line < len(lines) else "")

    tree = read_text(text, place)
    if tree is None:
        raise SceneError(f"{path}: is empty", hint=f"a {kind} is a mapping of keys to values")
    if not isinstance(tree.value, dict):
        raise SceneError(
            f"a {kind} must be a mapping of keys to values", 'such as "title:"', tree.origin
        )
    return tree


def read_text(text: str, place: Place) -> Tree | None:
    """Return the value of a YAML text, or None if it is empty.

    place: returns the location of a line and a column, both from 0.

    Raises
    ------
    SceneError
        The text is not valid YAML, or exceeds the limits of size and depth.
    """
    try:
        loader = SceneLoader(text)
        node = loader.get_single_node()
    except yaml.reader.ReaderError as error:
        message = f"has a character that YAML does not allow: {chr(int(error.character))!r}"
        raise SceneError(message, location=place(*_line_and_column(text, error.position))) from None
    except yaml.MarkedYAMLError as error:
        problem = error.problem or error.context or "not valid YAML"
        hint = next((h for part, h in HINTS.items() if part in f"{error.context} {problem}"), "")
        mark = error.problem_mark or error.context_mark
        where = (mark.line, mark.column) if mark else (0, 0)
        raise SceneError(problem, hint, place(*where)) from None
    except (ValueError, OverflowError) as error:  # an escape such as "\UFFFFFFFF"
        raise SceneError(f"not valid YAML: {error}", location=place(0, 0)) from None
    if node is None:
        return None
    builder = _TreeBuilder(place)
    return builder.build(node, builder.origin(node))


def _line_and_column(text: str, position: int) -> tuple[int, int]:
    before = LINE_BREAK.split(text[:position])
    return len(before) - 1, len(before[-1])


class _TreeBuilder:
    """Builder of trees from YAML nodes, which follows aliases up to a limit."""

    def __init__(self, place: Place) -> None:
        self.place = place
        self.count = 0
        self.open: set[int] = set()

    def origin(self, node: yaml.Node) -> Origin:
        return self.place(node.start_mark.line, node.start_mark.column)

    def build(self, node: yaml.Node, key_origin: Origin) -> Tree:
        origin = self.origin(node)
        self.count += 1
        if self.count > MOST_NODES:
            raise SceneError(f"more than {MOST_NODES} values", "aliases are counted too", origin)
        if id(node) in self.open:
            raise SceneError("an anchor contains its own alias", location=origin)
        self.open.add(id(node))
        value, text = self._value(node, origin)
        self.open.remove(id(node))
        return Tree(value, origin, key_origin, text)

    def _value(
        self, node: yaml.Node, origin: Origin
    ) -> tuple[Scalar | dict[str, Tree] | list[Tree], str]:
        if isinstance(node, yaml.MappingNode) and node.tag == TAG + "map":
            return self._mapping(node), ""
        if isinstance(node, yaml.SequenceNode) and node.tag == TAG + "seq":
            return [self.build(entry, self.origin(entry)) for entry in node.value], ""
        if isinstance(node, yaml.ScalarNode):
            return scalar(node, origin), node.value
        raise SceneError(f"the tag {node.tag!r} is not supported", "write plain values", origin)

    def _mapping(self, node: yaml.MappingNode) -> dict[str, Tree]:
        entries: dict[str, Tree] = {}
        for key_node, value_node in node.value:
            origin = self.origin(key_node)
            if not isinstance(key_node, yaml.ScalarNode):
                raise SceneError("a key must be a word, not a list or a mapping", location=origin)
            key = key_node.value
            if key in entries:
                first = entries[key].key_origin
                raise SceneError(f"the key {key!r} is given twice", f"first at {first}", origin)
            entries[key] = self.build(value_node, origin)
        return entries


def scalar(node: yaml.ScalarNode, origin: Origin) -> Scalar:
    """Return the value of a scalar.

    Raises SceneError for tags other than null, bool, int, float and str.
    """
    read: dict[str, Callable[[str], Scalar]] = {
        "null": lambda text: None,
        "bool": lambda text: text.lower() == "true",
        "int": int,
        "float": float,
        "str": str,
    }
    name = node.tag.removeprefix(TAG)
    if name not in read:
        raise SceneError(f"the tag {node.tag!r} is not supported", "write plain values", origin)
    try:
        return read[name](node.value)
    except ValueError:  # `!!int x`, or thousands of digits
        raise SceneError("cannot be read as a number", location=origin) from None
