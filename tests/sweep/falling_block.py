"""A block that falls, and a study of how long."""

BLOCK = """
bodies:
  block:
    mesh: {generator: block, length: 4 mm, height: 4 mm, element_size: 2 mm}
    formulation: plane_strain
    thickness: 10 mm
    material: dragon_skin_30
time: {end: 10 ms}
output: {history_interval: 0.1 ms}
"""

STUDY = """
title: A block falls
scene: block.yaml
factors:
  time: {key: time.end, range: [2 ms, 12 ms], count: 6}
measures:
  energy: {of: energy_error}
"""
