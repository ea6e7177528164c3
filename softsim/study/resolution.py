"""From a case to its scene, and to the key that its result is stored under."""

import hashlib
from collections.abc import Iterator, Sequence
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pydantic import BaseModel

import softsim
from softsim.errors import SceneError
from softsim.scene.assessment import layout_tree
from softsim.scene.loading import LoadedScene, overridden, read_scene, validated
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


@lru_cache(maxsize=4096)
def known_tree(source: Source, overrides: tuple[str, ...] = ()) -> Tree:
    """What a source says with overrides. Each file is read once, until `forget_files`, and cases
    share what they begin with: of ten thousand each costs some milliseconds. SceneError.
    """
    if not overrides:
        return source_tree(source)
    return overridden(known_tree(source, overrides[:-1]), overrides[-1])


def forget_files() -> None:
    """Read the files of all sources anew from here on."""
    known_tree.cache_clear()


def resolved(case: Case) -> LoadedScene:
    """The scene of a case, of files read before. SceneError as load_scene."""
    return validated(known_tree(case.source, case.overrides), case.source.scene, ())


def case_key(loaded: LoadedScene) -> str:
    """Digest of all that decides the result of a run: the same for cases that ask for the same.

    That is every value of the scene, the files that it names, softsim's version and sources.
    Raises SceneError where a file that it names is missing.
    """
    digest = hashlib.sha256(source_digest().encode())
    digest.update(loaded.scene.model_dump_json().encode())
    for keys in file_keys(loaded.scene):
        path = loaded.resolve_file(keys)
        digest.update(_content_digest(path, path.stat().st_mtime_ns))
    return digest.hexdigest()[:20]


def key_of(case: Case) -> str:
    """The key of a case, also of one that is no scene: a combination of values that do not go
    together is a row of the table like others, in which its run says what is wrong.
    """
    try:
        return case_key(resolved(case))
    except SceneError:
        asked = (source_digest(), str(case.source), *case.overrides)
        return hashlib.sha256("\n".join(asked).encode()).hexdigest()[:20]


@lru_cache(maxsize=1)
def source_digest() -> str:
    """Digest of softsim's version, its sources, and the constants that come with it."""
    home = Path(softsim.__file__).parent
    digest = hashlib.sha256(version("softsim").encode())
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
