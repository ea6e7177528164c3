"""From values of the factors to a scene: which file, and what is set in it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from softsim.errors import SceneError
from softsim.scene.reporting import did_you_mean
from softsim.scene.robots import robot_names
from softsim.scene.tree import Tree, child, entries
from softsim.study.case import Source, Value
from softsim.study.designs import refuse_incomplete_rows, rows
from softsim.study.factor_reading import factor_in, scene_file, scenes_factor
from softsim.study.factors import Factor
from softsim.study.resolution import known_tree
from softsim.study.schema import ListDesign, ScenesFactor, Study
from softsim.study.settings import Setting, option_setting, setting, with_options, with_settings


@dataclass(frozen=True)
class Composition:
    """What all cases share, and what varies. scene: None where a factor chooses it."""

    scene: Path | None
    robot: str | None
    shared: tuple[Setting, ...]
    factors: tuple[Factor, ...]

    def source(self, values: Mapping[str, Value]) -> Source:
        """The scene of a case with these values of the factors, by name."""
        chosen = [factor.scene(values[factor.axis.name]) for factor in self.factors]
        scene = next((path for path in chosen if path is not None), self.scene)
        assert scene is not None  # composed has seen to it
        return Source(scene, self.robot)

    def settings(self, values: Mapping[str, Value]) -> tuple[Setting, ...]:
        """What is set in it, in the order of the factors."""
        varied = (one for f in self.factors for one in f.settings(values[f.axis.name]))
        return (*self.shared, *varied)


def composed(study: Study, tree: Tree, folder: Path, overrides: Sequence[str]) -> Composition:
    """How values of a study's factors make a scene; the study lies in `folder`.

    Raises
    ------
    SceneError: a scene, a robot, a key or values that are not there.
    """
    refuse_unknown_robot(tree)
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
    alone = Composition(scene, study.robot, shared, tuple(scenes.values()))
    source = alone.source({name: factor.tried[0] for name, factor in scenes.items()})
    base = with_settings(known_tree(source), shared)
    factors: list[Factor] = []
    for name, part in study.factors.items():
        if isinstance(part, ScenesFactor):
            factors.append(scenes[name])
            continue
        in_list = None
        if isinstance(study.design, ListDesign):
            in_list = [row[name] for row in rows(tree)]
        factor = factor_in(name, part, held[name], base, in_list)
        base = with_settings(base, factor.settings(factor.tried[0]))
        factors.append(factor)
    return Composition(scene, study.robot, shared, tuple(factors))


def refuse_unknown_robot(tree: Tree) -> None:
    """SceneError at the name of a robot that does not ship with softsim."""
    robot = child(tree, "robot")
    if robot is not None and robot.value is not None and robot.text not in robot_names():
        hint = did_you_mean(robot.text, robot_names())
        raise SceneError(f"there is no robot {robot.text!r}", hint, robot.origin)


def refuse_other_than_one_scene(study: Study, tree: Tree) -> None:
    """A scene, or a factor that chooses it. SceneError at the one too many."""
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
        raise SceneError("the scene is chosen twice", hint, places[-1])
