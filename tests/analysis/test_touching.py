"""Over which area a body touches, how often and for how long its rows do."""

import numpy as np
import pytest

from softsim.analysis.catalogue import RecordedRun, contact_count, values
from softsim.scene.measures import Part

PRESSED = """\
bodies:
  block: {mesh: {generator: block, length: 6 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10,
          position: [0 mm, -0.0005 um]}
environment: {gravity: 9.81 m/s^2, walls: {floor: {kind: plane}}}
contact: {friction_coefficient: 0}
robot: {rows: [block.bottom]}
time: {end: 1 s}
"""


def test_a_contact_begins_after_a_while_without():
    """Rows of 0.5 ms: one row between two touches is no time away, two are one of 1 ms."""
    t = 0.5e-3 * np.arange(10)
    touched = np.array([0, 1, 1, 0, 1, 0, 0, 1, 0, 0], bool)
    assert contact_count(t, touched) == 2
    assert contact_count(t, ~touched) == 2
    assert contact_count(t, np.zeros(10, bool)) == 0
    assert contact_count(2.0 * t, touched) == 3


def test_a_block_lies_on_all_its_area(build, start):
    """Pressed into the floor by a micrometre: 6 mm times 5 mm. Its surface is 2 (6 + 2) 5 mm^2."""
    from softsim.output.observation import Observer, frame
    from softsim.solver.energy import EnergyBalance, EnergyReader

    model = build(PRESSED)
    solver = start(model)
    reader = EnergyReader(solver)
    balance = EnergyBalance.starting(reader.read(), model)
    solver.clear_impulses(0)
    solver.advance(1)
    reader.update()
    row = Observer(solver.scenario(0), reader, balance).observe(solver.time_increment).row
    assert model.bodies[0].surface_areas.sum() == pytest.approx(80e-6)
    assert row["contact_area"] == pytest.approx(35e-6)  # half an edge up either side
    shot = frame(solver.scenario(0), ("velocity", "contact_force", "stress"))
    upwards = shot.point_data["contact_force"].sum(axis=0)[1]
    assert upwards == pytest.approx(row["wall_force_y"], rel=1e-12) and upwards > 0.0
    assert shot.point_data["velocity"].shape == model.points.shape
    assert shot.cell_data["stress"].shape == (model.element_count, 6)
    history = {
        "time": np.array([0.0, 1.0, 3.0]),
        "contact_area": np.array([0.0, 2.0, 1.0]),
        "row_force_block.bottom": np.array([0.0, 1.0, 0.0]),
        "rows_in_contact": np.array([0.0, 1.0, 0.0]),
        "wall_force_normal": np.array([0.0, 1.0, 0.0]),
        "slip_share": np.zeros(3),
    }
    found = values(RecordedRun(history, {Part.ROWS}, rows=["block.bottom"]))
    assert found["largest_contact_area"] == 2.0
    assert found["mean_contact_area"] == pytest.approx(4.0 / 3.0)
    assert found["row_contacts"] == [1]
    assert found["row_contact_shares"] == [pytest.approx(1.0 / 3.0)]
