"""Mullins effect: softening of a law by the largest energy density so far.

Ogden and Roxburgh 1999, Proc. R. Soc. Lond. A 455:2861-2877, with the constants of ABAQUS's
*MULLINS EFFECT. W is the isochoric energy density of the law at a material point, W_m its largest
value so far. The stress of the law is multiplied by
    eta = 1 - erf(x) / r,    x = (W_m - W) / s,    s = m + beta W_m,
which is 1 on the first loading, W = W_m. At constant W_m this stress is the gradient of
    U = int_0^W eta dw = W - (s / r) [g(W_m / s) - g(x)],    g(x) = x erf x + exp(-x^2) / sqrt(pi).
The first loading does the work W_m, so
    D = W_m - U(W_m) = (s / r) [g(W_m / s) - g(0)]
is dissipated. It rises with W_m alone. After complete unloading U = 0: there is no permanent set.

The functions with the constants as `c` serve floats, numpy arrays and Taichi lane vectors, as those
of materials/law.py; they carry no annotations, because Taichi would read them.
"""

from dataclasses import dataclass

import numpy as np

LEAST_SCALE = 1e-9
"""Smallest s [J/m^3], that of a strain of about 1e-7: it matters at rest if m = 0."""


@dataclass(frozen=True)
class Mullins:
    """Constants r > 1 [-], m [J/m^3] and beta [-], of which m or beta is greater than 0."""

    r: float
    m: float
    beta: float

    @property
    def constants(self) -> tuple[float, ...]:
        """r, m, beta, which the functions below take as `c`."""
        return (self.r, self.m, self.beta)

    @property
    def least_factor(self) -> float:
        """1 - 1/r, below which eta never falls."""
        return 1.0 - 1.0 / self.r

    def steepest_slope(self, W: np.ndarray) -> np.ndarray:
        """Return d eta / dW [m^3/J] at energy densities W where unloading begins, W_m = W.

        For larger W_m it is smaller.
        """
        scale = np.maximum(self.m + self.beta * W, LEAST_SCALE)
        return np.asarray(2.0 / (np.sqrt(np.pi) * self.r * scale))

    @staticmethod
    def factor(W, peak, c, f):
        """Return eta [-]; peak: W_m, f: the `Functions` of the arguments' kind."""
        scale = f.maximum(c[1] + c[2] * peak, LEAST_SCALE)
        return 1.0 - f.erf((peak - W) / scale) / c[0]

    @staticmethod
    def stored(W, peak, c, f):
        """Return U [J/m^3]."""
        scale = f.maximum(c[1] + c[2] * peak, LEAST_SCALE)
        lost = f.erf_integral(peak / scale) - f.erf_integral((peak - W) / scale)
        return W - scale / c[0] * lost

    @staticmethod
    def dissipated(peak, c, f):
        """Return D [J/m^3]."""
        scale = f.maximum(c[1] + c[2] * peak, LEAST_SCALE)
        return scale / c[0] * f.erf_integral(peak / scale)
