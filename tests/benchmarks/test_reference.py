"""The ceiling computes softsim's increment."""

import dataclasses

import numpy as np
import pytest

from benchmarks.ceiling import Ceiling, CeilingError, compiled, compiler, write_problem
from softsim.solver.energy import EnergyReader
from softsim.solver.stable_step import stable_step

RUBBER = """
materials:
  rubber: {law: yeoh, C10: 36 kPa, C20: 9 kPa, C30: 2 kPa, density: 1070 kg/m^3%s}
time: {end: 1 s}
"""
BLOCKS = {
    "triangles": """
bodies:
  block: {mesh: {generator: block, length: 11 mm, height: 5 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 7 mm, material: rubber, fixed: [left]}
environment: {gravity: 500 m/s^2}
""",
    "tetrahedra": """
bodies:
  block: {mesh: {generator: box, length: 5 mm, width: 2 mm, height: 3 mm, element_size: 1 mm},
          formulation: solid, material: rubber, fixed: [left]}
environment: {gravity: 5000 m/s^2}
""",
    "quadrilaterals": """
bodies:
  block: {mesh: {generator: block, length: 11 mm, height: 5 mm, element_size: 1 mm, cells: quad},
          formulation: plane_strain, thickness: 7 mm, material: rubber, fixed: [left]}
environment: {gravity: 500 m/s^2}
""",
    "hexahedra": """
bodies:
  block: {mesh: {generator: box, length: 5 mm, width: 2 mm, height: 3 mm, element_size: 1 mm,
                 cells: quad},
          formulation: solid, material: rubber, fixed: [left]}
environment: {gravity: 5000 m/s^2}
""",
    "rings": """
bodies:
  block: {mesh: {generator: pfr_section, element_size: 1 mm}, formulation: ring_section,
          sector: 90 deg, rings: skin, thickness: 7 mm, material: rubber, fixed: [knots]}
environment: {gravity: 500 m/s^2}
""",
}
LAWS = {
    "elastic": RUBBER % "",
    "viscous": RUBBER
    % """,
           prony: [{g: 0.3, relaxation_time: 50 us}, {g: 0.2, relaxation_time: 2 ms}]""",
}
CASES = [
    pytest.param((mesh, law), marks=[] if law == "viscous" else pytest.mark.slow)
    for mesh in BLOCKS
    for law in LAWS
]
INCREMENTS = 200


@pytest.fixture(scope="session")
def program(tmp_path_factory):
    """The compiled reference."""
    if compiler() is None:
        pytest.skip("no C++ compiler on this machine")
    return compiled(tmp_path_factory.mktemp("reference"))


@pytest.fixture
def block(build, request):
    """A block of irregular elements whose nodes start with speeds of their own."""
    mesh, law = request.param
    model = build(BLOCKS[mesh] + LAWS[law])
    body = model.bodies[0]
    random = np.random.default_rng(4)
    points = body.points + 0.15e-3 * random.uniform(-1.0, 1.0, body.points.shape)
    regions = tuple(dataclasses.replace(region, points=points) for region in body.regions)
    moved = dataclasses.replace(body, points=points, regions=regions)
    velocity = np.where(model.is_free, random.uniform(-3.0, 3.0, points.shape), 0.0)
    return dataclasses.replace(model, bodies=(moved,), points=points, velocity=velocity)


@pytest.mark.parametrize("block", CASES, indirect=True, ids="-".join)
def test_reference_computes_the_increment_of_softsim(block, start, program, tmp_path):
    """After 200 increments the nodes are where softsim has them, on one thread and on two, and so
    are energies and what Maxwell branches and bulk viscosity have dissipated.

    The two add in different orders. A rounding error of 1e-16 in J, times kappa over the shear
    modulus (20), two hundred times over, is 4e-13 of a strain of order one; chaos does not set in.
    """
    solver = start(block)
    dt = solver.time_increment
    solver.advance(INCREMENTS)
    computed = solver.positions()[0]
    displacement = np.abs(computed - block.points).max()
    edges = block.points[block.bodies[0].cells]
    assert displacement > 0.3 * np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).min()
    energies = EnergyReader(solver).read()

    problem = write_problem(tmp_path / "block.bin", block, dt)
    for threads in (1, 2):
        ceiling = Ceiling(program, problem, threads)
        reference, printed = ceiling.outcome(INCREMENTS, tmp_path / "positions.bin")
        np.testing.assert_allclose(reference, computed, rtol=0.0, atol=1e-9 * displacement)
        assert printed["kinetic_energy"] == pytest.approx(energies.kinetic, rel=1e-8)
        assert printed["stored_energy"] == pytest.approx(energies.internal, rel=1e-8)
        dissipated = energies.viscous_dissipation
        assert printed["dissipated_energy"] == pytest.approx(dissipated, rel=1e-8)


@pytest.mark.parametrize("block", [("rings", "viscous")], indirect=True, ids="-".join)
@pytest.mark.physics
def test_a_reference_without_finite_energies_is_refused(block, program, tmp_path):
    dt = 100.0 * stable_step(block, block.points).value
    problem = write_problem(tmp_path / "block.bin", block, dt)
    with pytest.raises(CeilingError, match=r"^the compiled reference .* not finite .*$"):
        Ceiling(program, problem, 1).outcome(INCREMENTS, tmp_path / "positions.bin")


NEO_HOOKE = LAWS["elastic"].replace("yeoh", "neo_hooke").replace(", C20: 9 kPa, C30: 2 kPa", "")
UNKNOWN = {
    "Yeoh": BLOCKS["triangles"] + NEO_HOOKE,
    "quadrilaterals in plane strain only": BLOCKS["rings"].replace(
        "element_size: 1 mm", "element_size: 1 mm, cells: quad"
    )
    + LAWS["elastic"],
}


@pytest.mark.parametrize("reason", UNKNOWN)
def test_other_problems_are_refused(build, tmp_path, reason):
    model = build(UNKNOWN[reason])
    dt = stable_step(model, model.points).value
    with pytest.raises(ValueError, match=reason):
        write_problem(tmp_path / "block.bin", model, dt)
