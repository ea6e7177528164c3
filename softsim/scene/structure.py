"""Search in the schema for the class and the field at a path of keys."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, Tag
from pydantic.fields import FieldInfo

from softsim.scene.quantities import Quantity
from softsim.scene.tree import Key, Keys, Tree, child, plain

Model = type[BaseModel]


@dataclass(frozen=True)
class Place:
    """Place in the schema: its annotation, the field it belongs to and the keys to it."""

    annotation: Any
    field: FieldInfo | None = None
    keys: Keys = ()

    @property
    def models(self) -> list[Model]:
        """Classes that a mapping here may have; empty if no mapping of fields is allowed."""
        bare = _bare(self.annotation)
        if get_origin(bare) in (Union, UnionType):
            return [m for option in get_args(bare) for m in Place(option).models]
        return [bare] if isinstance(bare, type) and issubclass(bare, BaseModel) else []

    @property
    def entry_count(self) -> int | None:
        """Number of entries of the list here, None if the schema does not fix it."""
        arguments = get_args(_bare(self.annotation))
        is_tuple = get_origin(_bare(self.annotation)) is tuple
        return len(arguments) if is_tuple and Ellipsis not in arguments else None

    @property
    def quantity(self) -> Quantity | None:
        """Quantity of the number here, None if it is not a quantity."""
        notes = (*_layers(self.annotation)[1], *(self.field.metadata if self.field else ()))
        return next((note for note in notes if isinstance(note, Quantity)), None)

    @property
    def is_whole(self) -> bool:
        """True if the value here is a whole number."""
        return _bare(self.annotation) is int

    @property
    def tags(self) -> dict[str, Any]:
        """Annotation of each option here, by the tag that pydantic puts into the loc of an error.

        An option is a class, or a union of the spellings of one kind with tags of their own.
        """
        found: dict[str, Any] = {}
        for option in get_args(_bare(self.annotation)):
            notes = get_args(option)[1:] if get_origin(option) is Annotated else ()
            given = [note.tag for note in notes if isinstance(note, Tag)]
            for model in Place(option).models:
                found |= dict.fromkeys(given or discriminators(model).values(), option)
        return found

    def variant(self, value: Any) -> "Place":
        """Return the place with the class of the mapping `value`.

        The class follows from its law, kind or generator, or from the first key of a class that has
        none of these. Of two spellings of one kind, it is the one with more of the given keys.
        """
        given = value if isinstance(value, dict) else {}
        matching = [
            model
            for model in self.models
            if all(given.get(key) == tag for key, tag in discriminators(model).items())
            and (discriminators(model) or first_key(model) in given)
        ]
        if len(self.models) < 2 or not matching:
            return self
        meant = max(matching, key=lambda model: len(model.model_fields.keys() & given.keys()))
        return Place(meant, self.field, self.keys)

    def tagged(self, tag: str) -> "Place":
        """Return the place with the option that pydantic calls `tag`."""
        return Place(self.tags[tag], self.field, self.keys)

    def inside(self, key: Key) -> "Place | None":
        """Return the place of the entry `key`, or None if the schema has none."""
        keys = (*self.keys, key)
        if self.models:
            field = self.models[0].model_fields.get(str(key)) if len(self.models) == 1 else None
            return Place(field.annotation, field, keys) if field else None
        bare = _bare(self.annotation)
        arguments = get_args(bare)
        if get_origin(bare) is dict and isinstance(key, str):
            return Place(arguments[1], self.field, keys)
        if get_origin(bare) is tuple and isinstance(key, int):
            if Ellipsis in arguments:
                return Place(arguments[0], self.field, keys)
            return Place(arguments[key], self.field, keys) if key < len(arguments) else None
        return None


@cache
def discriminators(model: Model) -> dict[str, str]:
    """Return the required keys of a class with one allowed value, such as {"kind": "pipe"}."""
    return {
        name: get_args(field.annotation)[0]
        for name, field in model.model_fields.items()
        if get_origin(field.annotation) is Literal and field.is_required()
    }


def first_key(model: Model) -> str:
    """Return the first key of a class."""
    return next(iter(model.model_fields))


def place_of(root: Model, loc: Sequence[Key]) -> Place:
    """Return the place of pydantic's `loc` of an error, as deep as the schema goes.

    A loc also contains tags of classes, and a mark for an error in the key of a mapping, which are
    not keys.
    """
    place = Place(root)
    for part in loc:
        if part == "[key]":
            return place
        if len(place.models) > 1:
            place = place.tagged(str(part))
            continue
        place = place.inside(part) or Place(Any, None, (*place.keys, part))
    return place


def place_in(root: Model, tree: Tree, keys: Keys) -> Place | None:
    """Return the place of `keys` in a file with the content `tree`, or None if there is none."""
    place: Place | None = Place(root)
    held: Tree | None = tree
    for key in keys:
        place = place.variant(plain(held) if held else {}).inside(key) if place else None
        held = child(held, key) if held else None
    return place


def _bare(annotation: Any) -> Any:
    """Return the annotation without Annotated and without None."""
    return _layers(annotation)[0]


def _layers(annotation: Any) -> tuple[Any, list[Any]]:
    """Return the annotation without Annotated and without None, and the metadata of Annotated."""
    notes: list[Any] = []
    while True:
        arguments = get_args(annotation)
        if get_origin(annotation) is Annotated:
            annotation = arguments[0]
            notes.extend(arguments[1:])
        elif NoneType in arguments and len(arguments) == 2:
            annotation = next(a for a in arguments if a is not NoneType)
        else:
            return annotation, notes
