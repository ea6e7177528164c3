"""Cases of a study.

A case has a scene file with settings, the scene that results, the key under which its result is
stored, and a status.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

from pydantic import BaseModel

import softsim
from softsim import __version__
from softsim.analysis.catalogue import produced
from softsim.applications import STUDY_MODELS, entry
from softsim.errors import Option, SceneError
from softsim.scene.loading import (
    Loaded,
    flow_text,
    layout_tree,
    overridden,
    read_scene,
    validated_as,
)
from softsim.scene.measures import Measure, recorded
from softsim.scene.schema import Scene
from softsim.scene.text import Origin, Tree

Value = float | str

Program = Callable[[Loaded[Any], Path], object]
"""Function that runs a scene and writes its results into a folder. Raises SoftsimError."""

DONE, FAILED, PRUNED, LOST, WAITING = "done", "failed", "pruned", "lost", "waiting"
"""Status of a case: its run ended; a guard stopped it, or its scene is invalid; the optimiser
stopped it; its process died at each attempt; it was not run yet."""


@dataclass(frozen=True)
class Source:
    """Scene file, with the standard robot that is added to it if it is a bare layout.

    The finite element engine runs it. An application derives a class for files of its own, and
    lists it in `STUDY_MODELS`. root: the class of the whole file.
    """

    scene: Path
    robot: str | None = None

    root: ClassVar[type[BaseModel]] = Scene

    def tree(self) -> Tree:
        """Return the tree of its files. Raises SceneError as load_scene."""
        if self.robot is None:
            return read_scene(self.scene)
        return layout_tree(self.scene, self.robot)

    @staticmethod
    def refuse_unsupported(study: Tree) -> None:
        """Raise SceneError at options of a study that its model does not support."""

    @property
    def program(self) -> Program | None:
        """Function that runs its scene; None: the finite element engine runs it."""
        return None

    @staticmethod
    def produced(scene: Any) -> dict[str, Measure]:
        """Return the measures of a run of a scene, by name."""
        return produced(scene)

    @staticmethod
    def recorded(scene: Any) -> dict[str, Measure]:
        """Return the columns of the history of a run of a scene, by name."""
        return recorded(scene)

    @property
    def command(self) -> tuple[str, ...]:
        """Command line that runs it."""
        if self.robot is None:
            return ("softsim", "run", str(self.scene))
        return ("softsim", "assess", str(self.scene), "--robot", self.robot)


def source_class(model: str) -> type[Source]:
    """Return the class of the sources of a study with this `model`."""
    found: type[Source] = entry(STUDY_MODELS[model]) if model in STUDY_MODELS else Source
    return found


@dataclass(frozen=True)
class Case:
    """Case of a study: a row of its table.

    number: from 1, in the order of the table. values: factor -> its number, in the unit of its
    column, or its label; with repeats also "repeat" -> 1, 2, ... overrides: "time.end=3 s" each, as
    for `load_scene`; later ones win.
    """

    number: int
    source: Source
    overrides: tuple[str, ...] = ()
    values: Mapping[str, Value] = field(default_factory=dict)


@dataclass(frozen=True)
class Setting:
    """Key of the scene and its value, as YAML text in the form of --set.

    path_origin, origin: where the study gives the key and the value.
    """

    path: str
    text: str
    path_origin: Origin
    origin: Origin

    @property
    def override(self) -> str:
        """Setting in the form that `load_scene` accepts: "time.end=3 s"."""
        return f"{self.path}={self.text}"


def setting(path: str, value: Tree) -> Setting:
    """Return the setting of an entry {path: value} of the study."""
    return Setting(path, flow_text(value), value.key_origin, value.origin)


def with_settings(root: type[BaseModel], tree: Tree, settings: Sequence[Setting]) -> Tree:
    """Return the tree of a file of the class `root` with the settings; later ones win.

    Raises
    ------
    SceneError: the scene has no such key; located where the study gives it.
    """
    for one in settings:
        try:
            tree = overridden(tree, one.override, root)
        except SceneError as error:
            raise SceneError(error.message, error.hint, one.path_origin) from None
    return tree


def scene_with(
    root: type[BaseModel], tree: Tree, path: Path, settings: Sequence[Setting]
) -> Loaded[Any]:
    """Return the scene at `path`, of the class `root`, with the settings; `tree` holds its files.

    Raises
    ------
    SceneError: a setting is invalid, located at its value in the study; or the scene itself is.
    """
    places = {f"--set {one.override}": one.origin for one in settings}
    try:
        return validated_as(root, with_settings(root, tree, settings), path)
    except SceneError as error:
        raise _at_the_study(error, places) from None


def _at_the_study(error: SceneError, places: dict[str, Origin]) -> SceneError:
    """Return the error, located in the study instead of on an internal command line."""
    location = places.get(str(error.location), error.location)
    further = [_at_the_study(one, places) for one in error.further]
    return SceneError(error.message, error.hint, location, further)


def refuse_overwriting(settings: Sequence[Setting], earlier: Sequence[Setting] = ()) -> None:
    """Raise SceneError if a setting overwrites an earlier one, by the same key or a parent key.

    Raises
    ------
    SceneError: located at the path of the later one.
    """
    known = list(earlier)
    for one in settings:
        for other in known:
            if _is_at_or_below(other.path, one.path):
                hint = f"{other.path}, at {other.path_origin}"
                raise SceneError(f"{one.path} is already set", hint, one.path_origin)
        known.append(one)


def option_setting(override: str) -> Setting:
    """Return the setting of a --set option. Raises SceneError if it is not PATH=VALUE."""
    option = Option(f"--set {override}")
    path, equals, text = override.partition("=")
    if not equals:
        raise SceneError("must read PATH=VALUE", 'such as --set "time.end=3 s"', option)
    return Setting(path.strip(), text.strip(), option, option)


def with_options(settings: Sequence[Setting], options: Sequence[Setting]) -> tuple[Setting, ...]:
    """Return the settings of a file with options, which replace settings at or below their key."""
    kept = list(settings)
    for option in options:
        kept = [one for one in kept if not _is_at_or_below(one.path, option.path)]
        kept.append(option)
    return tuple(kept)


def _is_at_or_below(path: str, above: str) -> bool:
    return path == above or path.startswith(above + ".")


def load_source(source: Source, overrides: Sequence[str] = ()) -> Loaded[Any]:
    """Return the scene of a source, its files read again. Raises SceneError as load_scene."""
    return validated_as(source.root, source.tree(), source.scene, overrides)


@lru_cache(maxsize=4096)
def known_tree(source: Source, overrides: tuple[str, ...] = ()) -> Tree:
    """Return the tree of a source with overrides; cached until `forget_files`.

    Cases share the trees of their leading overrides: among ten thousand cases each costs some
    milliseconds. Raises SceneError.
    """
    if not overrides:
        return source.tree()
    return overridden(known_tree(source, overrides[:-1]), overrides[-1], source.root)


def forget_files() -> None:
    """Clear the cache, so that the files of all sources are read again."""
    known_tree.cache_clear()


def resolved(case: Case) -> Loaded[Any]:
    """Return the scene of a case, from cached files. Raises SceneError as load_scene."""
    tree = known_tree(case.source, case.overrides)
    return validated_as(case.source.root, tree, case.source.scene)


def case_key(loaded: Loaded[Any]) -> str:
    """Return the digest of all inputs of a run; identical cases have the same one.

    The inputs are every value of the scene, the files that it names, softsim's version and sources.
    Raises SceneError where a file that it names is missing.
    """
    digest = hashlib.sha256(source_digest().encode())
    digest.update(loaded.scene.model_dump_json().encode())
    for content in loaded.file_digests().values():
        digest.update(content.encode())
    return digest.hexdigest()[:20]


def key_of(case: Case) -> str:
    """Return the key of a case, also of one whose scene is invalid.

    An invalid combination of values is a row of the table like others, with the error as the
    reason of its failure.
    """
    try:
        return case_key(resolved(case))
    except SceneError:
        asked = (source_digest(), str(case.source), *case.overrides)
        return hashlib.sha256("\n".join(asked).encode()).hexdigest()[:20]


@lru_cache(maxsize=1)
def source_digest() -> str:
    """Return the digest of softsim's version, its sources, and the constants that come with it."""
    home = Path(softsim.__file__).parent
    digest = hashlib.sha256(__version__.encode())
    for path in sorted(p for p in home.rglob("*") if p.suffix in (".py", ".yaml")):
        digest.update(str(path.relative_to(home)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()
