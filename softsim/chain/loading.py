"""A chain from a file, or one that ships with softsim from its name."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from softsim.errors import Option, SceneError
from softsim.scene.chain import ChainScene
from softsim.scene.loading import Loaded, overridden, read_scene, validated_as
from softsim.scene.reporting import did_you_mean
from softsim.scene.robots import LIBRARY
from softsim.scene.tree import Keys, Tree, replaced
from softsim.scene.yaml_reading import is_file

CHAINS = LIBRARY / "chain"


LoadedChain = Loaded[ChainScene]


def chain_names() -> list[str]:
    """Names of the chains that ship with softsim."""
    return sorted(file.stem for file in CHAINS.glob("*.yaml"))


def load_chain(
    name: str | Path, overrides: Sequence[str] = (), options: Mapping[str, tuple[Keys, str]] = {}
) -> LoadedChain:
    """Read, merge and validate a chain.

    Parameters
    ----------
    name: of a file, or of a chain that ships with softsim, such as "leafbot5".
    overrides: "motor.frequency=142 Hz" each, as `load_scene` takes them.
    options: of a command that has some of its own: name -> keys and value; they win over all.

    Raises
    ------
    SceneError: anything that keeps it from being a chain; it holds every problem found.
    """
    path = _file(Path(name))
    tree = read_scene(path)
    for override in overrides:
        tree = overridden(tree, override, ChainScene)
    for flag, (keys, text) in options.items():
        origin = Option(f"{flag} {text}")
        tree = replaced(tree, keys, Tree(text, origin, origin, text))
    return validated_as(ChainScene, tree, path)


def _file(name: Path) -> Path:
    if is_file(name):
        return name
    shipped = CHAINS / f"{name}.yaml"
    if str(name) in chain_names():
        return shipped
    raise SceneError(
        f"there is neither a file nor a chain {str(name)!r}",
        did_you_mean(str(name), chain_names()),
    )
