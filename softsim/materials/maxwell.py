"""Maxwell branches in parallel with a spring, and their complex modulus.

mu(omega) / mu_inf = 1 + sum m_k i omega tau_k / (1 + i omega tau_k), mu_inf the long-term modulus.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from softsim.materials.material import MaxwellBranch


@dataclass(frozen=True, eq=False)
class MaxwellSeries:
    """Branches: relaxation times (k,) [s], and moduli (k,) over the long-term modulus."""

    relaxation_times: np.ndarray
    moduli: np.ndarray

    @classmethod
    def of_prony(cls, terms: Sequence[tuple[float, float]]) -> "MaxwellSeries":
        """Return the branches of a Prony series (g, relaxation time [s]).

        g is a fraction of the *instantaneous* modulus, as in ABAQUS's *VISCOELASTIC, TIME=PRONY;
        the law has the *long-term* modulus: m = g / (1 - sum g).
        """
        shares, times = np.reshape(terms, (-1, 2)).T
        return cls(times, shares / (1.0 - shares.sum()))

    @property
    def shares(self) -> np.ndarray:
        """g of each branch (k,): its fraction of the instantaneous modulus."""
        return self.moduli / (1.0 + self.moduli.sum())

    def modulus(self, frequency: np.ndarray) -> np.ndarray:
        """Return the complex modulus (n,) over the long-term one at frequencies (n,) [Hz]."""
        return 1.0 + branch_moduli(frequency, self.relaxation_times) @ self.moduli

    def branches(self, long_term_modulus: float) -> tuple[MaxwellBranch, ...]:
        """Return the branches of a law whose shear modulus at rest is `long_term_modulus` [Pa]."""
        return tuple(
            MaxwellBranch(float(modulus * long_term_modulus), float(time))
            for modulus, time in zip(self.moduli, self.relaxation_times, strict=True)
            if modulus > 0.0
        )


def branch_moduli(frequency: np.ndarray, relaxation_times: np.ndarray) -> np.ndarray:
    """Return the complex modulus (n, k) of branches of unit modulus.

    It is i omega tau / (1 + i omega tau).
    """
    turned = 2j * np.pi * frequency[:, None] * relaxation_times
    return turned / (1.0 + turned)
