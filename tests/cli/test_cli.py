"""The command line as a user types it: exit codes, places, no tracebacks."""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest

from softsim.output.folder import claimed

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10}
time: {end: 1 ms}
"""


STUDY = """
scene: scene.yaml
factors: {time: {key: time.end, values: [1 ms, 2 ms]}}
measures: {error: {of: energy_error}}
"""


def test_in_a_process_of_its_own(write_scene, kernel_cache):
    """Exit code, table and error where they belong, and no traceback."""

    def softsim(*arguments):
        return subprocess.run(
            [sys.executable, "-m", "softsim.cli", *map(str, arguments)],
            capture_output=True, text=True, timeout=120, check=False,
            env=os.environ | {"SOFTSIM_CACHE": kernel_cache},
        )  # fmt: skip

    done = softsim("check", write_scene(SCENE), "--no-duration")
    assert (done.returncode, done.stderr) == (0, "") and "8 triangles" in done.stdout
    done = softsim("check", write_scene(SCENE), "--set", "time.end=-1 s")
    assert (done.returncode, done.stdout) == (2, "") and len(done.stderr.splitlines()) < 5
    assert "--set" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.starts(1)
def test_run_and_report(softsim, write_scene, tmp_path):
    done = softsim("run", write_scene(SCENE), "--out", tmp_path / "out", "--device", "cpu")
    assert done.exit_code == 0, done.stderr
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "done"
    assert (tmp_path / "out" / "energies.png").stat().st_size > 5000
    written = [tmp_path / "out" / name for name in ("energies.png", "report.html")]
    for file in written:
        file.unlink()
    assert softsim("report", tmp_path / "out").exit_code == 0
    assert all(file.exists() for file in written)


@pytest.mark.physics
def test_each_step_has_a_folder_with_its_report(softsim, write_scene, tmp_path):
    steps = "steps: {first: {time: {end: 1 ms}}, then: {time: {end: 2 ms}}}"
    scene, out = write_scene(SCENE.replace("time: {end: 1 ms}", steps)), tmp_path / "out"
    checked = softsim("check", scene, "--no-duration")
    assert checked.exit_code == 0 and "step 2 of 2: then" in checked.stdout
    done = softsim("run", scene, "--out", out, "--device", "cpu", "--no-report")
    assert done.exit_code == 0, done.stderr
    assert softsim("report", out).exit_code == 0
    pages = [out / folder / "report.html" for folder in ("1_first", "2_then", ".")]
    assert all(page.stat().st_size > 5000 for page in [*pages, out / "steps.png"])
    refused = softsim("sweep", write_scene(STUDY, "study.yaml"), "--out", tmp_path / "study")
    assert refused.exit_code == 2 and "needs a scene without steps" in refused.stderr


def test_steps_are_taken_only_by_a_scene_that_has_some(softsim, write_scene, tmp_path):
    done = softsim("run", write_scene(SCENE), "--from", tmp_path, "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert f"--from {tmp_path}" in done.stderr.replace("\n", "") and "has no steps" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def finished(softsim, tmp_path_factory):
    """The scene and the folder of a run."""
    place = tmp_path_factory.mktemp("finished")
    (place / "scene.yaml").write_text(SCENE)
    done = softsim("run", place / "scene.yaml", "--out", place / "out", "--device", "cpu")
    assert done.exit_code == 0, done.stderr
    return place / "scene.yaml", place / "out"


@pytest.mark.parametrize("name", ["summary.json", "scene.resolved.yaml", "results.vtkhdf"])
@pytest.mark.starts(1)
def test_a_report_tells_a_damaged_file(softsim, finished, tmp_path, name):
    out = shutil.copytree(finished[1], tmp_path / "out")
    whole = (out / name).read_bytes()
    (out / name).write_bytes(whole[: len(whole) // 2] + b"\n: {[")
    done = softsim("report", out)
    assert done.exit_code == 2
    message, hint = done.stderr.splitlines()
    assert name in message and "run" in hint


@pytest.mark.starts(1)
def test_a_refusal_draws_nothing(softsim, finished):
    """A folder that another process works in keeps the figures of its run as they are."""
    scene, out = finished
    before = {file: file.stat().st_mtime_ns for file in out.glob("*.*")}
    with claimed(out):
        done = softsim("run", scene, "--out", out, "--device", "cpu")
    assert (done.exit_code, done.stdout) == (2, "")
    assert f"process {os.getpid()} on" in done.stderr and len(done.stderr.splitlines()) == 2
    assert {file: file.stat().st_mtime_ns for file in before} == before


def test_a_report_of_nothing_is_refused(softsim, tmp_path):
    done = softsim("report", tmp_path / "none")
    assert done.exit_code == 2
    assert "is not the folder of a run or a study" in done.stderr


@pytest.mark.parametrize(
    "expect, exit_code", [("", 0), ("expect: {body_displacement: {min: 1 m}}\n", 5)]
)
@pytest.mark.physics
def test_a_profile_is_printed_whatever_the_scene_expects(
    softsim, write_scene, tmp_path, expect, exit_code
):
    scene = write_scene(SCENE + expect)
    done = softsim("run", scene, "--profile", "--out", tmp_path / "out", "--device", "cpu")
    assert done.exit_code == exit_code, done.stderr
    for word in (
        "elements",
        "not part of a pass",
        "whole increment",
        "inspections",
        "figures",
        "page",
    ):
        assert word in done.stdout, word


@pytest.mark.physics
def test_figures_and_page_can_be_left_for_later(softsim, write_scene, tmp_path):
    out = tmp_path / "out"
    done = softsim("run", write_scene(SCENE), "--no-report", "--out", out, "--device", "cpu")
    assert done.exit_code == 0, done.stderr
    assert not [*out.glob("*.png"), *out.glob("*.html")]
    later = f"softsim report {out}"
    assert later in done.stdout and later in (out / "run.log").read_text()


@pytest.mark.physics
def test_compile_stores_the_large_kernels_of_a_run(write_scene, tmp_path):
    scene, environment = write_scene(SCENE), os.environ | {"SOFTSIM_CACHE": str(tmp_path / "new")}
    options = [scene, "--device", "cpu", "--threads", "1"]

    def call(*arguments):
        command = [sys.executable, "-m", "softsim.cli", *map(str, arguments)]
        done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True)
        assert done.returncode == 0, done.stderr
        sizes = {path.name: path.stat().st_size for path in (tmp_path / "new").glob("*.tic")}
        return done.stdout.decode(), sizes

    text, compiled = call("compile", *options)
    assert re.search(r"kernels ready after \d+\.\d s", text) and str(tmp_path / "new") in text
    _, after_run = call("run", *options, "--no-report")
    assert compiled.keys() <= after_run.keys()
    assert sum(compiled.values()) > 0.9 * sum(after_run.values()) > 0.0


@pytest.mark.starts(1)
def test_check_says_size_step_and_duration(softsim, write_scene):
    done = softsim("check", write_scene(SCENE), "--device", "cpu", "--threads", "1")
    assert done.exit_code == 0, done.stderr
    said = re.sub(r"\s+", " ", done.stdout)
    for word in ("8 triangles", "stable step", "limited by element", "expected about",
                 "M element updates/s (cpu, 1 thread)", "loads, supports and contact loads none",
                 "no warnings"):  # fmt: skip
        assert word in said, word


@pytest.mark.physics
def test_check_tells_natural_modes(softsim, write_scene, tmp_path):
    scene = write_scene(SCENE.replace("dragon_skin_10}", "dragon_skin_10, fixed: [left]}"))
    options = ["--no-duration", "--modes", "2", "--out", tmp_path, "--device", "cpu"]
    done = softsim("check", scene, *options)
    assert done.exit_code == 0, done.stderr
    said = re.sub(r"\s+", " ", done.stdout)
    for word in ("natural modes of 'b': 3 nodes held (fixed or tied); relative error of the",
                 "static stiffness dynamic effective mass largest motion at",
                 "mode Hz ratio Hz x y % mm set", "1.00, 0.00 bottom", "no warnings"):  # fmt: skip
        assert word in said, word
    assert (tmp_path / "modes.png").stat().st_size > 5000


def test_a_check_whose_trial_run_is_stopped_ends_with_that(softsim, write_scene, monkeypatch):
    from softsim.run import pilot

    found = pilot.Duration(1.0, 1.0, 1.0, 1.0, 100, 1e6, 1, 0.5, "element 3 of 'b' is crushed")
    monkeypatch.setattr(pilot, "predicted_duration", lambda *_, **__: found)
    done = softsim("check", write_scene(SCENE), "--device", "cpu")
    assert done.exit_code == 3
    assert "warning: element 3 of 'b' is crushed" in done.stdout
    assert done.stdout.endswith(": the trial run was stopped by a guard, see above\n")


@pytest.mark.parametrize("options", [["--modes", "0"], ["--out", "figures"]])
def test_a_check_of_no_modes_has_no_figure(softsim, write_scene, options):
    done = softsim("check", write_scene(SCENE), *options)
    assert done.exit_code == 2 and "--modes" in done.stderr


def test_check_prints_every_set_of_a_mesh_file_and_what_reading_changed(
    softsim, write_scene, tmp_path
):
    (tmp_path / "ring.inp").write_text(
        "*NODE\n1, 1, 0\n2, 2, 0\n3, 2, 1\n4, 1, 1\n"
        "*ELEMENT, TYPE=CAX3, ELSET=half\n1, 1, 3, 2\n2, 1, 3, 4\n"
        "*NSET, NSET=foot\n1, 2\n*SURFACE, NAME=bore\n2, S3\n*MATERIAL, NAME=rubber\n*STEP\n"
    )
    text = SCENE.replace("{generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm}",
                         "{file: ring.inp}")  # fmt: skip
    text = text.replace("plane_strain, thickness: 1 mm", "axisymmetric")
    done = softsim("check", write_scene(text), "--no-duration")
    assert done.exit_code == 0, done.stderr
    said = re.sub(r"\s+", " ", done.stdout)
    for words in ("foot (2)", "bore (2)", "half (4)", "surface (4)", "bore (1)",
                  "cell sets all (2), half (2)", "1 inverted cells turned",
                  "ignored in mesh files body 'b' *MATERIAL rubber, *STEP"):  # fmt: skip
        assert words in said, words


SECOND_ORDER = "*NODE\n1, 0, 0\n*ELEMENT, TYPE=C3D10\n1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1\n"
TWICE = (
    "*NODE\n1, 1, 0\n2, 2, 0\n3, 2, 1\n4, 2, 1\n5, 1, 1\n"
    "*ELEMENT, TYPE=CAX3\n1, 1, 2, 3\n2, 1, 4, 5\n"
)
MIXED = (
    "*NODE\n1, 1, 0, 0\n2, 2, 0, 0\n3, 2, 1, 0\n4, 1, 1, 1\n"
    "*ELEMENT, TYPE=CPE3\n1, 1, 2, 3\n*ELEMENT, TYPE=C3D4\n2, 1, 2, 3, 4\n"
)
LOOSE = "*NODE\n1, 1, 0\n2, 2, 0\n3, 2, 1\n9, 5, 5\n*ELEMENT, TYPE=CAX3\n1, 1, 2, 3\n"
EMPTY = "*NODE\n1, 1, 0\n2, 2, 0\n3, 2, 1\n*ELEMENT, TYPE=CAX3\n1, 1, 2, 3\n*NSET, NSET=none\n"


@pytest.mark.parametrize(
    ("deck", "named"),
    [
        (LOOSE, "node 9"),
        (SECOND_ORDER, "C3D10"),
        (TWICE, "are at the same place"),
        (MIXED, "C3D4"),
        (EMPTY, "'none'"),
    ],
    ids=["unconnected node", "second order", "duplicate nodes", "mixed dimensions", "empty set"],
)
def test_a_mesh_that_cannot_be_used_exits_with_2(softsim, write_scene, tmp_path, deck, named):
    (tmp_path / "ring.inp").write_text(deck)
    text = SCENE.replace("{generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm}",
                         "{file: ring.inp}")  # fmt: skip
    done = softsim(
        "check", write_scene(text.replace("plane_strain, thickness: 1 mm", "axisymmetric"))
    )
    assert done.exit_code == 2
    assert named in done.stderr, done.stderr


@pytest.mark.parametrize("command", ["run", "check"])
@pytest.mark.parametrize(
    "override",
    ["time.end=-1 s", "time.end=5", "tme.end=1 s", "bodies.b.thickness=3 kPa",
     "bodies.b.material=rubbr", "bodies.b.fixed=[botom]", "time.increment=1 s"],
)  # fmt: skip
def test_bad_values_exit_with_2_and_no_traceback(softsim, write_scene, command, override):
    done = softsim(command, write_scene(SCENE), "--set", override)
    assert done.exit_code == 2
    assert "--set" in done.stderr


def test_the_place_is_named(softsim, write_scene):
    path = write_scene(SCENE.replace("1 ms", "-1 ms"))
    done = softsim("check", path)
    assert done.exit_code == 2
    assert re.search(rf"{re.escape(str(path))}:5:\d+", done.stderr)


def test_a_missing_file(softsim, tmp_path):
    done = softsim("run", tmp_path / "none.yaml")
    assert done.exit_code == 2


@pytest.mark.parametrize("command", ["run", "check"])
@pytest.mark.parametrize("threads", ["0", "many", "10000"])
def test_threads_that_do_not_fit_exit_with_2(softsim, write_scene, tmp_path, command, threads):
    done = softsim(command, write_scene(SCENE), "--threads", threads)
    assert done.exit_code == 2
    assert f"--threads {threads}" in done.stderr
    assert re.search(r"on this machine|or less", done.stderr)


def test_an_absent_gpu_is_no_silent_fallback(softsim, write_scene, tmp_path):
    from softsim.compute import machine

    if machine.cuda_device_count():
        pytest.skip("this machine has a CUDA device")
    done = softsim("run", write_scene(SCENE), "--device", "cuda", "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "CUDA" in done.stderr


def test_schemas_are_json(softsim):
    scene = json.loads(softsim("schema").stdout)
    study = json.loads(softsim("schema", "study").stdout)
    assert "bodies" in scene["properties"] and "factors" in study["properties"]


def test_devices(softsim):
    from softsim.compute.machine import processor

    said = softsim("devices", "--seconds", "0").stdout
    assert "auto selects" in said
    assert processor().name in re.sub(r"\s+", " ", said)
    assert "M/s" not in said


@pytest.mark.slow
def test_devices_measures_the_processor(softsim):
    done = softsim("devices", "--seconds", "1")
    assert done.exit_code == 0, done.stderr
    assert len(re.findall(r"\d M/s", done.stdout)) >= 2


def test_light_commands_do_not_import_taichi(write_scene):
    """Commands that compute no forces, and errors in a scene's text or in the options."""
    scene, study = str(write_scene(SCENE)), str(write_scene(STUDY, "study.yaml"))
    commands = [
        ["--help"], ["check", scene, "--set", "time.end=-1 s"], ["check", scene, "--threads", "0"],
        ["devices", "--seconds", "0"], ["sweep", study, "--batch", "0"], ["optimize", "none.yaml"],
    ]  # fmt: skip
    code = (
        "import sys; from softsim.cli import app\n"
        f"for arguments in {commands!r}:\n"
        "    try: app(arguments)\n"
        "    except SystemExit: pass\n"
        "    assert 'taichi' not in sys.modules, arguments"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


PIPE = """\
environment:
  walls:
    pipe: {kind: pipe_path, diameter: 36 mm, start: [-24.8 mm, 0 mm], pipe: [{straight: 90 mm}]}
output: {frame_interval: 1 ms}
"""


@pytest.mark.physics
def test_assess_prints_the_verdict_and_tells_scripts(softsim, write_scene, tmp_path):
    layout, out = write_scene(PIPE), tmp_path / "out"
    done = softsim("assess", layout, "--out", out, "--device", "cpu", "--set", "time.end=4 ms")
    assert done.exit_code == 5, done.stderr
    assert "1  straight 90 mm" in done.stdout
    went = "unfinished: the centre of the robot moved 0 of 49 mm from start to goal in 0.0 s"
    assert f"{went}; it is in segment 1 (straight 90 mm) at 25 mm" in done.stdout
    assert (
        "closest to the verdict stuck: 0 of 2" in done.stdout
        and "friction: coefficient" in done.stdout
    )
    assert "verdict passed, found unfinished" in done.stderr
    assert (out / "layout.png").stat().st_size > 5000


@pytest.mark.parametrize(
    "robot, layout, said",
    [
        ("snake", PIPE, ["--robot snake", "there is no robot 'snake'", "pfr"]),
        ("pfr", PIPE.replace("pipe_path", "pipe_way"), [":3:18", "'pipe_way' is unknown here"]),
        ("pfr", "title: nothing\n", ["needs a wall of kind pipe_path"]),
    ],
)
def test_assess_refuses(softsim, write_scene, tmp_path, robot, layout, said):
    done = softsim("assess", write_scene(layout), "--robot", robot, "--out", tmp_path / "out")
    assert done.exit_code == 2
    for words in said:
        assert words in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "tether, said",
    [
        ("mass_per_length: 0 g/m", [":6:30", "must be greater than 0 g/m"]),
        ("friction_coefficient: [-0.5, 0.75]", [":6:36", "-0.5 must be at least 0"]),
    ],
)
def test_reach_refuses(softsim, write_scene, tmp_path, tether, said):
    layout = write_scene(PIPE + f"trailed:\n            {tether}\n")
    done = softsim("reach", layout, "--out", tmp_path / "out")
    assert done.exit_code == 2
    for words in said:
        assert words in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.physics
def test_sweep_lists_its_cases_without_running_them(softsim, write_scene, tmp_path):
    write_scene(SCENE)
    study, out = write_scene(STUDY, "study.yaml"), tmp_path / "out"
    done = softsim("sweep", study, "--dry-run", "--out", out, "--set", "bodies.b.thickness=2 mm")
    assert done.exit_code == 0, done.stderr
    assert "time [ms]" in done.stdout and "2 cases, 0 of them stored, 2 to run" in done.stdout
    assert re.search(r"cost at most [\d.e-]+ core hours, .*: 2 runs of at most \d", done.stdout)
    assert (
        "increments each, estimated from a short trial run of case 1 over 100 % of" in done.stdout
    )
    assert not out.exists()


@pytest.mark.parametrize(
    "options, said",
    [
        (["--batch", "few"], "--batch few"),
        (["--set", "time.nd=2 s"], "--set time.nd"),
        (["--scheduler", "nowhere"], "no dask scheduler responds at nowhere"),
    ],
)
def test_sweep_refuses(softsim, write_scene, tmp_path, options, said):
    write_scene(SCENE)
    done = softsim(
        "sweep", write_scene(STUDY, "study.yaml"), "--out", tmp_path, "--device", "cpu", *options
    )
    assert done.exit_code == 2
    assert said in done.stderr


def test_sweep_refuses_very_many_cases_unless_they_are_meant(softsim, write_scene, tmp_path):
    write_scene(SCENE)
    text = STUDY.replace("values: [1 ms, 2 ms]", "range: [1 ms, 2 ms], count: 10001")
    done = softsim("sweep", write_scene(text, "study.yaml"), "--out", tmp_path / "out")
    assert done.exit_code == 2 and "--yes" in done.stderr and "10,001 cases" in done.stderr
    assert not (tmp_path / "out").exists()


def test_the_version_is_told(softsim):
    import softsim as package

    assert softsim("--version").stdout.split() == ["softsim", package.__version__]


def test_a_live_view_needs_its_extra(softsim, write_scene, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    ran = softsim("run", write_scene(SCENE), "--live", "--out", tmp_path / "run")
    assert ran.exit_code == 2 and "pip install 'softsim[live]'" in ran.stderr
    assert not (tmp_path / "run").exists()  # refused before anything is written


@pytest.mark.physics
def test_a_live_view_prints_its_address_and_ends_with_the_run(softsim, write_scene, tmp_path):
    ran = softsim("run", write_scene(SCENE), "--live", "--no-report", "--out", tmp_path / "run")
    assert ran.exit_code == 0 and "live view: http://127.0.0.1:" in ran.output
    assert "viser" not in ran.output
