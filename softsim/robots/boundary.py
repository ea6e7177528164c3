"""Parts of a body's boundary, found by their nodes."""

import numpy as np

from softsim.mesh.mesh import boundary_facets


def facets_on(cells: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Boundary facets (k, 2 or 3), outward, whose nodes are all among `nodes`."""
    facets = boundary_facets(cells)
    return facets[np.isin(facets, nodes).all(axis=1)]


def facets_touching(cells: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Boundary facets (k, 2 or 3), outward, with at least one node among `nodes`."""
    facets = boundary_facets(cells)
    return facets[np.isin(facets, nodes).any(axis=1)]
