"""Scenes with several steps, such as inflation of a robot and then vibration.

Each step is a scene of its own: the content of `steps.NAME` is merged over the scene of the step
before, so that everything else continues. `time` and `expect` are not passed on: each step has
those of the file and its own. A condition or load that a step sets to nothing (`air: ~`) ends.
Bodies and walls stay the same; a step changes only loads and conditions on them.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

from softsim.errors import Option, SceneError
from softsim.scene.bodies import InitialVelocity, WallMotion
from softsim.scene.loading import (
    STEPS,
    LoadedScene,
    overridden,
    read_scene,
    validated,
)
from softsim.scene.loads import (
    AddedGasSpec,
    AddedVolumeSpec,
    Pneumatic,
    PulledCableSpec,
    TendonSpec,
    TetherSpec,
)
from softsim.scene.quantities import NAME
from softsim.scene.reporting import did_you_mean
from softsim.scene.schema import Scene
from softsim.scene.text import Keys, Tree, child, entries, merged

OF_A_STEP = ("time", "expect")
ENDED = ("loads", "conditions")
MAY_CHANGE = {
    "title", "environment", "contact", "conditions", "loads", "time", "solver", "robot", "layout",
    "trailed", "crossing", "output", "expect",
}  # fmt: skip
# A step cannot change any other part of a scene, nor the walls.
THE_SAME = (
    *((key,) for key in Scene.model_fields if key not in MAY_CHANGE),
    ("environment", "walls"),
)
# Loads whose length, angle or filling is measured from the shape and place at rest.
FROM_REST = (AddedVolumeSpec, AddedGasSpec, Pneumatic, TendonSpec, TetherSpec, PulledCableSpec)


@dataclass(frozen=True)
class Step:
    """One step of a scene.

    Attributes
    ----------
    name : str
        Name of the step.
    loaded : LoadedScene
        The scene of the step.
    """

    name: str
    loaded: LoadedScene


@dataclass(frozen=True)
class Beginning:
    """Start time of a step, and of the time histories that continue from earlier steps.

    time: of the step [s] after the start of the first one. earlier: start time [s] of each
    continued time history by its keys, such as ("loads", "air").
    """

    time: float = 0.0
    earlier: Mapping[Keys, float] = field(default_factory=dict)

    def of(self, keys: Keys) -> float:
        """Return the start time [s] of the time history at these keys."""
        return self.earlier.get(keys[:2], self.time)


AT_THE_START = Beginning()


def load_steps(path: str | Path, overrides: Sequence[str] = ()) -> tuple[Step, ...]:
    """Read, merge and validate the steps of a scene file.

    Parameters
    ----------
    path : Path or str
        Path of the scene file.
    overrides : sequence of str
        Values that override those of the file. "loads.air.profile.value=8 kPa" applies to all
        steps, "steps.shake.loads.motor.frequency=95 Hz" from this step on.

    Returns
    -------
    tuple of Step
        Steps in their order, each with its name and a complete scene; empty if the file has no
        steps.

    Raises
    ------
    SceneError
        A step is not a valid scene, or changes something that cannot change between steps.

    Examples
    --------
    >>> from softsim.scene.steps import load_steps
    >>> steps = load_steps("two_steps.yaml", ["steps.release.time.end=8 ms"])
    >>> [(step.name, step.loaded.scene.time.end) for step in steps]  # [s]
    [('press', 0.005), ('release', 0.008)]
    >>> load_steps("block.yaml")
    ()
    """
    path = Path(path)
    tree = read_scene(path)
    if child(tree, STEPS) is None:
        return ()
    assert isinstance(tree.value, dict)
    base = replace(tree, value={key: v for key, v in tree.value.items() if key != STEPS})
    parts = steps_said(tree)
    of_all, of_each = split_overrides(list(parts), overrides)
    steps: list[Step] = []
    carried = base
    for name, part in parts.items():
        carried = ended(merged(of_file(carried, base), part))
        for override in of_each[name]:
            carried = overridden(carried, override)
        steps.append(Step(name, validated(carried, path, of_all)))
    for number, (before, step) in enumerate(pairwise(steps), 2):
        refuse_change(before, step, number)
    return tuple(steps)


def steps_said(tree: Tree) -> Mapping[str, Tree]:
    """Return the content of each step by its name."""
    parts = entries(tree, STEPS)
    if not parts:
        held = child(tree, STEPS)
        raise SceneError(
            "steps: must be a mapping of step names to their keys",
            "steps: {inflate: {time: {end: 1 s}}, shake: {time: {end: 2 s}}}",
            held.origin if held else None,
        )
    for name, part in parts.items():
        if not re.fullmatch(NAME, name):
            raise SceneError(
                f"'{name}' is not a valid name of a step, which is also the name of its folder",
                "use letters, digits, _ and -, starting with a letter or _",
                part.key_origin,
            )
        if not isinstance(part.value, dict):
            raise SceneError(
                f"steps.{name}: must be a mapping of keys to values", location=part.origin
            )
    return parts


def split_overrides(
    names: Sequence[str], overrides: Sequence[str]
) -> tuple[list[str], dict[str, list[str]]]:
    """Return the overrides of all steps, and those of each step without "steps.NAME."."""
    of_all: list[str] = []
    of_each: dict[str, list[str]] = {name: [] for name in names}
    for override in overrides:
        key, _, rest = override.strip().partition(".")
        if key != STEPS:
            of_all.append(override)
            continue
        name, _, own = rest.partition(".")
        if name not in of_each:
            raise SceneError(
                f"there is no step '{name}'", did_you_mean(name, names), Option(f"--set {override}")
            )
        of_each[name].append(own)
    return of_all, of_each


def of_file(carried: Tree, base: Tree) -> Tree:
    """Return the scene of the previous step without the keys that apply to that step alone."""
    assert isinstance(carried.value, dict) and isinstance(base.value, dict)
    own = {key: value for key, value in base.value.items() if key in OF_A_STEP}
    kept = {key: value for key, value in carried.value.items() if key not in OF_A_STEP}
    return replace(carried, value=kept | own)


def ended(tree: Tree) -> Tree:
    """Return the scene without the loads and conditions that are set to nothing."""
    assert isinstance(tree.value, dict)
    result = dict(tree.value)
    for key in ENDED:
        if key in result and isinstance(result[key].value, dict):
            named = {n: t for n, t in entries(tree, key).items() if t.value is not None}
            result[key] = replace(result[key], value=named)
    return replace(tree, value=result)


def refuse_change(before: Step, step: Step, number: int) -> None:
    """Raise SceneError for a change between steps that is not possible."""
    loaded, earlier, now = step.loaded, before.loaded.scene, step.loaded.scene

    def refused(keys: Keys, problem: str, hint: str) -> SceneError:
        return loaded.error(keys, f"step '{step.name}', number {number}: {problem}", hint)

    for keys in THE_SAME:
        if _at(earlier, keys) != _at(now, keys):
            raise refused(
                keys, f"{'.'.join(keys)} cannot change between steps",
                "steps can change loads, conditions, friction, gravity, time, solver and output",
            )  # fmt: skip
    if now.time.procedure == "dynamic" and now.time.settle is not None:
        raise refused(
            ("time", "settle"), "bodies settle before the first step only",
            "write settle into the first step, or give this step procedure: static",
        )  # fmt: skip
    for name, condition in now.conditions.items():
        if condition == earlier.conditions.get(name):
            continue
        if isinstance(condition, InitialVelocity):
            raise refused(
                ("conditions", name), "bodies keep the velocity of the previous step",
                "write an initial velocity into the first step",
            )  # fmt: skip
        if isinstance(earlier.conditions.get(name), WallMotion):
            raise refused(
                ("conditions", name), f"'{name}' already moves a wall, which would jump back",
                "let the table of the previous step contain the whole motion",
            )  # fmt: skip
    for name, condition in earlier.conditions.items():
        if isinstance(condition, WallMotion) and name not in now.conditions:
            raise refused(
                ("conditions",), f"without '{name}' the wall that it moves would jump back",
                "keep it: a wall stays at the end of its table",
            )  # fmt: skip
    for name, load in now.loads.items():
        if isinstance(load, FROM_REST) and type(load) is not type(earlier.loads.get(name)):
            raise refused(
                ("loads", name), f"'{name}' starts from the shape at rest, so a later step cannot "
                    "add it",
                f"define it in the first step, with kind {load.kind}",
            )  # fmt: skip


def following(before: Scene, beginning: Beginning, now: Scene, time: float) -> Beginning:
    """Return the beginning of the step `now`, `time` [s] after the start of the first one.

    before: scene of the previous step, which had this `beginning`; its unchanged time histories
    continue.
    """
    same = [keys for keys in time_courses(now) if _at(before, keys) == _at(now, keys)]
    return Beginning(time, {keys: beginning.of(keys) for keys in same})


def time_courses(scene: Scene) -> Iterator[Keys]:
    """Yield the keys of all parts of a scene that depend on time."""
    yield "environment", "gravity_profile"
    if scene.pneumatics is not None:
        yield from (("pneumatics", part) for part in ("nodes", "edges"))
    for section in ENDED:
        for name in getattr(scene, section):
            yield section, name


def _at(scene: Scene, keys: Keys) -> object:
    """Return the value at keys, or None if a name does not exist."""
    held: object = scene
    for key in keys:
        held = held.get(key) if isinstance(held, dict) else getattr(held, str(key))
    return held
