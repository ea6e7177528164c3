"""Static runs by Newton's method: load steps to equilibria, and derivatives of their rows."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from softsim.builder import build_model
from softsim.errors import SceneError, SimulationError, StabilityError
from softsim.model import Model
from softsim.output.observation import Observer
from softsim.run.callbacks import RowReader, Rows, refuse_broken
from softsim.run.cost import INSPECTIONS, KERNEL
from softsim.run.loop import Callback, Run, Stepping
from softsim.scene.loading import Loaded, keys_at, overridden, validated_as
from softsim.scene.measures import WITHOUT_DERIVATIVE
from softsim.scene.quantities import Spec
from softsim.scene.schema import Scene
from softsim.scene.text import Origin, nearest, place_in
from softsim.solver.energy import EnergyBalance, EnergyReader
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.guards import refuse_broken_elements
from softsim.statics.forces import TRIAL_DURATION, Configuration, StaticForces
from softsim.statics.newton import ArcSteps, Equilibrium, LoadSteps, Newton, NoEquilibriumError

# -------------------------------------------------------------------------------------------------
# Derivatives of the rows of a static run with respect to numbers of its scene.
#
# At equilibrium R(q, p) = 0, where q are the free coordinates (statics/forces.py) as displacements
# from the mesh, and p is a number of the scene. Each p costs one solution of
#     K dq/dp = dR/dp,   K = -dR/dq,
# and then gives the derivative of every column g of the row:
#     dg/dp = partial g/partial p + dg/dq dq/dp.
# An adjoint method would save this solution only. It takes less time than dR/dp, which comes from
# two models built with p - h and p + h, whose forces are evaluated at the same displacements. The
# product K v is a central difference of the forces along v, so everything that exerts force takes
# part.
#
# The displacements are kept, not the places, so that fixed nodes move with the mesh if p is a
# dimension.


STEP = 3e-6
"""Difference h of a parameter over its value, for central differences."""

STENCILS: tuple[dict[int, float], ...] = (
    {-1: -0.5, 1: 0.5}, {0: 1.5, -1: -2.0, -2: 0.5}, {0: -1.5, 1: 2.0, 2: -0.5},
)  # fmt: skip
"""Number of steps h -> weight over h, of differences of second order.

The one-sided ones serve a dimension that is a multiple of the element size, where a longer one has
more elements.
"""

SOLUTIONS = 3
"""Solutions of K v = dR/dp, each for the error that the one before has left.

The first leaves 1e-6, the others correct soft directions, where round-off hides the error.
"""

ACCURACY, LARGEST_ERROR = 1e-11, 1e-5
"""Error of K v = dR/dp over dR/dp that needs no other solution, and that is refused."""

ROUND_OFF = 1e-10
"""Bound of the round-off of a residual over the internal forces."""

VISCOUS = 1e-7
"""Bound of the dashpot forces over the internal ones, at the rates of TRIAL_DURATION."""


@dataclass(frozen=True)
class Parameter:
    """Number of a scene.

    path: such as "materials.rubber.C10". value: SI. unit: its SI unit, empty for a plain number.
    """

    loaded: Loaded[Scene]
    path: str
    value: float
    unit: str

    @classmethod
    def at(cls, loaded: Loaded[Scene], path: str, origin: Origin) -> "Parameter":
        """Return the parameter at a path, which is written at `origin`.

        Raises SceneError if there is no such key, or no number that can vary.
        """
        keys = keys_at(loaded.tree, path, origin, type(loaded.scene))
        place = place_in(type(loaded.scene), loaded.tree, keys)
        value: Any = loaded.scene
        for key in keys:
            value = getattr(value, str(key)) if isinstance(value, Spec) else value[key]
        if place is None or place.is_whole or not isinstance(value, float) or value == 0.0:
            raise SceneError(
                f"{path} is {value!r}: a derivative needs a number that can vary, other than zero",
                "parameters are paths of the scene with a number or a quantity, such as "
                "materials.rubber.C10; set it in the scene if it has no value there",
                origin,
            )
        return cls(loaded, path, value, "" if place.quantity is None else place.quantity.unit)

    @property
    def step(self) -> float:
        """Difference h of the value, SI."""
        return STEP * abs(self.value)

    def model(self, steps: float) -> Model:
        """Return the model with the value changed by a number of steps.

        Raises SceneError, MeshError.
        """
        loaded = self.loaded
        text = f"{self.path}={self.value + steps * self.step!r} {self.unit}"
        tree = overridden(loaded.tree, text, type(loaded.scene))
        return build_model(validated_as(type(loaded.scene), tree, loaded.path))


def asked_parameters(loaded: Loaded[Scene]) -> list[Parameter]:
    """Return the parameters of the derivatives that a scene asks for. Raises SceneError."""
    asked, keys = loaded.scene.output.derivatives, ("output", "derivatives", "parameters")
    return [
        Parameter.at(loaded, path, nearest(loaded.tree, (*keys, number))[0].origin)
        for number, path in enumerate(asked.parameters if asked else ())
    ]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Residual (size,) [N] and row of the history of a model at a configuration."""

    residual: np.ndarray
    row: dict[str, float]


def derivatives(
    stepping: "LoadStepping", observer: Observer, parameters: Sequence[Parameter]
) -> dict[str, dict[str, float]]:
    """Return path -> column of the history -> derivative, SI, at the last equilibrium.

    Columns without a derivative are left out.

    Raises
    ------
    SimulationError: no equilibrium yet; a mesh that changes its elements; a state that depends on
    its path. StabilityError: K is singular.
    """
    if stepping.scenario.time <= stepping.model.start_time:
        raise SimulationError(
            "no equilibrium has been found yet", hint="advance the simulation by step()"
        )
    at, solver = stepping.forces.start, stepping.scenario.solver
    of_newton = dict(vars(stepping.newton))  # its factors, so that the next iterations are the same
    with np.errstate(over="ignore", invalid="ignore"), solver.lent():
        with solver.lent():
            other = Elsewhere(stepping, observer.reader, at)
            partial = [other.partial(p) for p in parameters]
        StaticForces(solver)  # holds pressures and relaxes branches again
        stepping.newton.renew(at)
        found = {
            p.path: _total(stepping, observer, at, p, of_one)
            for p, of_one in zip(parameters, partial, strict=True)
        }
    StaticForces(solver)
    vars(stepping.newton).update(of_newton)
    return found


def _total(
    stepping: "LoadStepping",
    observer: Observer,
    at: Configuration,
    p: Parameter,
    partial: Evaluation,
) -> dict[str, float]:
    """Return the derivatives of all columns, from those at the same displacements."""
    h = p.step
    forces = stepping.forces
    velocity = _solved(stepping, at, partial.residual, h)
    ends = [_evaluated(forces, forces.moved(at, s * h * velocity), observer) for s in (-1.0, 1.0)]
    return {
        name: value + (ends[1].row[name] - ends[0].row[name]) / (2.0 * h)
        for name, value in partial.row.items()
        if name not in WITHOUT_DERIVATIVE
    }


def _solved(stepping: "LoadStepping", at: Configuration, force: np.ndarray, h: float) -> np.ndarray:
    """Return v = dq/dp of K v = dR/dp `force` (size,).

    Differences of the forces over the displacement h v have far less round-off than those over the
    tiny steps of Newton's method.
    """
    forces, newton = stepping.forces, stepping.newton
    factors = newton.factors
    assert factors is not None
    found, defect, size = np.zeros_like(force), force, float(np.linalg.norm(force))
    for _ in range(SOLUTIONS):
        if not np.linalg.norm(defect) > ACCURACY * size:
            break
        found = found + newton.solve(at, defect, 1e-6)[0]
        resisted = forces.resisting(at, h * found) / h + factors.stiffness.holding(found)
        defect = force - resisted
    error = float(np.linalg.norm(defect))
    if not error <= LARGEST_ERROR * size + ROUND_OFF * forces.inner_force() / h:
        raise StabilityError(
            f"the derivatives at t = {forces.time:.6g} s cannot be computed: a change of the "
            f"forces is balanced within {error / size:.2g} only",
            "the state may be at a limit point, or a contact may open or close there",
        )
    return found


class Elsewhere:
    """Evaluates other models of a scene at the displacements of an equilibrium.

    It uses the solver of the run, which must be lent. here: evaluation of the model of the run.

    Raises SimulationError for a state that depends on its path.
    """

    def __init__(self, stepping: "LoadStepping", reader: EnergyReader, at: Configuration) -> None:
        self.stepping, self.reader, self.at = stepping, reader, at
        self.model, self.solver = stepping.model, stepping.scenario.solver
        self.time, self.load_time = stepping.scenario.time, stepping.forces.time
        self.centres = stepping.forces.bodies.rest_centre
        self.here = self._evaluated(self.model)
        self._refuse_path_dependence(self.here)

    def partial(self, parameter: Parameter) -> Evaluation:
        """Return the derivatives of residual and row with respect to a parameter.

        Raises SimulationError if the mesh has other elements on both sides.
        """
        for weights in STENCILS:
            models = {k: parameter.model(k) for k in weights if k}
            if all(_is_same_mesh(self.model, model) for model in models.values()):
                break
        else:
            raise SimulationError(
                f"the mesh has other elements or other fixed nodes if {parameter.path} changes by "
                f"{STEP:g} of its value, so there is no derivative",
                hint="choose another element_size",
            )
        found = {k: self._evaluated(models[k]) if k else self.here for k in weights}
        factors = {k: weight / parameter.step for k, weight in weights.items()}
        residual = sum(factors[k] * found[k].residual for k in weights)
        row = {n: sum(factors[k] * found[k].row[n] for k in weights) for n in self.here.row}
        return Evaluation(np.asarray(residual), row)

    def _refuse_path_dependence(self, here: Evaluation) -> None:
        """Raise SimulationError if the equilibrium does not follow from the loads alone."""
        softening = [r.material.name for r in self.model.regions if r.material.mullins is not None]
        if softening:
            raise SimulationError(
                f"the equilibrium depends on the path of the loads: material '{softening[0]}' "
                "softens",
                hint="derivatives need materials without `mullins`",
            )
        forces = self.stepping.forces.inner_force()
        share = float(np.linalg.norm(here.residual)) / max(forces, 1e-300)
        if share > max(self.stepping.newton.tolerance, VISCOUS):
            raise SimulationError(
                "the equilibrium depends on the path of the loads, as with friction: without it "
                f"the unbalanced force is {share:.2g} of the internal forces",
                hint="derivatives need a state that follows from the loads alone: set "
                "contact.friction_coefficient: 0, and no shear_strength",
            )

    def _evaluated(self, model: Model) -> Evaluation:
        solver, reader = self._solver_of(model)
        forces = StaticForces(solver)
        begin = forces.start
        placed = forces.steer(self.load_time)
        at, free_moves = self.at, forces.free_moves
        turning = forces.free_turns.any(axis=1, keepdims=True)
        there = replace(
            placed,
            x=np.where(forces.is_free, begin.x + (at.x - self.model.points), placed.x),
            centres=np.where(
                free_moves, forces.bodies.rest_centre + at.centres - self.centres, placed.centres
            ),
            turns=np.where(turning, at.turns, placed.turns),
            pressures=at.pressures,
        )
        # Accepted, so that no dashpot acts. `moved` puts tied nodes into their places.
        forces.accept(forces.moved(there, np.zeros(forces.size)), self.time)
        solver.clear_impulses(0)
        forces = StaticForces(solver)
        reader.update()
        balance = EnergyBalance.starting(reader.of_scenario(0), model)
        return _evaluated(forces, forces.start, Observer(solver.scenario(0), reader, balance))

    def _solver_of(self, model: Model) -> tuple[ExplicitSolver, EnergyReader]:
        """Return the lent solver with the model, or a new one if its kernels do not fit."""
        if self.solver.take_models([model]):
            return self.solver, self.reader
        solver = ExplicitSolver([model])
        reader = EnergyReader(solver)
        solver.compile()
        return solver, reader


def _evaluated(forces: StaticForces, at: Configuration, observer: Observer) -> Evaluation:
    residual = forces.residual(at)
    observer.reader.update()
    return Evaluation(residual, observer.observe(TRIAL_DURATION).row)


def _is_same_mesh(one: Model, other: Model) -> bool:
    pairs = zip(one.bodies, other.bodies, strict=True)
    return (
        one.points.shape == other.points.shape
        and all(np.array_equal(a.cells, b.cells) for a, b in pairs)
        and np.array_equal(one.is_free, other.is_free)
    )


# -------------------------------------------------------------------------------------------------
# Stepping of a static run: a block is a load step, and every row shows an equilibrium.


ADVICE = (
    "beyond a limit point a pressure or a force has no equilibrium nearby: drive the chamber by "
    "added_volume, follow the curve by time.control: arc_length, or find a state far away by "
    "time.method: relaxation"
)


class LoadStepping(Stepping):
    """Blocks of one load step each, whose equilibrium Newton's method finds."""

    def __init__(self, run: Run) -> None:
        super().__init__(run)
        assert run.model.relaxation is not None
        self.forces = StaticForces(run.scenario.solver)
        self.newton = Newton(self.forces, run.model.relaxation.tolerance)
        self.steps = LoadSteps(self.newton)
        self.worst_share = 0.0

    @property
    def iterations(self) -> list[int]:
        """Numbers of Newton iterations of all load steps so far."""
        return self.steps.iterations

    def next_block(self, longest: float) -> int:
        """Find the next equilibrium; return 0, as no increment is left to compute."""
        begin = self.scenario.time
        with self.run.clock.spending_on(KERNEL), np.errstate(over="ignore", invalid="ignore"):
            try:
                equilibrium = self.advance()
            except NoEquilibriumError as error:
                raise self._at_limit(error, begin) from None
            except StabilityError:
                self.run.files.write_failed_frame(self.scenario)
                raise
        self.worst_share = max(self.worst_share, equilibrium.unbalanced_share)
        return 0

    def advance(self) -> Equilibrium:
        """Return the equilibrium at the load time of the next row or frame, or of the end."""
        progress, now = self.run.progress, self.scenario.time
        due = [d for d in (progress.next_history, progress.next_frame) if d > now * (1 + 1e-12)]
        return self.steps.advance(min([*due, self.model.end_time]), self.show)

    def _at_limit(self, error: NoEquilibriumError, begin: float) -> StabilityError:
        """Return the error of a run that cannot go on, with the last converged state."""
        self.run.files.write_failed_frame(self.scenario)
        reached = f"; the last equilibrium is at t = {begin:.6g} s{self.pressures()}"
        return StabilityError(f"{error}{reached}", ADVICE)

    def pressures(self) -> str:
        """Return the pressures of all chambers in the last equilibrium, as a part of a sentence."""
        terms = {load.name: self.scenario.term_of(load) for load in self.model.pressures}
        values = {name: float(self.scenario.read(term.pressure)) for name, term in terms.items()}
        found = [f"{name} at {1e-3 * value:.4g} kPa" for name, value in values.items()]
        return f", with {', '.join(found)}" if found else ""

    def show(self, iteration: int, share: float) -> None:
        """Show an iteration on the console."""
        step = len(self.iterations) + 1
        self.run.show(f"load step {step}, iteration {iteration}, unbalanced {share:.1e}")

    def increments_to(self, due: float) -> int:
        """Return 0 once the load time [s] is reached, else 1."""
        return 0 if self.scenario.time >= due * (1.0 - 1e-12) else 1

    def contact_time(self) -> float:
        """Return the time [s] of a load step: impulses are those of the last one alone."""
        return TRIAL_DURATION

    def summary(self) -> dict[str, Any]:
        """Return what Newton's method needed, and the derivatives of the scene."""
        asked = self.run.output.derivatives
        found = {"derivatives": self.run.progress.derivatives} if asked else {}
        return found | {
            "load_steps": len(self.iterations),
            "newton_iterations": sum(self.iterations),
            "factorisations": self.newton.factorisations,
            "largest_unbalanced_share": self.worst_share,
        }


class PathStepping(LoadStepping):
    """Blocks along the path of equilibria, through limit points, by the arc-length method.

    The clock adds up the load time that the path covers in either direction.
    """

    def __init__(self, run: Run) -> None:
        solver = run.scenario.solver
        solver.load_times = solver.times.copy()
        super().__init__(run)
        self.path = ArcSteps(self.newton, self.model.end_time)

    @property
    def iterations(self) -> list[int]:
        return self.path.iterations

    def advance(self) -> Equilibrium:
        """Return the next equilibrium on the path, and report limit points before it."""
        passed, pressures = len(self.path.limit_points), self.pressures()
        equilibrium = self.path.advance(self.show)
        refuse_broken_elements(self.model, equilibrium.at.x, self.scenario.time)
        for point in self.path.limit_points[passed:]:
            kind = "largest" if point.is_largest else "smallest"
            self.run.files.tell(
                f"limit point: the load is {kind} near t = {point.load_time:.6g} s{pressures}"
            )
        return equilibrium

    def increments_to(self, due: float) -> int:
        """Return 0: every equilibrium is a row and a frame."""
        return 0

    def is_complete(self) -> bool:
        """Return True at the end of the path."""
        return self.path.is_complete

    def summary(self) -> dict[str, Any]:
        """Return what Newton's method needed, and the limit points."""
        points = [
            {"load_time": point.load_time, "is_largest": point.is_largest}
            for point in self.path.limit_points
        ]
        return super().summary() | {"limit_points": points}


class Equilibria(RowReader):
    """Columns and checks of the equilibria that load steps have found."""

    def __init__(self, run: Run, stepping: LoadStepping) -> None:
        self.run, self.stepping = run, stepping

    def readings(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Return the load time [s] and the number of unstable modes, along a path only."""
        relaxation, factors = self.run.model.relaxation, self.stepping.newton.factors
        if relaxation is None or not relaxation.follows_path:
            return {}
        unstable = 0 if factors is None else factors.negative_pivots
        return {
            "load_time": np.array([self.stepping.forces.time]),
            "unstable_modes": np.array([unstable]),
        }

    def act(self) -> None:
        """Warn if the energy balance of a new row is off: of the work alone, as forces balance."""
        rows = self.run.callback(Rows)
        if rows.is_new and rows.energy_error > self.run.model.energy_error_limit:
            self.run.files.warn(
                {
                    "external work": f"the energy balance is off by {100.0 * rows.energy_error:.3g}"
                    " %: load steps are too long to sum up the external work, or the body has "
                    "jumped to another equilibrium; the forces balance. Shorten "
                    "output.history_interval if you need the work"
                }
            )

    def at_end(self) -> None:
        """Warn if the last equilibrium is unstable, and check the elements."""
        with self.run.clock.spending_on(INSPECTIONS):
            self.run.files.warn(self._instability())
            refuse_broken(self.run)

    def _instability(self) -> dict[str, str]:
        newton = self.stepping.newton
        newton.renew(self.stepping.forces.start)
        assert newton.factors is not None
        count = newton.factors.negative_pivots
        if count <= 0:
            return {}
        modes = "one mode" if count == 1 else f"{count} modes"
        return {
            "unstable equilibrium": f"the equilibrium at the end is unstable in {modes}: Newton's "
            "method follows such a path, a body leaves it; find a stable state by time.method: "
            "relaxation, and the modes by `softsim modes`"
        }


class RowDerivatives(Callback):
    """Derivatives of the rows at the times at which the scene asks for them."""

    def __init__(self, run: Run, stepping: LoadStepping, rows: Rows) -> None:
        self.run, self.stepping, self.rows = run, stepping, rows
        self.parameters = asked_parameters(run.files.loaded)

    def act(self) -> None:
        """Compute the derivatives of a new row if they are asked for."""
        if self.rows.is_new and self._are_due():
            of_columns = derivatives(self.stepping, self.rows.observer, self.parameters)
            time = self.run.scenario.time
            self.run.progress.derivatives.append({"time": time, "of": of_columns})

    def _are_due(self) -> bool:
        """Return True if the row just written is the last up to a time at which they are asked."""
        run, asked, now = self.run, self.run.output.derivatives, self.run.scenario.time
        if asked is None:
            return False
        following = np.inf if run.has_reached_end else run.progress.next_history
        times = np.array(asked.at or (run.model.end_time,)) * (1.0 + 1e-9)
        return bool(((now <= times) & (times < following)).any())
