"""A layout of pipes, and a standard robot put into it."""

from collections.abc import Sequence
from pathlib import Path

from softsim.errors import Option, SceneError
from softsim.scene.loading import LoadedScene, read_part, read_scene, validated
from softsim.scene.reporting import did_you_mean
from softsim.scene.robots import PREFIX, robot_names
from softsim.scene.tree import Tree, merged
from softsim.scene.yaml_reading import read_text

ASSESS, REACH = Option("softsim assess"), Option("softsim reach")
QUESTIONS = {
    ASSESS: """
layout: {}
expect: {passes: true}
time: {end: 60 s}
""",
    REACH: """
layout: {}
trailed: {}
time: {end: 60 s}
""",
}
"""What a command asks of a layout that does not say it; a run ends as soon as it is answered."""


def load_layout(
    path: Path, robot: str, overrides: Sequence[str], command: Option = ASSESS
) -> LoadedScene:
    """The scene of a layout file with a robot in it, of which a command asks; what the file says
    wins.

    Raises
    ------
    SceneError: no such robot, or anything that keeps the whole from being a scene.
    """
    return validated(layout_tree(path, robot, command), path, overrides)


def layout_tree(path: Path, robot: str, command: Option = ASSESS) -> Tree:
    """What a layout file and a robot in it say together. SceneError: no such robot or file."""
    question = said(QUESTIONS[command], command)
    return merged(merged(question, robot_tree(path.parent, robot)), read_scene(path))


def robot_tree(folder: Path, robot: str) -> Tree:
    """What a standard robot says, put into a layout in `folder`. SceneError: no such robot."""
    option = Option(f"--robot {robot}")
    if robot not in robot_names():
        raise SceneError(f"there is no robot {robot!r}", did_you_mean(robot, robot_names()), option)
    return read_part(folder, Tree(PREFIX + robot, option, option))


def said(text: str, option: Option) -> Tree:
    """What a command says of its own, as YAML."""
    tree = read_text(text, lambda line, column: option)
    assert tree is not None
    return tree
