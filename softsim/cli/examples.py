"""Command that lists and copies the example scenes, layouts and studies of softsim."""

import shutil
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softsim.cli.options import explained
from softsim.errors import OutputError, SceneError

if TYPE_CHECKING:
    from softsim.scene.text import Tree


def examples(
    name: Annotated[
        str | None, typer.Argument(help="Example to copy; default: list all.", show_default=False)
    ] = None,
    to: Annotated[Path, typer.Option(help="Folder to copy it to.")] = Path(),
) -> None:
    """List the example scenes, layouts and studies, or copy one with all files that it needs."""
    with explained() as console:
        root = examples_folder()
        if name is None:
            for path in example_files(root):
                console.print(example_line(path), highlight=False, markup=False, soft_wrap=True)
            return
        example = find_example(root, name)
        for path in copy_example(example, root, to):
            console.print(f"file    {path}", highlight=False, soft_wrap=True)
        command = command_for(example, to / example.relative_to(root))
        console.print(f"next    {command}", highlight=False, soft_wrap=True)


def examples_folder() -> Path:
    """Return the folder of the examples: that of the installed package, in a checkout `scenes`."""
    package = Path(str(resources.files("softsim"))).resolve()
    installed = package / "examples"
    return installed if installed.is_dir() else package.parent / "scenes"


def example_files(root: Path) -> list[Path]:
    """Return all examples: first the scenes, then the files in subfolders."""
    return sorted(root.rglob("*.yaml"), key=lambda path: (path.parent, path.name))


def example_line(path: Path) -> str:
    """Return the command that runs an example, the name of the example, and its title."""
    return f"{command_for(path, path).split()[1]:10}{path.stem:30}{example_title(path)}"


def example_title(path: Path) -> str:
    """Return the title given in the file.

    Raises SceneError if the file has none.
    """
    from softsim.scene.text import entries, read_file

    tree = read_file(path)
    title = entries(tree).get("title")
    if title is None:
        raise SceneError(f"{path}: an example needs a title", "title: What it shows")
    return str(title.value)


def find_example(root: Path, name: str) -> Path:
    """Return the file of the example `name`.

    Raises SceneError if no example has this name.
    """
    from softsim.scene.reporting import did_you_mean

    found = {path.stem: path for path in example_files(root)}
    if name not in found:
        raise SceneError(f"there is no example {name!r}", did_you_mean(name, list(found)))
    return found[name]


def command_for(example: Path, target: Path) -> str:
    """Return the command that runs an example whose file is at `target`."""
    from softsim.scene.text import entries, read_file

    if example.parent.name == "layouts":
        return f"softsim assess {target} --robot pfr"
    if example.parent.name == "reach":
        return f"softsim reach {target} --robot pfr"
    if example.parent.name == "chains":
        return f"softsim chain {target}"
    if example.parent.name == "studies":
        verb = "optimize" if "optimize" in entries(read_file(example, "study")) else "sweep"
        return f"softsim {verb} {target}"
    return f"softsim run {target}"


def copy_example(example: Path, root: Path, folder: Path) -> list[Path]:
    """Copy an example and the files that it names into `folder`; return the copies.

    The example is first. The copies keep their positions relative to `root`.

    Raises
    ------
    OutputError: a file of that name exists with other content, or cannot be written.
    """
    sources = needed_files(example)
    targets = [folder / source.relative_to(root) for source in sources]
    for source, target in zip(sources, targets, strict=True):
        if target.exists() and target.read_bytes() != source.read_bytes():
            raise OutputError(
                f"{target} already exists, with content other than that of the example",
                hint="name another folder with --to, or move the file away",
            )
    for source, target in zip(sources, targets, strict=True):
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
        except OSError as error:
            raise OutputError(f"{target} cannot be written: {error.strerror}") from error
    return targets


def needed_files(example: Path) -> list[Path]:
    """Return the example and all files that it names, directly or through scene files."""
    from softsim.scene.text import is_file, read_file

    found = [example]
    for path in found:  # which grows as files are found
        if path.suffix == ".yaml":
            named = (path.parent / text for text in _texts(read_file(path)))
            files = dict.fromkeys(file.resolve() for file in named if is_file(file))
            found.extend(file for file in files if file not in found)
    return found


def _texts(tree: "Tree") -> Iterator[str]:
    """Yield every text value below `tree`."""
    if isinstance(tree.value, dict):
        for child in tree.value.values():
            yield from _texts(child)
    elif isinstance(tree.value, list):
        for child in tree.value:
            yield from _texts(child)
    elif isinstance(tree.value, str):
        yield tree.value
