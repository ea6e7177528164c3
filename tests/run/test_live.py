"""Live view of runs and simulations: same results untouched, pause, steps, sliders, warnings."""

import io
import sys
import threading
import time

import numpy as np
import pytest
from batches import PRESSED_BLOCK
from rich.console import Console

from softsim.errors import SimulationError


@pytest.fixture
def simulate(write_scene, kernel_cache, monkeypatch):
    """A simulation of the pressed block on one thread, with a live view."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim import Simulation
    from softsim.live import view

    opened = []

    def started():
        simulation = Simulation(write_scene(PRESSED_BLOCK), (), "cpu", 1)
        opened.append(view(simulation))
        return simulation, opened[0]

    yield started
    for one in opened:
        one.close()


def wait_for(condition):
    """Wait until a condition holds that another thread brings about."""
    end = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def meanwhile(act):
    """Start a function in a thread of its own, as viser does with its callbacks."""
    thread = threading.Thread(target=act)
    thread.start()
    return thread


@pytest.mark.starts(1)
def test_pause_step_and_sliders_act_between_increments(simulate):
    simulation, shown = simulate()
    controls, panel, run = shown.controls, shown.panel, shown.shown
    assert shown.address.startswith("http://127.0.0.1:")
    assert shown.address in shown._repr_html_()
    run._is_due = lambda now: True  # as if a browser asked for every picture
    simulation.step(10e-3)
    followed = run.sliders["air"].handle.value
    assert followed == pytest.approx(2.0 * 10.0 / 15.0, abs=0.02)  # kPa, on its way down
    assert len(run.curve.rows) == 11 and not simulation.record.warnings
    seen = simulation.history
    simulation.reset()
    simulation._calls.monitors.clear()
    simulation.step(10e-3)
    for name, column in simulation.history.items():  # a view that nobody touches has no effect
        np.testing.assert_array_equal(column, seen[name], err_msg=name)

    simulation.reset()
    simulation.watch(shown)
    run = shown.shown
    panel.set_paused(True)
    times = []

    def act():
        wait_for(lambda: "paused" in panel._state.content)
        times.append(simulation.time)
        controls.step()
        wait_for(lambda: simulation.time > times[0] and controls.holds(simulation.time))
        times.append(simulation.time)
        run.sliders["air"].move(1.5)
        run.sliders["motor"].move(50.0)
        panel.set_paused(False)

    acting = meanwhile(act)
    simulation.step(6e-3)
    acting.join()
    assert times[1] - times[0] == pytest.approx(1e-3, rel=0.1)  # the display interval
    assert simulation.row["pressure"] == pytest.approx(1.5e3, rel=1e-12)
    assert simulation._scenario.term_of(simulation._motors()[0]).rotors[0].frequency == 50.0
    text = "\n".join(simulation.record.warnings.values())
    assert "the load 'air' was changed by hand in the live view" in text and "'motor'" in text
    run.draw()
    assert run.sliders["air"].is_moved
    simulation.reset()  # sliders follow the scene again
    simulation.step(1e-3)
    assert not run.sliders["air"].is_moved
    assert [row["time"] for row in run.curve.rows] == simulation.history["time"].tolist()


def test_without_viser_the_view_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    from softsim.live import LiveView

    with pytest.raises(SimulationError, match="needs the package viser") as refused:
        LiveView()
    assert "pip install 'softsim[live]'" in str(refused.value) and refused.value.exit_code == 2


def test_a_second_view_takes_the_next_port_of_this_machine():
    from softsim.live import LiveView

    with LiveView() as one, LiveView() as other:
        assert one.address != other.address
        for view in (one, other):
            assert view.address.startswith("http://127.0.0.1:")


def test_a_run_with_a_view_has_the_same_files(run, write_scene, tmp_path, monkeypatch):
    from softsim.live import LiveView

    with monkeypatch.context() as without:
        without.setitem(sys.modules, "viser", None)  # not imported by a run without a view
        run(write_scene(PRESSED_BLOCK), out=tmp_path / "plain", threads=1)
    with LiveView() as shown:
        monkeypatch.setattr("softsim.live.RunView._is_due", lambda self, now: True)
        viewed = run(write_scene(PRESSED_BLOCK), out=tmp_path / "live", threads=1, monitors=[shown])
        assert "ended" in shown.panel._state.content
    plain, live = (tmp_path / name / "history.csv" for name in ("plain", "live"))
    assert plain.read_bytes() == live.read_bytes()
    assert not any("by hand" in text for text in viewed.summary["warnings"])


def test_a_run_changed_by_hand_says_so_in_its_summary(run, write_scene, tmp_path):
    from softsim.live import LiveView

    with LiveView() as shown:
        shown.panel.set_paused(True)  # before the kernels are compiled: held at the start

        def act():
            wait_for(lambda: shown.shown is not None)
            shown.shown.sliders["air"].move(1.0)
            shown.panel.set_paused(False)

        acting = meanwhile(act)
        found = run(write_scene(PRESSED_BLOCK), out=tmp_path / "run", threads=1, monitors=[shown])
        acting.join()
    assert found.history["pressure"][5:] == pytest.approx(1e3, rel=1e-12)
    [text] = [w for w in found.summary["warnings"] if "by hand" in w]
    assert text.startswith("t = 0 s: the load 'air' was changed by hand in the live view")
    assert text in (tmp_path / "run" / "run.log").read_text()


@pytest.fixture
def run_steps(write_scene, kernel_cache, monkeypatch, tmp_path):
    """Run three steps of the pressed block into a folder of that name: results by step."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run_steps as run_them
    from softsim.scene.steps import load_steps

    times = "".join(f"  {name}: {{time: {{end: 2 ms}}}}\n" for name in ("press", "hold", "release"))
    text = PRESSED_BLOCK.replace("time: {end: 20 ms}\n", "") + "steps:\n" + times

    def quiet(out, *overrides, **options):
        options = {"console": Console(file=io.StringIO())} | options
        steps = load_steps(write_scene(text), overrides)
        return run_them(steps, tmp_path / out, "cpu", threads=1, **options)

    return quiet


class Hand:
    """Monitor that sets the pressure in a live view before the first block of the given steps."""

    def __init__(self, shown, *starts):
        self.shown, self.starts = shown, starts

    def start(self, run):
        self.shown.start(run)
        if any(abs(run.model.start_time - start) < 1e-4 for start in self.starts):
            self.shown.shown.sliders["air"].move(1.0)

    def update(self, run, signals):
        self.shown.update(run, signals)


def test_each_step_starts_the_view_anew_and_inherits_warnings(run_steps, tmp_path):
    from softsim.live import LiveView

    def by_hand(results):
        return {
            name: [w for w in found.summary["warnings"] if "by hand" in w]
            for name, found in results.items()
        }

    with LiveView() as shown:
        found = by_hand(run_steps("changed", monitors=[Hand(shown, 2e-3, 4e-3)]))
        assert shown.shown.run.scenario.time == pytest.approx(6e-3)
        assert shown.shown.curve.rows[0]["time"] >= 4e-3 * 0.99
    first, second = found["release"]
    assert first.startswith("t = 0.002")
    assert second.startswith("t = 0.004")
    assert "the load 'air' was changed by hand in the live view" in first
    assert found == {"press": [], "hold": [first], "release": [first, second]}
    assert first in (tmp_path / "changed/3_release/run.log").read_text()

    faster = "steps.release.loads.motor.frequency=120 Hz"
    taken = run_steps("taken", faster, source=tmp_path / "changed")
    assert "taken_from" in taken["hold"].summary and "taken_from" not in taken["release"].summary
    assert by_hand(taken) == {"press": [], "hold": [first], "release": [first]}


class Broken:
    """Monitor that raises an error in an update after a time [s]."""

    def __init__(self, after):
        self.after, self.calls = after, 0

    def start(self, run):
        pass

    def update(self, run, signals):
        self.calls += 1
        if run.scenario.time > self.after:
            raise ValueError("cannot reshape array")


class BrokenAtStart(Broken):
    """Monitor that raises an error at its start."""

    def start(self, run):
        raise KeyError("edges")


def test_a_run_goes_on_without_a_monitor_that_fails(run, write_scene, tmp_path):
    plain = run(write_scene(PRESSED_BLOCK), out=tmp_path / "plain", threads=1)
    monitors = [BrokenAtStart(0.0), Broken(8e-3), Broken(1.0)]
    found = run(write_scene(PRESSED_BLOCK), out=tmp_path / "run", threads=1, monitors=monitors)
    assert found.summary["status"] == "done"
    for name, column in plain.history.items():
        np.testing.assert_array_equal(found.history[name], column, err_msg=name)
    early, late, whole = (monitor.calls for monitor in monitors)
    assert early == 0 < late < whole
    first, second = (w for w in found.summary["warnings"] if "Broken" in w)
    assert "BrokenAtStart failed and no longer follows the run, which continues" in first
    assert "KeyError('edges')" in first and "ValueError('cannot reshape array')" in second
    logged = (tmp_path / "run/run.log").read_text()
    assert 'raise ValueError("cannot reshape array")' in logged  # with the place in the code


def test_a_simulation_goes_on_without_a_monitor_that_fails(simulate):
    simulation, _ = simulate()
    broken = Broken(3e-3)
    simulation.watch(broken)
    simulation.step(6e-3)
    assert simulation.time >= 6e-3
    [text] = simulation.record.warnings.values()
    assert "ValueError('cannot reshape array')" in text and text.startswith("t = 0.00")
    calls = broken.calls
    simulation.step(1e-3)
    assert broken.calls == calls
