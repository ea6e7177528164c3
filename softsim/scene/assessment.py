"""Layout of pipes with a standard robot in it."""

from collections.abc import Sequence
from pathlib import Path

from softsim.errors import Option, SceneError
from softsim.scene.loading import PREFIX, LoadedScene, read_part, read_scene, robot_names, validated
from softsim.scene.reporting import did_you_mean
from softsim.scene.text import Tree, merged, read_text

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
"""Default content that each command adds to a layout file, as YAML."""


def load_layout(
    path: Path, robot: str, overrides: Sequence[str], command: Option = ASSESS
) -> LoadedScene:
    """Return the scene of a layout file with a robot in it, for a command.

    Values of the file override those of the robot and of the command.

    Raises
    ------
    SceneError
        There is no such robot, or the scene is not valid.
    """
    return validated(layout_tree(path, robot, command), path, overrides)


def layout_tree(path: Path, robot: str, command: Option = ASSESS) -> Tree:
    """Return the merged content of a layout file, a robot and the defaults of a command.

    Raises SceneError if there is no such robot or file.
    """
    question = said(QUESTIONS[command], command)
    return merged(merged(question, robot_tree(path.parent, robot)), read_scene(path))


def robot_tree(folder: Path, robot: str) -> Tree:
    """Return the content of a standard robot for a layout in `folder`.

    Raises SceneError if there is no such robot.
    """
    option = Option(f"--robot {robot}")
    if robot not in robot_names():
        raise SceneError(f"there is no robot {robot!r}", did_you_mean(robot, robot_names()), option)
    return read_part(folder, Tree(PREFIX + robot, option, option))


def said(text: str, option: Option) -> Tree:
    """Return the content of a YAML text, with the command `option` as its origin."""
    tree = read_text(text, lambda line, column: option)
    assert tree is not None
    return tree
