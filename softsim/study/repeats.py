"""Repeats of a case: what is not known for sure, drawn at random.

The draws are normal and independent of each other. Repeat n has the same ones in all cases, so that
cases differ by their factors alone.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from softsim.errors import SceneError
from softsim.scene.loading import Loaded, keys_at
from softsim.scene.part import Part
from softsim.scene.structure import Place, place_in
from softsim.scene.tree import Keys, Tree
from softsim.study.cases import Setting
from softsim.study.schema import Repeats
from softsim.study.values import quantity_of

SHARE = re.compile(r"\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*%\s*")


@dataclass(frozen=True)
class Perturbation:
    """A key that is perturbed. written: its standard deviation, as the study says it; draws
    (repeats,): in standard deviations.
    """

    path: str
    written: Tree
    draws: np.ndarray

    @property
    def extremes(self) -> tuple[int, int]:
        """The repeats, from 1, of its lowest and highest value: the limits of a key are intervals,
        so that what holds for these holds for all.
        """
        return int(self.draws.argmin()) + 1, int(self.draws.argmax()) + 1

    def setting(self, loaded: Loaded[Any], repeat: int) -> Setting:
        """What repeat number `repeat`, from 1, sets in a scene.

        Raises
        ------
        SceneError: the scene has no number there, or one of another kind than the deviation.
        """
        root = type(loaded.scene)
        keys = keys_at(loaded.tree, self.path, self.written.key_origin, root)
        place = place_in(root, loaded.tree, keys)
        value = value_at(loaded.scene, keys)
        if place is None or place.is_whole or not isinstance(value, float):
            hint = "a key with a quantity or a number can be, once it has one"
            raise self._refusal(f"{self.path} is {value!r}, which cannot be perturbed", hint)
        number = value + float(self.draws[repeat - 1]) * self._deviation(value, place)
        unit = place.quantity.unit if place.quantity is not None else ""
        text = f"{number!r} {unit}".rstrip()
        return Setting(self.path, text, self.written.key_origin, self.written.origin)

    def _deviation(self, value: float, place: Place) -> float:
        """Standard deviation, SI, of a value, SI."""
        share = SHARE.fullmatch(self.written.text)
        if share is not None:
            return float(share[1]) / 100.0 * abs(value)
        if place.quantity is not None:
            return float(quantity_of(self.written, place.quantity))
        if isinstance(self.written.value, bool) or not isinstance(self.written.value, int | float):
            raise self._refusal("a deviation is a number here, or a share such as 10 %", "")
        return float(self.written.value)

    def _refusal(self, message: str, hint: str) -> SceneError:
        return SceneError(message, hint, self.written.origin)


def perturbations(repeats: Repeats | None, perturb: Mapping[str, Tree]) -> tuple[Perturbation, ...]:
    """What is perturbed; perturb: what the study says under this key."""
    if repeats is None:
        return ()
    # a row a repeat: more repeats leave the earlier ones as they are
    draws = np.random.default_rng(repeats.seed).standard_normal((repeats.count, len(perturb)))
    return tuple(
        Perturbation(path, written, column)
        for (path, written), column in zip(perturb.items(), draws.T, strict=True)
    )


def value_at(scene: Part, keys: Keys) -> Any:
    """What a scene has at `keys`, SI."""
    held: Any = scene
    for key in keys:
        is_part = isinstance(held, Part)
        held = getattr(held, str(key)) if is_part else held[key]
    return held
