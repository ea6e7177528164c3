"""Scenes of a strip, of blocks and of a tube, and helpers for their runs."""

import json

import numpy as np
from rich.console import Console

from softsim.output.fields import read_frames

FALLING_STRIP = """
title: A strip falls on a floor
bodies:
  strip: {mesh: {generator: block, length: 10 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10,
          position: [0 mm, 1 mm]}
environment: {inclination: 10 deg, walls: {floor: {kind: plane}}}
time: {end: 60 ms}
output: {history_interval: 1 ms, frame_interval: 10 ms}
"""

PRESSED_BLOCK = """
title: A block is pressed, a motor shakes a frame
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10,
      position: [0 mm, 0.2 mm]}
rigid_bodies:
  frame: {mass: 10 g, inertia: 1 kg*mm^2, outline: {length: 20 mm, height: 10 mm}, free: [x, y],
          center: [-40 mm, 5.1 mm]}
loads:
  air: {kind: follower_pressure, facets: [b.top], offset: 0.5 kPa,
        profile: {kind: table, points: [[0 s, 0 Pa], [5 ms, 2 kPa], [20 ms, 0 Pa]]}}
  motor: {kind: eccentric_mass, acts_on: frame, eccentric_mass: 0.05 g, radius: 1 mm,
          frequency: 100 Hz, spin_up: 5 ms}
environment: {walls: {floor: {kind: plane}}}
contact: {friction_coefficient: 0}
time: {end: 20 ms}
output: {history_interval: 1 ms, frame_interval: 10 ms}
"""

INFLATED_TUBE = """
title: A bottle and a regulator inflate a tube, which a pulsed valve vents
bodies:
  tube: {mesh: {generator: block, length: 1 mm, height: 5 mm, element_size: 1 mm},
         formulation: axisymmetric, material: dragon_skin_10, position: [4 mm, 0 mm],
         fixed: [bottom, top]}
pneumatics:
  nodes:
    bottle: {kind: vessel, volume: 0.2 ml, pressure: 10 kPa}
    supply: {kind: regulator, flow: 20 ml/s, relieving: true,
             profile: {kind: table, points: [[0 s, 0 kPa], [6 ms, 8 kPa], [12 ms, 1 kPa]]}}
    chamber: {kind: chamber, facets: [tube.left]}
  edges:
    filling: {kind: tube, between: [bottle, chamber], length: 10 cm, bore: 0.6 mm}
    feed: {kind: valve, between: [supply, chamber], flow: 10 ml/s, pressure: 10 kPa}
    vent: {kind: valve, between: [chamber, ambient], flow: 10 ml/s, pressure: 10 kPa,
           pulses: 300 Hz, opening: {kind: ramp, value: 0.6, duration: 10 ms}}
time: {end: 12 ms, settle: 1 s}
output: {history_interval: 0.5 ms, frame_interval: 5 ms}
"""

SLIDING_BLOCK = """
title: A block slides on another one, up to a stop
bodies:
  lower: {mesh: {generator: block, length: 8 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10,
          position: [1.2 mm, 0 mm], fixed: [bottom]}
  stop: {mesh: {generator: block, length: 2 mm, height: 3 mm, element_size: 1 mm},
         formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10,
         position: [7 mm, 3 mm], fixed: [right]}
  slider: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm},
           formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10,
           position: [0.3 mm, 2.05 mm]}
environment: {gravity: 0 m/s^2}
contact: {self_contact: [lower, stop, slider], friction_coefficient: 0.2}
loads:
  down: {kind: body_force, bodies: [slider], density: [0 N/m^3, -150000 N/m^3]}
  air: {kind: follower_pressure, facets: [slider.left],
        profile: {kind: table, points: [[0 s, 0 Pa], [5 ms, 0.5 kPa]]}}
time: {end: 12 ms}
output: {history_interval: 0.5 ms, probes: {slider: {kind: displacement, nodes: slider.right}}}
"""


def finished(batch):
    """What a batch of one has found at its end."""
    [outcome] = batch.run(Console(quiet=True))
    if isinstance(outcome, Exception):
        raise outcome
    return outcome


def status(folder):
    return json.loads((folder / "summary.json").read_text())["status"]


def same_files(one, other):
    assert (one / "history.csv").read_bytes() == (other / "history.csv").read_bytes()
    a, b = read_frames(one / "results.vtkhdf"), read_frames(other / "results.vtkhdf")
    np.testing.assert_array_equal(a.times, b.times)
    for k in range(len(a)):
        np.testing.assert_array_equal(
            a.point_data["displacement"][k], b.point_data["displacement"][k]
        )
