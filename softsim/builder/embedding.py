"""Places in bodies: the elements around them, and how far outside they may lie."""

import numpy as np

from softsim.builder.names import MeshedBody, Names, in_mm
from softsim.elements.axisymmetric import Axisymmetric
from softsim.elements.embedding import embedded
from softsim.elements.ring_section import RingSection
from softsim.mesh.bearing import side_lengths
from softsim.mesh.mesh import SURFACE
from softsim.scene.tree import Keys

# Of the mean side of the surface's facets: how far outside a place may lie where the scene says
# nothing.
USUAL_TOLERANCE = 0.05


def refuse_all_around(names: Names, what: str, keys: Keys) -> None:
    """Raise SceneError in an axisymmetric or ring model, where `what` would be a closed sheet."""
    if isinstance(names.geometry, Axisymmetric | RingSection):
        raise names.loaded.error(
            keys,
            f"{what} in a model that is {names.geometry.name} would be a closed sheet around the "
            "axis",
            "write formulation solid or plane_strain, or use a layer instead",
        )


def usual_tolerance(body: MeshedBody) -> float:
    """Return the default tolerance [m]: how far outside of a body a place may lie."""
    facets, points = body.mesh.facet_sets[SURFACE], body.mesh.points
    sides = side_lengths(points, facets)
    return USUAL_TOLERANCE * float(sides[sides > 0.0].mean())


def in_bodies(
    names: Names, places: np.ndarray, tolerance: float | None, keys: Keys
) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (k, c) that each place (k, d) [m] follows, and their weights (k, c).

    They belong to the body in which the place lies, or to which it is closest. tolerance: how far
    it may lie outside [m], None: the usual one. Raises SceneError at `keys` with the number of a
    place that is farther away.
    """
    found = []
    for body in names.bodies.values():
        mesh = body.mesh
        nodes, weights, moved = embedded(places, mesh.points, mesh.cells, mesh.facet_sets[SURFACE])
        most = usual_tolerance(body) if tolerance is None else tolerance
        found.append((body.first_node + nodes, weights, moved, np.full(len(places), most)))
    nodes, weights, moved, allowed = (np.stack(parts) for parts in zip(*found, strict=True))
    closest, each = np.argmin(moved, axis=0), np.arange(len(places))
    outside = np.flatnonzero(moved[closest, each] > allowed[closest, each])
    if len(outside):
        k = int(outside[0])
        name = list(names.bodies)[closest[k]]
        raise names.loaded.error(
            (*keys, k),
            f"{in_mm(places[k])} is outside all bodies: {moved[closest[k], k] * 1e3:.3g} mm from "
            f"'{name}', more than the tolerance of {allowed[closest[k], k] * 1e3:.3g} mm",
            "place it inside a body",
        )
    return nodes[closest, each], weights[closest, each]
