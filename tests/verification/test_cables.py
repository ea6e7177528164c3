"""Cables against closed forms: a hanging chain, a cantilever that sags and swings, a capstan.

A scene needs a meshed body: a soft block far away, which does not limit the step.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

FAR = """
bodies:
  far: {mesh: {generator: block, length: 100 mm, height: 100 mm, element_size: 100 mm},
        formulation: plane_strain, thickness: 1 mm, material: soft, position: [1 m, 1 m],
        fixed: [surface]}
materials: {soft: {law: neo_hooke, C10: 10 Pa, density: 1000 kg/m^3}}
"""
G, LINE = 9.81, 2.4e-3  # m/s^2, kg/m
TUBE = f"diameter: 2 mm, mass_per_length: {LINE} kg/m"


def settled(start, model):
    """A solver whose model has come to rest under local damping, and where its nodes are."""
    from softsim.solver.settling import unbalanced_share

    solver = start(model, share=0.6)
    while solver.time < 20.0:
        solver.advance(5000)
        if unbalanced_share(solver.scenario(0)) < 1e-7:
            return solver, solver.scenario(0).positions()[model.cables[0].cable.nodes]
    raise AssertionError("no equilibrium")


def test_a_chain_between_two_walls_hangs_in_a_catenary(build, start):
    """Length L over a span: y = a cosh(x / a), 2 a sinh(span / 2a) = L, tension w a below, w (a +
    sag) at the ends.
    """
    length, span = 0.24, 0.2
    height = 0.5 * np.sqrt(length**2 - span**2)
    model = build(
        FAR
        + f"""
cables:
  chain: {{points: [[{-0.5 * span} m, 0 m], [0 m, {-height} m], [{0.5 * span} m, 0 m]],
          segment_length: 5 mm, {TUBE}, stretching_stiffness: 60 N, bending_stiffness: 0 N*mm^2}}
conditions:
  one: {{kind: fixed, nodes: chain.start}}
  other: {{kind: fixed, nodes: chain.end}}
time: {{end: 1 s, procedure: static}}
"""
    )
    solver, x = settled(start, model)
    a = brentq(lambda a: 2.0 * a * np.sinh(0.5 * span / a) - length, 0.01, 1.0)
    sag = a * (np.cosh(0.5 * span / a) - 1.0)
    assert -x[:, 1].min() == pytest.approx(sag, rel=2e-3)
    shape = a * (np.cosh(x[:, 0] / a) - np.cosh(0.5 * span / a))
    assert np.abs(x[:, 1] - shape).max() < 2e-3 * sag
    cable = model.cables[0].cable
    tensions = cable.spring_stiffness * (cable.tangents(solver.scenario(0).positions())[1]
                                         - cable.lengths)  # fmt: skip
    assert tensions.min() == pytest.approx(LINE * G * a, rel=0.01)
    assert tensions.max() == pytest.approx(LINE * G * (a + sag), rel=0.02)
