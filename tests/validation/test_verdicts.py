"""Judges: what agrees, what disagrees, and what a missing number makes of it."""

import math

import pytest

from validation import verdicts
from validation.cases import Outcome
from validation.statements import CLIMBS
from validation.verdicts import (
    AGREES,
    DISAGREES,
    IN_PART,
    TRIAL,
    UNEXAMINED,
    UNKNOWN,
    Row,
    verdict_of,
)

NAN = math.nan


@pytest.mark.parametrize(
    ("finding", "verdict"),
    [
        (verdicts.within(11.0, 10.0, 0.15), AGREES),
        (verdicts.within(12.0, 10.0, 0.15), DISAGREES),
        (verdicts.within(-9.0, -10.0, 0.15), AGREES),
        (verdicts.within_factor(0.26, 0.5, 2.0), AGREES),
        (verdicts.within_factor(0.24, 0.5, 2.0), DISAGREES),
        (verdicts.between(2.0, 2.0, 3.0), AGREES),
        (verdicts.between(3.1, 2.0, 3.0), DISAGREES),
        (verdicts.below(4.9, 5.0), AGREES),
        (verdicts.below(5.0, 5.0), DISAGREES),
        (verdicts.above(0.1, 0.0), AGREES),
        (verdicts.more_than(0.2, 0.1), AGREES),
        (verdicts.more_than(0.1, 0.1), DISAGREES),
        (verdicts.above(-0.1, 0.0), DISAGREES),
        (verdicts.at_most_share(-0.4, 5.0, 0.1), AGREES),
        (verdicts.at_most_share(0.6, 5.0, 0.1), DISAGREES),
        (verdicts.at_most_share(0.0, -1.0, 0.1), DISAGREES),
        (verdicts.all_between([2.0, 3.0], 2.0, 3.0), AGREES),
        (verdicts.all_between([2.0, 3.1], 2.0, 3.0), DISAGREES),
        (verdicts.rises([1.0, 2.0, 3.0]), AGREES),
        (verdicts.rises([1.0, 1.0, 3.0]), DISAGREES),
        (verdicts.rises([1.0, 0.5, 3.0], resolution=1.0), AGREES),
        (verdicts.rises([1.0, 3.0, 1.5, 4.0], resolution=1.0), DISAGREES),
        (verdicts.rises([1.0, 1.5], resolution=1.0), DISAGREES),
        (verdicts.falls([3.0, 2.0, 1.0]), AGREES),
        (verdicts.falls([3.0, 1.0, 2.0]), DISAGREES),
        (verdicts.some_above([-1.0, 2.0], 1.0), AGREES),
        (verdicts.some_above([-1.0, 1.0], 1.0), DISAGREES),
        (verdicts.highest_at(["a", "b", "c"], [1.0, 3.0, 2.0], ["b", "c"]), AGREES),
        (verdicts.highest_at(["a", "b", "c"], [4.0, 3.0, 2.0], ["b", "c"]), DISAGREES),
    ],
)
def test_numbers_are_judged(finding, verdict):
    assert finding.verdict == verdict


@pytest.mark.parametrize(
    "finding",
    [
        verdicts.within(NAN, 10.0, 0.15),
        verdicts.within(10.0, NAN, 0.15),
        verdicts.between(NAN, 0.0, 1.0),
        verdicts.below(NAN, 1.0),
        verdicts.below(1.0, NAN),
        verdicts.above(NAN, 1.0),
        verdicts.more_than(NAN, 1.0),
        verdicts.more_than(1.0, NAN),
        verdicts.at_most_share(NAN, 1.0, 0.1),
        verdicts.at_most_share(1.0, NAN, 0.1),
        verdicts.all_between([2.0, NAN], 2.0, 3.0),
        verdicts.rises([1.0, NAN, 3.0]),
        verdicts.falls([NAN, NAN]),
        verdicts.some_above([0.5, NAN], 1.0),
        verdicts.some_above([2.0], NAN),
        verdicts.highest_at(["a", "b"], [NAN, NAN], ["a"]),
        verdicts.highest_at(["a", "b"], [1.0, NAN], ["a"]),
        verdicts.highest_at(["a", "b", "c"], [2.0, 1.0, NAN], ["b", "c"]),
    ],
)
def test_what_is_missing_cannot_be_told(finding):
    assert finding.verdict == UNKNOWN


def test_known_numbers_may_contradict_though_others_are_missing():
    assert verdicts.all_between([4.0, NAN], 2.0, 3.0).verdict == DISAGREES
    assert verdicts.rises([3.0, NAN, 1.0]).verdict == DISAGREES
    assert verdicts.falls([1.0, NAN, 3.0]).verdict == DISAGREES
    assert verdicts.highest_at(["a", "b", "c"], [2.0, 1.0, NAN], ["b"]).verdict == DISAGREES
    assert verdicts.some_above([2.0, NAN], 1.0).verdict == AGREES


def test_an_unknown_row_says_why():
    fine, failed = Outcome("a"), Outcome("b", failure="the increment is too long\n  shorten it")
    row = verdicts.row(CLIMBS, "c", "r", verdicts.below(NAN, 1.0), [fine, failed, failed])
    assert (row.verdict, row.computed) == (UNKNOWN, "the increment is too long")
    row = verdicts.row(CLIMBS, "c", "r", verdicts.below(0.5, 1.0, "mm"), [failed])
    assert (row.verdict, row.computed) == (AGREES, "0.5 mm")


def test_missing_numbers_are_shown_as_missing():
    assert verdicts.shown(NAN, "mm") == verdicts.MISSING
    assert verdicts.shown_list([1.0, NAN], "mm") == "1, - mm"


@pytest.mark.parametrize(
    ("found", "verdict"),
    [
        ([], UNEXAMINED),
        ([UNKNOWN], UNKNOWN),
        ([AGREES], AGREES),
        ([AGREES, UNKNOWN], AGREES),
        ([AGREES, UNKNOWN, UNKNOWN], UNKNOWN),
        ([AGREES, DISAGREES, UNKNOWN], IN_PART),
        ([DISAGREES, UNKNOWN, UNKNOWN], DISAGREES),
    ],
)
def test_verdict_on_a_statement_follows_from_its_sub_claims(found, verdict):
    rows = [Row(CLIMBS, "c", "r", "", one) for one in found]
    assert verdict_of(rows) == verdict
    trial = Row(CLIMBS, "c", "r", "", DISAGREES, model=TRIAL)
    assert verdict_of([*rows, trial]) == (verdict if found else UNKNOWN)
