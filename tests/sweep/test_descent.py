"""Optimisations by derivatives: of a formula, and of a beam whose tip is to reach a place."""

import json

import numpy as np
import pytest
from trial_stand_ins import optimized

from softsim.errors import SceneError
from softsim.study.cases import DONE, FAILED
from softsim.study.loading import load_study
from softsim.sweep.trials import RANGE, Descent

STATIC = """
bodies:
  b: {mesh: {generator: block, length: 8 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: soft, fixed: [left]}
materials: {soft: {law: neo_hooke, C10: 60 kPa, density: 1000 kg/m^3}}
loads: {push: {kind: nodal_force, nodes: b.right, direction: [0, -1],
               profile: {kind: ramp, value: 2 mN, duration: 1 s}}}
environment: {gravity: 0 m/s^2}
output: {history_interval: 0.5 s, probes: {tip: {kind: displacement, nodes: b.right}}}
time: {end: 1 s, procedure: static}
"""

STUDY = """
scene: static.yaml
factors:
  modulus: {key: materials.soft.C10, range: [20 kPa, 100 kPa]}
  push: {key: loads.push.profile.value, log_range: [0.5 mN, 10 mN]}
measures:
  half: {of: tip_y, take: last, to: 0.5 s, unit: mm}
  full: {of: tip_y, take: last, to: 1 s, unit: um}
optimize: {match: {half: -0.6 mm, full: -900 um}, scale: {half: 1 mm}, method: gradient, trials: 40}
"""


@pytest.fixture
def descent_file(write_scene):
    """A study by derivatives."""
    write_scene(STATIC, "static.yaml")
    return write_scene(STUDY, "study.yaml")


def tip(modulus: float, push: float) -> tuple[np.ndarray, np.ndarray]:
    """Return tip_y (2,) [m] at both times, and its derivatives (2, 2) over modulus and push, SI."""
    x, y = modulus / 60e3, push / 2e-3
    places = -1e-3 * np.array([0.3 * y / x, 0.6 * y**0.5 / x**2])
    over_x = -1e-3 * np.array([-0.3 * y / x**2, -1.2 * y**0.5 / x**3])
    over_y = -1e-3 * np.array([0.3 / x, 0.3 * y**-0.5 / x**2])
    return places, np.column_stack([over_x / 60e3, over_y / 2e-3])


def formula(jobs):
    """`tip` as the result of runs."""
    for job in jobs:
        values = job.case.values
        places, slopes = tip(1e3 * values["modulus"], 1e-3 * values["push"])
        paths = ("materials.soft.C10", "loads.push.profile.value")
        found = [
            {"time": t, "of": {p: {"tip_y": s} for p, s in zip(paths, row, strict=True)}}
            for t, row in zip((0.5, 1.0), slopes.tolist(), strict=True)
        ]
        summary = {"status": "done", "derivatives": found}
        (job.folder / "summary.json").write_text(json.dumps(summary))
        half, full = places.tolist()
        rows = f"time,tip_y\ns,m\n0,0\n0.5,{half!r}\n1.0,{full!r}\n"
        (job.folder / "history.csv").write_text(rows)
    return [None for _ in jobs]


def test_the_gradient_is_that_of_the_objective(descent_file):
    """Over the scaled factors, one of them logarithmic, against central differences."""
    study = load_study(descent_file)
    [column] = [m for m in study.measures if m.name == "mismatch"]
    descent = Descent(study, column, "minimize")

    def objective(x):
        values = descent.case(1, x).values
        places, slopes = tip(1e3 * values["modulus"], 1e-3 * values["push"])
        paths = ("materials.soft.C10", "loads.push.profile.value")
        summary = {
            "derivatives": [
                {"time": t, "of": {p: {"tip_y": s} for p, s in zip(paths, row, strict=True)}}
                for t, row in zip((0.5, 1.0), slopes, strict=True)
            ]
        }
        history = {"time": np.array([0.5, 1.0]), "tip_y": places}
        return descent.value(x, summary, history)

    x = np.array([3.0, 6.0])
    slopes = [(objective(x + step)[0] - objective(x - step)[0]) / 2e-4 for step in 1e-4 * np.eye(2)]
    assert objective(x)[1] == pytest.approx(slopes, rel=1e-6)


def test_it_starts_at_the_scene_and_asks_for_derivatives(descent_file):
    study = load_study(descent_file)
    descent = Descent(study, study.measures[-1], "minimize")
    start = descent.start()
    assert start == pytest.approx([0.5 * RANGE, RANGE * np.log(4.0) / np.log(20.0)])
    case = descent.case(1, start)
    assert case.values == pytest.approx({"modulus": 60.0, "push": 2.0})
    assert case.overrides[-1] == (
        'output.derivatives={parameters: ["materials.soft.C10", "loads.push.profile.value"], '
        "at: [0.5 s, 1.0 s]}"
    )


def test_the_optimum_is_found_and_continued(descent_file, tmp_path):
    """Both measures match at x = 0.96, y = 1.92; repeated, it finds its stored trials."""
    few, said = optimized(descent_file, tmp_path / "out", formula, count=3)
    assert len(few) == 3 and "not converged within 3 trials" in said
    table, said = optimized(descent_file, tmp_path / "out", formula)
    assert table.head(3)["key"].to_list() == few["key"].to_list()
    assert "converged after" in said and len(table) < 25
    best = table.sort("mismatch").row(0, named=True)
    assert best["mismatch"] < 1e-6
    assert best["half [mm]"] == pytest.approx(-0.6, rel=2e-3)
    assert best["full [um]"] == pytest.approx(-900.0, rel=2e-3)


def test_a_failed_trial_ends_it(descent_file, tmp_path):
    """The objective has no value there; what was found before is kept."""

    def faulty(jobs):
        formula(jobs)
        return [SceneError("limit point") if job.case.number == 3 else None for job in jobs]

    table, said = optimized(descent_file, tmp_path / "out", faulty)
    assert table["status"].to_list() == [DONE, DONE, FAILED]
    assert "3 trials, trial 3 failed: limit point" in said


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("range: [20 kPa, 100 kPa]", "values: [20 kPa, 30 kPa]", "needs a range without a count"),
        ("range: [20 kPa, 100 kPa]", "range: [20 kPa, 100 kPa], count: 5", "needs a range without"),
        ("of: tip_y, take: last, to: 0.5 s", "of: tip_y, take: max", "needs take: last of a"),
        ("{of: tip_y, take: last, to: 0.5 s, unit: mm}", "{of: energy_error, take: last}",
         "needs a derivative, unlike energy_error"),
        ("trials: 40", "trials: 40, prune: {}", "leave prune out"),
        ("to: 0.5 s, ", "", "some measures of the objective have a time"),
    ],
)  # fmt: skip
def test_what_has_no_derivative_is_refused(descent_file, tmp_path, old, new, message):
    text = STUDY.replace(old, new)
    if "energy_error" in new:
        text = text.replace("half: -0.6 mm, ", "half: 1, ").replace(", scale: {half: 1 mm}", "")
    descent_file.write_text(text)
    with pytest.raises(SceneError) as caught:
        optimized(descent_file, tmp_path / "out", formula)
    assert message in f"{caught.value.message} {caught.value.hint}"


@pytest.mark.physics
def test_a_beam_reaches_its_place(descent_file, tmp_path, kernel_cache, monkeypatch):
    """The modulus with which the tip sinks by 0.3 mm under 2 mN, in a few runs of one solver."""
    from softsim.sweep.job import simulate

    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    descent_file.write_text(
        """
scene: static.yaml
factors: {modulus: {key: materials.soft.C10, range: [20 kPa, 100 kPa]}}
measures: {full: {of: tip_y, take: last, unit: mm}}
optimize: {match: {full: -0.3 mm}, method: gradient, trials: 12}
"""
    )
    table, said = optimized(descent_file, tmp_path / "out", simulate, device="cpu")
    assert "converged" in said
    assert table.sort("mismatch")["full [mm]"][0] == pytest.approx(-0.3, rel=1e-3)
