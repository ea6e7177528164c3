"""A boundary found by bisection: what is asked, what is known of it, what is no bisection."""

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsim.errors import SceneError
from softsim.study.bisection import (
    FOUND,
    NOT_MONOTONE,
    OUTSIDE,
    ROUNDING,
    UNDECIDED,
    Bisection,
    boundary,
    runs_left,
)
from softsim.study.factors import Interval
from softsim.study.loading import describe, load_study


def sought(low=5.0, high=25.0, tolerance=2.0, share=0.5, repeats=1, **spacing):
    return Bisection(
        "height", "passed", share, tolerance, Interval(low, high, **spacing), repeats
    )  # fmt: skip


def answered(asked, result):
    """The boundary that a sweep finds, and the answers; result(level, repeat) is the measure."""
    answers = {}
    runs, most = 0, asked.most_runs
    while levels := (found := boundary(asked, answers)).asked:
        assert runs + runs_left(asked, answers) <= most  # what is left at most never grows
        most = runs + runs_left(asked, answers)
        for level in levels:
            held = answers.setdefault(level, [])
            further = range(len(held), len(held) + asked.missing(held))
            held += [result(level, repeat) for repeat in further]
            runs += len(further)
    assert runs <= most <= asked.most_runs
    return found, answers


@given(
    edge=st.floats(5.0, 25.0, exclude_min=True, exclude_max=True),
    tolerance=st.floats(0.01, 19.0), rising=st.booleans(), logarithmic=st.booleans(),
)  # fmt: skip
def test_the_edge_lies_in_a_bracket_as_narrow_as_the_tolerance(
    edge, tolerance, rising, logarithmic
):
    asked = sought(tolerance=tolerance, logarithmic=logarithmic)
    found, answers = answered(asked, lambda level, _: float((level > edge) is rising))
    assert found.state == FOUND and found.high - found.low <= tolerance
    assert found.low <= edge <= found.high
    assert len(answers) <= asked.most_runs
    if not logarithmic:  # as many halvings as the width has factors of two
        assert asked.most_runs <= 2 + math.ceil(math.log2(20.0 / tolerance) + 1e-3)


def test_ends_that_answer_alike_ask_the_middle_and_no_more():
    found, answers = answered(sought(), lambda *_: 1.0)
    assert (found.state, list(answers)) == (OUTSIDE, [5.0, 25.0, 15.0])
    found, _ = answered(sought(), lambda level, _: float(level == 15.0))
    assert found.state == NOT_MONOTONE


def test_whole_numbers_stay_whole():
    found, answers = answered(
        sought(1, 9, 1, is_whole=True), lambda level, _: float(level < 6)
    )  # fmt: skip
    assert (found.low, found.high) == (5, 6)
    assert all(float(level).is_integer() for level in answers)


VALUES = st.lists(st.sampled_from([0.0, 0.25, 1.0, None]), min_size=1, max_size=12)


@given(values=VALUES, share=st.sampled_from([0.1, 0.3, 0.5, 0.9]))
@settings(max_examples=300)
def test_repeats_stop_when_the_answer_of_all_is_sure(values, share):
    """What the repeats that were asked say is what all say; one fewer would not have told."""
    asked, seen = sought(share=share, repeats=len(values)), []
    while (missing := asked.missing(seen)) > 0:
        seen += values[len(seen) : len(seen) + missing]
    known = [value for value in values if value is not None]
    if not known:
        assert asked.reached(seen) is None and len(seen) == len(values)
        return
    assert asked.reached(seen) == (sum(known) >= share * len(known) - ROUNDING)
    assert asked.reached(seen[:-1]) is None


def test_of_ten_repeats_that_agree_half_settle_it():
    asked = sought(repeats=10)
    _, answers = answered(asked, lambda level, _: float(level < 12.0))
    assert {level: len(held) for level, held in answers.items()} == {
        5.0: 5, 25.0: 6, 15.0: 6, 10.0: 5, 12.5: 6, 11.25: 5,
    }  # fmt: skip


def test_a_level_where_all_runs_fail_ends_the_search():
    found, answers = answered(
        sought(repeats=3), lambda level, _: None if level == 15.0 else float(level < 12.0)
    )
    assert found.state == UNDECIDED and answers[15.0] == [None] * 3
    found, _ = answered(
        sought(repeats=3), lambda level, repeat: None if repeat == 0 else float(level < 12.0)
    )
    assert found.state == FOUND  # two others tell


STUDY = """\
scene: block.yaml
factors:
  friction: {key: contact.friction_coefficient, values: [0.2, 0.4, 0.6]}
  thick: {key: bodies.block.thickness, range: [5 mm, 25 mm]}
design: {kind: bisection, factor: thick, measure: slips, tolerance: 2 mm}
measures:
  slips: {of: slip_share}
  moved: {of: body_displacement, unit: mm}
"""


@pytest.fixture
def load(folder):
    def load_text(old="", new=""):
        assert old in STUDY
        Path("study.yaml").write_text(STUDY.replace(old, new, 1), encoding="utf-8")
        return load_study("study.yaml")

    return load_text


def test_a_study_asks_round_by_round(load):
    study = load()
    assert study.case_count == 3 * 6 and study.plots == ()
    first = study.cases()
    assert [(c.number, *c.values.values()) for c in first] == [
        (1, 0.2, 5.0), (2, 0.2, 25.0), (3, 0.4, 5.0), (4, 0.4, 25.0), (5, 0.6, 5.0), (6, 0.6, 25.0),
    ]  # fmt: skip
    rounds = list(  # edges at 12 and 24 mm, and at 36, outside
        study.rounds(lambda case: float(case.values["thick"] > 60.0 * case.values["friction"]))
    )
    cases = [case for one in rounds for case in one.cases]
    assert [case.number for case in cases] == list(range(1, 16))
    assert [one.left for one in rounds] == [18, 9, 6, 4, 2]
    assert cases[6].overrides == (
        "contact.friction_coefficient=0.2", "bodies.block.thickness=15 mm",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "place", "message"),
    [
        ("factor: thick", "factor: thik", "5:35", "there is no factor 'thik' to bisect"),
        ("range: [5 mm, 25 mm]", "values: [5 mm, 25 mm]", "4:3", "needs a continuous range"),
        ("25 mm]}", "25 mm], count: 5}", "4:3", "needs a continuous range"),
        ("range: [5 mm, 25 mm]", "range: [5 mm]", "4:47", "range"),
        ("key: bodies.block.thickness, range: [5 mm, 25 mm]", "variants: {a: {title: x}}",
         "4:3", "needs a continuous range"),
        ("values: [0.2, 0.4, 0.6]", "range: [0.2, 0.6]", "3:3", "friction: with a bisection"),
        ("measure: slips", "measure: slps", "5:51", "there is no measure 'slps'"),
        ("measure: slips", "measure: moved", "5:51", "moved is not between 0 and 1"),
        ("tolerance: 2 mm", "tolerance: 0 mm", "5:69", "must be greater than 0"),
        ("tolerance: 2 mm", "tolerance: -2 mm", "5:69", "must be greater than 0"),
        ("tolerance: 2 mm", "tolerance: 2 cm", "5:69", "there is nothing to bisect"),
        ("tolerance: 2 mm", "tolerance: 2", "5:69", "unit"),
        ("tolerance: 2 mm", "tolerance: 2 s", "5:69", "'2 s'"),
        ("tolerance: 2 mm", "tolerance: 1e-7 mm", "5:69", "too fine a tolerance"),
        ("tolerance: 2 mm", "tolerance: 2 mm, share: 1.0", "5:82", "must be less than 1"),
        (", tolerance: 2 mm", "", "5:1", "'tolerance' is missing"),
    ],
)  # fmt: skip
def test_what_cannot_be_bisected_is_refused(load, old, new, place, message):
    with pytest.raises(SceneError) as refused:
        load(old, new)
    assert f"study.yaml:{place}" in str(refused.value), str(refused.value)
    assert message in str(refused.value)


def test_a_preview_says_what_is_sought_and_assumed(load):
    told = dict(describe(load()))
    assert told["thick [mm]"] == "5 to 25, continuous"
    assert told["design"] == (
        "bisection: where slips crosses 0.5 as thick increases, to within 2 mm, assumed to happen "
        "once; in 3 cells at most 18 cases"
    )
