"""Points of a study, and their repeats.

A design combines values of all factors to points. In the repeats of a point, uncertain values of
the scene are drawn at random.

The draws are normal and independent of each other; that of a material's spread is mapped to its
distribution (`ModulusSpread`). Repeat n has the same ones at all points, so
that cases differ by their factors alone.
"""

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from softsim.errors import SceneError
from softsim.materials.library import drawn_material, spread_of
from softsim.scene.loading import Loaded, flow_text, keys_at
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
from softsim.study.cases import Setting, Value
from softsim.study.factors import Factor, Interval, at, quantity_of
from softsim.study.schema import (
    GridDesign,
    LatinHypercubeDesign,
    ListDesign,
    PointDesign,
    Repeats,
    SobolDesign,
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
