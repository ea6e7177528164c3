"""Upper bound of the largest eigenvalue of a large symmetric matrix, from a few products with it.

Lanczos iteration from a random vector estimates the eigenvalue from below. The error has a bound
(Kuczynski and Wozniakowski 1992, SIAM J. Matrix Anal. Appl. 13:1094-1122, theorem 4.2): of all
start vectors, uniformly distributed over directions, the fraction with an error of more than
eps lambda after k steps is at most 1.648 sqrt(n) exp(-sqrt(eps) (2 k - 1)) for every matrix.
The start vector is always the same one, and products of vectors are summed by numpy itself
(einsum), not by BLAS, whose threads change the last bits: the result depends on the matrix alone.
"""

from collections.abc import Callable

import numpy as np
from scipy.linalg import eigh_tridiagonal

# Steps, and the share of start vectors for which the bound may fail. Of 2,000 unknowns the bound
# then lies 5 % above the estimate, 2.5 % of the time step.
STEPS = 36
FAILING_SHARE = 1e-5
# Steps of a mere estimate: of the robot in section and in space it lacks 0.5 % at most.
FEW_STEPS = 10


def largest_eigenvalue_bound(
    product: Callable[[np.ndarray], np.ndarray], moving: np.ndarray
) -> tuple[float, np.ndarray]:
    """Return an upper bound of the largest eigenvalue and a unit vector (size,) near its vector.

    The matrix is positive semidefinite. product: function that returns the matrix times a vector
    (size,). moving (size,): True where rows of the matrix may be nonzero.
    """
    estimate, vector = lanczos(product, start_vector(moving), STEPS)
    return estimate / (1.0 - shortfall(int(moving.sum()), STEPS)), vector


def largest_eigenvalue_estimate(
    product: Callable[[np.ndarray], np.ndarray], moving: np.ndarray
) -> float:
    """Return an estimate of the largest eigenvalue from below, in fewer steps than the bound."""
    return lanczos(product, start_vector(moving), FEW_STEPS)[0]


def start_vector(moving: np.ndarray) -> np.ndarray:
    """Return a random unit vector (size,), zero where `moving` is False."""
    start = np.random.default_rng(0).standard_normal(len(moving)) * moving
    return start / length(start)


def shortfall(size: int, steps: int) -> float:
    """Return eps, the largest error of the estimate over the eigenvalue [-]."""
    return float((np.log(1.648 * np.sqrt(size) / FAILING_SHARE) / (2 * steps - 1)) ** 2)


def lanczos(
    product: Callable[[np.ndarray], np.ndarray], start: np.ndarray, steps: int
) -> tuple[float, np.ndarray]:
    """Return the largest Ritz value and its unit vector after `steps` from the unit vector `start`.

    There is no reorthogonalisation: orthogonality is lost only once that value has converged
    (Paige 1976, J. Inst. Math. Appl. 18:341-349).
    """
    basis = np.zeros((steps, len(start)), dtype=np.float32)  # only the vector hangs on it
    diagonal, beside = np.zeros(steps), np.zeros(steps)
    vector, previous = start, np.zeros_like(start)
    for k in range(steps):
        basis[k] = vector
        image = product(vector) - beside[k - 1] * previous
        diagonal[k] = np.einsum("i,i", vector, image)
        image -= diagonal[k] * vector
        beside[k] = length(image)
        # An invariant subspace, which holds the eigenvector: nothing is left to find.
        if beside[k] <= 1e-10 * diagonal[: k + 1].max():
            steps = k + 1
            break
        vector, previous = image / beside[k], vector
    values, shares = eigh_tridiagonal(
        diagonal[:steps], beside[: steps - 1], select="i", select_range=(steps - 1, steps - 1)
    )
    found = np.einsum("k,ki", shares[:, 0], basis[:steps])
    # Of more steps than unknowns the basis repeats itself, and what is found is shorter than one.
    return float(values[0]), found / length(found)


def length(vector: np.ndarray) -> float:
    """Return the Euclidean norm."""
    return float(np.sqrt(np.einsum("i,i", vector, vector)))
