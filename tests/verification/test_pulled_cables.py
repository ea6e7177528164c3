"""Cables through eyelets: forces against energies, momentum, books, beams that tendons bend, the
stable step.
"""

import numpy as np
import pytest
from present_row import readings

from softsim.compute import fields

C10, KAPPA = 36e3, 2e6
SOFT = f"{{law: neo_hooke, C10: {C10} Pa, bulk_modulus: {KAPPA} Pa, density: 1000 kg/m^3}}"
STIFFNESS, PULL, TENSION = 300.0, 1.5e-3, 0.05
# One is drawn in, the other keeps its tension; neither runs along the elements' sides.
EYELETS = {
    "plane": ["[0.2 mm, 0.4 mm], [2.9 mm, 1.7 mm], [5.7 mm, 2.6 mm]",
              "[1 mm, 2.8 mm], [5.9 mm, 0.3 mm]"],
    "space": ["[0.2 mm, 0.4 mm, 0.5 mm], [2.9 mm, 1.7 mm, 2.4 mm], [5.7 mm, 2.6 mm, 2.2 mm]",
              "[1 mm, 2.8 mm, 0.4 mm], [5.9 mm, 0.3 mm, 2.9 mm]"],
}  # fmt: skip
KINDS = [pytest.param("plane"), pytest.param("space", marks=pytest.mark.slow)]


def block(kind):
    """A scene of a block, 6 mm long and 3 mm high, with two cables."""
    mesh, formulation = {
        "plane": ("generator: block", "plane_strain, thickness: 3 mm, position: [3 mm, 0 mm]"),
        "space": ("generator: box, width: 3 mm", "solid"),
    }[kind]
    drawn, kept = EYELETS[kind]
    return f"""
bodies:
  b: {{mesh: {{{mesh}, length: 6 mm, height: 3 mm, element_size: 1.5 mm, cells: quad}},
      formulation: {formulation}, material: soft}}
loads:
  drawn: {{kind: pulled_cable, eyelets: [{drawn}], pull: {PULL} m, stiffness: {STIFFNESS} N/m}}
  kept: {{kind: pulled_cable, eyelets: [{kept}], tension: {TENSION} N}}
materials: {{soft: {SOFT}}}
environment: {{gravity: 0 m/s^2}}
solver: {{bulk_viscosity: 0}}
time: {{end: 1 s}}
"""


def length(cable, x):
    """L [m]."""
    return np.linalg.norm(np.diff(cable.places(x), axis=0), axis=1).sum()


@pytest.mark.parametrize("kind", KINDS)
def test_forces_are_slopes_of_the_energy(build, start, kind):
    """k e^2 / 2 and S L, of a block that is deformed at random, taut and slack; no force and no
    moment of the cables is lost.
    """
    model = build(block(kind))
    solver, rng = start(model), np.random.default_rng(3)
    drawn, kept = model.loads
    x = model.points + 0.15e-3 * rng.uniform(-1.0, 1.0, model.points.shape)

    def energy(x):
        elongation = max(0.0, length(drawn, x) - drawn.rest_length + PULL)
        return 0.5 * STIFFNESS * elongation**2 + TENSION * length(kept, x)

    def forces(x):
        """Of the cables alone (n, d) [N]."""
        solver.terms.nodes.velocity.fill(0.0)
        fields.write(solver.terms.nodes.position, np.ascontiguousarray(x[None]))
        solver.find_forces(1e-9)
        found = np.zeros_like(x)
        for load, term in zip(model.loads, solver.terms.loads, strict=True):
            slots = slice(term.first_slot, term.first_slot + load.corners.size)
            for k, component in enumerate(solver.terms.nodes.corner_forces.component):
                values = fields.read(component)[0, slots]
                np.add.at(found[:, k], load.corners.ravel(), values)
        return found

    def slope(x, way, step=1e-8):
        return (energy(x + step * way) - energy(x - step * way)) / (2.0 * step)

    found = forces(x)
    scale = np.abs(found).sum()
    for _ in range(3):
        way = rng.uniform(-1.0, 1.0, x.shape)
        assert slope(x, way) == pytest.approx(-(found * way).sum(), rel=1e-6)
    assert np.abs(found.sum(axis=0)).max() < 1e-14 * scale
    moment = np.einsum("ni,nj->ij", x - x.mean(axis=0), found)
    assert np.abs(moment - moment.T).max() < 1e-14 * scale * 6e-3
    gradient = drawn.length_gradient(x)
    assert (gradient * way).sum() == pytest.approx(
        (length(drawn, x + 1e-8 * way) - length(drawn, x - 1e-8 * way)) / 2e-8, rel=1e-6
    )
    short = x * 0.7
    assert length(drawn, short) + PULL < drawn.rest_length
    assert np.abs(forces(short) + TENSION * kept.length_gradient(short)).max() < 1e-14


def test_work_of_the_winch_is_stored_or_moves(build, start, record_verification):
    """While both are pulled within half a millisecond, and the block shakes after it: the books are
    off by what central differences are, which falls with the square of the step.
    """
    from softsim.solver.energy import EnergyBalance, EnergyReader

    quickly = block("plane").replace("N/m}", "N/m, ramp: 0.5 ms}")
    model = build(quickly.replace("0.05 N}", "0.05 N, ramp: 0.5 ms}"))
    errors = []
    for share in (0.8, 0.4):
        solver = start(model, share=share)
        reader = EnergyReader(solver)
        balance, largest = EnergyBalance.starting(reader.read(), model), 0.0
        while solver.time < 5e-3:
            solver.clear_impulses(0)
            began = solver.time
            solver.advance(50)
            energies = reader.read()
            largest = max(largest, balance.error(energies))
        assert energies.kinetic > 0.01 * energies.external_work > 0.0
        errors.append(largest)
    assert errors[0] < 2e-3
    assert errors[1] < 0.3 * errors[0]
    record_verification("energy of pulled cables, half the step", 0.25 * errors[0], errors[1])
    x = solver.positions()[0]
    drawn, kept = (readings(term, solver.time - began) for term in solver.terms.loads)
    assert drawn["drawn_drawn_in"] == pytest.approx(PULL, rel=1e-9)
    assert kept["kept_tension"] == pytest.approx(TENSION, rel=1e-9)
    shorter = model.loads[1].rest_length - length(model.loads[1], x)
    assert kept["kept_drawn_in"] == pytest.approx(shorter, rel=1e-6)


LONG, HIGH, WIDE, OFF = 40e-3, 4e-3, 3e-3, 1.2e-3
ALONG = ", ".join(f"[{k} mm, 1.2 mm]" for k in range(0, 31, 3))
BEAM = f"""
bodies:
  beam: {{mesh: {{generator: block, length: 40 mm, height: 4 mm, element_size: 1 mm, cells: quad}},
         formulation: plane_strain, thickness: 3 mm, material: soft, fixed: [left],
         position: [20 mm, -2 mm]}}
loads:
  tendon: {{kind: pulled_cable, eyelets: [{ALONG}], DRIVEN}}
materials: {{soft: {SOFT}}}
environment: {{gravity: 0 m/s^2}}
time: {{end: 1 s, procedure: static}}
"""


@pytest.mark.parametrize(
    ("driven", "tension"), [("tension: 2 mN", 2e-3), ("pull: 0.02 mm, stiffness: 50 N/m", None)]
)
def test_a_tendon_beside_the_middle_bends_a_beam(
    build, start, driven, tension, record_verification
):
    """Between its first and last eyelet the beam has the moment T e, and turns by T e l / (E' I);
    what is drawn in is l times the strain at the eyelets, and what the cable stretches by. The side
    that is held cannot bulge, which makes the beam stiffer by some 1 %.
    """
    model = build(BEAM.replace("DRIVEN", driven))
    solver = start(model)
    solver.advance(60000)
    x = solver.positions()[0]
    tip = np.flatnonzero(model.points[:, 0] > LONG - 1e-9)
    way = x[tip[-1]] - x[tip[0]]
    turned = np.abs(np.arctan(way[0] / way[1]))
    mu = 2.0 * C10
    modulus, nu = (
        9.0 * KAPPA * mu / (3.0 * KAPPA + mu),
        0.5 * (3.0 * KAPPA - 2.0 * mu) / (3.0 * KAPPA + mu),
    )
    plane = modulus / (1.0 - nu**2)
    area, inertia, reach = WIDE * HIGH, WIDE * HIGH**3 / 12.0, 30e-3
    compliance = reach * (OFF**2 / (plane * inertia) + 1.0 / (plane * area))
    if tension is None:
        tension = 0.02e-3 / (compliance + 1.0 / 50.0)
        assert readings(solver.terms.loads[0], 1.0)["tendon_drawn_in"] == pytest.approx(0.02e-3)
    exact = tension * OFF * reach / (plane * inertia)
    record_verification(f"beam bent by a tendon, {driven.split(':')[0]}: turn [rad]", exact, turned)
    assert turned == pytest.approx(exact, rel=0.02)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("driven", "limit"), [("pulled hard", "a pulled cable"), ("under tension", "cable 'kept'")]
)
def test_the_stable_step_bounds_a_cable(build, fresh_taichi, kind, driven, limit):
    """The largest omega of the block with its cables, one very stiff or under a large tension, is
    below 2 / dt, and no less than half of it: along k dL dL^T, across T d2L/dx2, by differences.
    """
    from softsim.solver.natural_modes import inertia_root, rest_stiffness
    from softsim.solver.stable_step import stable_step

    stiffer = {
        "pulled hard": (f"pull: {PULL} m, stiffness: {STIFFNESS}", "pull: 1 um, stiffness: 1e5"),
        "under tension": (f"tension: {TENSION} N", "tension: 200 N"),
    }
    model = build(block(kind).replace(*stiffer[driven]))
    found, x = stable_step(model, model.points), model.points
    (body,), size, step = model.bodies, model.points.size, 1e-8
    K = rest_stiffness(model, body, body.regions[0]).matrix.toarray()
    for cable in model.loads:
        gradient = cable.length_gradient(x).ravel()
        K += cable.stiffness * np.outer(gradient, gradient)
        tension = cable.largest_tension(cable.rest_length)
        for row in range(size):
            way = np.zeros(size)
            way[row] = step
            ends = [cable.length_gradient(x + sign * way.reshape(x.shape)) for sign in (1.0, -1.0)]
            K[row] += tension * (ends[0] - ends[1]).ravel() / (2.0 * step)
    _, inverse_root = inertia_root(model, body)
    matrix = inverse_root.T @ (0.5 * (K + K.T)) @ inverse_root
    omega = np.sqrt(np.linalg.eigvalsh(matrix).max())
    assert omega < 2.0 / found.stable < 2.0 * omega
    assert limit in found.limit
