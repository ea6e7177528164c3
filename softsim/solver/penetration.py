"""Penetration of walls by nodes and of bodies by each other, which penalty contact allows.

Depths are compared with the size of the elements and the thickness of walls. A node that is more
than half through a wall is pushed out on the other side. If no increment moves it by more than a
quarter of the wall's thickness, its depth has been between a quarter and a half before: a motion
per increment and a largest depth that are both below a quarter therefore rule this out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from softsim.contact.wall import Wall
from softsim.mesh.surface import side_lengths
from softsim.model import Model, SelfContactData
from softsim.solver.explicit import Scenario

# Deeper than this share of its elements' size a node is held by a contact that is too soft.
DEEPEST = 0.1
# Share of a wall's thickness beyond which a node may come out on the other side.
THROUGH = 0.25


@dataclass(frozen=True)
class Penetration:
    """Largest penetration of walls so far.

    depths: (walls, k) [m], of each node of `model.contact` into each wall. relative: the largest
    ratio to the size of the elements at the node [-]; node: that node, None without contact.
    """

    depths: np.ndarray
    relative: float
    node: int | None


def penetration(scenario: Scenario) -> Penetration:
    """Return the largest penetration of walls since t = 0."""
    contacts = scenario.terms.contacts_by_wall
    depths = np.array(
        [np.max([scenario.read(c.penetration) for c in of_wall], axis=0) for of_wall in contacts]
    )
    return penetration_of(scenario.model, depths)


def penetration_of(model: Model, depths: np.ndarray) -> Penetration:
    """Return the penetration for depths (walls, k) [m] of the nodes that may touch."""
    if not depths.size:
        return Penetration(depths, 0.0, None)
    relative = depths.max(axis=0) / element_sizes(model)[model.contact.nodes]
    worst = int(np.argmax(relative))
    node = int(model.contact.nodes[worst]) if relative[worst] > 0.0 else None
    return Penetration(depths, float(relative[worst]), node)


@dataclass(frozen=True)
class BodyPenetration:
    """Largest penetration of bodies into each other, or of one into itself, so far.

    relative: over the size of the facets there [-]; depth [m]; place (d,) of that point at rest
    [m]. Zero without contact.
    """

    relative: float
    depth: float
    place: np.ndarray


def body_penetration(scenario: Scenario) -> BodyPenetration | None:
    """Return the largest penetration of surfaces since t = 0, None without contact of bodies."""
    if scenario.model.self_contact is None:
        return None
    depths = np.max([scenario.read(c.deepest) for c in scenario.terms.self_contacts], axis=0)
    return body_penetration_of(scenario.model, scenario.model.self_contact, depths)


def body_penetration_of(model: Model, data: SelfContactData, depths: np.ndarray) -> BodyPenetration:
    """Return the penetration for depths (k + f,) [m] of all contact points."""
    corners = model.points[data.facets]
    of_facets = side_lengths(model.points, data.facets).mean(axis=1)
    sizes = np.concatenate([element_sizes(model)[data.nodes], of_facets])
    # A finely meshed rigid surface makes no contact softer: deformable facets are the measure.
    rigid = np.concatenate([data.nodes, data.facets[:, 0]]) >= model.meshed_count
    sizes[rigid] = np.maximum(sizes[rigid], sizes[~rigid].mean())
    relative = depths / sizes
    worst = int(np.argmax(relative))
    places = np.concatenate([model.points[data.nodes], corners.mean(axis=1)])
    return BodyPenetration(float(relative[worst]), float(depths[worst]), places[worst])


def body_penetration_warnings(found: BodyPenetration | None) -> dict[str, str]:
    """Return a warning of bodies that penetrated each other deeply for the size of elements."""
    if found is None or found.relative <= DEEPEST:
        return {}
    place = ", ".join(f"{c * 1e3:.2f}" for c in found.place)
    return {
        "penetration of bodies": f"the surface at rest at ({place}) mm penetrated another surface "
        f"by {1e3 * found.depth:.3g} mm, {100.0 * found.relative:.3g} % of the size of its "
        f"elements, more than {100.0 * DEEPEST:g} %: the contact is too soft; lower "
        "contact.allowed_penetration, or leave out contact.penalty_stiffness"
    }


def element_sizes(model: Model) -> np.ndarray:
    """Return the mean side of the surface facets at each node (n,) [m].

    It is infinite for nodes that are on no surface, and the smallest diameter of all rigid outlines
    for their nodes.
    """
    sizes = np.full(len(model.points), np.inf)
    outlines = slice(model.first_outline_node, None)
    sizes[outlines] = min((2.0 * o.shape.radius for o in model.outlines), default=np.inf)
    surfaces = [body.facet_sets["surface"] for body in model.bodies]
    for facets in (*surfaces, *(body.facets for body in model.rigid_bodies)):
        sides = side_lengths(model.points, facets)
        corners = [facets, np.roll(facets, 1, axis=1)]
        sums, counts = (
            sum(np.bincount(c.ravel(), w.ravel(), len(sizes)) for c in corners)
            for w in (sides, sides > 0.0)
        )
        np.divide(sums, counts, out=sizes, where=counts > 0)
    return sizes


def penetration_warnings(model: Model, found: Penetration) -> dict[str, str]:
    """Return warnings of nodes that penetrated a wall deeply for their elements or the wall."""
    warnings = {}
    if found.node is not None and found.relative > DEEPEST:
        depth = found.depths[:, model.contact.nodes == found.node].max()
        place = ", ".join(f"{c * 1e3:.2f}" for c in model.points[found.node])
        warnings["penetration"] = (
            f"the node at rest at ({place}) mm penetrated a wall by {1e3 * depth:.3g} mm, "
            f"{100.0 * found.relative:.3g} % of the size of its elements, more than "
            f"{100.0 * DEEPEST:g} %: the contact is too soft; raise "
            "contact.penalty_stiffness, or leave it out"
        )
    for wall, depths in zip(model.walls, found.depths, strict=False):
        thickness, depth = wall.thickness(), float(depths.max())
        if depth > THROUGH * thickness:
            warnings[f"thickness of {wall.names[0]}"] = (
                f"a node penetrated the wall '{wall.names[0]}' by {1e3 * depth:.3g} mm, and the "
                f"wall is {1e3 * thickness:.3g} mm thick: the node may have passed through; "
                "make the wall thicker, raise contact.penalty_stiffness, or reduce the speed "
                "of impact"
            )
    return warnings


def thinnest_wall(walls: Sequence[Wall]) -> tuple[str, float]:
    """Return the name of the thinnest wall and its thickness [m]; infinite without thin walls."""
    return min(
        ((w.names[0], w.thickness()) for w in walls), key=lambda w: w[1], default=("", np.inf)
    )


def crossing_warnings(name: str, thickness: float, speed: float, dt: float) -> dict[str, str]:
    """Return a warning if the fastest node can pass through a thin wall in one increment.

    name, thickness [m]: of the wall. speed [m/s]: of the node. dt [s]: the time step.
    """
    if speed * dt <= THROUGH * thickness:
        return {}
    return {
        f"thickness of {name}": f"a node moves at {speed:.3g} m/s, which is "
        f"{1e3 * speed * dt:.3g} mm per increment, and the wall '{name}' is "
        f"{1e3 * thickness:.3g} mm thick: nodes may pass through it; make the wall thicker, "
        f"or set time.increment to at most {1e6 * THROUGH * thickness / speed:.3g} us"
    }
