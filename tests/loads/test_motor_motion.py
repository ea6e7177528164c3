"""A motor on a free frame: the swing of a mass under a sinusoidal force."""

import numpy as np
import pytest

from softsim.compute import fields

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 1 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10}
rigid_bodies:
  frame: {mass: 10 g, inertia: 1 kg*mm^2, tied: [b.surface]}
environment: {gravity: 0 m/s^2}
loads:
  motor: {kind: eccentric_mass, acts_on: frame, eccentric_mass: 0.572 g, radius: 1.72 mm,
          frequency: 192 Hz, spin_up: 20 ms}
time: {end: 1 s}
"""


def test_the_frame_swings_with_m_r_over_M(build, start):
    """x = m_e r_e / M at any frequency; the work done is the kinetic energy gained."""
    from softsim.solver.energy import EnergyReader

    solver = start(build(SCENE))
    reader = EnergyReader(solver)
    track = []
    while solver.time < 80e-3:
        solver.advance(50)
        track.append((solver.time, *fields.read(solver.terms.rigid_bodies.centre)[0, 0]))
    t, x, y = np.array(track).T
    late = t > 30e-3
    angle = 2.0 * np.pi * 192.0 * t[late]
    shapes = np.stack([np.ones(late.sum()), t[late], np.cos(angle), np.sin(angle)], axis=1)
    fitted = np.linalg.lstsq(shapes, y[late], rcond=None)[0]
    swing = np.hypot(*fitted[2:])
    mass = fields.read(solver.terms.rigid_bodies.mass)[0]
    assert swing == pytest.approx(0.572e-3 * 1.72e-3 / mass, rel=1e-3)
    assert np.abs(x).max() < 1e-12
    energies = reader.read()
    assert energies.external_work == pytest.approx(energies.kinetic, rel=1e-6)
