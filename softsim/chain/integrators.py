"""Time integration of y' = rates(t, y)."""

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from softsim.errors import StabilityError

Rates = Callable[[float, np.ndarray], np.ndarray]

REAL_STABILITY = 2.78
"""Largest increment times decay rate for which the classical Runge-Kutta method is stable (Hairer,
Wanner, *Solving Ordinary Differential Equations II*, IV.2)."""

RELATIVE, ABSOLUTE = 1e-6, 1e-9
"""Relative [-] and absolute [m, m/s] error of an adaptive step."""


def fixed_steps(rates: Rates, times: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Return the states (steps + 1, ...) at evenly spaced times by the Runge-Kutta method RK4.

    The order is 4 between changes of contact, and 1 across them, where forces jump.

    Raises
    ------
    StabilityError
        The states become infinite.
    """
    states = np.empty((len(times), *start.shape), start.dtype)
    states[0] = y = start
    h = times[1] - times[0]
    with np.errstate(over="ignore", invalid="ignore"):  # told below
        for step, t in enumerate(times[:-1].tolist(), 1):
            k1 = rates(t, y)
            k2 = rates(t + 0.5 * h, y + 0.5 * h * k1)
            k3 = rates(t + 0.5 * h, y + 0.5 * h * k2)
            k4 = rates(t + h, y + h * k3)
            states[step] = y = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    if not np.isfinite(states[-1]).all():
        lost = times[np.flatnonzero(~np.isfinite(states).reshape(len(times), -1).all(axis=1))[0]]
        raise StabilityError(
            f"the motion of the chain became infinite at {lost:.4g} s",
            "reduce time.increment, or reduce the motor force",
        )
    return states


def adaptive_steps(rates: Rates, times: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Return the states (rows, ...) at some times by the Dormand-Prince pair of order 5 and 4.

    This is the method of MATLAB's ode45, which the thesis uses.

    Raises
    ------
    StabilityError
        The step becomes too small.
    """

    def flat(t: float, y: np.ndarray) -> np.ndarray:
        return rates(t, y.reshape(start.shape)).ravel()

    found = solve_ivp(
        flat, (times[0], times[-1]), start.ravel(), method="RK45", t_eval=times,
        rtol=RELATIVE, atol=ABSOLUTE, max_step=10.0 * (times[1] - times[0]),
    )  # fmt: skip
    if not found.success:
        raise StabilityError(
            f"the integration of the chain stopped at {found.t[-1]:.4g} s: {found.message}"
        )
    return found.y.T.reshape(len(times), *start.shape)


INTEGRATORS = {"fixed": fixed_steps, "adaptive": adaptive_steps}
