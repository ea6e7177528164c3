"""Steps one after another: each begins where the one before has ended."""

import io
import json
import signal
from types import SimpleNamespace

import numpy as np
import pytest
from batches import INFLATED_TUBE, PRESSED_BLOCK
from rich.console import Console

from softsim.compute.machine import Choice
from softsim.errors import Interrupted, OutputError, SceneError, StabilityError
from softsim.output.folder import read_checkpoint
from softsim.run.scenes import fitting_steps
from softsim.scene.steps import load_steps

# With a branch, which remembers; the block lies on the floor and rubs on it.
BLOCK = f"""
{PRESSED_BLOCK.replace("dragon_skin_10", "soft").replace("coefficient: 0", "coefficient: 0.5")}
materials:
  soft: {{law: neo_hooke, C10: 15 kPa, density: 1070 kg/m^3, poisson_ratio: 0.49,
         prony: [{{g: 0.4, relaxation_time: 2 ms}}]}}
""".replace("end: 20 ms", "end: 10 ms, settle: 1 s")
IN_TWO = BLOCK.replace(
    "time: {end: 10 ms, settle: 1 s}",
    "steps: {first: {time: {end: 5.5 ms, settle: 1 s}}, then: {time: {end: 4.5 ms}}}",
)

# Pressed at rest; held; let go, while a motor begins.
PRESSED_AT_REST = """
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm}, fixed: [bottom],
      formulation: plane_strain, thickness: 5 mm, material: soft}
rigid_bodies:
  frame: {mass: 10 g, inertia: 1 kg*mm^2, free: [y], center: [-40 mm, 5 mm]}
materials:
  soft: {law: neo_hooke, C10: 15 kPa, density: 1070 kg/m^3, poisson_ratio: 0.49,
         prony: [{g: 0.4, relaxation_time: 2 ms}]}
environment: {gravity: 0 m/s^2}
loads:
  air: {kind: follower_pressure, facets: [b.top],
        profile: {kind: table, points: [[0 s, 0 Pa], [5 ms, 8 kPa]]}}
output: {history_interval: 1 ms, frame_interval: 10 ms}
steps:
  press: {time: {end: 5 ms, procedure: static}}
  hold: {time: {end: 5 ms}}
  let_go:
    time: {end: 30 ms}
    loads:
      air: ~
      motor: {kind: eccentric_mass, acts_on: frame, eccentric_mass: 0.05 g, radius: 1 mm,
              frequency: 100 Hz, spin_up: 5 ms}
"""

UNTIL = (
    PRESSED_AT_REST.replace("{", "{{")
    .replace("}", "}}")
    .replace("end: 30 ms", "end: 30 ms, reach: {}")
)

TUBE_IN_TWO = INFLATED_TUBE.replace(
    "time: {end: 12 ms, settle: 1 s}",
    "steps: {inflate: {time: {end: 5.2 ms, settle: 1 s}}, vent: {time: {end: 6.8 ms}}}",
)


@pytest.fixture
def run_steps(write_scene, kernel_cache, monkeypatch, tmp_path):
    """Run the steps of a scene text quietly on the CPU: results by name, and what was told."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run_steps as run_them

    def quiet(text, *overrides, out="out", **options):
        console = Console(file=io.StringIO(), width=500)
        steps = load_steps(write_scene(text, "steps.yaml"), overrides)
        found = run_them(steps, tmp_path / out, "cpu", console=console, threads=1, **options)
        return SimpleNamespace(of=found, told=console.file.getvalue())

    return quiet


def test_two_steps_in_which_nothing_changes_are_one_run(run_steps, run, write_scene, tmp_path):
    """Pressure, motor, branches, friction go on; what differs is the last increments of a step."""
    whole = run(write_scene(BLOCK), out=tmp_path / "whole").history
    then = run_steps(IN_TWO).of["then"].history
    assert then["time"][0] == 5.5e-3 and then["time"][-1] == pytest.approx(10e-3, rel=1e-12)
    for name in ("body_y", "frame_y", "pressure", "wall_force_y"):
        moved = np.ptp(whole[name])
        assert then[name][-1] == pytest.approx(whole[name][-1], abs=2e-3 * moved), name
    assert then["energy_error"].max() < 1e-3


class StopAt:
    """Monitor that stops a run, as a user does, once it has reached a time [s]."""

    def __init__(self, time):
        self.time = time

    def start(self, run):
        """Do nothing."""

    def update(self, run, signals):
        if run.scenario.time >= self.time and not signals:
            signal.raise_signal(signal.SIGTERM)


def test_network_over_two_steps(run_steps, run, write_scene, tmp_path):
    """Check that contents and time continue in the second step, also if it is interrupted."""
    whole = run(write_scene(INFLATED_TUBE), out=tmp_path / "whole").history
    found = run_steps(TUBE_IN_TWO)
    assert "jumps" not in found.told
    inflate, vent = (found.of[name].history for name in ("inflate", "vent"))
    nodes = {"bottle": "line_pressure", "supply": "line_pressure", "chamber": "pressure"}

    # Bodies have settled: the contents are those of the volumes at t = 0.
    ambient = 101325.0
    for node, prefix in nodes.items():
        pressure = 10e3 if node == "bottle" else 0.0
        assert inflate[f"{prefix}_{node}"][0] == pytest.approx(pressure, abs=1e-9)
        content = inflate[f"volume_{node}"][0] * (ambient + pressure) / ambient
        assert inflate[f"content_{node}"][0] == pytest.approx(content, rel=1e-14)

    # All columns of the state are continuous, and what flows in and out is the change of content.
    for node, prefix in nodes.items():
        for column in (f"{prefix}_{node}", f"volume_{node}", f"content_{node}"):
            assert vent[column][0] == pytest.approx(inflate[column][-1], rel=1e-12), column
    total, gained = [], []
    for history in (inflate, vent):
        total.append(sum(history[f"content_{node}"] for node in nodes))
        inflow = history["supply_supply"] - history["flow_vent"]
        gained.append(inflow[1:] * np.diff(history["time"]))
    change = np.concatenate(total)[-1] - total[0][0]
    assert change == pytest.approx(np.concatenate(gained).sum(), rel=1e-9)
    assert np.ptp(np.concatenate(total)) > 0.02 * total[0][0]

    # The run in one step has other last increments of 5.2 ms alone.
    for column in ("pressure_chamber", "content_chamber", "line_pressure_bottle", "flow_vent"):
        assert vent[column][-1] == pytest.approx(
            whole[column][-1], abs=1e-3 * np.ptp(whole[column])
        ), column

    with pytest.raises(Interrupted):
        run_steps(TUBE_IN_TWO, out="parts", monitors=[StopAt(8e-3)])
    resumed = run_steps(TUBE_IN_TWO, out="parts", resume=True)
    assert resumed.told.count("is done") == 1
    for step in ("1_inflate", "2_vent"):
        whole_step, parts = (tmp_path / out / step / "history.csv" for out in ("out", "parts"))
        assert whole_step.read_bytes() == parts.read_bytes(), step


def test_a_step_after_a_static_one_begins_at_rest(run_steps):
    """With branches that have relaxed, so that nothing moves until something changes."""
    found = run_steps(UNTIL.format("{column: frame_y, above: 5.003 mm}")).of
    press, hold, let_go = (found[name].history for name in ("press", "hold", "let_go"))
    pressed = press["body_y"][0] - press["body_y"][-1]
    assert pressed > 30e-6
    assert np.ptp(hold["body_y"]) < 1e-4 * pressed
    assert (hold["pressure"] == 8e3).all() and "pressure" not in let_go
    assert hold["time"][0] == press["time"][-1] and let_go["time"][0] == hold["time"][-1]
    assert np.ptp(hold["frame_y"]) == 0.0 and np.ptp(let_go["frame_y"]) > 1e-6

    # It ends where a column reaches a value.
    assert found["let_go"].summary["ended_by"] == "frame_y above its limit"
    assert let_go["frame_y"][-1] > 5.003e-3 >= let_go["frame_y"][-2]
    assert let_go["time"][-1] < let_go["time"][0] + 30e-3


@pytest.mark.parametrize(
    ("reach", "told"),
    [
        ("{column: bodyy, above: 1 mm}", "the history has no column 'bodyy'"),
        ("{column: body_y, above: 1 kPa}", "1 kPa"),
        ("{column: body_y, above: 1 mm, below: 0 mm}", "give one limit: above or below"),
    ],
)
def test_a_column_that_cannot_be_reached_is_refused_at_once(run_steps, tmp_path, reach, told):
    with pytest.raises(SceneError, match=told) as caught:
        run_steps(UNTIL.format(reach))
    assert "steps.yaml:19:" in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_resume_keeps_what_is_done_and_begins_a_changed_step_anew(run_steps, tmp_path):
    out = tmp_path / "out"
    run_steps(PRESSED_AT_REST)
    first, last = (out / name / "history.csv" for name in ("1_press", "3_let_go"))
    written, before = first.stat().st_mtime_ns, last.read_bytes()
    again = run_steps(PRESSED_AT_REST, resume=True)
    assert again.told.count("is done") == 3 and last.read_bytes() == before

    slower = run_steps(PRESSED_AT_REST, "steps.let_go.loads.motor.frequency=50 Hz", resume=True)
    told = "step 'let_go' was computed with another loads.motor.frequency: it is run again"
    assert told in slower.told
    assert "jumps" not in again.told + slower.told
    assert first.stat().st_mtime_ns == written and last.read_bytes() != before

    points = "steps.hold.loads.air.profile.points=[[0 s, 5 kPa], [1 s, 5 kPa]]"
    lower = run_steps(PRESSED_AT_REST, points, resume=True)
    assert (
        "warning: 'air' jumps from 8 to 5 kPa on the facets at the start of the step" in lower.told
    )
    whole = json.loads((out / "summary.json").read_text())
    assert [step["status"] for step in whole["steps"]] == ["done"] * 3
    assert first.stat().st_mtime_ns == written

    # One that fails leaves what was before, and nothing after it, not even of an earlier run.
    with pytest.raises(StabilityError):
        run_steps(PRESSED_AT_REST, "steps.hold.solver.energy_error_limit=1e-15", resume=True)
    whole = json.loads((out / "summary.json").read_text())
    assert whole["status"] == "aborted"
    assert [step["status"] for step in whole["steps"]] == ["done", "aborted", "not begun"]


SLOWER = "steps.let_go.loads.motor.frequency=50 Hz"


def test_steps_taken_from_another_run_give_the_bits_of_a_run_made_whole(run_steps, tmp_path):
    run_steps(PRESSED_AT_REST, out="source")
    run_steps(PRESSED_AT_REST, SLOWER, out="whole")
    source, whole, out = (tmp_path / name for name in ("source", "whole", "out"))
    (out / "1_press").mkdir(parents=True)
    (out / "1_press" / "checkpoint.h5").write_text("of an earlier course")
    found = run_steps(PRESSED_AT_REST, SLOWER, source=source)
    assert "1_press, 2_hold; later steps are not reused: 3_let_go was computed" in found.told
    assert "loads.motor.frequency" in found.told
    assert list(found.of) == ["press", "hold", "let_go"]
    for step in ("1_press", "2_hold", "3_let_go"):
        histories = [(folder / step / "history.csv").read_bytes() for folder in (whole, out)]
        assert histories[0] == histories[1], step
        ends = [read_checkpoint(folder / step / "checkpoint.h5").state for folder in (whole, out)]
        assert ends[0].keys() == ends[1].keys()
        assert all(np.array_equal(ends[0][name], ends[1][name]) for name in ends[0]), step
    assert (out / "3_let_go" / "history.csv").read_bytes() != (
        source / "3_let_go" / "history.csv"
    ).read_bytes()
    assert found.of["hold"].summary["taken_from"] == str(source / "2_hold")
    assert "taken_from" not in found.of["let_go"].summary
    whole_summary = json.loads((out / "summary.json").read_text())
    assert [step["status"] for step in whole_summary["steps"]] == ["done"] * 3

    # It is a run as any other: it is kept, and steps are taken from it.
    assert run_steps(PRESSED_AT_REST, SLOWER, resume=True).told.count("is done") == 3
    third = run_steps(PRESSED_AT_REST, SLOWER, out="third", source=out)
    assert "1_press, 2_hold, 3_let_go\n" in third.told

    def refused(*overrides, **options):
        with pytest.raises(OutputError) as caught:
            run_steps(PRESSED_AT_REST, *overrides, **{"source": source, "out": "new"} | options)
        assert not (tmp_path / "new").exists()
        return str(caught.value)

    assert "1_press was computed with another time.end" in refused("steps.press.time.end=6 ms")
    assert "is not the run folder of a scene with steps" in refused(source=source / "1_press")
    assert "continue it with --resume, or" in refused(out="source")
    assert "continue it with --resume alone" in refused(resume=True)
    first = load_steps(tmp_path / "steps.yaml")[0]
    for named, device, told in (
        ({"1_press": first}, "cuda", "1_press was computed on cpu, this is cuda"),
        ({"1_inflate": first}, "cpu", "it has no folder 1_inflate, only 1_press, 2_hold, 3_let_go"),
    ):
        with pytest.raises(OutputError, match=told):
            fitting_steps(source, named, Choice(device, None))
    summary = source / "1_press" / "summary.json"
    summary.write_text(summary.read_text().replace('"done"', '"interrupted"'))
    assert "1_press is not complete there, but interrupted" in refused()
