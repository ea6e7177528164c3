"""The bar of tetrahedra as a flex of MuJoCo, beside softsim's.

Nodes, elements, nodal masses, gravity and the elastic moduli at small strain are the same, both
compute in double precision on one thread, and both run at the same fraction of their stability
limits. MuJoCo has a body with three slide joints for each node and a Saint Venant-Kirchhoff solid
of constant strain without damping; softsim has Yeoh's law, a pressure averaged around each node,
bulk viscosity and a balance of energies. tests/verification/test_flex.py compares frequencies of
the two bars.
"""

import time
import warnings
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from benchmarks import scenes
from benchmarks.effort import Effort
from benchmarks.rates import MEGA, PIECE
from benchmarks.solver_process import SolverProcess
from benchmarks.table import Row
from softsim.builder import build_model
from softsim.model import Model
from softsim.scene.loading import load_scene
from softsim.solver.stable_step import largest_eigenvalue_bound, stable_step

OLDEST = 4
"""First major version of MuJoCo whose flexes have the elastic moduli that they are given."""

COUNT = 20_000  # elements, about

# Of the implicit integrator [s]. It has no stability limit, but with 0.15 ms MuJoCo 4.0.0 warns
# that the iterations of this bar do not converge.
IMPLICIT_STEP = 1e-4

DISPLACEMENT = 1e-5  # of nodes, for differences of forces, over the size of an element


def mujoco_version() -> str | None:
    """Return the version of MuJoCo, None if none is installed or one before OLDEST."""
    try:
        found = version("mujoco")
    except PackageNotFoundError:
        return None
    return found if int(found.split(".")[0]) >= OLDEST else None


class Flex:
    """The body of a model as a flex of MuJoCo at rest, without contact.

    element_count: number of tetrahedra. mass (k,) [kg]: masses of the k nodes that are free.
    """

    def __init__(self, model: Model, integrator: str = "Euler") -> None:
        import mujoco

        self.mujoco = mujoco
        [body] = model.regions
        is_free = np.all(model.is_free, axis=1)
        mu, kappa = body.material.law.initial_shear_modulus, body.material.bulk_modulus
        spec, names = mujoco.MjSpec(), []
        for node, x in enumerate(body.points):
            names.append(f"node {node}" if is_free[node] else "world")
            if is_free[node]:
                mass = model.mass[node]
                # The inertia of a node must be positive, although no node rotates.
                placed = spec.worldbody.add_body(
                    name=names[-1], pos=x, mass=mass, inertia=np.full(3, mass * scenes.SIZE**2),
                    explicitinertial=True,
                )  # fmt: skip
                for axis in np.eye(3):
                    placed.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        spec.add_flex(
            name="bar", dim=3, vertbody=names, elem=body.cells.ravel(),
            vert=np.where(is_free[:, None], 0.0, body.points).ravel(),  # in the frames of bodies
            young=9.0 * kappa * mu / (3.0 * kappa + mu),
            poisson=(3.0 * kappa - 2.0 * mu) / (6.0 * kappa + 2.0 * mu),
            contype=0, conaffinity=0, selfcollide=mujoco.mjtFlexSelf.mjFLEXSELF_NONE,
        )  # fmt: skip
        spec.option.gravity = model.gravity
        spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
        spec.option.solver = mujoco.mjtSolver.mjSOL_CG  # of the implicit integrator
        spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
        with warnings.catch_warnings():
            # MuJoCo 4.0 overlooks the elasticity of a flex that is not made by a <flexcomp>.
            warnings.filterwarnings("ignore", message="flex 'bar' is not rigid and has no equality")
            self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.element_count, self.mass = len(body.cells), self.model.body_mass[1:]

    def resisting(self, displacement: np.ndarray) -> np.ndarray:
        """Return K u (k, 3) [N] for a displacement u (k, 3) [m] of the free nodes."""
        data, forces = self.mujoco.MjData(self.model), []
        scale = DISPLACEMENT * scenes.SIZE / np.abs(displacement).max()
        for sign in (-1.0, 1.0):
            data.qpos[:] = sign * scale * displacement.ravel()
            self.mujoco.mj_forward(self.model, data)
            forces.append(data.qfrc_passive.reshape(-1, 3).copy())
        return (forces[0] - forces[1]) / (2.0 * scale)

    @cached_property
    def stable_step(self) -> float:
        """Largest stable step [s] of the explicit integrator, 2 / omega, by softsim's estimate."""
        root = np.repeat(np.sqrt(self.mass), 3)

        def product(vector: np.ndarray) -> np.ndarray:
            return self.resisting((vector / root).reshape(-1, 3)).ravel() / root

        return 2.0 / np.sqrt(largest_eigenvalue_bound(product, np.ones(len(root)))[0])

    def seconds_of_a_step(self, increment: float, seconds: float) -> float:
        """Return the shortest wall time [s] of a step of length `increment` [s].

        Pieces of about PIECE, of one step at least, are computed for `seconds` [s] from rest.
        Raises RuntimeError if MuJoCo warns, as it does where it is unstable.
        """
        self.model.opt.timestep = increment
        self.mujoco.mj_resetData(self.model, self.data)
        took: list[float] = []
        steps, end = 1, time.perf_counter() + seconds
        while not took or time.perf_counter() < end:
            start = time.perf_counter()
            self.mujoco.mj_step(self.model, self.data, nstep=steps)
            took.append((time.perf_counter() - start) / steps)
            steps = max(1, int(PIECE / took[-1]))
        kinds = [kind for kind, warning in enumerate(self.data.warning) if warning.number]
        if kinds:
            names = ", ".join(self.mujoco.mjtWarning(kind).name for kind in kinds)
            raise RuntimeError(f"MuJoCo warns of a step of {increment:g} s: {names}")
        return min(took)


def flex_rows(folder: Path, program: Path | None, effort: Effort) -> list[Row]:
    """Rates of element updates and wall times of a simulated second, each over MuJoCo's."""
    scene = scenes.block(folder, "tetrahedra", COUNT)
    model = build_model(load_scene(scene))
    step = model.safety_factor * stable_step(model, model.points).value
    flex, implicit = Flex(model), Flex(model, "discrete")
    flex_step = model.safety_factor * flex.stable_step
    rates, explicit_times, implicit_times = [], [], []
    with SolverProcess(scene) as solver:
        count, pieces = solver.increments_for(PIECE), round(effort.seconds / PIECE)
        for _ in range(effort.rounds):
            solver.start(count, pieces)
            rates.append(solver.rate())
            explicit_times.append(flex.seconds_of_a_step(flex_step, effort.seconds))
            implicit_times.append(implicit.seconds_of_a_step(IMPLICIT_STEP, effort.seconds))
    rate, flex_rate = max(rates), flex.element_count / min(explicit_times)
    wall = flex.element_count / rate / step
    flex_wall, implicit_wall = min(explicit_times) / flex_step, min(implicit_times) / IMPLICIT_STEP
    bar, other = f"{flex.element_count} tetrahedra, 1 thread", f"MuJoCo {mujoco_version()}"
    return [
        Row(
            f"{bar}, over a flex", rate / MEGA, "M/s", ratio=rate / flex_rate,
            remark=f"the ratio is over a flex of {other}, integrator Euler, {flex_rate / MEGA:.4g} "
            "M/s: Saint Venant-Kirchhoff solid without damping; softsim has Yeoh's law, averaged "
            "nodal pressure and bulk viscosity; moduli at small strain, mesh and masses are equal",
        ),
        Row(
            f"{bar}, a simulated second", wall, "s", ratio=flex_wall / wall,
            remark=f"the ratio is {other}'s wall time over softsim's, {flex_wall:.4g} s with steps "
            f"of {1e6 * flex_step:.3g} us; softsim's are {1e6 * step:.3g} us, both "
            f"{model.safety_factor:g} of the stability limit",
        ),
        Row(
            f"{bar}, over an implicit flex", wall, "s", ratio=implicit_wall / wall,
            remark=f"the ratio is the wall time of {other}, integrator discrete, over softsim's, "
            f"{implicit_wall:.4g} s with steps of {1e6 * IMPLICIT_STEP:g} us, which damp a "
            f"vibration of f Hz by the ratio {np.pi * IMPLICIT_STEP:.2g} f",
        ),
    ]  # fmt: skip
