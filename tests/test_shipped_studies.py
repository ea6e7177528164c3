"""Every study that is shipped: it loads, and its first case runs for a moment."""

import io
from pathlib import Path

import pytest
from rich.console import Console

from softsim.study.loading import load_study
from softsim.study.resolution import case_key, load_source, resolved
from softsim.study.spacing import Interval

STUDIES = Path(__file__).parents[1] / "scenes/studies"
ALL = sorted(path.name for path in STUDIES.glob("*.yaml"))
MOMENT = ("time={end: 2 ms}", "expect={}")


def test_there_are_studies():
    assert {"deflation_rate.yaml", "frequency_pressure.yaml", "friction_uncertainty.yaml",
            "best_cycle.yaml"} <= set(ALL)  # fmt: skip


def first_cases(study):
    """All cases, or, where values are to be sought, one in the middle of each interval."""
    if study.design is not None:
        return study.cases()
    values = {
        name: space.at(0.5) if isinstance(space, Interval) else space[0]
        for name, space in study.search_space.items()
    }
    return [study.case(1, values)]


@pytest.mark.parametrize("name", ALL)
def test_cases_differ_and_run_for_a_moment(name, tmp_path, kernel_cache, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    cases = first_cases(load_study(STUDIES / name))
    assert len({case_key(resolved(case)) for case in cases}) == len(cases)
    loaded = load_source(cases[0].source, (*cases[0].overrides, *MOMENT))
    results = run(loaded, (), tmp_path, "cpu", console=Console(file=io.StringIO()))
    assert results.summary["status"] == "done"
    assert results.summary["energy_error"] < 0.01
