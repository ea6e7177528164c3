"""Standard robots: parts of scenes that ship with softsim and are included by name.

`include: [robot:pfr]` adds a whole robot, `robot:pfr/motor` a part of it.
"""

from importlib import resources
from pathlib import Path

from softsim.errors import SceneError
from softsim.scene.reporting import did_you_mean
from softsim.scene.tree import Tree

PREFIX = "robot:"
LIBRARY = Path(str(resources.files("softsim.scene"))) / "library"


def robot_names() -> list[str]:
    """Return the names of the whole robots, as --robot takes them."""
    return sorted(file.stem for file in LIBRARY.glob("*.yaml"))


def part_names() -> list[str]:
    """Return the names of robots and their parts, as `include` takes them."""
    files = (file.relative_to(LIBRARY) for file in LIBRARY.rglob("*.yaml"))
    return sorted(PREFIX + file.with_suffix("").as_posix() for file in files)


def part_file(named: Tree) -> Path:
    """Return the file of the robot or part that an include names.

    Raises
    ------
    SceneError
        There is none with this name.
    """
    name, known = str(named.value), part_names()
    if name not in known:
        raise SceneError(
            f"there is no {name!r} to include", did_you_mean(name, known), named.origin
        )
    return LIBRARY / (name.removeprefix(PREFIX) + ".yaml")
