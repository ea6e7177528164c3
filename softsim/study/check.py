"""A study is checked before anything runs: each value of each factor once, with the first values of
the others. What only fails in another combination is a failed row of the table.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from softsim.errors import SceneError
from softsim.scene.loading import Loaded
from softsim.study.cases import Value, file_keys, known_tree, refuse_overwriting, scene_with
from softsim.study.design import Composition
from softsim.study.factors import Factor
from softsim.study.repeats import Perturbation


def checked_scenes(
    composition: Composition, perturbed: Sequence[Perturbation]
) -> list[Loaded[Any]]:
    """The scenes with which the study was checked, the first with the first value of each factor.

    Raises
    ------
    SceneError: what is wrong, at the place in the study that brings it about.
    """
    refuse_conflicts(composition)
    first = {factor.axis.name: factor.tried[0] for factor in composition.factors}
    base = scene_of(composition, first)
    for repeat in sorted({repeat for one in perturbed for repeat in one.extremes}):
        refuse_wrong_repeat(base, perturbed, repeat)
    scenes = [base]
    for factor in composition.factors:
        for value in factor.tried[1:]:
            values = {**first, factor.axis.name: value}
            try:
                scene = scene_of(composition, values)
                if perturbed:
                    refuse_wrong_repeat(scene, perturbed, 1)
            except SceneError as error:
                raise brought_about(error, factor, value) from None
            scenes.append(scene)
    return scenes


def refuse_conflicts(composition: Composition) -> None:
    """Nothing sets what another has set. SceneError at the later one."""
    refuse_overwriting(composition.shared)
    earlier = list(composition.shared)
    for factor in composition.factors:
        settings = [factor.settings(value) for value in factor.tried]
        for of_value in settings:
            refuse_overwriting(of_value, earlier)
        earlier.extend(one for of_value in settings for one in of_value)


def scene_of(composition: Composition, values: Mapping[str, Value]) -> Loaded[Any]:
    """The scene of a case with these values, whose files are there. SceneError."""
    source = composition.source(values)
    settings = composition.settings(values)
    loaded = scene_with(source.root, known_tree(source), source.scene, settings)
    for keys in file_keys(loaded.scene):
        loaded.resolve_file(keys)
    return loaded


def refuse_wrong_repeat(
    loaded: Loaded[Any], perturbed: Sequence[Perturbation], repeat: int
) -> None:
    """A repeat must be a scene too. SceneError at the deviation."""
    settings = [one.setting(loaded, repeat) for one in perturbed]
    try:
        scene_with(type(loaded.scene), loaded.tree, loaded.path, settings)
    except SceneError as error:
        message = f"in repeat {repeat}: {error.message}"
        hint = "a smaller deviation keeps within limits"
        raise SceneError(message, hint, error.location) from None


def brought_about(error: SceneError, factor: Factor, value: Value) -> SceneError:
    """An error of a scene that holds without this value, at the place of the value, though another
    value of the scene is what does not go with it. Another scene's error stays where it is.
    """
    settings = factor.settings(value)
    own = [place for one in settings for place in (one.origin, one.path_origin)]
    if not settings or error.location in own:
        return error
    shown = value if isinstance(value, str) else f"{value:.6g} {factor.axis.unit}".rstrip()
    message = f"{factor.axis.name} = {shown} does not go with the rest"
    return SceneError(message, "", settings[0].origin, [error])
