"""MkDocs hook: parts of the reference are generated when the site is built.

The keys of a scene come from its JSON schema, the commands from the command line itself, the
measures of a run from their catalogue.
"""

import json
import re
from collections import defaultdict
from collections.abc import Iterator
from itertools import groupby
from typing import Any

import typer
from mkdocs.structure.pages import Page
from typer.cli import get_docs_for_click
from typer.core import TyperGroup
from typer.main import get_command

from softsim.analysis.catalogue import CATALOGUE
from softsim.cli import app
from softsim.scene.quantities import COLUMNS
from softsim.scene.schema import scene_json_schema

Schema = dict[str, Any]
MARK, MARK_OF_MEASURES = "<!-- generated -->", "<!-- measures -->"
MARK_OF_COLUMNS = "<!-- columns -->"
# A profile exists for each quantity and for factors; the page describes that of a pressure.
SHAPES = "Constant|Ramp|SmoothStep|Sine|Table|PeriodicCycles"
OF_QUANTITY = re.compile(rf"^(Length|Velocity|Force|ForceDensity|Mass|Volume|Factor)(?={SHAPES}$)")
# Examples in a text: {a: {b: c}}, [[a, b], [c, d]], [a, b]; what stands in backquotes stays.
NESTED = r"\{(?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*\}"
EXAMPLE = re.compile(rf"`[^`]*`|{NESTED}|\[\[.*?\]\]|\[[^\]]*\]")
BOUNDS = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Replace the mark in a generated page by its text."""
    if page.file.src_uri == "reference/scene.md":
        return markdown.replace(MARK, "\n".join(SceneReference().lines()))
    if page.file.src_uri == "reference/commands.md":
        return markdown.replace(MARK, commands())
    if page.file.src_uri == "reference/results.md":
        tables = {MARK_OF_MEASURES: measures(), MARK_OF_COLUMNS: columns()}
        for mark, lines in tables.items():
            markdown = markdown.replace(mark, "\n".join(lines))
    return markdown


def measures() -> Iterator[str]:
    """Yield the lines of a table for each subject of the catalogue of measures."""
    for subject, listed in CATALOGUE.items():
        yield from ("", f"#### {subject}", "", "| measure | unit | meaning |", "|---|---|---|")
        for one in listed:
            each = f"One value per {one.kind.listed}." if one.kind.listed else ""
            meaning = " ".join(filter(None, (one.about, one.details, each)))
            yield f"| `{one.name}` | {one.kind.unit or '-'} | {meaning} |"


def commands() -> str:
    """Return all commands with their arguments and options."""
    command = get_command(app)
    assert isinstance(command, TyperGroup)
    for one in command.commands.values():
        one.short_help = one.get_short_help_str(limit=200)
    context = typer.Context(command, info_name="softsim")
    return get_docs_for_click(obj=command, ctx=context, name="softsim", indent=1)


def columns() -> Iterator[str]:
    """Yield the lines of the table of columns of the history; components share a row."""
    yield from ("| column | unit | meaning |", "|---|---|---|")
    for column, group in groupby(COLUMNS, key=COLUMNS.__getitem__):
        names = ", ".join(f"`{name}`" for name in group)
        yield f"| {names} | {column.unit} | {column.about} |"


def target(reference: str) -> str:
    """Return the name of the class that a reference leads to; of a profile that of a pressure."""
    return OF_QUANTITY.sub("Pressure", reference.rpartition("/")[2])


def named(part: Any) -> Iterator[str]:
    """Yield the names of the classes that a part of the schema refers to."""
    if isinstance(part, list):
        part = dict(enumerate(part))
    if isinstance(part, dict):
        for key, value in part.items():
            if key == "$ref":
                yield target(value)
            elif key != "discriminator":
                yield from named(value)


def coded(text: str) -> str:
    """Return a text with its examples set as code."""
    return EXAMPLE.sub(lambda found: f"`{found[0].strip('`')}`", text)


def flow(value: Any) -> str:
    """Return a value as it is written in YAML."""
    if isinstance(value, list):
        return f"[{', '.join(map(flow, value))}]"
    return value if isinstance(value, str) else json.dumps(value)


class SceneReference:
    """The keys of a scene: a section for each top-level key, a table for each class."""

    def __init__(self) -> None:
        self.scene = scene_json_schema()
        self.classes: dict[str, Schema] = self.scene["$defs"]
        self.keys: dict[str, Schema] = self.scene["properties"]
        self.sections: dict[str, list[str]] = defaultdict(list)  # key, or "profiles" -> classes
        placed: set[str] = set()
        for key, part in self.keys.items():
            waiting = [] if key == "steps" else list(named(part))
            while waiting:
                name = waiting.pop(0)
                if name not in placed:
                    placed.add(name)
                    is_profile = re.search(f"({SHAPES}|Profile)$", name)
                    self.sections["profiles" if is_profile else key].append(name)
                    waiting += named(self.classes[name])

    def lines(self) -> Iterator[str]:
        """Yield the lines of the page."""
        yield from ("## Top-level keys", "", *self.table(self.scene))
        for key in [key for key in self.keys if key in self.sections]:
            yield from ("", f"## {key}", "", coded(self.meaning(self.keys[key])), "")
            yield f"Value: {self.kind(self.keys[key])}."
            for name in self.sections[key]:
                yield from self.described(name)
        yield from ("", "## Profiles")
        for name in self.sections["profiles"]:
            yield from self.described(name)

    def described(self, name: str) -> Iterator[str]:
        """Yield the heading of a class, what it is, and the table of its keys."""
        model = self.classes[name]
        yield from ("", f"### {self.title(name)} {{ #{name} }}", "")
        yield from (coded(self.meaning(model)), "", *self.table(model))

    def table(self, model: Schema) -> Iterator[str]:
        """Yield the lines of a table with the keys of a class."""
        yield from ("| Key | Value | Default | Meaning |", "|---|---|---|---|")
        keys: dict[str, Schema] = model["properties"]
        for key in sorted(keys, key=lambda key: "const" not in keys[key]):
            name, kind = f"`{key}`", self.kind(keys[key])
            if model is self.scene and key in self.sections:
                name, kind = f"[`{key}`](#{key})", "by name" if "NAME" in kind else "mapping"
            default = keys[key].get("default")
            given = "-" if default in (None, "", [], {}) else f"`{flow(default)}`"
            given = "required" if key in model.get("required", ()) else given
            yield f"| {name} | {kind} | {given} | {coded(self.meaning(keys[key]))} |"

    def title(self, name: str) -> str:
        """Return what a user writes for a class: its kind, or its first key, or else its name."""
        keys = self.classes[name]["properties"]
        told = [part["const"] for part in keys.values() if "const" in part]
        told += [next(iter(keys))] if name.endswith(("Item", "Set", "FileMesh")) else []
        spelling = " with `direction`" if name.startswith("Directed") else ""
        spelling = " with rates" if name == "CyclesProfile" else spelling
        return f"`{told[0]}`{spelling}" if told else name

    def meaning(self, part: Schema) -> str:
        """Return the description of a part, or that of the class that it refers to."""
        found = part if "$ref" not in part else {**self.classes[target(part["$ref"])], **part}
        text: str = found.get("description", "")
        return " ".join(text.split())

    def kind(self, part: Schema) -> str:
        """Return the values that a part takes: an example of a quantity, a link to a class ..."""
        if "$ref" in part:
            return f"[{self.title(target(part['$ref']))}](#{target(part['$ref'])})"
        options = part.get("anyOf", part.get("oneOf", []))
        name = options[0].get("$ref", "").rpartition("/")[2] if options else ""
        if target(name) == "PressureConstant":
            return f"[profile](#profiles) of {self.kind(self.classes[name]['properties']['value'])}"
        if options:
            return " or ".join(self.kind(one) for one in options if one.get("type") != "null")
        if "const" in part or "enum" in part:
            return ", ".join(f"`{flow(value)}`" for value in part.get("enum", [part.get("const")]))
        if "examples" in part:
            return " or ".join(f"`{example}`" for example in part["examples"])
        if part.get("type") == "array":
            if "prefixItems" in part:
                return f"[{', '.join(map(self.kind, part['prefixItems']))}]"
            return f"list of {self.kind(part.get('items', {}))}"
        if part.get("type") == "object":
            held: Schema = next(iter(part.get("patternProperties", {}).values()), {})
            return f"NAME: {self.kind(held)}" if held else "mapping"
        words = {"string": "text", "boolean": "`true`, `false`", "integer": "integer"}
        kind = words.get(part.get("type", ""), "number")
        bounds = [f"{sign} {part[key]:g}" for key, sign in BOUNDS.items() if key in part]
        return ", ".join([kind, *bounds])
