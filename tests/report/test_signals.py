"""Which figures over time a history has, and that both renderers draw all of them."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from softsim.report.curves import signals
from softsim.report.page.charts import chart_of
from softsim.report.png import draw

TIME = np.linspace(0.0, 1.0, 50)
UNITS = {"tip_x": "m", "clamp_x": "N"}


@pytest.fixture
def history() -> dict[str, np.ndarray]:
    ends = {
        "pull": 2.0, "pressure": 1e4, "frame_x": 5e-3, "rows_in_contact": 4.0,
        "internal_energy": 1e-3, "kinetic_energy": 1e-4, "energy_error": 1e-3,
        "tip_x": 1e-3, "clamp_x": 3.0,
    }  # fmt: skip
    return {"time": TIME, **{name: end * TIME for name, end in ends.items()}}


def test_a_history_without_data_has_no_figures() -> None:
    assert signals({"time": TIME, "internal_energy": np.full(50, np.nan)}, {}) == {}


def test_forces_of_rows_and_sides_over_the_last_fall_of_the_pressure(history) -> None:
    cycle = np.interp(TIME, TIME[[0, 10, 20, 25, 49]], [0.0, 1e4, 4e3, 1e4, 2e3])
    assert "deflation" not in signals(history, UNITS)
    pressed = {"row_force_skin.j1": 2.0 * TIME, "side_force_top": TIME, "side_force_left": -TIME}
    rows, sides, speed = signals(history | pressed | {"pressure": cycle}, UNITS)["deflation"].panels
    assert [line.name for line in rows.left.series] == ["skin.j1"]
    assert [line.name for line in sides.left.series] == ["top", "left"]
    (drawn,) = speed.left.series
    np.testing.assert_allclose(drawn.y, 5.0)  # 5 mm in a second
    assert drawn.x[[0, -1]] == pytest.approx([10.0, 2.0], abs=0.3)
    assert (np.diff(drawn.x) < 0.0).all()
    in_pipe = history | pressed | {"pressure": cycle, "arc_length": 7e-3 * TIME}
    np.testing.assert_allclose(signals(in_pipe, UNITS)["deflation"].panels[2].left.series[0].y, 7.0)


def test_pull_is_shown_where_a_tendon_holds_the_robot(history) -> None:
    (panel,) = signals(history, UNITS)["pull"].panels
    assert [axis.scale.title for axis in panel.axes] == [
        "tendon tension [N]", "air pressure [kPa]",
    ]  # fmt: skip
    del history["pull"]
    assert "pull" not in signals(history, UNITS)


def test_each_of_several_chambers_has_its_line(history) -> None:
    history |= {"pressure": 0.0 * TIME, "pressure_rear": 0.0 * TIME, "pressure_front": 2e3 * TIME}
    (panel,) = signals(history, UNITS)["displacement_pressure"].panels
    rear, front = panel.right.series
    assert (rear.name, front.name, front.y[-1]) == ("rear", "front", 2.0)
    assert rear.colour != front.colour


def test_a_line_is_named_by_its_axis_or_a_legend(history) -> None:
    found = signals(history, UNITS)
    assert [panel.has_legend for panel in found["energies"].panels] == [True, False]
    assert [panel.has_legend for panel in found["probes"].panels] == [True, True]


def test_every_figure_is_drawn_in_both_ways(history, tmp_path: Path) -> None:
    found = signals(history, UNITS)
    assert list(found) == [
        "displacement_pressure", "energies", "contact_rows", "pull", "probes", "pressure_probe",
    ]  # fmt: skip
    for name, curves in found.items():
        draw(tmp_path / f"{name}.png", curves)
        assert imread(tmp_path / f"{name}.png")[..., :3].std() > 0.02
        chart = chart_of(curves).figure
        titles = [a["title"]["text"] for n, a in chart["layout"].items() if n.startswith("yaxis")]
        assert titles == [axis.scale.title for panel in curves.panels for axis in panel.axes]
        lines = [line for panel in curves.panels for axis in panel.axes for line in axis.series]
        assert [trace["y"][-1] for trace in chart["data"]] == pytest.approx(
            [line.y[-1] for line in lines]
        )
