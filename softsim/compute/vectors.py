"""Functions of vectors for formulas of which one text serves numpy and kernels.

Such a formula is a plain function with these functions as its last argument `m`. With NUMPY it
takes numbers (n,) and vectors (d, n), the components first; with KERNEL, compiled by `ti.func`, the
numbers and vectors of one point. It carries no annotations, because Taichi would read them.

Operators, `abs` and indexing of components serve both. `where` evaluates both branches, so
denominators must vanish in neither. `if m.any(condition)` saves work where no point needs it; a
`where` inside it chooses. Loops over a fixed number take `ti.static`. Formulas that call each other
are methods of a class that derives from Vectors, and of one in kernels (contact/junction.py).
"""

from typing import Any

import numpy as np
import taichi as ti


class Vectors:
    """Functions of numpy arrays."""

    sqrt: Any = staticmethod(np.sqrt)
    sin: Any = staticmethod(np.sin)
    cos: Any = staticmethod(np.cos)
    atan2: Any = staticmethod(np.arctan2)
    sign: Any = staticmethod(np.sign)
    floor: Any = staticmethod(np.floor)
    minimum: Any = staticmethod(np.minimum)
    maximum: Any = staticmethod(np.maximum)
    where: Any = staticmethod(np.where)
    any: Any = staticmethod(np.any)
    all: Any = staticmethod(np.all)

    def dot(self, a, b):
        """Return the scalar product of two vectors."""
        return (a * b).sum(axis=0)

    def cross(self, a, b):
        """Return the vector product of two vectors in space."""
        return np.cross(a, b, axis=0)

    def norm(self, a):
        """Return the length of a vector."""
        return np.sqrt((a * a).sum(axis=0))

    def vector(self, components):
        """Return the vector of a list of components."""
        return np.stack(components)


@ti.data_oriented  # an argument of functions in kernels
class KernelVectors(Vectors):
    """Functions of numbers and vectors in kernels."""

    sqrt, sin, cos = staticmethod(ti.sqrt), staticmethod(ti.sin), staticmethod(ti.cos)
    atan2, sign = staticmethod(ti.atan2), staticmethod(ti.math.sign)
    floor, where = staticmethod(ti.floor), staticmethod(ti.select)
    minimum, maximum = staticmethod(ti.min), staticmethod(ti.max)
    vector = staticmethod(ti.Vector)

    @ti.func
    def any(self, condition):
        """Return the condition, which is that of one point."""
        return condition

    all = any

    @ti.func
    def dot(self, a, b):
        """Return the scalar product of two vectors."""
        return a.dot(b)

    @ti.func
    def cross(self, a, b):
        """Return the vector product of two vectors in space."""
        return a.cross(b)

    @ti.func
    def norm(self, a):
        """Return the length of a vector."""
        return a.norm()


NUMPY, KERNEL = Vectors(), KernelVectors()
