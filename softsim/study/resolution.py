"""From a case to its scene, and to the key that its result is stored under."""

import hashlib
from collections.abc import Iterator, Sequence
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pydantic import BaseModel

import softsim
from softsim.scene.assessment import layout_tree
from softsim.scene.loading import LoadedScene, read_scene, validated
from softsim.scene.tree import Keys, Tree
from softsim.study.case import Case, Source


def load_source(source: Source, overrides: Sequence[str] = ()) -> LoadedScene:
    """The scene of a source, its files read anew. SceneError as load_scene."""
    return validated(source_tree(source), source.scene, overrides)


def source_tree(source: Source) -> Tree:
    """What the files of a source say. SceneError as load_scene."""
    if source.robot is None:
        return read_scene(source.scene)
    return layout_tree(source.scene, source.robot)


known_tree = lru_cache(maxsize=256)(source_tree)
"""`source_tree`, each source read once."""


def forget_files() -> None:
    """Read the files of all sources anew from here on."""
    known_tree.cache_clear()


def resolved(case: Case) -> LoadedScene:
    """The scene of a case. SceneError as load_scene.

    The files of a source are read once, until `forget_files`: ten thousand cases share a few.
    """
    return validated(known_tree(case.source), case.source.scene, case.overrides)


def case_key(loaded: LoadedScene) -> str:
    """Digest of all that decides the result of a run: the same for cases that ask for the same.

    That is every value of the scene, the files that it names, softsim's version and sources.
    Raises SceneError where a file that it names is missing.
    """
    digest = hashlib.sha256()
    for part in (loaded.scene.model_dump_json(), version("softsim"), source_digest()):
        digest.update(part.encode() + b"\n")
    for keys in file_keys(loaded.scene):
        path = loaded.resolve_file(keys)
        digest.update(_content_digest(path, path.stat().st_mtime_ns))
    return digest.hexdigest()[:20]


@lru_cache(maxsize=1)
def source_digest() -> str:
    """Digest of softsim's sources and the constants that come with it."""
    home = Path(softsim.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(p for p in home.rglob("*") if p.suffix in (".py", ".yaml")):
        digest.update(str(path.relative_to(home)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def file_keys(part: Any, keys: Keys = ()) -> Iterator[Keys]:
    """The keys of all files that a scene names: meshes of bodies, walls."""
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


@lru_cache(maxsize=256)
def _content_digest(path: Path, changed_at: int) -> bytes:
    return hashlib.sha256(path.read_bytes()).digest()
