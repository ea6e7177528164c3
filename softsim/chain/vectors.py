"""Functions of vectors (..., d) in the plane (x, z) or in space (x, y, z), last component up."""

import numpy as np


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar products (...) of vectors."""
    return (a * b).sum(axis=-1)


def size(a: np.ndarray) -> np.ndarray:
    """Return the lengths (...) of vectors."""
    return np.sqrt(dot(a, a))


def level(a: np.ndarray) -> np.ndarray:
    """Return the vectors without their upward component (..., d)."""
    along = a.copy()
    along[..., -1] = 0.0
    return along


def upwards(sizes: np.ndarray, like: np.ndarray) -> np.ndarray:
    """Return upward vectors of these sizes (...), with as many components as `like`."""
    vectors = np.zeros(like.shape)
    vectors[..., -1] = sizes
    return vectors
