"""Loading of scene files: YAML, included parts, overrides of the command line, validation."""

import hashlib
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import resources
from pathlib import Path, PurePath
from typing import Any, Generic, TypeVar

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import PydanticUndefined

from softsim.errors import Location, Option, SceneError
from softsim.scene.reporting import did_you_mean, scene_error, title
from softsim.scene.schema import Scene
from softsim.scene.text import (
    DISCRIMINATORS,
    Key,
    Keys,
    Model,
    Origin,
    SceneLoader,
    SchemaLocation,
    Tree,
    child,
    entries,
    is_file,
    merged,
    nearest,
    plain,
    read_file,
    read_text,
    replaced,
    tree_of,
)

# -------------------------------------------------------------------------------------------------
# Scene with all values, including defaults, as YAML with the origin of each value.
#
# Values keep the text they were given with, so that the file loads to exactly the same floats.

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


@lru_cache(maxsize=4096)
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


# -------------------------------------------------------------------------------------------------
# Standard robots: parts of scenes that ship with softsim and are included by name.
#
# `include: [robot:pfr]` adds a whole robot, `robot:pfr/motor` a part of it.

PREFIX = "robot:"
LIBRARY = Path(str(resources.files("softsim.scene"))) / "library"


def robot_names() -> list[str]:
    """Return the names of the whole robots, as --robot takes them."""
    return sorted(file.stem for file in LIBRARY.glob("*.yaml"))


def part_names() -> list[str]:
    """Return the names of robots and their parts, as `include` takes them."""
    files = (file.relative_to(LIBRARY) for file in LIBRARY.rglob("*.yaml"))
    return sorted(PREFIX + file.with_suffix("").as_posix() for file in files)


def part_file(named: Tree) -> Path:
    """Return the file of the robot or part that an include names.

    Raises
    ------
    SceneError
        There is none with this name.
    """
    name, known = str(named.value), part_names()
    if name not in known:
        raise SceneError(
            f"there is no {name!r} to include", did_you_mean(name, known), named.origin
        )
    return LIBRARY / (name.removeprefix(PREFIX) + ".yaml")


MOST_FILES = 100
STEPS = "steps"
IN_PYTHON = Option("the scene given in Python")
PATH = re.compile(r"[^.\s]+(\.[^.\s]+)*")
ENTRY = re.compile(r"\[(\d+)\]")

Kind = TypeVar("Kind", bound=BaseModel)


@dataclass(frozen=True)
class Loaded(Generic[Kind]):
    """Valid scene, or file of an application, with its source.

    Attributes
    ----------
    scene : Scene, or the class of an application's file
        The validated content, quantities as SI floats.
    path : Path
        Path of the file.
    folder : Path
        Folder of the file.
    tree : Tree
        The content as written, with the place of each value.
    """

    scene: Kind
    path: Path
    folder: Path
    tree: Tree

    def error(self, keys: Keys, message: str, hint: str = "") -> SceneError:
        """Return an error at the value of `keys`, or at the nearest one above it."""
        return SceneError(message, hint, nearest(self.tree, keys)[0].origin)

    def resolved(self) -> str:
        """Return the scene as YAML with all values, including defaults, and the source of each."""
        return resolved_text(self.scene, self.tree)

    def resolve_file(self, keys: Keys) -> Path:
        """Return the path of the file named by the value of `keys`.

        Raises
        ------
        SceneError
            It does not exist, or lies outside the main scene's folder.
        """
        named = nearest(self.tree, keys)[0]
        path = _inside(self.folder, named)
        if not is_file(path):
            raise self.error(keys, f"{title(keys)}: there is no file {path}")
        return path

    def file_digests(self) -> dict[str, str]:
        """Return the SHA-256 digests of all files that the scene names, such as meshes and walls.

        Returns
        -------
        dict of str to str
            Path relative to the scene's folder -> hexadecimal digest of the content.

        Raises
        ------
        SceneError
            As from `resolve_file`.
        """
        paths = [self.resolve_file(keys) for keys in file_keys(self.scene)]
        return {path.relative_to(self.folder).as_posix(): _content_digest(path) for path in paths}


LoadedScene = Loaded[Scene]


def file_keys(part: Any, keys: Keys = ()) -> Iterator[Keys]:
    """Yield the keys of all files that a part of a scene names: meshes of bodies, walls."""
    entries: list[tuple[str | int, Any]] = []
    if isinstance(part, BaseModel):
        entries = [(name, getattr(part, name)) for name in type(part).model_fields]
    elif isinstance(part, dict):
        entries = list(part.items())
    for name, entry in entries:
        if isinstance(part, BaseModel) and name == "file" and entry is not None:
            yield (*keys, name)
        else:
            yield from file_keys(entry, (*keys, name))


def _content_digest(path: Path) -> str:
    """Return the digest of a file's content, which is read again only after a change."""
    state = path.stat()
    return _digest_of_state(path, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=256)
def _digest_of_state(path: Path, changed_at: int, size: int) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def load_scene(path: str | Path, overrides: Sequence[str] = ()) -> LoadedScene:
    """Read, merge and validate a scene.

    Parameters
    ----------
    path : Path or str
        Path of the scene file.
    overrides : sequence of str
        Values that override those of the file, "time.end=3 s" each: keys joined by dots, then a
        value in YAML. `points.2.1` or `points[2][1]` is an entry of a list, counted from 0. Later
        overrides win.

    Returns
    -------
    LoadedScene
        The validated scene, which `softsim.run.run` and `softsim.Simulation` accept. Its attribute
        `scene` holds the values in SI units.

    Raises
    ------
    SceneError
        The file is not a valid scene. The error holds all problems found.

    Examples
    --------
    >>> from softsim import load_scene
    >>> loaded = load_scene("block.yaml", ["time.end=20 ms"])
    >>> loaded.scene.time.end  # [s]
    0.02
    >>> list(loaded.scene.bodies)
    ['block']
    """
    return validated(read_scene(Path(path)), Path(path), overrides)


def scene_of(scene: Scene) -> LoadedScene:
    """Return the loaded form of a scene made in Python, in the working folder."""
    tree = tree_of(scene.model_dump(exclude_unset=True), IN_PYTHON)  # in SI
    return LoadedScene(scene, Path("scene"), Path(), tree)


def scene_said(said: Mapping[str, Any], overrides: Sequence[str] = ()) -> LoadedScene:
    """Return the scene with the content of a mapping, with files relative to the working folder.

    Raises SceneError as `load_scene`.
    """
    tree = _Includes(Path()).merged_over_parts(tree_of(said, IN_PYTHON))
    return validated(tree, Path("scene"), overrides)


def read_scene(path: Path) -> Tree:
    """Return the content of a scene file merged with the files that it includes.

    Raises SceneError as `load_scene`.
    """
    return _Includes(path.parent).read(path)


def read_part(folder: Path, named: Tree) -> Tree:
    """Return the content of a part that a scene in `folder` includes by name.

    Raises SceneError as `load_scene`.
    """
    return _Includes(folder).part(named)


def validated(tree: Tree, path: Path, overrides: Sequence[str]) -> LoadedScene:
    """Return the valid scene of a tree with overrides. Raises SceneError as `load_scene`."""
    return validated_as(Scene, tree, path, overrides)


def validated_as(
    root: type[Kind], tree: Tree, path: Path, overrides: Sequence[str] = ()
) -> Loaded[Kind]:
    """Return the valid content of a tree with overrides, as the class `root` of the whole file.

    Raises SceneError as `load_scene`.
    """
    refuse_steps(tree)
    for override in overrides:
        tree = overridden(tree, override, root)
    return Loaded(valid(root, tree), path, path.parent, tree)


def refuse_steps(tree: Tree) -> None:
    """Raise SceneError for a scene with several steps (scene/steps.py)."""
    steps = child(tree, STEPS)
    if steps is not None:
        raise SceneError(
            "steps: this command needs a scene without steps",
            "softsim run and softsim check accept a scene with steps",
            steps.key_origin,
        )


def valid(root: type[Kind], tree: Tree) -> Kind:
    """Return the content of a tree as the class of its whole file. Raises SceneError."""
    try:
        return root.model_validate(plain(tree))
    except ValidationError as error:
        raise scene_error(error, tree, root, beside=("include",)) from None


class _Includes:
    """Reader of a file with all files that it includes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.open: list[Path] = []
        self.count = 0

    def read(self, path: Path) -> Tree:
        """Return the content of the file merged over the files under its key `include`."""
        self.count += 1
        if self.count > MOST_FILES:
            raise SceneError(f"{path}: more than {MOST_FILES} files are included")
        self.open.append(path)
        tree = self.merged_over_parts(read_file(path))
        self.open.pop()
        return tree

    def merged_over_parts(self, tree: Tree) -> Tree:
        """Return a tree, and each of its steps, merged over the files it includes."""
        if steps := entries(tree, STEPS):
            for name, step in steps.items():
                tree = replaced(tree, (STEPS, name), self.merged_over_parts(step))
        if not isinstance(tree.value, dict) or "include" not in tree.value:
            return tree
        own = {key: value for key, value in tree.value.items() if key != "include"}
        parts = [self.part(named) for named in _listed(tree.value["include"])]
        result = replace(tree, value={})
        for part in [*parts, replace(tree, value=own)]:
            result = merged(result, part)
        return result

    def part(self, named: Tree) -> Tree:
        """Return the content of a file that is included by name."""
        if str(named.value).startswith(PREFIX):
            path = part_file(named)
        else:
            path = _inside(self.folder, named)
        if path in self.open:
            circle = " -> ".join(str(p) for p in [*self.open[self.open.index(path) :], path])
            raise SceneError("files include each other in a circle", circle, named.origin)
        if not is_file(path):
            raise SceneError(f"there is no file {path} to include", location=named.origin)
        return self.read(path)


def _listed(named: Tree) -> list[Tree]:
    """Return the file names under `include`, one or several."""
    names = named.value if isinstance(named.value, list) else [named]
    for name in names:
        if not isinstance(name.value, str) or not name.value:
            raise SceneError(
                "include: must be a file name or a list of file names",
                "include: parts/skin.yaml",
                name.origin,
            )
    return names


def _inside(folder: Path, named: Tree) -> Path:
    """Return the path given by `named`, never outside `folder`."""
    name = str(named.value)
    home = folder if isinstance(named.origin, Option) else Path(named.origin.file).parent
    path = home / name
    steps = _normal(path.relative_to(folder)) if not PurePath(name).is_absolute() else None
    if steps is None or "\0" in name:
        raise SceneError(
            f"{name!r} is outside the folder of the scene",
            f"put the file into {folder} or a folder below, and give its path relative to this "
            "file",
            named.origin,
        )
    inside = folder.joinpath(*steps)
    target = os.path.realpath(inside)
    if not Path(target).is_relative_to(os.path.realpath(folder)):
        raise SceneError(
            f"{name!r} is a symbolic link to a file outside the folder of the scene, {target}",
            f"copy the file into {folder} or below",
            named.origin,
        )
    return inside


def _normal(path: PurePath) -> list[str] | None:
    """Return the parts of a relative path without "..", or None if it leaves its folder."""
    steps: list[str] = []
    for step in path.parts:
        if step != "..":
            steps.append(step)
        elif steps:
            steps.pop()
        else:
            return None
    return steps


def overridden(tree: Tree, override: str, root: Model = Scene) -> Tree:
    """Return a tree with one value set, such as "time.end=3 s".

    Parameters
    ----------
    tree : Tree
        Content of a file.
    override : str
        Path and value.
    root : type
        Class of the whole file.

    Raises
    ------
    SceneError
        There is no "=", the schema or the scene does not have the path, or the value is not YAML.
    """
    option = Option(f"--set {override}")
    path, equals, text = override.partition("=")
    if not equals or not PATH.fullmatch(path.strip()):
        raise SceneError("must read PATH=VALUE", 'such as --set "time.end=3 s"', option)
    keys = keys_at(tree, path.strip(), option, root)
    value = read_text(text, lambda line, column: option)
    return replaced(tree, keys, value or Tree(None, option, option))


def keys_at(tree: Tree, path: str, origin: Origin, root: Model = Scene) -> Keys:
    """Return the keys of a path such as "time.end", "points[2][1]" or "points.2.1".

    Parameters
    ----------
    tree : Tree
        Content of a file.
    path : str
        The path.
    origin : Origin
        Where the path is written.
    root : type
        Class of the whole file.

    Raises
    ------
    SceneError
        It is not a path, or the schema or the scene does not have it.
    """
    if not PATH.fullmatch(path):
        raise SceneError(f"{path!r} is not a path of keys", 'such as "time.end"', origin)
    return tuple(_keys(tree, ENTRY.sub(r".\1", path).split("."), origin, root))


def _keys(tree: Tree, words: Sequence[str], origin: Origin, root: Model) -> Iterator[Key]:
    """Yield the words as keys, integers where the scene has a list; each must exist.

    A section of the schema may be absent from the file, a name before the last word may not: a
    mistyped body would become a new one.
    """
    place: SchemaLocation | None = SchemaLocation(root)
    held: Tree | None = tree
    for position, word in enumerate(words):
        is_last = position == len(words) - 1
        if held is not None and isinstance(held.value, list):
            key: Key = _index(held, word, origin)
        else:
            key = word
            if held is not None and held.value is not None and not isinstance(held.value, dict):
                raise SceneError(f"{words[position - 1]} has no keys below it", location=origin)
        place = place.variant(plain(held) if held else {}) if place else None
        following = child(held, key) if held else None
        if place and following is None:
            known = list(place.models[0].model_fields) if len(place.models) == 1 else []
            names = list(held.value) if held and isinstance(held.value, dict) else []
            if (known and word not in known) or (not place.models and not is_last):
                hint = f"nothing is set there: give '{'.'.join(words[:position])}' as a whole"
                if known or names:
                    hint = did_you_mean(word, known or names)
                raise SceneError(f"there is no '{'.'.join(words[: position + 1])}'", hint, origin)
        place = place.inside(key) if place else None
        held = following
        yield key


def _index(held: Tree, word: str, origin: Origin) -> int:
    count = len(held.value) if isinstance(held.value, list) else 0
    if not re.fullmatch(r"[0-9]{1,6}", word) or int(word) >= count:
        raise SceneError(
            f"'{word}' is not an entry of this list",
            f"entries 0 to {count - 1}" if count else "",
            origin,
        )
    return int(word)


# -------------------------------------------------------------------------------------------------
# Layout of pipes with a standard robot in it, for `softsim assess` and `softsim reach`.

ASSESS, REACH = Option("softsim assess"), Option("softsim reach")
QUESTIONS = {
    ASSESS: """
layout: {}
expect: {passes: true}
time: {end: 60 s}
""",
    REACH: """
layout: {}
trailed: {}
time: {end: 60 s}
""",
}
"""Default content that each command adds to a layout file, as YAML."""


def load_layout(
    path: Path, robot: str, overrides: Sequence[str], command: Option = ASSESS
) -> LoadedScene:
    """Return the scene of a layout file with a robot in it, for a command.

    Values of the file override those of the robot and of the command.

    Raises
    ------
    SceneError
        There is no such robot, or the scene is not valid.
    """
    return validated(layout_tree(path, robot, command), path, overrides)


def layout_tree(path: Path, robot: str, command: Option = ASSESS) -> Tree:
    """Return the merged content of a layout file, a robot and the defaults of a command.

    Raises SceneError if there is no such robot or file.
    """
    question = said(QUESTIONS[command], command)
    return merged(merged(question, robot_tree(path.parent, robot)), read_scene(path))


def robot_tree(folder: Path, robot: str) -> Tree:
    """Return the content of a standard robot for a layout in `folder`.

    Raises SceneError if there is no such robot.
    """
    option = Option(f"--robot {robot}")
    if robot not in robot_names():
        raise SceneError(f"there is no robot {robot!r}", did_you_mean(robot, robot_names()), option)
    return read_part(folder, Tree(PREFIX + robot, option, option))


def said(text: str, option: Option) -> Tree:
    """Return the content of a YAML text, with the command `option` as its origin."""
    tree = read_text(text, lambda line, column: option)
    assert tree is not None
    return tree
