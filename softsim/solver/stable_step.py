"""Stable time step of central differences and its limits.

Velocities lag half a step: M (v+ - v-) = -dt (K x + C v-). As v- = (v+ + v-)/2 - (v+ - v-)/2, that
is a central difference with the mass M - (dt/2) C and damping at the middle of the step. It is
stable while M - (dt/2) C - (dt^2/4) K is positive definite (Belytschko, Liu, Moran, Nonlinear
Finite Elements, ch. 6, by the energy):
    dt < 2 / sqrt(lambda),  lambda the largest eigenvalue of M^-1 (K + (2 / dt) C);
for one mode with the damping ratio z that is dt < 2/omega (sqrt(1 + z^2) - z). K is bounded from
above in solver/stiffness_bound.py, lambda below. Maxwell branches count as springs. Local damping
(Nodes.shift_damped) increases every force that slows its node down: at the stability limit, where
the velocity of each node changes sign in every step, these are all forces.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg import eigh_tridiagonal

from softsim.elements.geometry import Geometry, Region, altitude, principal_values
from softsim.model import LOCAL_DAMPING, Model
from softsim.solver.contact_bound import (
    ContactBound,
    load_springs,
    spring_frequencies,
    with_bodies,
)
from softsim.solver.element_bound import ElementStiffness
from softsim.solver.stiffness_bound import ModelStiffness, ScaledStiffness, volume_gradient

# -------------------------------------------------------------------------------------------------
# Upper bound of the largest eigenvalue of a large symmetric matrix, from a few products with it.
#
# Lanczos iteration from a random vector estimates the eigenvalue from below. The error has a bound
# (Kuczynski and Wozniakowski 1992, SIAM J. Matrix Anal. Appl. 13:1094-1122, theorem 4.2): of all
# start vectors, uniformly distributed over directions, the fraction with an error of more than
# eps lambda after k steps is at most 1.648 sqrt(n) exp(-sqrt(eps) (2 k - 1)) for every matrix.
# The start vector is always the same one, and products of vectors are summed by numpy itself
# (einsum), not by BLAS, whose threads change the last bits: the result depends on the matrix alone.

# Steps, and the share of start vectors for which the bound may fail. Of 2,000 unknowns the bound
# then lies 5 % above the estimate, 2.5 % of the time step.
STEPS = 36
FAILING_SHARE = 1e-5
# Steps of a mere estimate: of the robot in section and in space it lacks 0.5 % at most.
ESTIMATE_STEPS = 10


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
    return lanczos(product, start_vector(moving), ESTIMATE_STEPS)[0]


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


# Dashpots are bounded with a guess of the step, made with the dashpots at an earlier one: that of
# the last estimate, or the first of two guesses, which is made without dashpots. The eigenvalue is
# taken for so much larger than estimated: its bound will lie some 5 % above it, and of two guesses
# equally far off the longer one costs more.
OVER_ESTIMATE = 1.1
# omega dt of what hits a penalty spring, or the end of a tendon's slack: within a step it gets as
# deep as v dt and is thrown back with up to (omega^2 dt^2 - 1) v, which must not be more than it
# came with.
CONTACT_OMEGA_DT = np.sqrt(2.0)
# omega dt of the swing of what fills a chamber. The whole skin swings with it, so it shows in the
# books, whose error goes with the square: a pump that starts at full speed is off by 4 % at first.
CHAMBER_OMEGA_DT = 0.8
# The step over that of the stiffest element alone at rest, at most. Averaged pressure makes it some
# 1.5 to 2; where every node is held or tied nothing else would limit it.
LONGEST_OVER_ELEMENT = 4.0
# The cause of a step that an element sets: which one, is named when it is told.
ELEMENT_CAUSE = "an element"


@dataclass(frozen=True)
class StableStep:
    """Time step [s] without safety factor, and its limit.

    value [s]: step to take, which for accuracy may be less than the stable one; `limit` then names
    the reason. stable [s]: stability limit. cause: text of the limit of `value`; ELEMENT_CAUSE for
    an element. region, element: element with most energy of the fastest mode, numbered within its
    region. x (n, d): positions of all nodes [m].
    """

    value: float
    stable: float
    cause: str
    region: Region
    element: int
    x: np.ndarray

    @property
    def limit(self) -> str:
        """Text of the limit of `value`, with the name of the element if an element sets it."""
        if self.cause != ELEMENT_CAUSE:
            return self.cause
        return element_name(self.region, self.element, self.x)

    @property
    def altitude(self) -> float:
        """Smallest altitude of the element [m]."""
        return altitude(self.x[self.region.nodes][self.region.cells[self.element]])

    def describe(self) -> str:
        """Return one line of text with the step and its limit."""
        beyond = f"; stability limit {self.stable * 1e6:.3g} us" if self.stable > self.value else ""
        return f"{self.value * 1e6:.3g} us, limited by {self.limit}{beyond}"


def element_frequencies(region: Region) -> np.ndarray:
    """Return an upper bound (m,) of omega^2 [1/s^2] of each element at rest."""
    material, geometry, x = region.material, region.geometry, region.points
    gradients = geometry.gradients(x, region.cells)
    d = geometry.dimension
    G = np.zeros((len(gradients), 3, 3))
    G[:, :d, :d] = np.einsum("eai,eaj->eij", gradients, gradients)
    hoop = np.zeros(len(region.cells))
    if geometry.hoop is not None:
        slopes = geometry.hoop.gradient(x, region.cells, x)
        # Where others than its corners strain it, its corners strain as many more elements.
        hoop = slopes.shape[1] / region.cells.shape[1] * (slopes**2).sum(axis=(1, 2))
    trace = np.trace(G, axis1=1, axis2=2) + hoop
    largest = principal_values(G)[:, 0] + hoop
    mu = material.instantaneous_shear_modulus + material.law.initial_stiffening
    dilation = material.bulk_modulus - 2.0 / 3.0 * mu
    smallest_share = geometry.mass_shares(x, region.cells).min(axis=1)
    stiffness = max(dilation, 0.0) * trace + 2.0 * mu * largest
    return stiffness / (material.density * smallest_share)


def chamber_compliance(
    geometry: Geometry, facets: np.ndarray, x: np.ndarray, mass: np.ndarray, is_free: np.ndarray
) -> float:
    """Return sum |dV/dx_a|^2 / m_a [m^4/kg] over the free components of a chamber.

    It is the second time derivative of the chamber's volume per pressure on its facets.
    """
    gradient = volume_gradient(geometry, facets, x)
    inverse_mass = np.where(is_free, 1.0 / np.maximum(mass, 1e-30)[:, None], 0.0)
    return float((gradient**2 * inverse_mass).sum())


class StableStepEstimator:
    """Estimator of the stable step of one model in any configuration."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.stiffness = ModelStiffness(model)
        springs = load_springs(model)
        self.springs = spring_frequencies(model, springs)
        self.going_taut = spring_frequencies(model, [one for one in springs if one.goes_taut])
        alone = [element_frequencies(region) for region in model.regions]
        stiffest = int(np.argmax([frequencies.max() for frequencies in alone]))
        inertia = 1.0 if model.mass_scaling is None else model.mass_scaling.factor
        self.longest = LONGEST_OVER_ELEMENT * 2.0 * np.sqrt(inertia / alone[stiffest].max())
        element = int(np.argmax(alone[stiffest]))
        name = element_name(model.regions[stiffest], element, model.points)
        self.longest_limit = f"{LONGEST_OVER_ELEMENT:g} times the stable step of {name}"

    @cached_property
    def at_rest(self) -> StableStep:
        """Stable step with all nodes at their reference positions."""
        return self.at(self.model.points)

    def at(self, x: np.ndarray, earlier: float | None = None) -> StableStep:
        """Return the stable step with all nodes at x (n, d) [m].

        earlier [s]: stable step of a similar configuration, which saves a fifth of the work.
        """
        elements = self.stiffness.elements(x)
        undamped = self.stiffness.at(elements, x)
        slowed = 1.0 if self.model.relaxation is None else 1.0 + LOCAL_DAMPING

        def next_guess(guess: float) -> float:
            contact = self.stiffness.contact.at(x, guess)
            damped = self.stiffness.damped(undamped, contact, guess)
            fastest = largest_eigenvalue_estimate(damped.product, self.stiffness.moving)
            of_all = self._with_bodies(OVER_ESTIMATE * fastest, contact)
            return 2.0 / np.sqrt(slowed * of_all)

        guess = next_guess(next_guess(np.inf) if earlier is None else earlier)
        contact = self.stiffness.contact.at(x, guess)
        matrix = self.stiffness.damped(undamped, contact, guess)
        bound, found = largest_eigenvalue_bound(matrix.product, self.stiffness.moving)
        mode = matrix.motion(found)
        stable = 2.0 / np.sqrt(slowed * self._with_bodies(bound, contact))
        # lambda falls with dt, but no faster than 1/dt: it may be taken at a guess that is too
        # small, and from one that is too large dt <= 4 / (lambda guess) is stable.
        stable = min(stable, stable**2 / guess)
        region, element = self._stiffest(elements, matrix, mode)
        shares = other_shares(matrix, mode) | self._other_shares(mode, x)
        shares[ELEMENT_CAUSE] = bound - sum(shares.values())
        on_bodies = {"contact of a rigid body": contact.bodies}
        on_bodies |= {f"{kind} of a rigid body": k for kind, k in self.springs.items()}
        if sum(on_bodies.values()) > bound:
            shares = on_bodies
        limits = {max(shares, key=lambda part: shares[part]): stable}
        hit = max(self.stiffness.hardest_hit(contact), contact.bodies)
        if hit > 0.0:
            limits["contact stiffness"] = CONTACT_OMEGA_DT / np.sqrt(hit)
        for kind, frequency in self.going_taut.items():
            limits[f"stiffness of a {kind}"] = CONTACT_OMEGA_DT / np.sqrt(frequency)
        for kind, frequency in matrix.structure_frequencies().items():
            if frequency > 0.0:
                limits[f"stiffness of a {kind}"] = CONTACT_OMEGA_DT / np.sqrt(frequency)
        swing = matrix.chamber_frequency()
        if self.model.relaxation is None and swing > 0.0:
            limits["chamber oscillation"] = CHAMBER_OMEGA_DT / np.sqrt(swing)
        limits[self.longest_limit] = self.longest
        cause = min(limits, key=lambda cause: limits[cause])
        return StableStep(float(limits[cause]), float(stable), cause, region, element, x)

    def _with_bodies(self, nodes: float, contact: ContactBound) -> float:
        """Return a bound of omega^2 [1/s^2] of nodes and rigid bodies together.

        nodes [1/s^2]: that of the nodes alone.
        """
        bodies = contact.bodies + sum(self.springs.values())
        pressed = self.stiffness.hardest_press(contact)
        return with_bodies(nodes, bodies, pressed, contact.pressed_bodies)

    def _other_shares(self, mode: np.ndarray, x: np.ndarray) -> dict[str, float]:
        """Return the parts of omega^2 [1/s^2] of a unit mode (n d,) from structures, by name.

        x (n, d) [m]: positions of all nodes.
        """
        u = (self.stiffness.inverse_sqrt_mass * mode).reshape(x.shape)
        shares: dict[str, float] = {}
        for bound in self.stiffness.structure_bounds(x):
            moved = u[bound.nodes]
            part = float(np.einsum("abm,ami,bmi->", bound.values, moved, moved))
            shares[bound.name] = shares.get(bound.name, 0.0) + part
        return shares

    def _stiffest(
        self, elements: list[ElementStiffness], matrix: ScaledStiffness, mode: np.ndarray
    ) -> tuple[Region, int]:
        """Return the element with most energy of a mode: its region and its number in it."""
        u = (self.stiffness.inverse_sqrt_mass * mode).reshape(self.model.points.shape)
        pressure = matrix.pressures(mode)
        most = (-np.inf, self.model.regions[0], 0)
        of_regions = zip(self.stiffness.regions, self.stiffness.pressures, elements, strict=True)
        for r, rows, stiffness in of_regions:
            moved = u[r.region.nodes].T[:, r.movers]
            energies = stiffness.energies(moved, pressure[rows])
            element = int(np.argmax(energies))
            if energies[element] > most[0]:
                most = (float(energies[element]), r.region, element)
        return most[1:]


def element_name(region: Region, element: int, x: np.ndarray) -> str:
    """Return the text of an element: number, place with all nodes at x (n, d) [m], altitude."""
    centre = x[region.nodes][region.cells[element]].mean(axis=0)
    place = ", ".join(f"{c * 1e3:.2f}" for c in centre)
    height = f"{altitude(x[region.nodes][region.cells[element]]) * 1e3:.3g} mm"
    return (
        f"element {region.numbers[element]} of '{region.body}' at ({place}) mm, altitude {height}"
    )


def other_shares(matrix: ScaledStiffness, mode: np.ndarray) -> dict[str, float]:
    """Return the parts of omega^2 [1/s^2] of a unit mode (n d,) from contact, chambers, structures.

    The keys are names of these parts; structures count with their roots, by kind.
    """
    parts = {
        "contact": float((matrix.contact * mode**2).sum()),
        "chamber stiffness": float(sum(np.einsum("i,i", c, mode) ** 2 for c in matrix.chambers)),
    }
    for kind, root in matrix.structures:
        name = f"a {kind}"
        parts[name] = parts.get(name, 0.0) + float(np.einsum("i,i", root, mode) ** 2)
    return parts


# The build, the checks and the start of a run ask for the same model one after another.
@lru_cache(maxsize=1)
def estimator(model: Model) -> StableStepEstimator:
    """Return the estimator of a model, which is cached until another model is passed."""
    return StableStepEstimator(model)


def stable_step(model: Model, x: np.ndarray) -> StableStep:
    """Return the stable step with all nodes at x (n, d) [m]."""
    return estimator(model).at(x)


def first_time_increment(model: Model) -> float:
    """Return the first step [s] of a run: the user's, else a safe fraction of the stable one."""
    return time_increment(model, estimator(model).at_rest)


def time_increment(model: Model, stable: StableStep) -> float:
    """Return the step to take [s]: the user's, else a safe fraction of the stable one."""
    return model.time_increment or model.safety_factor * stable.value


# -------------------------------------------------------------------------------------------------
# Schedule of the estimates of the stable step, which changes as elements deform.
#
# The step in use has a margin below the stable one (solver.safety_factor, 0.9 unless given). A load
# that starts grows with the square or the cube of time, so from one interval to the next, twice as
# long, its effect may grow eightfold: ALLOWED_CHANGE, 1/100, then becomes 8/100. An estimate costs
# as much as some hundred increments, a look at the strains of the elements a tenth of that. While
# the step hardly falls, estimates are therefore further apart than looks. A look requests an
# estimate if elements were strained since the last one (solver/stiffness_bound.py): the start of a
# load or an impact is detected within LOOK_INTERVAL, and in a short run within 1/LEAST_LOOKS of it.

FIRST_INTERVAL, SHORTEST_INTERVAL = 16, 8
LOOK_INTERVAL = 2048
LONGEST_INTERVAL = 16 * LOOK_INTERVAL
LEAST_LOOKS = 32  # of a run
ALLOWED_CHANGE = 0.01
# The step shrinks at once. It grows when all estimates during so many increments, or this fraction
# of a short run, have found the stable one grown by this factor: that of a body that swings rises
# and falls with every swing, and to follow it would take an estimate every few dozen increments.
GROWTH = 1.05
INCREMENTS_TO_GROW = 2 * LONGEST_INTERVAL
FRACTION_TO_GROW = 0.25


@dataclass
class StableStepSchedule:
    """Schedule of looks at the elements and of estimates of the stable step, after the first one.

    lowest: the smallest stable step [s] since it last grew, from which the step in use is taken.
    look_due, estimate_due: increment counts at which they are due. interval: increments between the
    last estimate and the next one. grown_since: increment count at the first of the estimates in a
    row above GROWTH times the lowest, None without any; lowest_grown: the smallest of them [s].
    latest: stable step [s] of the last estimate, None before the first one of the schedule.
    """

    lowest: float
    look_due: int = FIRST_INTERVAL
    estimate_due: int = FIRST_INTERVAL
    interval: int = FIRST_INTERVAL
    grown_since: int | None = None
    lowest_grown: float = 0.0
    latest: float | None = None

    def plan_next(self, stable: float, increment_count: int, run_length: float) -> None:
        """Plan the next estimate after one that found the stable step `stable` [s].

        increment_count: increments done so far. run_length: increments of the whole run.
        """
        self.latest = stable
        self.interval = next_interval(self.interval, self.lowest, stable, run_length)
        self.estimate_due = increment_count + self.interval
        self.plan_look(increment_count, run_length)
        if stable <= GROWTH * self.lowest:
            self.grown_since, self.lowest = None, min(self.lowest, stable)
        elif self.grown_since is None:
            self.grown_since, self.lowest_grown = increment_count, stable
        else:
            self.lowest_grown = min(self.lowest_grown, stable)
            if increment_count - self.grown_since >= increments_to_grow(run_length):
                self.grown_since, self.lowest = None, self.lowest_grown

    def plan_look(self, increment_count: int, run_length: float) -> None:
        """Plan the next look at the elements.

        increment_count: increments done so far. run_length: increments of the whole run.
        """
        interval = max(SHORTEST_INTERVAL, int(min(LOOK_INTERVAL, run_length / LEAST_LOOKS)))
        self.look_due = min(self.estimate_due, increment_count + interval)


def next_interval(interval: int, lowest: float, now: float, run_length: float) -> int:
    """Return the number of increments to the next estimate, after `interval` of them.

    lowest: the smallest recent stable step [s], from which the step in use was taken; `now`: the
    current one. While a body only oscillates, the lowest is soon known and the step does not fall
    below it.
    run_length: increments of the whole run.
    """
    fall = max(0.0, float(np.log(lowest / now)))
    factor = min(2.0, ALLOWED_CHANGE / fall) if fall > 0.0 else 2.0
    longest = 0.5 * increments_to_grow(run_length) if now > GROWTH * lowest else LONGEST_INTERVAL
    return max(SHORTEST_INTERVAL, int(min(interval * factor, longest)))


def increments_to_grow(run_length: float) -> float:
    """Return the number of increments after which the step may grow.

    run_length: increments of the whole run.
    """
    return min(INCREMENTS_TO_GROW, FRACTION_TO_GROW * run_length)
