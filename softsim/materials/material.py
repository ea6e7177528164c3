"""What a body is made of: an isochoric law, a bulk modulus, Maxwell branches, a density."""

from dataclasses import dataclass

import numpy as np

from softsim.materials.laws import Law

# ABAQUS/Explicit takes this ratio kappa / mu0 where no compressibility is given.
DEFAULT_BULK_RATIO = 20.0


@dataclass(frozen=True)
class MaxwellBranch:
    """A spring of shear modulus `shear_modulus` [Pa] behind a dashpot: relaxation time [s]."""

    shear_modulus: float
    relaxation_time: float


@dataclass(frozen=True)
class Material:
    """A nearly incompressible, viscoelastic solid.

    W = law(I1_bar) + (bulk_modulus / 2) (J - 1)^2 + the energy of the Maxwell branches.
    strain_range: largest engineering strain that the law was fitted on, or None.
    """

    name: str
    law: Law
    bulk_modulus: float
    density: float
    branches: tuple[MaxwellBranch, ...] = ()
    strain_range: float | None = None

    @property
    def instantaneous_shear_modulus(self) -> float:
        """Shear modulus at rest under a sudden load [Pa]: the law's and that of all branches."""
        return self.law.initial_shear_modulus + sum(b.shear_modulus for b in self.branches)

    @property
    def impedance(self) -> float:
        """rho c_d [Pa s/m], the stress of a compression wave over its velocity: at rest, under a
        sudden load.
        """
        modulus = self.bulk_modulus + 4.0 / 3.0 * self.instantaneous_shear_modulus
        return float(np.sqrt(modulus * self.density))


def bulk_modulus_from_poisson_ratio(shear_modulus: float, poisson_ratio: float) -> float:
    """kappa = 2 mu (1 + nu) / (3 (1 - 2 nu)) [Pa]."""
    return 2.0 * shear_modulus * (1.0 + poisson_ratio) / (3.0 * (1.0 - 2.0 * poisson_ratio))


def maxwell_branches(
    long_term_shear_modulus: float, prony: list[tuple[float, float]]
) -> tuple[MaxwellBranch, ...]:
    """Branches of a Prony series (g, relaxation time [s]).

    g is a share of the *instantaneous* modulus, as in ABAQUS's *VISCOELASTIC, TIME=PRONY, the law
    holds the *long-term* one: mu_branch = g mu0 / (1 - sum g).
    """
    remaining = 1.0 - sum(g for g, _ in prony)
    return tuple(MaxwellBranch(g * long_term_shear_modulus / remaining, time) for g, time in prony)
