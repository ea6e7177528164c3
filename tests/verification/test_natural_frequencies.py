"""Natural frequencies: single springs by hand, and rods.

A rod of length L that is held at one end, in which waves run at c: f_k = (2 k - 1) c / (4 L), and
the first mode takes 8 / pi^2 of the mass. A chain of N equal masses is off by the share
(pi (2 k - 1) / (4 N))^2 / 6. Triangles are by a little more, as they give the two sides of the rod
unequal masses, and where the wave compresses by six times as much more, as a pressure averaged over
two of them is soft.
"""

import meshes
import numpy as np
import pytest
from scipy.optimize import brentq

from softsim.solver.natural_modes import natural_modes

DENSITY, SHEAR_MODULUS = 1000.0, 72e3
KAPPA = 20.0 * SHEAR_MODULUS
RUBBER = "{law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}"

ROD = f"""
bodies:
  rod: {{mesh: {{generator: block, length: 20 mm, height: 1 mm, element_size: 1 mm}},
        formulation: plane_strain, thickness: 1 mm, material: rubber, fixed: [left]}}
conditions: {{guide: {{kind: fixed, nodes: rod.surface, directions: [GUIDED]}}}}
materials: {{rubber: {RUBBER}}}
time: {{end: 1 s}}
"""

HALVES = """
bodies:
  rod: {mesh: {generator: block, length: 20 mm, height: 1 mm, element_size: 0.5 mm},
        formulation: plane_strain, thickness: 1 mm, material: soft, fixed: [left],
        sets: {outer: {plane: {point: [0 mm, 0 mm], normal: [1, 0]}}},
        regions: {outer: {material: lossy}}}
conditions: {guide: {kind: fixed, nodes: rod.all, directions: [x]}}
materials:
  soft: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}
  lossy: {law: ogden, mu: [108 kPa], alpha: [3], density: 2000 kg/m^3,
          prony: [{g: 0.2, relaxation_time: 3 ms}]}
time: {end: 1 s}
"""

TRIANGLES = f"""
bodies:
  pair: {{mesh: {{file: pair.inp, length_unit: 1 m}}, formulation: plane_strain, thickness: 3 mm,
         material: rubber, fixed: [held]}}
materials: {{rubber: {RUBBER}}}
time: {{end: 1 s}}
"""


def test_two_triangles_by_hand(build, fresh_taichi, tmp_path):
    """Of two right triangles with the legs a and b along x and y all but the end of a is held:
    along y it has the spring mu V / a^2, along x (kappa + 4/3 mu) V / a^2, and rho V / 3.
    """
    a = np.array([2e-3, 3e-3])
    corners = [[[0.0, y], [leg, y], [0.0, y + 1e-3]] for leg, y in zip(a, (0.0, 5e-3), strict=True)]
    mesh = meshes.SmallMesh(
        np.concatenate(corners), np.array([[0, 1, 2], [3, 4, 5]]), {"held": np.array([0, 2, 3, 5])}
    )
    mesh.write(tmp_path / "pair.inp", "plane_strain")
    model = build(TRIANGLES)
    found = natural_modes(model, model.bodies[0], 3)
    stiff = np.concatenate([SHEAR_MODULUS / a**2, (KAPPA + 4.0 / 3.0 * SHEAR_MODULUS) / a**2])
    exact = np.sort(np.sqrt(3.0 * stiff / DENSITY)) / (2.0 * np.pi)
    assert [m.frequency for m in found.modes] == pytest.approx(exact[:3], rel=1e-8)
    assert [m.most_moved for m in found.modes] == [4, 1, 4]
    assert (found.held_count, found.rigid_motions) == (4, 0)


@pytest.mark.parametrize(
    ("guided", "modulus", "off"),
    [("x", SHEAR_MODULUS, 1.2), ("y", KAPPA + 4.0 / 3.0 * SHEAR_MODULUS, 7.2)],
)
def test_rods(build, fresh_taichi, record_verification, guided, modulus, off):
    """Waves across and along a rod whose nodes all are guided."""
    model = build(ROD.replace("GUIDED", guided))
    body, length, count = model.bodies[0], 20e-3, 20
    found = natural_modes(model, body, 3).modes
    exact = np.sqrt(modulus / DENSITY) / (4.0 * length)
    for k, mode in enumerate(found):
        error = (np.pi * (2 * k + 1) / (4.0 * count)) ** 2 / 6.0
        assert mode.frequency == pytest.approx((2 * k + 1) * exact, rel=off * error)
    case = f"rod held at one end [Hz], guided along {guided}"
    record_verification(case, exact, found[0].frequency)
    assert found[0].mass_shares["yx".index(guided)] == pytest.approx(8.0 / np.pi**2, rel=1e-2)
    shapes = np.stack([mode.shape.ravel() for mode in found])
    mass = (shapes * np.repeat(model.mass, 2)) @ shapes.T
    assert np.abs(mass - np.diag(np.diag(mass))).max() < 1e-9 * mass.max()


def test_a_rod_of_two_materials(build, fresh_taichi, record_verification):
    """Waves across, halves l of the impedances Z = sqrt(mu rho): where
    tan(omega l / c_1) tan(omega l / c_2) = Z_1 / Z_2; with the branches mu_2 is that at omega. Of
    the shape without them the frequency is too high, by the square of what it changes.
    """
    model = build(HALVES)
    body = model.bodies[0]
    soft, lossy = sorted((r.material for r in body.regions), key=lambda m: m.density)

    def excess(frequency, outer_modulus):
        moduli = np.array([soft.storage_modulus(0.0), outer_modulus])
        density = np.array([soft.density, lossy.density])
        first, second = np.tan(2.0 * np.pi * frequency * 10e-3 / np.sqrt(moduli / density))
        impedance = np.sqrt(moduli * density)
        return first * second - impedance[0] / impedance[1]

    exact = brentq(lambda f: excess(f, lossy.storage_modulus(0.0)), 1.0, 150.0)
    dynamic = brentq(lambda f: excess(f, lossy.storage_modulus(f)), 1.0, 150.0)
    [mode] = natural_modes(model, body, 1).modes
    record_verification("rod of two materials [Hz], laws alone", exact, mode.frequency)
    record_verification("rod of two materials [Hz], dynamic", dynamic, mode.dynamic_frequency)
    assert mode.frequency == pytest.approx(exact, rel=1e-3)
    assert dynamic < mode.dynamic_frequency < 1.003 * dynamic
