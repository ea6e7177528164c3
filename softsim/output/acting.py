"""Description of the loads, gravity, walls, contact and supports that act on the bodies of a scene.

Defaults that a scene does not mention are listed too, and marked.
"""

from collections.abc import Iterator

import numpy as np

from softsim.mesh.surface import sharp_edges
from softsim.model import Model
from softsim.scene.loading import LoadedScene, flow_text, phrase
from softsim.scene.text import Key, entries, nearest

Row = tuple[str, str]

SHARP = np.radians(45.0)
"""Angle between the normals on both sides of an edge beyond which it counts as sharp."""

CROSSING_DEPTH = 0.4
"""Measured depth of two crossing beams, over the side of their elements
(tests/verification/test_body_contact_in_space.py)."""


def acting(loaded: LoadedScene, model: Model) -> list[Row]:
    """Return the loads, supports, walls and contact of a scene as (title, text) pairs.

    Parameters
    ----------
    loaded: the scene, whose own words and units are used.
    model: the model that was built from it, which knows areas, resultants and the direction of
        gravity.
    """
    return [
        *_loads(loaded, model),
        *(
            (f"{part[:-1]} '{name}'", phrase(tree))
            for part in ("nodes", "edges")
            for name, tree in entries(loaded.tree, "pneumatics", part).items()
        ),
        ("gravity", _gravity(loaded, model)),
        *_held(loaded),
        *(
            (f"condition '{name}'", phrase(tree))
            for name, tree in entries(loaded.tree, "conditions").items()
            if name in loaded.scene.conditions
        ),
        *(
            (f"wall '{name}'", phrase(tree))
            for name, tree in entries(loaded.tree, "environment", "walls").items()
        ),
        *_contact(loaded),
        *_crossing_edges(model),
    ]


def not_read(model: Model) -> list[Row]:
    """Return the unsupported keywords of mesh files, as (body, keywords) pairs."""
    return [(f"body '{b.name}'", ", ".join(b.not_read)) for b in model.bodies if b.not_read]


def _loads(loaded: LoadedScene, model: Model) -> Iterator[Row]:
    """Yield a row for each load of the scene, or the row "none"."""
    remarks = model.named_loads
    trees = entries(loaded.tree, "loads")
    for name in loaded.scene.loads:
        remark = remarks[name].remark(model.points) if name in remarks else ""
        yield f"load '{name}'", phrase(trees[name]) + (f"; {remark}" if remark else "")
    if not loaded.scene.loads:
        yield "loads", "none"


def _gravity(loaded: LoadedScene, model: Model) -> str:
    keys = ("gravity", "gravity_profile", "inclination", "roll")
    given = entries(loaded.tree, "environment")
    said = [f"{key} {flow_text(given[key])}" for key in keys[1:] if key in given]
    vector = ", ".join(f"{component + 0.0:.4g}" for component in model.gravity)
    return "; ".join(
        [
            _value(loaded, "environment", keys[0]),
            *said,
            f"as a vector ({vector}) m/s^2",
        ]
    )


def _held(loaded: LoadedScene) -> Iterator[Row]:
    for name, body in loaded.scene.bodies.items():
        if body.fixed:
            yield "held", (f"{', '.join(f'{name}.{one}' for one in body.fixed)}, in all directions")
    for name, rigid in loaded.scene.rigid_bodies.items():
        tied = ", ".join(rigid.tied) or "no nodes"
        free = "" if rigid.free is None else f"; free: {', '.join(rigid.free) or 'nothing'}"
        if rigid.surface is not None:
            free += f"; surface: {rigid.surface.file or 'a polygon'}"
        yield f"rigid body '{name}'", f"moves with {tied}{free}"
    for name, tree in entries(loaded.tree, "ties").items():
        yield f"tie '{name}'", phrase(tree)


def _contact(loaded: LoadedScene) -> Iterator[Row]:
    scene = loaded.scene
    contact, touching = scene.contact, scene.contact.self_contact
    outlines = [name for name, rigid in scene.rigid_bodies.items() if rigid.supports]
    pairs = ["bodies with walls"] if scene.environment.walls else []
    pairs += [f"outline of '{name}' with its supports" for name in outlines]
    if touching:
        pairs.append(f"{', '.join(touching)} with themselves and each other")
    pairs += [" with ".join(pair.between) for pair in contact.pairs]
    named = touching or contact.pairs
    missing = (
        "" if named else ("; no self_contact: bodies can pass through themselves and each other")
    )
    yield "contact", ("; ".join(pairs) or "none: no walls") + missing
    if not pairs:
        return
    law = [f"mu {_value(loaded, 'contact', 'friction_coefficient')}"]
    if contact.friction_memory == 0.0:
        law.append(f"Coulomb's law, memory {_value(loaded, 'contact', 'friction_memory')}")
    else:
        law.append(
            "the friction limit follows the normal force with a memory of "
            f"{_value(loaded, 'contact', 'friction_memory')} and a slip length of "
            f"{_value(loaded, 'contact', 'friction_slip_length')}"
        )
    if touching and contact.self_friction_coefficient is not None:
        law.append(f"mu {contact.self_friction_coefficient:g} in self_contact")
    law += [
        f"mu {pair.friction_coefficient:g} between {' and '.join(pair.between)}"
        for pair in contact.pairs
        if pair.friction_coefficient is not None
    ]
    yield "friction", ", ".join(law)
    for name, tree in entries(loaded.tree, "contact", "adhesion").items():
        yield f"adhesion '{name}'", phrase(tree)


def _crossing_edges(model: Model) -> Iterator[Row]:
    """Yield a warning if sharp edges of several bodies in space may cross: contact misses that."""
    data = model.self_contact
    if data is None or model.dimension == 2:
        return
    nodes = np.unique(sharp_edges(model.points, data.facets, SHARP))
    owners = {b.name: np.r_[b.nodes] for b in model.bodies}
    owners |= {b.name: np.unique(b.facets) for b in model.rigid_bodies}
    sharp = [f"'{name}'" for name, own in owners.items() if np.isin(nodes, own).any()]
    if len(sharp) > 1:
        yield (
            "sharp edges",
            f"of {', '.join(sharp)}: contact between two edges is not detected; where edges cross "
            f"between nodes, they penetrate by up to {CROSSING_DEPTH:g} of an element side "
            "before contact acts; use smaller elements there, or round the edges",
        )


def _value(loaded: LoadedScene, *keys: Key) -> str:
    """Return a value as written in the scene, or its default, marked as default."""
    held, depth = nearest(loaded.tree, keys)
    if depth == len(keys):
        return flow_text(held)
    part = getattr(loaded.scene, str(keys[0]))
    return f"{flow_text(type(part).model_fields[str(keys[1])].default)} (default)"
