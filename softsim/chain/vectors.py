"""Vectors (..., d), of the plane (x, z) or of space (x, y, z): the last component is up."""

import numpy as np


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(...)."""
    return (a * b).sum(axis=-1)


def size(a: np.ndarray) -> np.ndarray:
    """(...)."""
    return np.sqrt(dot(a, a))


def level(a: np.ndarray) -> np.ndarray:
    """Without what they have upwards (..., d)."""
    along = a.copy()
    along[..., -1] = 0.0
    return along


def upwards(sizes: np.ndarray, like: np.ndarray) -> np.ndarray:
    """Of these sizes (...), straight up, with as many components as `like` has."""
    vectors = np.zeros(like.shape)
    vectors[..., -1] = sizes
    return vectors
