"""Which values of a constant fit a statement."""

import numpy as np

from validation.admitted import NOTHING, Condition, admitted, told, told_of
from validation.statements import CONTACT_ROWS

VALUES = np.array([1.0, 2.0, 3.0, 4.0, 5.0])


def condition(measured):
    return Condition(CONTACT_ROWS, "name", "claim", "reference", measured, 2.0, 3.0, "N")


def test_ranges_of_what_fits():
    fits = admitted(condition(lambda value: [value]), VALUES)
    assert fits.tolist() == [False, True, True, False, False]
    assert told(fits, VALUES) == "2.00 to 3.00"
    assert told(~fits, VALUES) == "1.00 to 1.00 and 4.00 to 5.00"
    assert told(np.zeros(5, dtype=bool), VALUES) == NOTHING


def test_all_numbers_must_fit():
    assert not admitted(condition(lambda value: [2.5, value]), VALUES)[3:].any()


def test_what_is_not_known_does_not_fit():
    unknown = condition(lambda value: [2.5, np.nan])
    assert not admitted(unknown, VALUES).any()
    assert unknown.shown(1.0) == "2.5, - ?"
    assert condition(lambda value: [9.0, np.nan]).shown(1.0) == "9, - x"


def test_ends_that_cannot_be_told_are_open():
    assert told_of(condition(lambda value: [value]), VALUES) == "2.00 to 3.00"
    assert told_of(condition(lambda value: [value if value > 1.0 else np.nan]), VALUES) == (
        "up to 3.00"
    )
    assert told_of(condition(lambda value: [0.5 * value]), VALUES) == "from 4.00"
    assert told_of(condition(lambda value: [2.5]), VALUES) == "all told, 1.00 to 5.00"
