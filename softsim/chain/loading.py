"""A chain from a file, or one that ships with softsim from its name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from softsim.chain.schema import ChainScene
from softsim.errors import Option, SceneError
from softsim.scene.loading import overridden, read_scene, valid
from softsim.scene.reporting import did_you_mean
from softsim.scene.resolved import resolved_text
from softsim.scene.robots import LIBRARY
from softsim.scene.tree import Keys, Tree, nearest, replaced
from softsim.scene.yaml_reading import is_file

CHAINS = LIBRARY / "chain"


@dataclass(frozen=True)
class LoadedChain:
    """A valid chain, its file, and where it says what."""

    scene: ChainScene
    path: Path
    tree: Tree

    def error(self, keys: Keys, message: str, hint: str = "") -> SceneError:
        """An error at the value of `keys`, or at the nearest value above it that is written."""
        return SceneError(message, hint, nearest(self.tree, keys)[0].origin)

    def resolved(self) -> str:
        """A file with every value, also the defaults, and where each comes from."""
        return resolved_text(self.scene, self.tree)


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
    return LoadedChain(valid(ChainScene, tree), path, tree)


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
