"""A design puts values of the factors together; a composition makes a scene of them."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from softsim.errors import SceneError
from softsim.scene.reporting import did_you_mean
from softsim.scene.robots import robot_names
from softsim.scene.tree import Tree, child, entries, listed, nearest
from softsim.study.cases import (
    SOURCES,
    Setting,
    Source,
    Value,
    known_tree,
    option_setting,
    setting,
    with_options,
    with_settings,
)
from softsim.study.factors import Factor, factor_in, scene_file, scenes_factor
from softsim.study.schema import (
    GridDesign,
    LatinHypercubeDesign,
    ListDesign,
    PointDesign,
    ScenesFactor,
    SobolDesign,
    Study,
)
from softsim.study.values import Interval, at

Point = tuple[Value, ...]
"""A value of each factor, in their order."""


def point_count(design: PointDesign, factors: Sequence[Factor]) -> int:
    """How many points a design has, without making them."""
    if isinstance(design, GridDesign):
        return math.prod(len(_levels(factor)) for factor in factors)
    return len(design.cases) if isinstance(design, ListDesign) else design.count


def points(design: PointDesign, factors: Sequence[Factor], tree: Tree) -> Iterator[Point]:
    """The points of a design, in the order of the table; `tree` is what the study says."""
    if isinstance(design, GridDesign):
        yield from itertools.product(*(_levels(factor) for factor in factors))
    elif isinstance(design, ListDesign):
        for row in rows(tree):
            yield tuple(factor.read(row[factor.axis.name]) for factor in factors)
    else:
        for shares in even_shares(design, len(factors)):
            pairs = zip(factors, shares, strict=True)
            yield tuple(at(factor.space, share) for factor, share in pairs)


def even_shares(design: LatinHypercubeDesign | SobolDesign, dimension: int) -> list[list[float]]:
    """Points (count, dimension) that fill the unit cube evenly."""
    from scipy.stats import qmc  # slow to import

    is_sobol = isinstance(design, SobolDesign)
    engine = (qmc.Sobol if is_sobol else qmc.LatinHypercube)(dimension, seed=design.seed)
    shares: list[list[float]] = engine.random(design.count).tolist()
    return shares


def rows(tree: Tree) -> list[dict[str, Tree]]:
    """The cases that a list design writes."""
    return [dict(entries(case)) for case in listed(tree, "design", "cases")]


def refuse_incomplete_rows(tree: Tree, names: Sequence[str]) -> None:
    """Each case of a list gives each factor, and nothing else. SceneError at the case."""
    for number, row in enumerate(rows(tree)):
        for name, value in row.items():
            if name not in names:
                hint = did_you_mean(name, names)
                raise SceneError(f"there is no factor '{name}'", hint, value.key_origin)
        missing = [name for name in names if name not in row]
        if missing:
            place = nearest(tree, ("design", "cases", number))[0]
            raise SceneError(f"the case has no value of {', '.join(missing)}", "", place.origin)


def refuse_misfit(design: PointDesign, factors: Sequence[Factor], tree: Tree) -> None:
    """A grid needs values; a Sobol sequence a power of two of points. SceneError there."""
    if isinstance(design, GridDesign):
        for factor in factors:
            if isinstance(factor.space, Interval):
                place = nearest(tree, ("factors", factor.axis.name))[0]
                raise SceneError(
                    f"{factor.axis.name}: a grid needs the number of its values",
                    "give a count, or another design", place.key_origin,
                )  # fmt: skip
    elif isinstance(design, SobolDesign) and design.count & (design.count - 1):
        below = 1 << (design.count.bit_length() - 1)
        raise SceneError(
            f"count: {design.count} is no power of two, so the sequence would not be even",
            f"take {below} or {2 * below}", nearest(tree, ("design", "count"))[0].origin,
        )  # fmt: skip


def _levels(factor: Factor) -> Sequence[Value]:
    assert not isinstance(factor.space, Interval)  # refuse_misfit has seen to it
    return factor.space


@dataclass(frozen=True)
class Composition:
    """What all cases share, and what varies. kind: of the scenes; scene: None where a factor
    chooses it.
    """

    kind: type[Source]
    scene: Path | None
    robot: str | None
    shared: tuple[Setting, ...]
    factors: tuple[Factor, ...]

    def source(self, values: Mapping[str, Value]) -> Source:
        """The scene of a case with these values of the factors, by name."""
        chosen = [factor.scene(values[factor.axis.name]) for factor in self.factors]
        scene = next((path for path in chosen if path is not None), self.scene)
        assert scene is not None  # composed has seen to it
        return self.kind(scene, self.robot)

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
    if study.model == "chain":
        refuse_what_chains_lack(tree)
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
    alone = Composition(SOURCES[study.model], scene, study.robot, shared, tuple(scenes.values()))
    source = alone.source({name: factor.tried[0] for name, factor in scenes.items()})
    base = with_settings(source.root, known_tree(source), shared)
    factors: list[Factor] = []
    for name, part in study.factors.items():
        if isinstance(part, ScenesFactor):
            factors.append(scenes[name])
            continue
        in_list = None
        if isinstance(study.design, ListDesign):
            in_list = [row[name] for row in rows(tree)]
        factor = factor_in(name, part, held[name], source.root, base, in_list)
        base = with_settings(source.root, base, factor.settings(factor.tried[0]))
        factors.append(factor)
    return replace(alone, factors=tuple(factors))


def refuse_unknown_robot(tree: Tree) -> None:
    """SceneError at the name of a robot that does not ship with softsim."""
    robot = child(tree, "robot")
    if robot is not None and robot.value is not None and robot.text not in robot_names():
        hint = did_you_mean(robot.text, robot_names())
        raise SceneError(f"there is no robot {robot.text!r}", hint, robot.origin)


def refuse_what_chains_lack(tree: Tree) -> None:
    """SceneError at a robot that a chain is to take, or at trials of it that are to be stopped."""
    robot, objective = child(tree, "robot"), child(tree, "optimize")
    if robot is not None and robot.value is not None:
        raise SceneError("a chain is a robot already", "leave robot out", robot.key_origin)
    prune = None if objective is None else child(objective, "prune")
    if prune is not None and prune.value is not None:
        hint = "leave prune out: a chain takes seconds"
        raise SceneError("trials of a chain are not stopped early", hint, prune.key_origin)


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
