"""Elementary functions for laws, of floats and numpy arrays.

Kernels use the same functions of lane vectors (elements/isochoric.py), compiled from the texts
below: their arguments carry no annotations, which Taichi would read.
"""

from typing import Any

import numpy as np

CLOSE = 3e-3
"""Difference of squared stretches below which a series is used: a second divided difference loses
eps / CLOSE^2 to rounding, and the series that stands for it CLOSE^5."""


class Functions:
    """Elementary functions, and functions of the principal stretches of isochoric deformations."""

    exp: Any
    log: Any
    sqrt: Any
    cos: Any
    acos: Any
    minimum: Any
    maximum: Any
    where: Any

    exp, log, sqrt, cos, acos = np.exp, np.log, np.sqrt, np.cos, np.arccos
    minimum, maximum, where = np.minimum, np.maximum, staticmethod(np.where)

    def principal_logarithms(self, I1, I2):
        """Return ln c1 >= ln c2 >= ln c3 of the squared principal stretches.

        c1, c2, c3 are the roots of c^3 - I1 c^2 + I2 c - 1 = 0, by the angle of its three cosines
        (Smith 1961, Comm. ACM 4:168).
        """
        q = self.maximum((I1 * I1 - 3.0 * I2) / 9.0, 1e-30)
        r = (2.0 * I1 * I1 * I1 - 9.0 * I1 * I2 + 27.0) / 54.0
        size = self.sqrt(q)
        angle = self.acos(self.minimum(self.maximum(r / (q * size), -1.0), 1.0)) / 3.0
        c1 = I1 / 3.0 + 2.0 * size * self.cos(angle)
        # Two that are far below c1 lose digits to its size: their sum is (I2 - c2 c3) / c1.
        half = 0.5 * (I2 - 1.0 / c1) / c1
        below = half + self.sqrt(self.maximum(half * half - 1.0 / c1, 0.0))
        beside = I1 / 3.0 + 2.0 * size * self.cos(angle - 2.0943951023931953)
        u, v = self.log(c1), self.log(self.where(r > 0.0, below, beside))
        return u, v, -u - v  # c1 c2 c3 = 1

    def power_curvature(self, p, u, v, w):
        """Return the second divided difference of c^p at exp u >= exp v >= exp w with product 1.

        It is half the second derivative of c^p where all are equal.

        Where the three are close to their mean, the Taylor series there is used, in the complete
        homogeneous polynomials of the differences from it: h1 = 0, h2, h3, h4 = h2^2.
        """
        a, b, c = self.exp(u), self.exp(v), self.exp(w)
        mean = (a + b + c) / 3.0
        h2 = 0.5 * ((a - mean) * (a - mean) + (b - mean) * (b - mean) + (c - mean) * (c - mean))
        h3 = (a - mean) * (b - mean) * (c - mean)
        k = p * (p - 1.0) / 2.0
        k2 = k * (p - 2.0) * (p - 3.0) / 12.0
        k3 = k2 * (p - 4.0) / 5.0
        k4 = k3 * (p - 5.0) / 6.0
        near = mean ** (p - 2.0) * (k + k2 * h2 + k3 * h3 + k4 * h2 * h2)
        slopes = self.power_slope(p, u, v) - self.power_slope(p, v, w)
        return self.where(a - c < CLOSE, near, slopes / self.maximum(a - c, CLOSE))

    def power_slope(self, p, u, v):
        """Return (a^p - b^p) / (a - b) of a = exp u, b = exp v.

        With m = sqrt(a b), h = ln(a/b) / 2 it is m^(p-1) sinh(p h) / sinh h.
        """
        h = 0.5 * (u - v)
        ratio = self.sinh_ratio(p * h) / self.sinh_ratio(h)
        return p * self.exp(0.5 * (p - 1.0) * (u + v)) * ratio

    def sinh_ratio(self, x):
        """Return sinh x / x, by its series where |x| < 1: to x^14 / 15!."""
        s = x * x
        series = 1.0 + s / 6.0 * (1.0 + s / 20.0 * (1.0 + s / 42.0 * (1.0 + s / 72.0 * (
            1.0 + s / 110.0 * (1.0 + s / 156.0 * (1.0 + s / 210.0))))))  # fmt: skip
        far = self.where(s < 1.0, 1.0, x)
        return self.where(s < 1.0, series, (self.exp(far) - self.exp(-far)) / (2.0 * far))
