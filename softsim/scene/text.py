"""Reading of YAML as a tree with locations: safe part of YAML 1.2, limited in size and depth."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path, PurePath
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import yaml
from pydantic import BaseModel, Tag
from pydantic.fields import FieldInfo

from softsim.errors import Location, Option, SceneError
from softsim.scene.quantities import Quantity

# -------------------------------------------------------------------------------------------------
# Content of scene files before validation: values with the location of each in its file.

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


OriginOf = Callable[[int, int], Origin]  # of a line and a column, both from 0


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
        return _parsed(path, kind, content)
    except UnicodeDecodeError:
        raise SceneError(
            f"{path}: is not UTF-8 text",
            hint=f"a {kind} is a YAML file; give a mesh: file: in a scene",
        ) from None


@lru_cache(maxsize=32)
def _parsed(path: Path, kind: str, content: bytes) -> Tree:
    """Return the mapping in the content of a file; cached, as the cases of a study share files.

    Raises UnicodeDecodeError, or SceneError as `read_file`.
    """
    text = content.decode("utf-8-sig")
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


def read_text(text: str, place: OriginOf) -> Tree | None:
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

    def __init__(self, place: OriginOf) -> None:
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


# -------------------------------------------------------------------------------------------------
# Search in the schema for the class and the field at a path of keys.

Model = type[BaseModel]


@dataclass(frozen=True)
class SchemaLocation:
    """Place in the schema: its annotation, the field it belongs to and the keys to it."""

    annotation: Any
    field: FieldInfo | None = None
    keys: Keys = ()

    @property
    def models(self) -> list[Model]:
        """Classes that a mapping here may have; empty if no mapping of fields is allowed."""
        bare = _bare(self.annotation)
        if get_origin(bare) in (Union, UnionType):
            return [m for option in get_args(bare) for m in SchemaLocation(option).models]
        return [bare] if isinstance(bare, type) and issubclass(bare, BaseModel) else []

    @property
    def entry_count(self) -> int | None:
        """Number of entries of the list here, None if the schema does not fix it."""
        arguments = get_args(_bare(self.annotation))
        is_tuple = get_origin(_bare(self.annotation)) is tuple
        return len(arguments) if is_tuple and Ellipsis not in arguments else None

    @property
    def quantity(self) -> Quantity | None:
        """Quantity of the number here, None if it is not a quantity."""
        notes = (*_layers(self.annotation)[1], *(self.field.metadata if self.field else ()))
        return next((note for note in notes if isinstance(note, Quantity)), None)

    @property
    def is_whole(self) -> bool:
        """True if the value here is a whole number."""
        return _bare(self.annotation) is int

    @property
    def tags(self) -> dict[str, Any]:
        """Annotation of each option here, by the tag that pydantic puts into the loc of an error.

        An option is a class, or a union of the spellings of one kind with tags of their own.
        """
        found: dict[str, Any] = {}
        for option in get_args(_bare(self.annotation)):
            notes = get_args(option)[1:] if get_origin(option) is Annotated else ()
            given = [note.tag for note in notes if isinstance(note, Tag)]
            for model in SchemaLocation(option).models:
                found |= dict.fromkeys(given or discriminators(model).values(), option)
        return found

    def variant(self, value: Any) -> "SchemaLocation":
        """Return the place with the class of the mapping `value`.

        The class follows from its law, kind or generator, or from the first key of a class that has
        none of these. Of two spellings of one kind, it is the one with more of the given keys.
        """
        given = value if isinstance(value, dict) else {}
        matching = [
            model
            for model in self.models
            if all(given.get(key) == tag for key, tag in discriminators(model).items())
            and (discriminators(model) or first_key(model) in given)
        ]
        if len(self.models) < 2 or not matching:
            return self
        meant = max(matching, key=lambda model: len(model.model_fields.keys() & given.keys()))
        return SchemaLocation(meant, self.field, self.keys)

    def tagged(self, tag: str) -> "SchemaLocation":
        """Return the place with the option that pydantic calls `tag`."""
        return SchemaLocation(self.tags[tag], self.field, self.keys)

    def inside(self, key: Key) -> "SchemaLocation | None":
        """Return the place of the entry `key`, or None if the schema has none."""
        keys = (*self.keys, key)
        if self.models:
            field = self.models[0].model_fields.get(str(key)) if len(self.models) == 1 else None
            return SchemaLocation(field.annotation, field, keys) if field else None
        bare = _bare(self.annotation)
        arguments = get_args(bare)
        if get_origin(bare) is dict and isinstance(key, str):
            return SchemaLocation(arguments[1], self.field, keys)
        if get_origin(bare) is tuple and isinstance(key, int):
            if Ellipsis in arguments:
                return SchemaLocation(arguments[0], self.field, keys)
            return (
                SchemaLocation(arguments[key], self.field, keys) if key < len(arguments) else None
            )
        return None


@cache
def discriminators(model: Model) -> dict[str, str]:
    """Return the required keys of a class with one allowed value, such as {"kind": "pipe"}."""
    return {
        name: get_args(field.annotation)[0]
        for name, field in model.model_fields.items()
        if get_origin(field.annotation) is Literal and field.is_required()
    }


def first_key(model: Model) -> str:
    """Return the first key of a class."""
    return next(iter(model.model_fields))


def place_of(root: Model, loc: Sequence[Key]) -> SchemaLocation:
    """Return the place of pydantic's `loc` of an error, as deep as the schema goes.

    A loc also contains tags of classes, and a mark for an error in the key of a mapping, which are
    not keys.
    """
    place = SchemaLocation(root)
    for part in loc:
        if part == "[key]":
            return place
        if len(place.models) > 1:
            place = place.tagged(str(part))
            continue
        place = place.inside(part) or SchemaLocation(Any, None, (*place.keys, part))
    return place


def place_in(root: Model, tree: Tree, keys: Keys) -> SchemaLocation | None:
    """Return the place of `keys` in a file with the content `tree`, or None if there is none."""
    place: SchemaLocation | None = SchemaLocation(root)
    held: Tree | None = tree
    for key in keys:
        place = place.variant(plain(held) if held else {}).inside(key) if place else None
        held = child(held, key) if held else None
    return place


def _bare(annotation: Any) -> Any:
    """Return the annotation without Annotated and without None."""
    return _layers(annotation)[0]


def _layers(annotation: Any) -> tuple[Any, list[Any]]:
    """Return the annotation without Annotated and without None, and the metadata of Annotated."""
    notes: list[Any] = []
    while True:
        arguments = get_args(annotation)
        if get_origin(annotation) is Annotated:
            annotation = arguments[0]
            notes.extend(arguments[1:])
        elif NoneType in arguments and len(arguments) == 2:
            annotation = next(a for a in arguments if a is not NoneType)
        else:
            return annotation, notes
