"""Points of a study, their repeats, and the scenes composed for them.

A design combines values of all factors to points. In the repeats of a point, uncertain values of
the scene are drawn at random.

The draws are normal and independent of each other; that of a material's spread is mapped to its
distribution (`ModulusSpread`). Repeat n has the same ones at all points, so that cases differ by
their factors alone.
"""

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from softsim.errors import SceneError
from softsim.materials.library import drawn_material, spread_of
from softsim.scene.loading import Loaded, file_keys, flow_text, keys_at, robot_names
from softsim.scene.quantities import Spec
from softsim.scene.reporting import did_you_mean
from softsim.scene.text import (
    Keys,
    SchemaLocation,
    Tree,
    child,
    entries,
    listed,
    nearest,
    place_in,
    plain,
)
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
from softsim.study.factors import (
    Factor,
    Interval,
    at,
    factor_in,
    quantity_of,
    scene_file,
    scenes_factor,
)
from softsim.study.schema import (
    GridDesign,
    LatinHypercubeDesign,
    ListDesign,
    PointDesign,
    Repeats,
    ScenesFactor,
    SobolDesign,
    StudySpec,
)

Point = tuple[Value, ...]
"""Value of each factor, in their order."""

SPREAD = "spread"
"""Deviation that stands for the spread of a material's initial shear modulus."""

SHARE = re.compile(r"\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*%\s*")
"""Pattern of a standard deviation relative to the value: "10 %"."""


def point_count(design: PointDesign, factors: Sequence[Factor]) -> int:
    """Return the number of points of a design, without generating them."""
    if isinstance(design, GridDesign):
        return math.prod(len(_levels(factor)) for factor in factors)
    return len(design.cases) if isinstance(design, ListDesign) else design.count


def points(design: PointDesign, factors: Sequence[Factor], tree: Tree) -> Iterator[Point]:
    """Yield the points of a design, in the order of the table; `tree` is the study's file."""
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
    """Return points (count, dimension) that fill the unit cube evenly."""
    from scipy.stats import qmc  # slow to import

    is_sobol = isinstance(design, SobolDesign)
    engine = (qmc.Sobol if is_sobol else qmc.LatinHypercube)(dimension, seed=design.seed)
    shares: list[list[float]] = engine.random(design.count).tolist()
    return shares


def rows(tree: Tree) -> list[dict[str, Tree]]:
    """Return the cases of a list design."""
    return [dict(entries(case)) for case in listed(tree, "design", "cases")]


def refuse_incomplete_rows(tree: Tree, names: Sequence[str]) -> None:
    """Raise SceneError at a case of a list that does not give exactly the factors `names`."""
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
    """Raise SceneError if a factor of a grid is continuous, or a Sobol count is no power of two."""
    if isinstance(design, GridDesign):
        for factor in factors:
            if isinstance(factor.space, Interval):
                place = nearest(tree, ("factors", factor.axis.name))[0]
                raise SceneError(
                    f"{factor.axis.name}: a grid needs a number of values",
                    "give a count, or another design", place.key_origin,
                )  # fmt: skip
    elif isinstance(design, SobolDesign) and design.count & (design.count - 1):
        below = 1 << (design.count.bit_length() - 1)
        raise SceneError(
            f"count: {design.count} is not a power of two, so the sequence would not be uniform",
            f"use {below} or {2 * below}", nearest(tree, ("design", "count"))[0].origin,
        )  # fmt: skip


def _levels(factor: Factor) -> Sequence[Value]:
    assert not isinstance(factor.space, Interval)  # refuse_misfit has seen to it
    return factor.space


@dataclass(frozen=True)
class Perturbation:
    """Perturbed key of a scene.

    written: its standard deviation, as written in the study. draws (repeats,): deviations in
    standard deviations.
    """

    path: str
    written: Tree
    draws: np.ndarray

    @property
    def extremes(self) -> tuple[int, int]:
        """Repeats, from 1, with its lowest and highest value.

        The limits of a key are intervals, so if these two are valid, all are.
        """
        return int(self.draws.argmin()) + 1, int(self.draws.argmax()) + 1

    def setting(self, loaded: Loaded[Any], repeat: int) -> Setting:
        """Return the setting of repeat number `repeat`, from 1, in a scene.

        Raises
        ------
        SceneError: the scene has no number there, or one of another kind than the deviation.
        """
        if self.draws_material:
            return self._material_setting(loaded, repeat)
        root = type(loaded.scene)
        keys = keys_at(loaded.tree, self.path, self.written.key_origin, root)
        place = place_in(root, loaded.tree, keys)
        value = value_at(loaded.scene, keys)
        if place is None or place.is_whole or not isinstance(value, float):
            hint = "only keys with a number or a quantity can be perturbed; set a value first"
            raise self._refusal(f"{self.path} is {value!r}, which cannot be perturbed", hint)
        number = value + float(self.draws[repeat - 1]) * self._deviation(value, place)
        unit = place.quantity.unit if place.quantity is not None else ""
        text = f"{number!r} {unit}".rstrip()
        return Setting(self.path, text, self.written.key_origin, self.written.origin)

    @property
    def draws_material(self) -> bool:
        """True if the whole material is drawn, from its spread."""
        return self.written.text == SPREAD

    def _material_setting(self, loaded: Loaded[Any], repeat: int) -> Setting:
        """Return the setting of a material of the scene or the library, drawn from its spread."""
        section, _, name = self.path.partition(".")
        if section != "materials" or not name or "." in name:
            hint = "give it for a material: {materials.skin: spread}"
            raise self._refusal(
                f"{self.path} is no material, and only a material has a spread", hint
            )
        materials = child(loaded.tree, "materials")
        written = None if materials is None else child(materials, name)
        own = None if written is None else plain(written)
        spread = spread_of(name, own)
        if spread is None:
            hint = (
                f"give materials.{name} the key spread: [lowest, typical, highest initial shear "
                "modulus]; `softsim materials` prints those of the library"
            )
            raise self._refusal(f"no spread of the material '{name}' is known", hint)
        entry = drawn_material(name, own, spread, float(self.draws[repeat - 1]))
        return Setting(self.path, flow_text(entry), self.written.key_origin, self.written.origin)

    def _deviation(self, value: float, place: SchemaLocation) -> float:
        """Return the standard deviation, SI, of a value, SI."""
        share = SHARE.fullmatch(self.written.text)
        if share is not None:
            return float(share[1]) / 100.0 * abs(value)
        if place.quantity is not None:
            return float(quantity_of(self.written, place.quantity))
        if isinstance(self.written.value, bool) or not isinstance(self.written.value, int | float):
            raise self._refusal("the deviation must be a number, or a percentage such as 10 %", "")
        return float(self.written.value)

    def _refusal(self, message: str, hint: str) -> SceneError:
        return SceneError(message, hint, self.written.origin)


def perturbations(repeats: Repeats | None, perturb: Mapping[str, Tree]) -> tuple[Perturbation, ...]:
    """Return the perturbations of a study; perturb: its key -> deviation, as written.

    Drawn materials come first: a perturbation of one of their keys is not overwritten.
    """
    if repeats is None:
        return ()
    # a row a repeat: more repeats leave the earlier ones as they are
    draws = np.random.default_rng(repeats.seed).standard_normal((repeats.count, len(perturb)))
    found = (
        Perturbation(path, written, column)
        for (path, written), column in zip(perturb.items(), draws.T, strict=True)
    )
    return tuple(sorted(found, key=lambda one: not one.draws_material))


def value_at(scene: Spec, keys: Keys) -> Any:
    """Return the value of a scene at `keys`, SI."""
    held: Any = scene
    for key in keys:
        is_part = isinstance(held, Spec)
        held = getattr(held, str(key)) if is_part else held[key]
    return held


# -------------------------------------------------------------------------------------------------
# Composition of scenes from values of the factors, and the check of a study before it runs.
#
# Each value of each factor is checked once, with the first values of the others. An error that only
# occurs in another combination gives a failed row of the table.


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
