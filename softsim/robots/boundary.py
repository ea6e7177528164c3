"""Parts of a body's boundary, found by their nodes."""

import numpy as np


def facets_on(boundary: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Those of the boundary's facets (k, corners) whose nodes are all among `nodes`."""
    return boundary[np.isin(boundary, nodes).all(axis=1)]


def facets_touching(boundary: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Those of the boundary's facets (k, corners) with at least one node among `nodes`."""
    return boundary[np.isin(boundary, nodes).any(axis=1)]
