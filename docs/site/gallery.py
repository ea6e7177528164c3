"""Makes the pictures of docs/tutorials/gallery.md: `python docs/site/gallery.py [NAME ...]`.

The page itself says how. Each section has the command of a run, the figure of that run's folder
(`runs/gallery/.../snapshots.png`) and the picture that it becomes, `gallery/NAME.png`, smaller.
Without names all pictures are made.
"""

import argparse
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "tutorials" / "gallery.md"
WIDTH = 900
"""Of a picture, at most [pixels]."""

LARGEST = 70_000
"""Size of a picture's file, at most [bytes]."""

COMMAND = re.compile(r"^```\n(softsim .*?)^```", re.MULTILINE | re.DOTALL)
FIGURE = re.compile(r"`(runs/gallery/[\w/]+\.png)`")
PICTURE = re.compile(r"!\[[^\]]*\]\(gallery/(\w+)\.png\)")


@dataclass(frozen=True)
class Entry:
    """A section of the page: its picture, the words of its command, the figure that this draws."""

    name: str
    command: list[str]
    figure: Path

    @property
    def picture(self) -> Path:
        """Where the page shows it from."""
        return PAGE.parent / "gallery" / f"{self.name}.png"

    def make(self) -> None:
        """Run the command and shrink its figure to the picture.

        Raises CalledProcessError where the run fails, ValueError where the picture stays too large.
        """
        _, *words = self.command
        subprocess.run([sys.executable, "-m", "softsim.cli", *words], cwd=ROOT, check=True)
        self.picture.parent.mkdir(exist_ok=True)
        shrink(self.figure, self.picture)


def entries(page: str) -> list[Entry]:
    """The sections of a page. ValueError where one lacks its command, figure or picture."""
    found = []
    for section in page.split("\n## ")[1:]:
        parts = [pattern.findall(section) for pattern in (PICTURE, COMMAND, FIGURE)]
        if any(len(part) != 1 for part in parts):
            title = section.splitlines()[0]
            raise ValueError(f"'{title}' has not one picture, one command and one figure")
        (name,), (command,), (figure,) = parts
        found.append(Entry(name, shlex.split(command.replace("\\\n", " ")), ROOT / figure))
    return found


def shrink(figure: Path, picture: Path) -> None:
    """Write a figure as a picture of less width, in 256 colours.

    Raises ValueError where its file is too large.
    """
    with Image.open(figure) as opened:
        image = opened.convert("RGB")
    if image.width > WIDTH:
        height = round(image.height * WIDTH / image.width)
        image = image.resize((WIDTH, height), Image.Resampling.LANCZOS)
    # The usual choice of colours, by median cut, takes them from the white and turns green grey.
    palette = image.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    palette.save(picture, optimize=True)
    size = picture.stat().st_size
    if size > LARGEST:
        raise ValueError(f"{picture} has {size} bytes, more than {LARGEST}: take a simpler figure")


def main() -> None:
    """Make the pictures that are named on the command line, or all."""
    parser = argparse.ArgumentParser(description="Make the pictures of docs/tutorials/gallery.md.")
    known = {entry.name: entry for entry in entries(PAGE.read_text())}
    parser.add_argument("names", nargs="*", help=f"of: {', '.join(known)}; default: all")
    names = parser.parse_args().names
    unknown = sorted(set(names) - known.keys())
    if unknown:
        parser.error(f"no picture is called {', '.join(unknown)}; there are {', '.join(known)}")
    for name in names or known:
        known[name].make()
        print(f"picture {known[name].picture.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
