"""The values that trials get, and which of them are stopped early."""

import json
import pickle
from functools import partial
from itertools import islice

import numpy as np
import optuna
import pytest
from falling_block import BLOCK
from trial_stand_ins import optimized

from softsim.builder import build_model
from softsim.errors import OutputError, SceneError
from softsim.scene.loading import load_scene
from softsim.study.cases import DONE, FAILED
from softsim.study.factors import Interval
from softsim.study.loading import load_study
from softsim.study.measures import MeasureColumn
from softsim.study.schema import Prune
from softsim.sweep.optimisation import RANGE, START, Descent, PruningCondition, Trials

SPACE = {
    "rate": Interval(1.0, 100.0, logarithmic=True),
    "count": Interval(1, 4, is_whole=True),
    "level": (8.0, 2.0, 4.0, 6.0),
    "pipe": ("30 mm", "36 mm"),
}


@pytest.fixture
def trials(tmp_path):
    """Of four factors of different kinds."""
    return Trials(tmp_path, SPACE, MeasureColumn("speed", of="speed"), "maximize", seed=1)


def test_the_first_trials_lie_evenly(trials):
    """Of eight points a half each in each half of every factor."""
    found = [trial.values for trial in trials.to_run(START)]
    assert sum(values["rate"] < 10.0 for values in found) == START // 2
    assert sum(values["count"] <= 2 for values in found) == START // 2
    assert sorted(values["level"] for values in found) == [2, 2, 4, 4, 6, 6, 8, 8]
    assert sum(values["pipe"] == "30 mm" for values in found) == START // 2


def test_later_trials_go_where_good_ones_were(trials):
    """Good is what is in the 36 mm pipe at high levels."""
    for trial in trials.to_run(40):
        good = trial.values["level"] * (1.0 + (trial.values["pipe"] == "36 mm"))
        trials.tell(trial.number, good)
    late = [trial.values for trial in trials.ended()][-20:]
    assert sum(values["pipe"] == "36 mm" for values in late) > 15
    assert sum(values["level"] for values in late) / 20 > 6.0
    assert all(type(values["count"]) is int and 1 <= values["rate"] <= 100 for values in late)


def test_trials_in_flight_are_taken_up(trials, tmp_path):
    """As they were: the journal has their values."""
    begun = list(islice(trials.to_run(5), 3))
    again = Trials(tmp_path, SPACE, MeasureColumn("speed", of="speed"), "maximize", seed=1)
    assert list(again.to_run(3)) == begun and again.is_open(3)
    for trial in begun:
        again.tell(trial.number, None)
    assert not again.is_open(3) and list(again.ended()) == begun


def test_another_major_version_of_optuna_is_refused(trials, tmp_path, monkeypatch):
    assert trials.study.user_attrs["optuna"] == optuna.__version__
    monkeypatch.setattr(optuna, "__version__", "99.0.0")
    with pytest.raises(OutputError, match=r"started with optuna .* this is optuna 99\.0\.0"):
        Trials(tmp_path, SPACE, MeasureColumn("speed", of="speed"), "maximize", seed=1)


END = 10e-3
COLUMN = MeasureColumn("way", "mm", of="body_displacement", size=1e-3)
SPEED = MeasureColumn("speed", "mm/s", of="mean_speed", size=1e-3)  # a block has no frame


@pytest.fixture
def runs(tmp_path):
    """Of one factor, the way of a block, made up; it should be long."""
    return Trials(tmp_path, {"rate": Interval(1.0, 2.0)}, COLUMN, "maximize", seed=1)


@pytest.fixture
def condition_of(tmp_path, write_scene):
    """The condition of a trial, as a worker makes it for the model of its run."""

    def make(number, column=COLUMN, scene=BLOCK, **prune):
        settings = Prune(**{"after_trials": 2, "after_share": 0.4, **prune})
        given = partial(PruningCondition, tmp_path, number, column, settings)
        model = build_model(load_scene(write_scene(scene)))
        return pickle.loads(pickle.dumps(given))(model)

    return make


def seen(condition, speed, rows=100):
    """Show the rows of a block that goes at `speed` [m/s] until the condition ends the run; the
    share of it that was seen.
    """
    for k in range(rows + 1):
        share = k / rows
        condition.see_row({
            "time": END * share, "body_x": speed * END * share, "body_y": 0.0,
            "rows_in_contact": 0.0, "slip_share": 0.0, "wall_force_normal": 0.0,
            "cycles_done": 0.0, "contact_area": 0.0,
        })  # fmt: skip
        if condition.is_over:
            break
    return share


def finished(runs, condition_of, *speeds):
    """Trials that ran to their end."""
    for trial, speed in zip(runs.to_run(len(speeds)), speeds, strict=True):
        assert seen(condition_of(trial.number), speed) == 1.0
        runs.tell(trial.number, 1e3 * speed * END)


def test_a_trial_worse_than_the_median_is_stopped(runs, condition_of):
    """After two finished ones, of 1 and 3 m/s, and not before 40 % of its run."""
    finished(runs, condition_of, 1.0, 3.0)
    worse, better = runs.to_run(4)
    assert seen(condition_of(worse.number), 1.9) == pytest.approx(0.4)
    assert seen(condition_of(better.number), 2.1) == 1.0
    reported = runs.study.trials[better.number - 1].intermediate_values
    assert list(reported) == list(range(10, 100, 10))
    assert reported[50] == pytest.approx(1e3 * 2.1 * 0.5 * END)


def test_the_first_trials_are_not_stopped(runs, condition_of):
    finished(runs, condition_of, 3.0, 1.0)


def test_a_measure_that_is_not_there_yet_stops_nothing(runs, condition_of):
    finished(runs, condition_of, 1.0, 3.0)
    (trial,) = runs.to_run(3)
    assert seen(condition_of(trial.number, SPEED), 0.0) == 1.0
    assert runs.study.trials[trial.number - 1].intermediate_values == {}


def test_a_run_that_goes_on_shows_its_rows_again(runs, condition_of, recwarn):
    finished(runs, condition_of, 1.0, 3.0)
    (trial,) = runs.to_run(3)
    assert seen(condition_of(trial.number), 1.9) == pytest.approx(0.4)
    assert seen(condition_of(trial.number), 1.9) == pytest.approx(0.5)
    assert not [w for w in recwarn if "already reported" in str(w.message)]


def test_tenths_are_those_of_the_cycles(condition_of):
    """Half of two cycles is done while the time that they may take has hardly begun."""
    air = """
loads:
  air: {kind: follower_pressure, facets: [block.top],
        profile: {kind: table, points: [[0 s, 0 Pa], [1 ms, 2 Pa], [2 ms, 1 Pa], [3 ms, 2 Pa],
                                        [9 ms, 1 Pa]]}}
"""
    condition = condition_of(1, scene=BLOCK.replace("10 ms}", "10 ms, cycles: 2}") + air)
    assert condition.share({"time": 3e-3, "cycles_done": 1.0}) == 0.5
    assert condition.share({"time": 6e-3, "cycles_done": 1.0}) == pytest.approx(6.0 / 9.0)


def test_pruned_trials_are_told(runs):
    (trial,) = runs.to_run(1)
    runs.tell(trial.number, None, pruned=True)
    assert runs.study.trials[0].state.name == "PRUNED"
    assert [one.number for one in runs.ended()] == [1] and next(runs.ended()) == trial


# -------------------------------------------------------------------------------------------------
# Optimisation by the derivatives of the measures.

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
