"""From pydantic's list of errors to messages a person can act on, each at its place."""

import difflib
import json
from functools import lru_cache
from typing import Any

from pydantic import ValidationError

from softsim.errors import Location, SceneError
from softsim.scene.schema import scene_json_schema
from softsim.scene.tree import Entry, PathKey

# What pydantic calls the type, and what is due.
DUE = {
    "dict_type": "a mapping of names to values",
    "model_type": "a mapping of keys to values",
    "model_attributes_type": "a mapping of keys to values",
    "tuple_type": "a list",
    "list_type": "a list",
    "string_type": "a text",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
}


def validation_error(error: ValidationError, tree: Entry) -> SceneError:
    """One SceneError that says everything that is wrong, each with its place and line."""
    problems: dict[PathKey, SceneError] = {}
    for item in error.errors(include_url=False):
        path, unknown = _data_path(item["loc"], tree)
        problem = _problem(item, path, unknown, tree)
        # A union of "auto" and a quantity complains twice about one value: the quantity's
        # complaint shows the right form.
        if path not in problems or item["type"] == "value_error":
            problems[path] = problem
    found = list(problems.values())
    if len(found) == 1:
        return found[0]
    text = "\n".join(str(p) for p in found)
    return SceneError(f"{len(found)} problems\n{text}")


def _data_path(loc: tuple[str | int, ...], tree: Entry) -> tuple[PathKey, str | None]:
    """The place in the scene that pydantic's `loc` means, and the key there that is missing.

    `loc` also names members of unions, which the scene does not know.
    """
    path: list[str | int] = []
    entry = tree
    missing = None
    tagged: Entry | None = None
    for part in loc:
        below = entry.child(part)
        if entry is not tagged and part in _tags(entry):
            tagged = entry
        elif below is not None:
            entry = below
            path.append(part)
            missing = None
        else:
            missing = str(part)
    return (*path,), missing


def _tags(entry: Entry) -> list[Any]:
    """Values by which the entry may choose a member of a union: kind, generator, law."""
    chosen = (entry.child(key) for key in ("kind", "generator", "law"))
    return [c.value for c in chosen if c is not None and isinstance(c.value, str)]


def _problem(item: Any, path: PathKey, missing: str | None, tree: Entry) -> SceneError:
    entry = tree.nearest(path)
    name = ".".join(map(str, path)) or "the scene"
    kind, context = item["type"], item.get("ctx", {})
    location = entry.location
    if kind == "extra_forbidden":
        key = str(path[-1])
        allowed = sorted(_schema_at(item["loc"][:-1]).get("properties", {}))
        close = difflib.get_close_matches(key, allowed, n=2, cutoff=0.6)
        hint = f"did you mean {' or '.join(map(repr, close))}? " if close else ""
        return SceneError(f"unknown key '{key}'", f"{hint}allowed here: {', '.join(allowed)}",
                          entry.key_location or location)  # fmt: skip
    if kind == "missing":
        wanted = _schema_at(item["loc"])
        example = wanted.get("examples", [""])[0]
        hint = wanted.get("description", "")
        if example:
            hint = f"{hint} For example: {missing}: {example}"
        place = entry.key_location or location
        return SceneError(f"{name} needs the key '{missing}'", hint.strip(), place)
    if kind == "union_tag_not_found":
        tag = context["discriminator"].strip("'")
        return SceneError(f"{name} needs the key '{tag}'", "", entry.key_location or location)
    if kind == "union_tag_invalid":
        tag = context["discriminator"].strip("'")
        below = entry.child(tag)
        return SceneError(
            f"{tag}: there is no '{context['tag']}'", f"one of: {context['expected_tags']}",
            below.location if below is not None else location,
        )  # fmt: skip
    if kind == "literal_error":
        return _at(location, f"{name}: {entry.plain()!r} is not allowed",
                   f"one of: {context['expected']}")  # fmt: skip
    if kind == "value_error":
        complaint = str(context["error"])
        return _at(location, f"{name}: {_shown(entry, complaint)}{complaint}", "")
    if kind in DUE:
        return _at(location, f"{name}: {DUE[kind]} is due, not {_short(entry)}",
                   _example(item["loc"]))  # fmt: skip
    message = item["msg"][:1].lower() + item["msg"][1:]
    return _at(location, f"{name}: {_short(entry)}: {message}", "")


def _at(location: Location, message: str, hint: str) -> SceneError:
    return SceneError(message, hint, location)


def _shown(entry: Entry, complaint: str) -> str:
    """The value in front of a complaint that does not say it: "must be greater than zero"."""
    said = isinstance(entry.value, dict | list) or str(entry.value) in complaint
    return "" if said else f"{entry.value!r} "


def _short(entry: Entry) -> str:
    text = json.dumps(entry.plain(), ensure_ascii=False)
    return text if len(text) < 40 else text[:37] + "..."


def _example(loc: tuple[str | int, ...]) -> str:
    examples = _schema_at(loc).get("examples", [])
    return f'for example "{examples[0]}"' if examples else ""


@lru_cache(maxsize=1)
def _schema() -> dict[str, Any]:
    return scene_json_schema()


def _schema_at(loc: tuple[str | int, ...]) -> dict[str, Any]:
    """The part of the JSON schema that describes `loc`; empty if the schema has none."""
    here = _schema()
    for part in loc:
        here = _below(_dereferenced(here), part)
    described = {k: v for k, v in here.items() if k != "$ref"}
    return {**_dereferenced(here), **described}


def _dereferenced(schema: dict[str, Any]) -> dict[str, Any]:
    if "$ref" in schema:
        return _schema()["$defs"][schema["$ref"].rsplit("/", 1)[-1]]
    return schema


def _below(schema: dict[str, Any], part: str | int) -> dict[str, Any]:
    if isinstance(part, int):
        items = schema.get("prefixItems")
        return items[part] if items and part < len(items) else schema.get("items", {})
    if part in schema.get("properties", {}):
        return schema["properties"][part]
    if isinstance(schema.get("additionalProperties"), dict):
        return schema["additionalProperties"]
    for member in (*schema.get("oneOf", ()), *schema.get("anyOf", ())):
        full = _dereferenced(member)
        constants = [p.get("const") for p in full.get("properties", {}).values()]
        if part in constants or (part == "mesh_file" and "file" in full.get("properties", {})):
            return member
    return schema



