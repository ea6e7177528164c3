"""Base class of the parts of a scene, and choice between classes of parts."""

import json
from collections.abc import Collection, Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, Discriminator

from softsim.scene.quantities import written

ORIGIN = written("0 mm", "0 mm")
AT_REST = written("0 mm/s", "0 mm/s")


class Part(BaseModel):
    """Anything in a scene: frozen, and strict about its keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True)


def json_schema(model: type[BaseModel]) -> dict[str, Any]:
    """Return the JSON schema of a class, with short names of classes such as `PressureTable`."""
    schema = model.model_json_schema()
    text = json.dumps(schema)
    for name, definition in schema["$defs"].items():
        text = text.replace(f'#/$defs/{name}"', f'#/$defs/{definition["title"]}"')
    read: dict[str, Any] = json.loads(text)
    read["$defs"] = {definition["title"]: definition for definition in read["$defs"].values()}
    return read


def told_by_key(classes: Mapping[str, type[Part]]) -> Discriminator:
    """Return a discriminator that selects a class by the first key of a mapping in `classes`."""

    def tag(value: Any) -> str | None:
        if isinstance(value, dict):
            return next((key for key in value if key in classes), None)
        return next((key for key, each in classes.items() if isinstance(value, each)), None)

    return Discriminator(tag)


def told_by_presence(tag: str, keys: Collection[str], otherwise: str) -> Discriminator:
    """Return a discriminator between two spellings of one kind.

    It selects `tag` if a mapping has any of `keys`, and `otherwise` if it has none.
    """

    def told(value: Any) -> str:
        if isinstance(value, Mapping):
            return tag if any(key in value for key in keys) else otherwise
        return tag if any(hasattr(value, key) for key in keys) else otherwise

    return Discriminator(told)
