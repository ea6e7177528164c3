"""What a calibration shows: numbers, lines for the scene, figure."""

import numpy as np
import pytest
import yaml

from softsim.apps.calibration.experiments import (
    Calibration,
    SpecimenStiffness,
    Stiffnesses,
    WallCurve,
    calibration_diagram,
    calibration_rows,
    matched,
    sample_table,
    scene_lines,
)
from softsim.report.png import draw


def curve(highest, touch, slope):
    """A wall that feels slope (p - touch); the second row touches 2 kPa after the first."""
    pressure = np.linspace(0.0, highest, 1001)
    force = slope * np.maximum(pressure - touch, 0.0)
    rows = (force > 0.0).astype(float) + (pressure > touch + 2e3)
    return WallCurve(pressure, force, rows, np.full(1001, 1e-3))


@pytest.fixture
def found():
    """Of 14 spikes, twice the section's stiffness; q = 2 (p - 5 kPa) exactly."""
    reference, section = curve(15e3, 5e3, 2e-3), curve(30e3, 0.0, 0.5e-3)
    across = Stiffnesses("y", SpecimenStiffness(600.0, 0.01), SpecimenStiffness(300.0, 0.01))
    along = Stiffnesses("x", SpecimenStiffness(500.0, 0.01), SpecimenStiffness(200.0, 0.01))
    return Calibration(
        reference, section, matched(reference, section), 7e-3, 14, (10e3, 10e3), (across, along),
        matched(reference, section, across.ratio),
    )  # fmt: skip


def test_the_lines_are_what_a_scene_reads(found):
    as_it_is, thick = scene_lines(found, "air", "skin").split("\n\n")
    for text, thickness, factor in ((as_it_is, "7 mm", 2.0), (thick, "14 mm", 1.0)):
        said = yaml.safe_load(text)
        assert said["bodies"]["skin"]["thickness"] == thickness
        assert said["loads"]["air"]["factor"] == pytest.approx(factor, rel=5e-3)
        assert float(said["loads"]["air"]["offset"].removesuffix(" kPa")) == pytest.approx(
            5.0, abs=0.05
        )


def test_the_numbers_tell_spikes_stiffness_and_thickness(found):
    rows = dict(calibration_rows(found))
    assert "n/4 = 3.5 spikes of 2 mm" in rows["thickness"]
    assert "ratio 2" in rows["stiffness, transverse"]
    assert "ratio 2.5" in rows["stiffness, along the pipe"]
    assert rows["equivalent thickness"].startswith("14 mm")


def test_without_a_frame_there_is_no_stiffness_to_tell(found):
    plain = Calibration(found.reference, found.section, found.mapping, 7e-3, 14, (10e3, 10e3))
    assert not any("stiff" in text for row in calibration_rows(plain) for text in row)
    assert scene_lines(plain, "air", "skin").count("thickness") == 1
    assert plain.as_json()["equivalent_thickness"] is None


def test_the_comparison_has_a_line_a_pressure(found):
    table = sample_table(found)
    assert all(len(row) == len(table.headings) for row in table.rows)
    last = [float(cell.text) for cell in table.rows[-1]]
    # p, q matched, q line, N in space, N section (half of it), rows, rows
    assert last == pytest.approx([15.0, 20.0, 20.0, 20.0, 10.0, 2.0, 2.0], rel=5e-3)


def test_the_figure(found, tmp_path):
    draw(tmp_path / "calibration.png", calibration_diagram(found))
    assert (tmp_path / "calibration.png").stat().st_size > 20_000
