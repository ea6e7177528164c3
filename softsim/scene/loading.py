"""Scene files: YAML, the parts they include, the command line's overrides, the validated scene."""

import hashlib
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path, PurePath
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from softsim.errors import Option, SceneError
from softsim.scene.reporting import did_you_mean, scene_error, title
from softsim.scene.resolved import resolved_text
from softsim.scene.robots import PREFIX, part_file
from softsim.scene.schema import Scene
from softsim.scene.structure import Model, Place
from softsim.scene.tree import (
    Key,
    Keys,
    Origin,
    Tree,
    child,
    entries,
    merged,
    nearest,
    plain,
    replaced,
    tree_of,
)
from softsim.scene.yaml_reading import is_file, read_file, read_text

MOST_FILES = 100
STEPS = "steps"
IN_PYTHON = Option("the scene given in Python")
PATH = re.compile(r"[^.\s]+(\.[^.\s]+)*")
ENTRY = re.compile(r"\[(\d+)\]")

Kind = TypeVar("Kind", bound=BaseModel)


@dataclass(frozen=True)
class Loaded(Generic[Kind]):
    """A valid scene, of one kind or another, and where it says what; `folder` holds its file."""

    scene: Kind
    path: Path
    folder: Path
    tree: Tree

    def error(self, keys: Keys, message: str, hint: str = "") -> SceneError:
        """An error at the value of `keys`, or at the nearest value above it that is written."""
        return SceneError(message, hint, nearest(self.tree, keys)[0].origin)

    def resolved(self) -> str:
        """A scene file with every value, also the defaults, and where each comes from."""
        return resolved_text(self.scene, self.tree)

    def resolve_file(self, keys: Keys) -> Path:
        """The file named by the value of `keys`, relative to the scene file that says it.

        Raises
        ------
        SceneError: it does not exist, or lies outside the main scene's folder.
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
        The file's path relative to the scene's folder -> hexadecimal digest of its content.

        Raises
        ------
        SceneError: as `resolve_file`.
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
    path: the scene file.
    overrides: "time.end=3 s" each: keys joined by dots, then a YAML value; `points.2.1` or
        `points[2][1]` is an entry of a list, counted from 0. Later ones win, and all win over
        files.

    Raises
    ------
    SceneError: anything that keeps it from being a scene; it holds every problem found.
    """
    return validated(read_scene(Path(path)), Path(path), overrides)


def scene_of(scene: Scene) -> LoadedScene:
    """A scene that was made in Python. Files that it names are looked for in the working folder."""
    tree = tree_of(scene.model_dump(exclude_unset=True), IN_PYTHON)  # in SI
    return LoadedScene(scene, Path("scene"), Path(), tree)


def scene_said(said: Mapping[str, Any], overrides: Sequence[str] = ()) -> LoadedScene:
    """The scene of which a mapping says what a file would, in the working folder. SceneError as
    load_scene.
    """
    tree = _Includes(Path()).merged_over_parts(tree_of(said, IN_PYTHON))
    return validated(tree, Path("scene"), overrides)


def read_scene(path: Path) -> Tree:
    """What a scene file says, merged over the files that it includes. SceneError as load_scene."""
    return _Includes(path.parent).read(path)


def read_part(folder: Path, named: Tree) -> Tree:
    """What a part says that a scene in `folder` includes by name. SceneError as load_scene."""
    return _Includes(folder).part(named)


def validated(tree: Tree, path: Path, overrides: Sequence[str]) -> LoadedScene:
    """The scene that a tree is, once overrides have won. SceneError as load_scene."""
    return validated_as(Scene, tree, path, overrides)


def validated_as(
    root: type[Kind], tree: Tree, path: Path, overrides: Sequence[str] = ()
) -> Loaded[Kind]:
    """What a tree is, as the class of its whole file, once overrides have won. SceneError as
    load_scene.
    """
    refuse_steps(tree)
    for override in overrides:
        tree = overridden(tree, override, root)
    return Loaded(valid(root, tree), path, path.parent, tree)


def refuse_steps(tree: Tree) -> None:
    """Several steps (scene/steps.py) where one scene is due."""
    steps = child(tree, STEPS)
    if steps is not None:
        raise SceneError(
            "steps: here one scene is due, without steps",
            "softsim run and softsim check take a scene of several steps",
            steps.key_origin,
        )


def valid(root: type[Kind], tree: Tree) -> Kind:
    """What a tree says, as the class that its whole file is. SceneError: it is none."""
    try:
        return root.model_validate(plain(tree))
    except ValidationError as error:
        raise scene_error(error, tree, root, beside=("include",)) from None


class _Includes:
    """Reads a file with all that it includes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.open: list[Path] = []
        self.count = 0

    def read(self, path: Path) -> Tree:
        """The file's tree, merged over those of the files under its key `include`."""
        self.count += 1
        if self.count > MOST_FILES:
            raise SceneError(f"{path}: more than {MOST_FILES} files are included")
        self.open.append(path)
        tree = self.merged_over_parts(read_file(path))
        self.open.pop()
        return tree

    def merged_over_parts(self, tree: Tree) -> Tree:
        """What a file says, merged over the files under its key `include`; so each of its steps."""
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
        """The tree of a file that is included by its name."""
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
    """The file names under `include`, one or several."""
    names = named.value if isinstance(named.value, list) else [named]
    for name in names:
        if not isinstance(name.value, str) or not name.value:
            raise SceneError(
                "include: a file name is due, or a list of them",
                "include: parts/skin.yaml",
                name.origin,
            )
    return names


def _inside(folder: Path, named: Tree) -> Path:
    """The path that `named` gives, relative to the file that says so, never outside `folder`."""
    name = str(named.value)
    home = folder if isinstance(named.origin, Option) else Path(named.origin.file).parent
    path = home / name
    steps = _normal(path.relative_to(folder)) if not PurePath(name).is_absolute() else None
    if steps is None or "\0" in name:
        raise SceneError(
            f"{name!r} leaves the scene's folder",
            f"put the file into {folder} or below and name it relative to this one",
            named.origin,
        )
    inside = folder.joinpath(*steps)
    target = os.path.realpath(inside)
    if not Path(target).is_relative_to(os.path.realpath(folder)):
        raise SceneError(
            f"{name!r} leaves the scene's folder by a symbolic link, to {target}",
            f"copy the file into {folder} or below",
            named.origin,
        )
    return inside


def _normal(path: PurePath) -> list[str] | None:
    """The steps of a relative path without "..", None where it climbs out."""
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
    """`tree` with one value set from the command line, "time.end=3 s"; `root` is the class of the
    whole file.

    Raises
    ------
    SceneError: no "=", a path that the schema or the scene does not have, a value that is no YAML.
    """
    option = Option(f"--set {override}")
    path, equals, text = override.partition("=")
    if not equals or not PATH.fullmatch(path.strip()):
        raise SceneError("must read PATH=VALUE", 'such as --set "time.end=3 s"', option)
    keys = keys_at(tree, path.strip(), option, root)
    value = read_text(text, lambda line, column: option)
    return replaced(tree, keys, value or Tree(None, option, option))


def keys_at(tree: Tree, path: str, origin: Origin, root: Model = Scene) -> Keys:
    """Return the keys of "time.end", or of "points[2][1]", which may be written "points.2.1".

    `origin` is where the path is written, `root` the class of the whole file.

    Raises
    ------
    SceneError: no path, or one that the schema or the scene does not have.
    """
    if not PATH.fullmatch(path):
        raise SceneError(f"{path!r} is no path of keys", 'such as "time.end"', origin)
    return tuple(_keys(tree, ENTRY.sub(r".\1", path).split("."), origin, root))


def _keys(tree: Tree, words: Sequence[str], origin: Origin, root: Model) -> Iterator[Key]:
    """The words as keys: whole numbers where the scene has a list; each must lead somewhere.

    A section of the schema may be absent from the file, a name before the last word may not: a
    mistyped body would become a new one.
    """
    place: Place | None = Place(root)
    held: Tree | None = tree
    for position, word in enumerate(words):
        is_last = position == len(words) - 1
        if held is not None and isinstance(held.value, list):
            key: Key = _index(held, word, origin)
        else:
            key = word
            if held is not None and held.value is not None and not isinstance(held.value, dict):
                raise SceneError(f"{words[position - 1]} holds no keys", location=origin)
        place = place.variant(plain(held) if held else {}) if place else None
        following = child(held, key) if held else None
        if place and following is None:
            known = list(place.models[0].model_fields) if len(place.models) == 1 else []
            names = list(held.value) if held and isinstance(held.value, dict) else []
            if (known and word not in known) or (not place.models and not is_last):
                hint = f"nothing is written there: give '{'.'.join(words[:position])}' whole"
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
            f"'{word}' is no entry of this list",
            f"entries 0 to {count - 1}" if count else "",
            origin,
        )
    return int(word)
