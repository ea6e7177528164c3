"""A spinning body without half of the weight along its own axis, against the closed form.

With e = (cos wt, sin wt), r = share * (weight of all) / (weight of the body), G downwards:
dv/dt = (0, -G) + r G sin wt (cos wt, sin wt), so from rest
v = G (r sin^2(wt) / (2 w), -t + r (t/2 - sin(2 wt) / (4 w))).
"""

import numpy as np
import pytest

from softsim.compute import fields

SPIN, SHARE, END = 40.0, 0.4, 50e-3  # rad/s, -, s: two radians
SCENE = f"""
bodies:
  far: {{mesh: {{generator: block, length: 100 mm, height: 100 mm, element_size: 100 mm}},
        formulation: plane_strain, thickness: 100 mm, material: soft, position: [1 m, 1 m],
        fixed: [left]}}
materials: {{soft: {{law: neo_hooke, C10: 100 Pa, density: 1 kg/m^3}}}}
rigid_bodies:
  frame: {{mass: 5 g, inertia: 1 kg*mm^2, initial_angular_velocity: {SPIN} rad/s}}
loads: {{relief: {{kind: axial_relief, acts_on: frame, share: {SHARE}}}}}
time: {{end: 1 s}}
"""


def test_velocity_follows_the_closed_form(build, start):
    """Central difference: the error is (2 w dt)^2 / 24 of the terms that turn at 2 w."""
    model = build(SCENE)
    gravity = 9.81
    ratio = SHARE * (model.mass.sum() + 5e-3) / 5e-3
    solver = start(model)
    dt = solver.time_increment
    count = int(np.ceil(END / dt))
    solver.advance(count)
    t = (count + 0.5) * dt  # velocities live at half steps
    body = solver.terms.rigid_bodies
    v = fields.read(body.velocity)[0, 0]
    turn = SPIN * t
    expected = gravity * np.array(
        [
            ratio * np.sin(turn) ** 2 / (2.0 * SPIN),
            -t + ratio * (0.5 * t - np.sin(2.0 * turn) / (4.0 * SPIN)),
        ]
    )
    error = 4.0 * (2.0 * SPIN * dt) ** 2 / 24.0 * gravity * ratio / (2.0 * SPIN)
    assert ratio > SHARE  # the other body's weight counts too
    assert v == pytest.approx(expected, abs=error + 1e-12)
