"""Error messages of invalid scenes, from pydantic's errors: problem, location and remedy."""

import difflib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from softsim.errors import SceneError
from softsim.scene.text import (
    Keys,
    Model,
    SchemaLocation,
    Tree,
    discriminators,
    entries,
    first_key,
    nearest,
    place_in,
    place_of,
    plain,
)

MOST_SHOWN = 20
# Names that begin with a word are told where it has so many letters, and so many of them.
SHORTEST_BEGINNING, MOST_MEANT = 3, 3
WANTED = {
    "float_type": "a number without a unit, such as 0.5",
    "int_type": "a whole number, such as 5",
    "int_from_float": "a whole number, such as 5",
    "string_type": "a text",
    "string_unicode": "a text of valid characters",
    "finite_number": "a finite number",
    "tuple_type": "a list, such as [a, b]",
    "dict_type": "a mapping of names to values",
    "model_type": "a mapping of keys to values",
    "model_attributes_type": "a mapping of keys to values",
}
CONSEQUENCES = {"missing", "value_error"}
"""Types of errors that a misspelt key causes elsewhere."""
BOUNDS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}


def scene_error(
    error: ValidationError, tree: Tree, root: Model, beside: Collection[str] = ()
) -> SceneError:
    """Return all errors that pydantic found in `tree` as one error, which contains the others.

    root: class of the whole tree, a scene or a study. beside: keys that its file may have besides
    those of the class.
    """
    found = error.errors(include_url=False)
    above = {item["loc"][:depth] for item in found for depth in range(len(item["loc"]))}
    # A list is too short for pydantic when one of its entries is wrong: only that is news.
    items = [item for item in found if item["type"] != "too_short" or item["loc"] not in above]
    strays = {stray.keys: stray for item in items if (stray := _stray(item, tree, root))}
    left = [item for item in items if not any(s.explains(item, root) for s in strays.values())]
    # A key that is missing or due may be there under a wrong name: that is said first.
    unknown = [item["loc"] for item in left if item["type"] == "extra_forbidden"]
    if unknown:
        left = [item for item in left if not _is_misspelt(item, unknown)]
        left.sort(key=lambda item: item["type"] in CONSEQUENCES)
    problems = [stray.error(tree) for stray in strays.values()]
    problems += [_problem(item, tree, root, beside) for item in left[:MOST_SHOWN]]
    if len(left) > MOST_SHOWN:
        problems.append(SceneError(f"and {len(left) - MOST_SHOWN} more problems"))
    first = problems[0]
    return SceneError(first.message, first.hint, first.location, problems[1:])


@dataclass(frozen=True)
class _Stray:
    """Key that is indented one level too little.

    keys: path to it. owner: the key before it, below which it belongs.
    """

    keys: Keys
    owner: str

    def error(self, tree: Tree) -> SceneError:
        """Return the error that names the place where the key belongs."""
        key = _printable(str(self.keys[-1]))
        return SceneError(
            f"'{key}' is one level too far out: it belongs to '{_printable(self.owner)}'",
            f"indent it, and everything below it, as deep as the other keys of '{self.owner}'",
            nearest(tree, self.keys)[0].key_origin,
        )

    def explains(self, item: Mapping[str, Any], root: Model) -> bool:
        """Return True if the stray key causes an error of pydantic's.

        Such errors are at or below the key, or the owner lacks the key or has no content at all.
        """
        keys, owner = place_of(root, item["loc"]).keys, (*self.keys[:-1], self.owner)
        lacks = item["type"] == "missing" and keys == (*owner, self.keys[-1])
        is_empty = keys == owner and item["input"] is None
        return keys[: len(self.keys)] == self.keys or lacks or is_empty


def _stray(item: Mapping[str, Any], tree: Tree, root: Model) -> _Stray | None:
    """Return the key at or above an error that belongs to the mapping written just before it.

    By the schema, that mapping has such a field, and it lacks it. None if there is no such key.
    """
    keys = place_of(root, item["loc"]).keys
    for depth, key in enumerate(keys):
        beside = list(entries(tree, *keys[:depth]))
        if key not in beside[1:]:
            continue
        owner = beside[beside.index(str(key)) - 1]
        held = nearest(tree, (*keys[:depth], owner))[0]
        place = place_in(root, tree, (*keys[:depth], owner))
        models = place.variant(plain(held)).models if place else []
        is_free = held.value is None or (isinstance(held.value, dict) and key not in held.value)
        if len(models) == 1 and key in models[0].model_fields and is_free:
            return _Stray(keys[: depth + 1], owner)
    return None


def _is_misspelt(item: Mapping[str, Any], unknown: Sequence[Keys]) -> bool:
    """Return True if a missing key is there under a similar name, one of the unknown keys."""
    if item["type"] != "missing" or not isinstance(item["loc"][-1], str):
        return False
    *parent, key = item["loc"]
    beside = [str(word) for *place, word in unknown if place == parent]
    return any(_similar(word, [key]) for word in beside)


def _similar(word: str, allowed: Collection[str]) -> list[str]:
    """Return the allowed words that begin with a word, else the most similar one, if any."""
    longer = [name for name in allowed if len(word) >= SHORTEST_BEGINNING and name.startswith(word)]
    return longer[:MOST_MEANT] or difflib.get_close_matches(word, allowed, n=1)


def did_you_mean(word: str, allowed: Collection[str]) -> str:
    """Return a hint such as "did you mean 'length'?" for an unknown word.

    It names allowed words that begin with the word, else a similar one, else all allowed words.
    """
    if close := _similar(word, allowed):
        return f"did you mean {' or '.join(map(repr, close))}?"
    return f"allowed here: {', '.join(allowed)}"


def title(keys: Keys) -> str:
    """Return a short name of a place: its last key with the indices after it, "points[0][1]"."""
    words = [i for i, key in enumerate(keys) if isinstance(key, str)]
    if not words:
        return "the file"
    indices = "".join(f"[{index}]" for index in keys[words[-1] + 1 :])
    return f"{_printable(str(keys[words[-1]]))}{indices}"


def _problem(
    item: Mapping[str, Any], tree: Tree, root: Model, beside: Collection[str]
) -> SceneError:
    """Return the scene error of one of pydantic's errors."""
    kind, loc = item["type"], item["loc"]
    place, parent = place_of(root, loc), place_of(root, loc[:-1])
    if kind == "missing" and isinstance(loc[-1], str):
        return _missing_key(parent, place, tree)
    if kind == "missing":
        return _wrong_count(parent, tree)
    if kind == "extra_forbidden":
        return _unknown_key(parent, place.keys, tree, beside)
    if kind.startswith("union_tag"):
        return _unknown_variant(place, tree)
    if loc[-1:] == ("[key]",):
        message = f"{item['input']!r} is not a name: use letters, digits, _ and - only"
        return SceneError(
            message, location=nearest(tree, (*place.keys, item["input"]))[0].key_origin
        )
    message, hint = _about_value(item)
    if not hint and place.field is not None:
        hint = place.field.description or ""
    location = nearest(tree, place.keys)[0].origin
    return SceneError(f"{title(place.keys)}: {message}", hint, location)


def _missing_key(parent: SchemaLocation, place: SchemaLocation, tree: Tree) -> SceneError:
    description = (place.field.description or "") if place.field else ""
    key, holder = place.keys[-1], nearest(tree, parent.keys)[0]
    return SceneError(
        f"{title(parent.keys)}: the key '{key}' is missing", description, holder.key_origin
    )


def _wrong_count(place: SchemaLocation, tree: Tree) -> SceneError:
    held = nearest(tree, place.keys)[0]
    given = len(held.value) if isinstance(held.value, list) else 1
    return SceneError(
        f"{title(place.keys)}: must have {place.entry_count} entries, not {given}",
        (place.field.description or "") if place.field else "",
        held.origin,
    )


def _unknown_key(
    parent: SchemaLocation, keys: Keys, tree: Tree, beside: Collection[str]
) -> SceneError:
    allowed = list(parent.models[0].model_fields)
    if not parent.keys:
        allowed.extend(beside)
    where = f" in {title(parent.keys)}" if parent.keys else ""
    return SceneError(
        f"unknown key '{_printable(str(keys[-1]))}'{where}",
        did_you_mean(str(keys[-1]), allowed),
        nearest(tree, keys)[0].key_origin,
    )


def _unknown_variant(place: SchemaLocation, tree: Tree) -> SceneError:
    """Return the error of a mapping whose key for its kind is missing or wrong."""
    held = nearest(tree, place.keys)[0]
    name = title(place.keys)
    if not isinstance(held.value, dict):
        return SceneError(
            f"{name}: must be {WANTED['model_type']}, not {_given(held.value)}",
            (place.field.description or "") if place.field else "",
            held.origin,
        )
    pairs = [pair for model in place.models for pair in discriminators(model).items()]
    tags = list(dict.fromkeys(pairs))
    others = [first_key(model) for model in place.models if not discriminators(model)]
    if not tags:
        words = [key for key in held.value if difflib.get_close_matches(key, others)]
        hint = (
            did_you_mean(words[0], others) if words else (f"start with one of {', '.join(others)}")
        )
        return SceneError(f"{name}: does not state its kind", hint, held.origin)
    key, allowed = tags[0][0], [tag for _, tag in tags]
    choice = " or ".join([f"{key}: {' | '.join(allowed)}", *(f"{other}: ..." for other in others)])
    if key not in held.value:
        return SceneError(f"{name}: the key '{key}' is missing", f"give {choice}", held.key_origin)
    told = held.value[key]
    problem = f"{key}: {_quoted(told.value)} is unknown here"
    hint = did_you_mean(told.text, allowed)
    return SceneError(problem, hint, told.origin)


def _about_value(item: Mapping[str, Any]) -> tuple[str, str]:
    """Return message and hint for an invalid value of a known key."""
    kind, value, context = item["type"], item["input"], item.get("ctx", {})
    if kind == "quantity":
        return context["problem"], context["hint"]
    if kind == "value_error":
        return str(context["error"]), ""
    if kind in WANTED:
        hint = f'write "{value}" with quotes' if kind == "string_type" and _is_number(value) else ""
        return f"must be {WANTED[kind]}, not {_given(value)}", hint
    if kind in BOUNDS:
        limit, words = BOUNDS[kind]
        return f"{value} must be {words} {context[limit]:g}", ""
    if kind == "literal_error":
        allowed = re.findall(r"'([^']*)'|(-?\d+)", context["expected"])
        choice = ", ".join(word or number for word, number in allowed)
        return f"{_quoted(value)} is not one of: {choice}", ""
    if kind == "string_pattern_mismatch":
        return f'{value!r} must read body.set, such as "skin.chamber_top"', ""
    if kind == "too_short":
        return (
            f"must have at least {context['min_length']}, not {context['actual_length']}",
            "",
        )
    if kind == "too_long":
        return f"must have at most {context['max_length']}, not {context['actual_length']}", ""
    return item["msg"], ""


def _printable(word: str) -> str:
    return word if word.isprintable() else repr(word)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _quoted(value: Any) -> str:
    return repr(value) if isinstance(value, str) else _given(value)


def _given(value: Any) -> str:
    """Return a description of a given value for a message."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return "a list"
    return f"the text {value!r}" if isinstance(value, str) else f"the number {value}"
