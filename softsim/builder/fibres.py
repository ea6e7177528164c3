"""Fibres in bodies: the places along them, the elements around these, and their mass."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from softsim.builder.embedding import refuse_all_around, usual_tolerance
from softsim.builder.names import MeshedBody, Names, close_names, in_mm
from softsim.elements.embedding import embedded
from softsim.elements.fibre import Fibre
from softsim.mesh.closest import at
from softsim.mesh.mesh import SURFACE
from softsim.scene import fibres
from softsim.scene.tree import Keys

# A helix is a polygon with so many sides a turn, at least.
LEAST_SIDES = 8


def built_fibres(names: Names) -> tuple[Fibre, ...]:
    """Return all fibres of a scene, in its order.

    Raises SceneError in an axisymmetric model or a ring section, for a fibre without a length, and
    for one that leaves its body.
    """
    return tuple(fibre(names, name) for name in names.scene.fibres)


def fibre_masses(all_fibres: Sequence[Fibre], node_count: int) -> np.ndarray:
    """Return the mass (n,) [kg] of the fibres at each node."""
    return sum((f.nodal_mass(node_count) for f in all_fibres), np.zeros(node_count))


def fibre(names: Names, name: str) -> Fibre:
    """Return a fibre of a scene."""
    data, keys = names.scene.fibres[name], ("fibres", name)
    refuse_all_around(names, "a fibre", keys)
    if data.body not in names.bodies:
        raise names.loaded.error(
            (*keys, "body"),
            f"there is no body '{data.body}'",
            close_names(data.body, list(names.bodies), "bodies"),
        )
    body = names.bodies[data.body]
    if data.helix is None:
        places = along_corners(names, name)
    else:
        places = along_helix(names, data.helix, data.spacing, (*keys, "helix"))
    points = body.mesh.points
    nodes, weights, moved = embedded(places, points, body.mesh.cells, body.mesh.facet_sets[SURFACE])
    refuse_outside(names, name, body, places, moved)
    held = at(weights, points[nodes])
    area = 0.25 * np.pi * data.diameter**2
    return Fibre(
        name=name,
        corners=body.first_node + nodes,
        weights=weights,
        lengths=np.linalg.norm(np.diff(held, axis=0), axis=1),
        stretching_stiffness=data.youngs_modulus * area,
        mass_per_length=data.density * area,
        bears_compression=data.bears_compression,
    )


def along_corners(names: Names, name: str) -> np.ndarray:
    """Return places (k, d) [m] along a fibre: its points, and places evenly between them."""
    data = names.scene.fibres[name]
    assert data.points is not None
    corners = [
        names.vector(point, ("fibres", name, "points", k)) for k, point in enumerate(data.points)
    ]
    places = [corners[0]]
    for k, (start, end) in enumerate(pairwise(corners)):
        length = float(np.linalg.norm(end - start))
        if length == 0.0:
            raise names.loaded.error(
                ("fibres", name, "points", k + 1),
                f"'{name}' has two successive points at {in_mm(start)}",
                "leave one of them out",
            )
        count = max(1, round(length / data.spacing))
        places += [start + (end - start) * step / count for step in range(1, count)]
        places.append(end)
    return np.array(places)


def along_helix(names: Names, helix: fibres.Helix, spacing: float, keys: Keys) -> np.ndarray:
    """Return places (k, 3) [m], evenly spaced along a helix.

    Raises SceneError in a section, and if the spacing makes too coarse a polygon of it.
    """
    if names.dimension == 2:
        raise names.loaded.error(
            keys,
            "a helix is not possible in a plane section",
            "write points, or use formulation solid",
        )
    axis = names.axis(helix.direction, (*keys, "direction"))
    a_turn = float(np.hypot(2.0 * np.pi * helix.radius, helix.pitch))
    if spacing * LEAST_SIDES > a_turn:
        raise names.loaded.error(
            (*keys[:-1], "spacing"),
            f"a turn of the helix is {a_turn * 1e3:.4g} mm long, less than {LEAST_SIDES} bars of "
            f"{spacing * 1e3:.4g} mm",
            f"set spacing to at most {a_turn / LEAST_SIDES * 1e3:.3g} mm",
        )
    count = max(1, round(helix.turns * a_turn / spacing))
    turned = helix.turns * np.linspace(0.0, 1.0, count + 1)
    sense = 1.0 if helix.handedness == "right" else -1.0
    angle = helix.start_angle + sense * 2.0 * np.pi * turned
    across = [helix.radius * np.cos(angle), helix.radius * np.sin(angle)]
    # The first column is along the axis; those after it follow as y after x.
    places = np.roll(np.stack([helix.pitch * turned, *across], axis=1), axis, axis=1)
    return places + names.vector(helix.center, (*keys, "center"))


def refuse_outside(
    names: Names, name: str, body: MeshedBody, places: np.ndarray, moved: np.ndarray
) -> None:
    """Raise SceneError if a place (k, d) [m] of a fibre is too far outside its body.

    moved (k,) [m]: its distance from the body, which must not exceed the tolerance.
    """
    data = names.scene.fibres[name]
    tolerance = usual_tolerance(body) if data.tolerance is None else data.tolerance
    out = np.flatnonzero(moved > tolerance)
    if not len(out):
        return
    worst = int(np.argmax(moved))
    raise names.loaded.error(
        ("fibres", name, "helix" if data.points is None else "points"),
        f"'{name}' leaves body '{data.body}' at {in_mm(places[out[0]])}; at "
        f"{in_mm(places[worst])} it is {moved[worst] * 1e3:.3g} mm outside, more than the "
        f"tolerance of {tolerance * 1e3:.3g} mm",
        f"place it inside the body, or raise the tolerance (fibres.{name}.tolerance)",
    )
