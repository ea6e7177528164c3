"""Mutants of all shipped scenes are built or refused: none ends in a traceback, none hangs."""

import random
import re
import shutil
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml

from softsim.apps.chain.running import build_chain
from softsim.apps.chain.scene import ChainScene, load_chain
from softsim.builder import build_model
from softsim.errors import SoftsimError
from softsim.scene.loading import Loaded, load_layout, load_scene
from softsim.scene.steps import load_steps

pytestmark = pytest.mark.physics

SCENES = Path(__file__).parents[1] / "scenes"
NAMES = sorted(
    str(path.relative_to(SCENES))
    for path in SCENES.rglob("*.yaml")
    if path.parent.name != "studies"
)
MUTANTS = 2
"""Mutants of each scene."""

LIMIT = 15.0
"""Processor time that a mutant may take [s]; the slowest shipped scene takes 1.5 s."""

NUMBER = re.compile(r"\s*([-+]?\d[\d.]*(?:[eE][-+]?\d+)?)(.*)", re.DOTALL)
UNITS = ("", "mm", "m", "s", "kPa", "kg", "Hz", "deg", "mm/mm", "banana")
WRONG = ([], {}, [1, 2], {"x": 1}, True, None, "", "x", -1, 7, "5 mm", "2026-11-26", "\u202e=1")

Mutation = tuple[str, tuple[Any, ...]]


class HangError(BaseException):
    """The time of a mutant is up. No handler of Exception may swallow it."""


def load(path: Path) -> Loaded[Any]:
    """Load a scene, a layout, a chain, or the first of several steps."""
    if path.parent.name == "chains":
        return load_chain(path)
    if path.parent.name in ("layouts", "reach"):
        return load_layout(path, "pfr", [])
    steps = load_steps(path)
    return steps[0].loaded if steps else load_scene(path)


def build(loaded: Loaded[Any]) -> None:
    """Build the model of a scene or a chain."""
    if isinstance(loaded.scene, ChainScene):
        build_chain(loaded)
    else:
        build_model(loaded)


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise HangError when the block has taken so much processor time."""

    def stop(number: int, frame: Any) -> None:
        raise HangError(f"more than {seconds:g} s")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def places(node: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """All entries of a tree of dicts and lists: the containers from outside to inside, the key."""
    keys = node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
    for key in keys:
        yield (*above, node), key
        yield from places(node[key], (*above, node))


def change_number(tree: Any, rng: random.Random) -> str:
    """Scale a number, change its sign or its unit, or put none in its place."""
    found = [
        (above[-1], key, match)
        for above, key in places(tree)
        if not isinstance(above[-1][key], dict | list | bool)
        and (match := NUMBER.fullmatch(str(above[-1][key])))
    ]
    if not found:
        return change_entry(tree, rng)
    container, key, match = rng.choice(found)
    number, unit = float(match[1]), match[2]
    new = rng.choice(
        [f"{number * 10.0**power!r}{unit}" for power in (-300, -12, -6, -3, -1, 1, 3, 6, 12, 300)]
        + [f"{-number!r}{unit}", f"0{unit}", f".nan{unit}", f".inf{unit}"]
        + [f"{number!r} {rng.choice(UNITS)}"]
    )
    container[key] = yaml.safe_load(new)
    return f"{key}: {new}"


def change_entry(tree: Any, rng: random.Random) -> str:
    """Delete, misspell, move, copy or replace an entry."""
    above, key = rng.choice(list(places(tree)))
    container = above[-1]
    kind = rng.choice(["delete", "misspell", "move out", "copy", "replace", "huge"])
    if kind == "replace":
        container[key] = rng.choice(WRONG)
    elif kind == "huge":
        container[key] = "mm" * 50_000
    elif kind == "copy" and isinstance(container, list):
        container.insert(key, container[key])
    elif kind == "copy":
        container[f"{key}_2"] = container[key]
    else:
        value = container.pop(key)
        if kind == "misspell" and isinstance(container, dict):
            container[f"{str(key)[:-1]}q"] = value
        elif kind == "move out" and len(above) > 1 and isinstance(above[-2], dict):
            above[-2][key] = value
    return f"{kind} {key}"


def mutant(text: str, rng: random.Random) -> tuple[str, str]:
    """A text of a scene with one or two mutations, and what they are."""
    tree = yaml.safe_load(text)
    done = [
        rng.choice([change_number, change_number, change_entry])(tree, rng)
        for _ in range(rng.choice([1, 1, 2]))
    ]
    mutated = yaml.safe_dump(tree, sort_keys=False, allow_unicode=True)
    if rng.random() < 0.1:
        lines = mutated.splitlines(keepends=True)
        line = rng.randrange(len(lines))
        lines.insert(line, lines[line])
        return "".join(lines), "; ".join([*done, f"line {line + 1} twice"])
    return mutated, "; ".join(done)


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    """A copy of the shipped scenes, in which mutants lie beside the files that they name."""
    return Path(shutil.copytree(SCENES, tmp_path_factory.mktemp("mutants") / "scenes"))


def mutants(name: str, count: int) -> Iterator[tuple[str, str]]:
    """Mutants of a shipped file, and of what it stands for: its robot and all defaults written out.

    Yields the text, and what was changed.
    """
    texts = (SCENES / name).read_text(encoding="utf-8"), load(SCENES / name).resolved()
    for number in range(count):
        rng = random.Random(f"{name} {number}")
        yield mutant(texts[number % 2], rng)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_mutant_is_built_or_refused(scenes, name):
    path = (scenes / name).with_name("mutant.yaml")
    for text, told in mutants(name, MUTANTS):
        path.write_text(text, encoding="utf-8")
        try:
            with limited(LIMIT):
                build(load(path))
        except SoftsimError as refusal:
            assert refusal.exit_code == 2, told
        except (Exception, HangError) as fault:
            pytest.fail(f"{name} ({told[:300]}): {type(fault).__name__}: {fault}")
