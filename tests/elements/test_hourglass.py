"""Hourglass modes alone: springs that relax, and the pressures of cells that have collapsed."""

import numpy as np
import pytest

from softsim.compute import fields
from softsim.elements.geometry import Region
from softsim.elements.plane_elements import PlaneStrain
from softsim.materials.laws import Yeoh
from softsim.materials.material import Material

SIDE, TAU, SHARE = 1e-3, 1e-3, 0.4
MU = 72e3  # [Pa], of the law
BRANCH = MU * SHARE / (1.0 - SHARE)

SCENE = f"""
bodies:
  b:
    mesh: {{generator: GENERATOR, element_size: 1 mm, cells: quad}}
    formulation: FORMULATION
    material: soft
    fixed: [surface]
materials:
  soft: {{law: neo_hooke, C10: {0.5 * MU} Pa, density: 1000 kg/m^3,
         prony: [{{g: {SHARE}, relaxation_time: {TAU} s}}]}}
environment: {{gravity: 0 m/s^2}}
solver: {{bulk_viscosity: 0}}
time: {{end: 1 s}}
"""
CASES = {
    "plane_strain, thickness: 2 mm": ("block, length: 1 mm, height: 1 mm", 2e-3 * SIDE**2),
    "solid": ("box, length: 1 mm, height: 1 mm, width: 1 mm", SIDE**3),
}


def scene(case):
    """One element of this case."""
    text = SCENE.replace("GENERATOR", CASES[case][0])
    formulation, *more = case.split(", ")
    text = text.replace("formulation: FORMULATION", f"formulation: {formulation}")
    return text.replace("    material:", f"    {more[0]}\n    material:") if more else text


@pytest.mark.parametrize("case", list(CASES))
def test_a_bent_element_relaxes(build, start, case):
    """One element, bent at once and held: E I kappa^2 / 2 for each length of it, times the modulus
    of the moment: mu + mu_b exp(-t / tau). The branch dissipates mu_b (1 - exp(-2 t / tau)) of it.

    E/mu of nu = 0.475 in plane strain, 2/(1 - nu): in space too, where the element is held from
    bending the other way as a plate does.
    """
    from softsim.solver.energy import EnergyReader

    volume = CASES[case][1]
    model = build(scene(case))
    assert len(model.bodies[0].cells) == 1
    solver = start(model)
    reader = EnergyReader(solver)
    middle = model.points.mean(axis=0)
    curvature = 1.0  # [1/m]: fibres along x strain by a two-thousandth
    x = model.points.copy()
    x[:, 0] -= curvature * (model.points[:, 0] - middle[0]) * (model.points[:, 1] - middle[1])
    fields.write(solver.terms.nodes.position, np.ascontiguousarray(x[None]))
    nu = (3.0 * 20.0 - 2.0) / (2.0 * (3.0 * 20.0 + 1.0))
    over_mu = 0.5 * 2.0 / (1.0 - nu) * curvature**2 * SIDE**2 / 12.0 * volume  # [m^3]
    for _ in range(3):
        solver.advance(int(0.4 * TAU / solver.time_increment))
        energies = reader.read()
        left = np.exp(-solver.time / TAU)
        assert energies.hourglass == pytest.approx(over_mu * (MU + BRANCH * left**2), rel=0.02)
        assert energies.internal == pytest.approx(energies.hourglass, rel=0.02)
        dissipated = over_mu * BRANCH * (1.0 - left**2)
        assert energies.viscous_dissipation == pytest.approx(dissipated, rel=0.02)


@pytest.mark.parametrize("case", list(CASES))
def test_a_checkpoint_keeps_the_springs(build, start, case):
    """What a solver does after its state was put back it did before, to the bit.

    With bulk viscosity: a single cube without damping has its fastest mode at omega dt = sqrt(3) in
    0.9 of the stable step, where central differences resonate with the square of the strains.
    """
    model = build(scene(case), "bodies.b.fixed=[left]", "solver.bulk_viscosity=0.06")
    solver = start(model)
    noise = np.random.default_rng(2).standard_normal(model.points.shape)
    x = model.points + 0.02 * SIDE * noise * model.is_free
    fields.write(solver.terms.nodes.position, x[None])
    solver.advance(100)
    kept, at = solver.state(), (solver.time, solver.increment_count)
    solver.advance(100)
    first = solver.state()
    solver.restore(kept, *at, solver.time_increment)
    solver.advance(100)
    again = solver.state()
    assert np.abs(first["elements/0/hourglass_relaxed"]).max() > 0.0
    for name, values in first.items():
        np.testing.assert_array_equal(again[name], values, err_msg=name)


def test_collapsed_cells_share_pressures():
    """Two triangles among quadrilaterals: each quadrilateral has a pressure of its own, a triangle
    those of its nodes, so that triangles do not lock.
    """
    points = np.array([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], dtype=float)
    cells = np.array([[0, 1, 4, 3], [1, 2, 5, 5], [1, 5, 4, 4]])
    rubber = Material("rubber", Yeoh(50e3, 1e3), 1e6, 1000.0)
    region = Region("b", None, 0, points, cells, np.arange(3), PlaneStrain(1.0), rubber)
    found = region.pressure_points
    assert (found[0] == 0).all()
    np.testing.assert_array_equal(np.sort(found[1:], axis=1), [[4, 5, 8], [4, 7, 8]])
    assert region.pressure_count == 9
    sizes = region.pressure_sizes
    assert (sizes[2] == 0.0) and (sizes[[3 + 0, 3 + 3]] == 0.0).all()  # of nobody
    assert (sizes**2).sum() == pytest.approx(2.0)
