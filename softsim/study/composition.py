"""Composition of scenes from values of the factors, and the check of a study before it runs.

Each value of each factor is checked once, with the first values of the others. An error that only
occurs in another combination gives a failed row of the table.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from softsim.errors import SceneError
from softsim.scene.loading import Loaded, file_keys, robot_names
from softsim.scene.reporting import did_you_mean
from softsim.scene.text import Tree, child, entries
from softsim.study.cases import (
    Setting,
    Source,
    Value,
    known_tree,
    option_setting,
    refuse_overwriting,
    scene_with,
    setting,
    source_class,
    with_options,
    with_settings,
)
from softsim.study.design import Perturbation, refuse_incomplete_rows, rows
from softsim.study.factors import Factor, factor_in, scene_file, scenes_factor
from softsim.study.schema import ListDesign, ScenesFactor, StudySpec


@dataclass(frozen=True)
class Composition:
    """Shared settings and factors of all cases of a study.

    kind: class of the sources. scene: None if a factor chooses it.
    """

    kind: type[Source]
    scene: Path | None
    robot: str | None
    shared: tuple[Setting, ...]
    factors: tuple[Factor, ...]

    def source(self, values: Mapping[str, Value]) -> Source:
        """Return the source of a case with these values of the factors, by name."""
        chosen = [factor.scene(values[factor.axis.name]) for factor in self.factors]
        scene = next((path for path in chosen if path is not None), self.scene)
        assert scene is not None  # composed has seen to it
        return self.kind(scene, self.robot)

    def settings(self, values: Mapping[str, Value]) -> tuple[Setting, ...]:
        """Return the settings of a case with these values, in the order of the factors."""
        varied = (one for f in self.factors for one in f.settings(values[f.axis.name]))
        return (*self.shared, *varied)

    def loaded(self, values: Mapping[str, Value]) -> Loaded[Any]:
        """Return the scene of a case. Raises SceneError, also if one of its files is missing."""
        source = self.source(values)
        loaded = scene_with(source.root, known_tree(source), source.scene, self.settings(values))
        for keys in file_keys(loaded.scene):
            loaded.resolve_file(keys)
        return loaded


def composed(study: StudySpec, tree: Tree, folder: Path, overrides: Sequence[str]) -> Composition:
    """Return the composition of a study that lies in `folder`.

    Raises
    ------
    SceneError: a scene, a robot, a key or values are missing.
    """
    refuse_unknown_robot(tree)
    kind = source_class(study.model)
    kind.refuse_unsupported(tree)
    refuse_other_than_one_scene(study, tree)
    if isinstance(study.design, ListDesign):
        refuse_incomplete_rows(tree, list(study.factors))
    given = [setting(*entry) for entry in entries(tree, "set").items()]
    shared = with_options(given, [option_setting(one) for one in overrides])
    held = entries(tree, "factors")
    scenes: dict[str, Factor] = {
        name: scenes_factor(name, part.about, held[name], folder)
        for name, part in study.factors.items()
        if isinstance(part, ScenesFactor)
    }
    named = child(tree, "scene")
    scene = scene_file(named, folder) if named is not None else None
    alone = Composition(kind, scene, study.robot, shared, tuple(scenes.values()))
    source = alone.source({name: factor.tried[0] for name, factor in scenes.items()})
    base = with_settings(source.root, known_tree(source), shared)
    factors: list[Factor] = []
    for name, part in study.factors.items():
        if isinstance(part, ScenesFactor):
            factors.append(scenes[name])
            continue
        is_list = isinstance(study.design, ListDesign)
        in_list = [row[name] for row in rows(tree)] if is_list else None
        factor = factor_in(name, part, held[name], source.root, base, in_list)
        base = with_settings(source.root, base, factor.settings(factor.tried[0]))
        factors.append(factor)
    return replace(alone, factors=tuple(factors))


def refuse_unknown_robot(tree: Tree) -> None:
    """Raise SceneError at the name of a robot that does not ship with softsim."""
    robot = child(tree, "robot")
    if robot is not None and robot.value is not None and robot.text not in robot_names():
        hint = did_you_mean(robot.text, robot_names())
        raise SceneError(f"there is no robot {robot.text!r}", hint, robot.origin)


def refuse_other_than_one_scene(study: StudySpec, tree: Tree) -> None:
    """Raise SceneError unless the study has one scene, or one factor that chooses it."""
    choosing = [name for name, part in study.factors.items() if isinstance(part, ScenesFactor)]
    places = [entries(tree, "factors")[name].key_origin for name in choosing]
    named = child(tree, "scene")
    if named is not None:
        places.append(named.key_origin)
    if not places:
        hint = "give scene: FILE, or a factor with scenes: {LABEL: FILE, ...}"
        raise SceneError("the study names no scene", hint, tree.origin)
    if len(places) > 1:
        hint = "give one: scene, or a factor with scenes"
        raise SceneError("the scene is given twice", hint, places[-1])


def checked_scenes(
    composition: Composition, perturbed: Sequence[Perturbation]
) -> list[Loaded[Any]]:
    """Check the study, and return the scenes used, the first with the first value of each factor.

    Raises
    ------
    SceneError: located at the place in the study that causes the error.
    """
    refuse_conflicts(composition)
    first = {factor.axis.name: factor.tried[0] for factor in composition.factors}
    base = composition.loaded(first)
    for repeat in sorted({repeat for one in perturbed for repeat in one.extremes}):
        refuse_wrong_repeat(base, perturbed, repeat)
    scenes = [base]
    for factor in composition.factors:
        for value in factor.tried[1:]:
            try:
                scene = composition.loaded({**first, factor.axis.name: value})
                if perturbed:
                    refuse_wrong_repeat(scene, perturbed, 1)
            except SceneError as error:
                raise brought_about(error, factor, value) from None
            scenes.append(scene)
    return scenes


def refuse_conflicts(composition: Composition) -> None:
    """Raise SceneError if two settings conflict, located at the later one."""
    refuse_overwriting(composition.shared)
    earlier = list(composition.shared)
    for factor in composition.factors:
        settings = [factor.settings(value) for value in factor.tried]
        for of_value in settings:
            refuse_overwriting(of_value, earlier)
        earlier += itertools.chain(*settings)


def refuse_wrong_repeat(
    loaded: Loaded[Any], perturbed: Sequence[Perturbation], repeat: int
) -> None:
    """Raise SceneError if a perturbed repeat is no valid scene, located at the deviation."""
    settings = [one.setting(loaded, repeat) for one in perturbed]
    try:
        scene_with(type(loaded.scene), loaded.tree, loaded.path, settings)
    except SceneError as error:
        message = f"in repeat {repeat}: {error.message}"
        hint = "use a smaller deviation to stay within the limits"
        raise SceneError(message, hint, error.location) from None


def brought_about(error: SceneError, factor: Factor, value: Value) -> SceneError:
    """Return an error that a value causes in an otherwise valid scene, located at the value.

    The original error, at another value of the scene that conflicts with it, is attached. An error
    of another scene file stays where it is.
    """
    settings = factor.settings(value)
    own = [place for one in settings for place in (one.origin, one.path_origin)]
    if not settings or error.location in own:
        return error
    shown = value if isinstance(value, str) else f"{value:.6g} {factor.axis.unit}".rstrip()
    message = f"{factor.axis.name} = {shown} does not fit the other settings"
    return SceneError(message, "", settings[0].origin, [error])
