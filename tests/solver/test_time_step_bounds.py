"""The stable step is a bound, and not a wasteful one: for every formulation on an irregular
mesh, at rest, stretched, and with a chamber of gas that is stiffer than the body.

A free vibration starts from random velocities, so that every mode takes part. Below the limit its
kinetic energy stays within 1/(1 - (w dt/2)^2) of what it was, 50 times at 0.99 of a limit that were
exact; above, it grows without limit.
"""

import dataclasses

import numpy as np
import pytest

from softsim.mesh.abaqus import FACES
from softsim.robots.block import block, box
from softsim.solver.stable_step import stable_step

TYPES = {"plane_strain": "CPE", "axisymmetric": "CAX", "solid": "C3D"}
WHOLE = pytest.mark.parametrize("cells", ["simplex", "quad"])
SIZE = 0.5e-3
STABLE, UNSTABLE = 100.0, 1e6

SCENE = """
bodies:
  b: {mesh: {file: mesh.inp, length_unit: 1 m}, formulation: FORMULATION, material: rubber,
      fixed: [FIXED]}
materials:
  rubber: {law: yeoh, C10: 36 kPa, C20: 5 kPa, C30: 1 kPa, density: 1000 kg/m^3,
           prony: [{g: 0.3, relaxation_time: 1 ms}]}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""


def scene(formulation, fixed):
    more = ", thickness: 5 mm" if formulation == "plane_strain" else ""
    return SCENE.replace("FORMULATION", formulation + more).replace("FIXED", fixed)


@pytest.fixture
def write_mesh(tmp_path):
    """Write a block whose inner nodes are off their places by a tenth of an element."""

    def write(formulation, cells="simplex"):
        if formulation == "solid":
            mesh = box(2e-3, 2e-3, 1.5e-3, SIZE, cells)
        else:
            mesh = block(3e-3, 2e-3, SIZE, cells)
        points = mesh.points.copy()
        points[:, 0] -= points[:, 0].min()  # a half section reaches to the axis
        inner = np.setdiff1d(np.arange(len(points)), mesh.node_sets["surface"])
        points[inner] += np.random.default_rng(0).uniform(-0.1, 0.1, points[inner].shape) * SIZE
        kind = f"{TYPES[formulation]}{mesh.cells.shape[1]}"
        text = "*NODE\n"
        for a, place in enumerate(points):
            text += f"{a + 1}, " + ", ".join(f"{c:.12e}" for c in place) + "\n"
        text += f"*ELEMENT, TYPE={kind}\n"
        for e, cell in enumerate(mesh.cells):
            text += f"{e + 1}, " + ", ".join(str(a + 1) for a in cell) + "\n"
        for name, nodes in mesh.node_sets.items():
            if name != "surface":  # every mesh gets that one when it is read
                text += f"*NSET, NSET={name}\n" + "".join(f"{a + 1},\n" for a in nodes)
        text += "*SURFACE, TYPE=ELEMENT, NAME=underside\n"
        for e, cell in enumerate(mesh.cells):
            for k, corners in enumerate(FACES[mesh.dimension, len(cell)]):
                if np.isin(cell[corners], mesh.node_sets["bottom"]).all():
                    text += f"{e + 1}, S{k + 1}\n"
        (tmp_path / "mesh.inp").write_text(text)

    return write


@pytest.fixture
def largest_energies(fresh_taichi):
    """Largest kinetic energy within 3000 increments, seen every 30, over that of the start, for
    each of the steps [s].
    """

    def vibrate(model, x, steps, speed):
        from softsim.solver.energy import EnergyReader
        from softsim.solver.explicit import ExplicitSolver

        solver = ExplicitSolver([model])
        memory, reader = solver.state(), EnergyReader(solver)
        memory["nodes/position"] = np.ascontiguousarray(x[None])
        noise = np.random.default_rng(1).standard_normal(x.shape)
        memory["nodes/velocity"] = (speed * noise * model.is_free)[None]
        found = []
        for step in steps:
            solver.restore(memory, 0.0, 0, step)
            solver.begin(step)
            before, largest = reader.read(), 0.0
            for _ in range(100):
                solver.advance(30)
                now = reader.read()
                gain = now.kinetic / before.kinetic
                largest = max(largest, gain if np.isfinite(gain) else np.inf)
            found.append(largest)
        return found

    return vibrate


SCALED = "{within: 0.9 mm, factor: 9}"
# Groups of nodes are slowed alike whatever elements are between them: one kind is enough.
AT_REST = [
    *[(kind, cells, "null") for kind in TYPES for cells in ("simplex", "quad")],
    ("plane_strain", "simplex", SCALED),
    pytest.param("plane_strain", "quad", SCALED, marks=pytest.mark.slow),
    *[
        pytest.param(kind, cells, SCALED, marks=pytest.mark.slow)
        for kind in ("axisymmetric", "solid")
        for cells in ("simplex", "quad")
    ],
]


@pytest.mark.parametrize(("formulation", "cells", "scaling"), AT_REST)
def test_at_rest(build, write_mesh, largest_energies, formulation, cells, scaling):
    """A free block with bulk viscosity, which shortens the step, and with groups of nodes that are
    slowed, which makes it longer: 0.99 of the bound is stable, 1.3 times it is not.
    """
    write_mesh(formulation, cells)
    model = build(
        scene(formulation, ""), "solver.bulk_viscosity=0.06", f"solver.mass_scaling={scaling}"
    )
    bound = stable_step(model, model.points).value
    steps = [0.99 * bound, 1.3 * bound]
    energies = largest_energies(model, model.points, steps, 1e-3)
    assert energies[0] < STABLE
    assert energies[1] > UNSTABLE


STRETCHES = {
    "plane_strain": np.diag([2.0, 0.5]),
    "axisymmetric": np.diag([1.4, 1.0 / 1.96]),
    "solid": np.diag([2.0, np.sqrt(0.5), np.sqrt(0.5)]),
}


@pytest.mark.slow
@WHOLE
@pytest.mark.parametrize("formulation", list(TYPES))
def test_stretched(build, write_mesh, largest_energies, formulation, cells):
    """Inner nodes within a surface that holds the block at a stretch of two: elements are longer
    one way and shorter the other, and the law has stiffened. Here the bound is a cautious one.
    """
    write_mesh(formulation, cells)
    model = build(scene(formulation, "surface"), "solver.bulk_viscosity=0")
    x = model.points @ STRETCHES[formulation]
    bound = stable_step(model, x).value
    assert bound < stable_step(model, model.points).value
    assert largest_energies(model, x, [0.99 * bound], 1e-4)[0] < STABLE


@pytest.mark.parametrize(
    "formulation",
    [
        "plane_strain",
        pytest.param("axisymmetric", marks=pytest.mark.slow),
        pytest.param("solid", marks=pytest.mark.slow),
    ],
)
def test_with_a_stiff_chamber(build, write_mesh, largest_energies, formulation):
    """Gas in a dead volume so small that its stiffness, not that of the elements, sets the limit:
    the bound knows, and the step of the elements alone would be unstable. The bound is 2.5 times
    lower than stability asks, to resolve the swing of the gas, and takes the chamber as full as it
    will get, five times its first mass: eight times the bound is unstable.
    """
    write_mesh(formulation)
    rim = {
        "plane_strain": "left, right",
        "axisymmetric": "right",
        "solid": "left, right, back, front",
    }
    text = scene(formulation, rim[formulation]) + (
        "loads: {gas: {kind: added_gas, facets: [b.underside], dead_volume: 2e-7 ml,\n"
        "        profile: {kind: ramp, value: 1e-12 kg, duration: 1 s}}}\n"
    )
    model = build(text, "solver.bulk_viscosity=0")
    found = stable_step(model, model.points)
    assert found.limit == "chamber oscillation"
    assert found.stable == pytest.approx(2.5 * found.value, rel=0.1)
    bound = found.value
    alone = stable_step(dataclasses.replace(model, loads=()), model.points).value
    assert bound < 0.35 * alone
    energies = largest_energies(
        model, model.points, [0.99 * bound, 8.0 * bound, 0.99 * alone], 1e-6
    )
    assert energies[0] < STABLE
    assert energies[1] > UNSTABLE
    assert energies[2] > UNSTABLE
