"""Every scene that is shipped: it loads, builds, and runs for a moment."""

import io
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

SCENES = Path(__file__).parents[1] / "scenes"
ALL = sorted(p.name for p in SCENES.glob("*.yaml"))
# The others differ from these in numbers, or take long to compile.
PHYSICS = {
    "bellows.yaml", "first_look.yaml", "leafbot5.yaml", "pfr_30mm_3d.yaml",
    "pfr_36mm_air_line.yaml", "pneunet.yaml", "skin_inflation_rings.yaml", "spike_patch.yaml",
    "tendon_finger.yaml", "terrain_step.yaml", "worm.yaml",
}  # fmt: skip


def in_its_tier(name: str):
    """Return a scene with the marker of its tier: the main job belongs to the default one."""
    if name == "pfr_36mm.yaml":
        return pytest.param(name, marks=pytest.mark.starts(1))
    return name if name in PHYSICS else pytest.param(name, marks=pytest.mark.slow)


def test_there_are_scenes():
    assert {"pfr_30mm.yaml", "pfr_36mm.yaml", "pfr_41mm.yaml", "pfr_mode1.yaml", "pfr_mode2.yaml",
            "pfr_vertical_hold.yaml", "first_look.yaml"} <= set(ALL)  # fmt: skip


@pytest.mark.parametrize("name", [in_its_tier(name) for name in ALL])
def test_runs_for_a_moment(name, tmp_path, kernel_cache, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    results = run(
        SCENES / name,
        # Static scenes too: settling takes longer than a moment and has tests of its own. What a
        # scene expects, it expects of its whole run.
        ["time.end=4 ms", "time.procedure=dynamic", "time.method=null", "time.settle=null",
         "expect={}"],
        tmp_path,
        "cpu",
        console=Console(file=io.StringIO()),
    )  # fmt: skip
    assert results.summary["status"] == "done"
    assert results.summary["energy_error"] < 0.01
    place = "frame_x" if "frame_displacement" in results.summary else "body_x"
    assert np.isfinite(results.history[place]).all()


@pytest.mark.parametrize("path", sorted(SCENES.glob("steps/*.yaml")), ids=lambda path: path.stem)
def test_steps_run_for_a_moment(path, tmp_path, kernel_cache, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run_steps
    from softsim.scene.steps import load_steps

    steps = load_steps(path, ["time.end=2 ms", "time.procedure=dynamic"])
    found = run_steps(steps, tmp_path, "cpu", console=Console(file=io.StringIO()))
    assert list(found) == [step.name for step in steps] and len(steps) > 1
    for results in found.values():
        assert results.summary["status"] == "done" and results.summary["energy_error"] < 0.01


@pytest.mark.skipif(shutil.which("gmsh") is None, reason="gmsh is not installed")
def test_the_mesh_of_the_worm_is_what_its_script_makes(tmp_path):
    """Its triangles may differ between versions of gmsh, its sets may not."""
    shipped, found = meshes_of_script("worm", tmp_path)
    assert found.node_sets.keys() == shipped.node_sets.keys()
    for name, nodes in shipped.node_sets.items():
        for extreme in (np.min, np.max):
            places = (
                extreme(mesh.points[mesh.node_sets[name]], axis=0) for mesh in (shipped, found)
            )
            np.testing.assert_allclose(*places, atol=1e-9)
        assert len(found.node_sets[name]) == pytest.approx(len(nodes), rel=0.1)


def meshes_of_script(name, folder):
    """Return the shipped mesh of a scene and that which gmsh makes of its script."""
    from softsim.mesh.reading import read_mesh

    made = folder / f"{name}.msh"
    subprocess.run(["gmsh", "-2", SCENES / f"{name}.geo", "-o", made], check=True)
    return tuple(read_mesh(path).mesh for path in (SCENES / f"{name}.msh", made))


@pytest.mark.slow
def test_vertical_hold(tmp_path):
    """Once inflated and at rest, 5 s in a vertical pipe without creep: less than 1 um."""
    from softsim.run import run

    results = run(SCENES / "pfr_vertical_hold.yaml", out=tmp_path, device="cpu")
    t, x = results.history["time"], results.history["frame_x"]
    assert abs(x[-1] - x[np.searchsorted(t, 2.5)]) < 1e-6


@pytest.mark.slow
def test_mode_3_in_the_36_mm_pipe(tmp_path):
    """It stands at full pressure, at less than a hundredth of its mean speed while the pressure
    falls, and moves forward in both cycles.
    """
    from softsim.run import run

    results = run(SCENES / "pfr_36mm.yaml", out=tmp_path, device="cpu")
    t, x = results.history["time"], results.history["frame_x"]
    hold = (t > 1.2) & (t < 2.0)
    walked = results.summary["displacement_while_falling"][0]
    falling = (23e3 - 11e3) / 1.3e3  # s
    assert np.ptp(x[hold]) / np.ptp(t[hold]) < 0.01 * walked / falling
    assert min(results.summary["displacement_per_cycle"]) > 5e-3
    assert results.summary["energy_error"] < 0.01


@pytest.mark.slow
def test_leafbot_x5_turns_away_from_the_motor_that_runs(tmp_path):
    """Its left motor alone is the mirror image of the right one, but for round-off in contact."""
    from softsim.run import run

    tracks = []
    for side in ("right", "left"):
        changes = ["time.end=0.3 s", f"loads.motor.acts_on={side}"]
        results = run(SCENES / "leafbot_x5.yaml", changes, tmp_path / side, "cpu")
        tracks.append(results.summary["track"])
    to_left, to_right = tracks
    assert 0.5 < to_left["turning_rate"] < 1.1  # rad/s
    assert to_left["curvature"] > 15.0  # 1/m
    assert to_right["turning_rate"] == pytest.approx(-to_left["turning_rate"], rel=0.02)
    assert to_right["curvature"] == pytest.approx(-to_left["curvature"], rel=0.02)
    forward = to_left["forward_displacement"]
    assert to_right["forward_displacement"] == pytest.approx(forward, rel=1e-3)


@pytest.mark.slow
def test_worm(tmp_path):
    """It comes forward in each cycle of its valves, and neither end slips back by a third of it."""
    from softsim.run import run

    results = run(SCENES / "worm.yaml", out=tmp_path, device="cpu")
    history, period = results.history, 0.4
    ends = [np.searchsorted(history["time"], k * period) for k in (1, 2)]
    walked = np.diff([history["body_y"][k] for k in (*ends, -1)])
    assert (walked > 2.5e-3).all()
    for end in ("tip_y", "tail_y"):
        after = history[end][ends[0] :]
        assert (np.maximum.accumulate(after) - after).max() < 0.5 * walked.min()
    supplied = np.trapezoid(history["supply_pump"], history["time"])
    leaked = sum(
        np.trapezoid(history[f"flow_leak_{part}"], history["time"])
        for part in ("rear", "middle", "front")
    )
    assert supplied > leaked > 10e-6
    assert results.summary["energy_error"] < 1e-3
