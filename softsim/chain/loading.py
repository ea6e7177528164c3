"""Loading of chains from files, or by the names of those that ship with softsim."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from softsim.errors import Option, SceneError
from softsim.scene.chain import ChainScene
from softsim.scene.loading import LIBRARY, Loaded, overridden, read_scene, validated_as
from softsim.scene.reporting import did_you_mean
from softsim.scene.text import Keys, Tree, is_file, replaced

CHAINS = LIBRARY / "chain"


LoadedChain = Loaded[ChainScene]


def chain_names() -> list[str]:
    """Return the names of the chains that ship with softsim."""
    return sorted(file.stem for file in CHAINS.glob("*.yaml"))


def load_chain(
    name: str | Path, overrides: Sequence[str] = (), options: Mapping[str, tuple[Keys, str]] = {}
) -> LoadedChain:
    """Read, merge and validate a chain.

    Parameters
    ----------
    name : Path or str
        Path of a file, or name of a chain that ships with softsim, such as "leafbot5".
    overrides : sequence of str
        Values that override those of the file: "motor.frequency=142 Hz", as for `load_scene`.
    options : mapping
        Options of the command line: name -> keys and value. They override everything else.

    Returns
    -------
    LoadedChain
        The validated chain, which `run_chain` accepts.

    Raises
    ------
    SceneError
        The file is not a valid chain. The error holds all problems found.

    Examples
    --------
    >>> from softsim.chain.loading import load_chain
    >>> loaded = load_chain("leafbot5", ["time.end=0.1 s"])
    >>> loaded.scene.rows.count, loaded.scene.time.end  # [s]
    (5, 0.1)
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
        f"there is no file and no built-in chain {str(name)!r}",
        did_you_mean(str(name), chain_names()),
    )
