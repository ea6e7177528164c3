"""Scenes from files: YAML, `include`, `--set`, validation, and the place of every value."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from softsim.errors import Location, SceneError
from softsim.scene.reporting import validation_error
from softsim.scene.schema import Scene
from softsim.scene.tree import Entry, PathKey, merged, parse_tree, read_tree


@dataclass(frozen=True)
class LoadedScene:
    """A checked scene, and where each of its values was written."""

    scene: Scene
    path: Path
    tree: Entry

    @property
    def folder(self) -> Path:
        """The folder of the scene file."""
        return self.path.parent

    def error(self, path: PathKey, message: str, hint: str = "") -> SceneError:
        """An error at the value of `path`, or at its nearest ancestor that was written."""
        return SceneError(message, hint, self.tree.nearest(path).location)

    def resolve_file(self, path: PathKey) -> Path:
        """The file named by the value at `path`, relative to the file that says so.

        Raises SceneError if it lies outside the scene's folder or is not there.
        """
        entry = self.tree.nearest(path)
        base = Path(entry.location.file)
        base = base.parent if base.is_file() else self.folder
        target = _inside(self.folder, base, str(entry.value), entry.location)
        if not target.is_file():
            raise SceneError(f"there is no file {target}", "", entry.location)
        return target

    def resolved(self) -> str:
        """The scene with every value, defaults too, each with its origin as a comment.

        Loading this text gives the same scene.
        """
        values = self.scene.model_dump(mode="json", exclude_none=True)
        return "\n".join(_lines(values, self.tree, "")) + "\n"


def load_scene(path: Path | str, overrides: Sequence[str] = ()) -> LoadedScene:
    """Read and check a scene file; `overrides` are "a.b.c=value".

    Raises SceneError with the place of everything that is wrong.
    """
    path = Path(path)
    tree = _with_includes(path, path.parent, ())
    for override in overrides:
        tree = _overridden(tree, override)
    try:
        scene = Scene.model_validate(tree.plain())
    except ValidationError as error:
        raise validation_error(error, tree) from None
    return LoadedScene(scene, path, tree)


def _with_includes(path: Path, root: Path, open_files: tuple[Path, ...]) -> Entry:
    tree = read_tree(path, str(path))
    include = tree.value.pop("include", None)
    if include is None:
        return tree
    names = include.value if isinstance(include.value, list) else [include]
    below = Entry({}, tree.location)
    for entry in names:
        if not isinstance(entry.value, str):
            raise SceneError("include needs the path of a file", "include: parts/robot.yaml",
                             entry.location)  # fmt: skip
        target = _inside(root, path.parent, entry.value, entry.location)
        chain = (*open_files, path.resolve())
        if target.resolve() in chain:
            raise SceneError(f"{entry.value} includes itself", "remove one of the includes",
                             entry.location)  # fmt: skip
        if not target.is_file():
            raise SceneError(f"there is no file {target}", "", entry.location)
        below = merged(below, _with_includes(target, root, chain))
    return merged(below, tree)


def _inside(root: Path, base: Path, name: str, location: Location) -> Path:
    target = base / name
    if not target.resolve().is_relative_to(root.resolve()):
        raise SceneError(
            f"'{name}' leaves the scene's folder {root.resolve()}",
            "keep included and mesh files beside the scene or below it",
            location,
        )
    return target


def _overridden(tree: Entry, override: str) -> Entry:
    name, equals, text = override.partition("=")
    shown = f"--set {override}"
    keys = name.strip().split(".")
    if not equals or not all(keys):
        raise SceneError(
            f"{shown}: an override is PATH=VALUE", "--set contact.friction_coefficient=0.6"
        )
    value = parse_tree(text, shown) if text.strip() else Entry(None, Location(shown, 1, 1, text))
    return _placed(tree, keys, value, shown)


def _placed(entry: Entry, keys: list[str], value: Entry, shown: str) -> Entry:
    """`entry` with `value` at `keys`; mappings grow, lists do not."""
    if not keys:
        location = Location(shown, 1, 1, value.location.text)
        return Entry(value.value, location, location)
    key, rest = keys[0], keys[1:]
    here = Location(shown, 1, 1, "")
    if isinstance(entry.value, list):
        if not key.isdigit() or int(key) >= len(entry.value):
            raise SceneError(f"'{key}' is no index of a list of {len(entry.value)}", "", here)
        items = list(entry.value)
        items[int(key)] = _placed(items[int(key)], rest, value, shown)
        return Entry(items, entry.location, entry.key_location)
    if not isinstance(entry.value, dict):
        raise SceneError(f"'{key}' lies below a value, not below a mapping", "", here)
    below = entry.value.get(key, Entry({}, here, here))
    return Entry(
        {**entry.value, key: _placed(below, rest, value, shown)},
        entry.location,
        entry.key_location,
    )


def _lines(values: dict[str, Any], tree: Entry | None, indent: str) -> Iterator[str]:
    for key, value in values.items():
        entry = None if tree is None else tree.child(key)
        if isinstance(value, dict) and value:
            yield f"{indent}{key}:"
            yield from _lines(value, entry, indent + "  ")
        elif entry is None:
            yield f"{indent}{key}: {json.dumps(value, ensure_ascii=False)}  # default"
        else:
            given = json.dumps(entry.plain(), ensure_ascii=False)
            yield f"{indent}{key}: {given}  # {_origin(entry.location)}"


def _origin(location: Location) -> str:
    shown = str(location.file)
    return shown if shown.startswith("--set") else f"{shown}:{location.line}"
