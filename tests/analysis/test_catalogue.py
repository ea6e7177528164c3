"""The measures that a scene promises are those of its run."""

import numpy as np
import pytest

from softsim.analysis.catalogue import OF_EVERY_RUN, produced
from softsim.analysis.measures import measures, recorded_run
from softsim.builder import build_model
from softsim.output.observation import columns
from softsim.scene.loading import load_scene
from softsim.scene.measures import parts_of, recorded

BODY = """
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 1 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10, fixed: [bottom]}
time: {end: 2 s}
"""
FRAME = """
rigid_bodies:
  frame: {mass: 8.8 g, inertia: 1 g*mm^2, outline: {length: 3 mm, height: 1 mm},
          center: [2 mm, 9 mm]}
"""
CYCLES = """
loads:
  air: {kind: follower_pressure, facets: [b.top],
        profile: {kind: table, points: [[0 s, 1 kPa], [0.5 s, 2 kPa], [1 s, 1 kPa], [2 s, 2 kPa]]}}
"""
SECOND = (
    """
loads:
  held: {kind: follower_pressure, facets: [b.right], profile: {kind: constant, value: 1 kPa}}
"""
    + CYCLES.replace("loads:\n", "")
    + "robot: {chamber: air}"
)
EVENTS = """
loads:
  air: {kind: follower_pressure, facets: [b.top],
        profile: {kind: event_cycles, highest: 20 kPa, inflation_rate: 20 kPa/s, lowest: 10 kPa,
                  deflation_rate: 20 kPa/s, contact_force: 1 N, contact_rows: 0, least_rows: 0}}
  gauge: {kind: tendon, acts_on: frame}
layout: {}
environment:
  walls: {pipe: {kind: pipe_path, diameter: 40 mm, start: [-9 mm, 9 mm], pipe: [{straight: 50 mm}]}}
"""
PROBES = """
output:
  probes:
    moved: {kind: displacement, nodes: b.top}
    held: {kind: reaction, nodes: b.bottom}
    turned: {kind: rotation, nodes: b.top}
"""
OF_REVOLUTION = """
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 1 mm, element_size: 1 mm},
      formulation: axisymmetric, material: dragon_skin_10, fixed: [bottom], position: [3 mm, 0 mm]}
time: {end: 2 s}
rigid_bodies: {frame: {mass: 8.8 g, inertia: 1 g*mm^2, center: [0 mm, 9 mm]}}
"""
IN_SPACE = """
bodies:
  b: {mesh: {generator: box, length: 4 mm, height: 1 mm, width: 1 mm, element_size: 1 mm},
      formulation: solid, material: dragon_skin_10, fixed: [bottom]}
time: {end: 2 s}
rigid_bodies: {frame: {mass: 8.8 g, inertia: 1 g*mm^2, center: [2 mm, 9 mm]}}
output:
  probes: {moved: {kind: displacement, nodes: b.top}, turned: {kind: rotation, nodes: b.top}}
robot: {track: moved}
"""


def history(model):
    """Rows of a run: one cycle, felt as one too; everything else is 1, growing with time."""
    t = np.linspace(0.0, 2.0, 401)
    rows = dict.fromkeys(columns(model), 1.0 + t)
    rows["time"] = t
    if "pressure" in rows:
        rows["pressure"] = np.interp(t, [0, 0.5, 1, 2], [1e3, 2e3, 1e3, 2e3])
    if "phase" in rows:
        rows |= {"cycle": 1.0 + (t > 1.0), "phase": np.where((t > 0.5) & (t <= 1.0), 3.0, 1.0)}
    if "branch" in rows:
        rows["branch"] = np.zeros_like(t)
    if "cycles_done" in rows:
        rows["cycles_done"] = np.floor(t)
    return rows


def flat(found, prefix=""):
    """Mappings within mappings as dotted names."""
    for name, value in found.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


SCENES = pytest.mark.parametrize(
    "parts",
    [
        (BODY,),
        (BODY, FRAME),
        (BODY, CYCLES),
        (BODY, FRAME, CYCLES),
        (BODY, FRAME, EVENTS),
        (BODY, FRAME, SECOND),
        (BODY, PROBES),
        (IN_SPACE,),
        (OF_REVOLUTION, PROBES),
    ],
)


@SCENES
def test_parts_and_columns(write_scene, parts):
    loaded = load_scene(write_scene("".join(parts)))
    model = build_model(loaded)
    assert recorded_run(model, history(model)).parts == parts_of(loaded.scene)
    units = columns(model)
    for name, column in recorded(loaded.scene).items():
        assert units[name] == (column.unit or "-"), name


@SCENES
def test_names_and_kinds(write_scene, parts):
    loaded = load_scene(write_scene("".join(parts)))
    model = build_model(loaded)
    found = dict(flat(measures(model, history(model))))
    said = produced(loaded.scene)
    of_the_run = set(OF_EVERY_RUN)
    said_of_layouts = {name for name in said if name.startswith("layout.")}
    found_of_layouts = {name for name in found if name.startswith("layout.")}
    assert set(said) - of_the_run - said_of_layouts == set(found) - found_of_layouts
    # why it is stuck is known only of those that are
    assert said_of_layouts - found_of_layouts <= {"layout.blocked_by"}
    for name in set(said) & set(found):
        measure, value = said[name], found[name]
        assert isinstance(value, list) == bool(measure.listed), name
        assert isinstance(value, str) == measure.is_label, name
