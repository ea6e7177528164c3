"""Every study that is shipped: it loads, its cases are models, one of them runs for a moment."""

import io
from pathlib import Path

import pytest
from rich.console import Console

from softsim.apps.chain.running import ChainSource, build_chain
from softsim.builder import build_model
from softsim.study.cases import case_key, load_source, resolved
from softsim.study.factors import Interval
from softsim.study.loading import load_study

STUDIES = Path(__file__).parents[1] / "scenes/studies"
ALL = sorted(path.name for path in STUDIES.glob("*.yaml"))


def test_there_are_studies():
    assert {"deflation_rate.yaml", "frequency_pressure.yaml", "friction_uncertainty.yaml",
            "best_cycle.yaml", "tether.yaml"} <= set(ALL)  # fmt: skip


def some_cases(study):
    """Its cases, or, where values are to be sought, one in the middle of each interval."""
    if study.design is not None:
        return study.cases()
    values = {
        name: space.at(0.5) if isinstance(space, Interval) else space[0]
        for name, space in study.search_space.items()
    }
    return [study.case(1, values)]


@pytest.mark.parametrize("name", ALL)
def test_cases_differ_and_are_models(name):
    cases = some_cases(load_study(STUDIES / name))
    assert len({case_key(resolved(case)) for case in cases}) == len(cases)
    for case in {cases[0].number: cases[0], cases[-1].number: cases[-1]}.values():
        loaded = resolved(case)
        if isinstance(case.source, ChainSource):
            assert build_chain(loaded).node_count > 1
            continue
        time = loaded.scene.time
        end_time = build_model(loaded).end_time
        assert end_time < time.end or time.cycles is None  # the cycle ends before


def test_a_case_runs_for_a_moment(tmp_path, kernel_cache, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    (case,) = some_cases(load_study(STUDIES / "best_cycle.yaml"))
    loaded = load_source(case.source, (*case.overrides, "time={end: 2 ms}"))
    results = run(loaded, (), tmp_path, "cpu", console=Console(file=io.StringIO()))
    assert results.summary["status"] == "done"
    assert results.summary["energy_error"] < 0.01
