"""README and docs/ as tests read them: blocks in fences, fragments of scenes in the text."""

import re
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`(\w+: [{\[].*?)`")


def name(page):
    """The path of a page below the project, such as docs/how_to/scenes.md."""
    return str(page.relative_to(ROOT))


def blocks(page, language):
    """The fenced blocks of a page in a language; "" for those that a shell takes."""
    return [body for name, body in BLOCK.findall(page.read_text()) if name == language]


def inline_fragments(page):
    """What stands in a page's text or tables and is a mapping in YAML: `time: {end: 1 s}`."""
    return INLINE.findall(BLOCK.sub("", page.read_text()))


def first_scene(page):
    """The text of the first whole scene of a page, "" where there is none."""
    whole = (t for t in blocks(page, "yaml") if {"bodies", "time"} <= yaml.safe_load(t).keys())
    return next(whole, "")
