"""What a study sets in a scene, and where the study says so."""

from collections.abc import Sequence
from dataclasses import dataclass

from softsim.errors import Option, SceneError
from softsim.scene.loading import LoadedScene, overridden, validated
from softsim.scene.resolved import flow_text
from softsim.scene.tree import Origin, Tree
from softsim.study.case import Source


@dataclass(frozen=True)
class Setting:
    """A key of the scene and its value, as text: YAML, as --set has it; where the study says the
    one and the other.
    """

    path: str
    text: str
    path_origin: Origin
    origin: Origin

    @property
    def override(self) -> str:
        """As `load_scene` takes it: "time.end=3 s"."""
        return f"{self.path}={self.text}"


def setting(path: str, value: Tree) -> Setting:
    """The setting that an entry {path: value} of the study is."""
    return Setting(path, flow_text(value), value.key_origin, value.origin)


def with_settings(tree: Tree, settings: Sequence[Setting]) -> Tree:
    """A scene's tree with the settings, of which later ones win.

    Raises
    ------
    SceneError: the scene has no such key, at the place where the study gives it.
    """
    for one in settings:
        try:
            tree = overridden(tree, one.override)
        except SceneError as error:
            raise SceneError(error.message, error.hint, one.path_origin) from None
    return tree


def scene_with(tree: Tree, source: Source, settings: Sequence[Setting]) -> LoadedScene:
    """The scene of a source, of which `tree` is what its files say, with the settings.

    Raises
    ------
    SceneError: what is wrong with a setting, at the value that the study gives it; or with the
    scene itself.
    """
    places = {f"--set {one.override}": one.origin for one in settings}
    try:
        return validated(with_settings(tree, settings), source.scene, ())
    except SceneError as error:
        raise _at_the_study(error, places) from None


def _at_the_study(error: SceneError, places: dict[str, Origin]) -> SceneError:
    """The error with locations on a command line that nobody wrote replaced."""
    location = places.get(str(error.location), error.location)
    further = [_at_the_study(one, places) for one in error.further]
    return SceneError(error.message, error.hint, location, further)


def refuse_overwriting(settings: Sequence[Setting], earlier: Sequence[Setting] = ()) -> None:
    """Settings must not undo earlier ones, by the same key or one that holds it.

    Raises
    ------
    SceneError: at the later one's path.
    """
    known = list(earlier)
    for one in settings:
        for other in known:
            if _is_at_or_below(other.path, one.path):
                hint = f"{other.path}, at {other.path_origin}"
                raise SceneError(f"{one.path} is set already", hint, one.path_origin)
        known.append(one)


def option_setting(override: str) -> Setting:
    """The setting that --set gives on the command line. SceneError: it reads not PATH=VALUE."""
    option = Option(f"--set {override}")
    path, equals, text = override.partition("=")
    if not equals:
        raise SceneError("must read PATH=VALUE", 'such as --set "time.end=3 s"', option)
    return Setting(path.strip(), text.strip(), option, option)


def with_options(settings: Sequence[Setting], options: Sequence[Setting]) -> tuple[Setting, ...]:
    """The settings of a file, of which options replace those of the same key or below it."""
    kept = list(settings)
    for option in options:
        kept = [one for one in kept if not _is_at_or_below(one.path, option.path)]
        kept.append(option)
    return tuple(kept)


def _is_at_or_below(path: str, above: str) -> bool:
    return path == above or path.startswith(above + ".")
