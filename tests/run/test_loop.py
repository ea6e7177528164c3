"""Rows of the history and blocks of increments, without a solver."""

import pytest

from softsim.run.loop import increments_to

END = 4e-3


@pytest.mark.parametrize(
    ("due", "time", "dt", "increments"),
    [
        (2e-3, 1.5e-3, 0.3e-3, 1),  # up to 1.8 ms: the next one would end after a corner at 2 ms
        (2e-3, 1.8e-3, 0.3e-3, 0),  # it is written now
        (2e-3, 1.5e-3, 0.25e-3, 2),  # the second one ends there, to round-off
        (2e-3, 2e-3, 0.25e-3, 0),
        (1e-3, 1.1e-3, 0.25e-3, -1),
        (END, 3.5e-3, 0.3e-3, 2),  # the end has a row of its own, not one before it
        (5e-3, 4.5e-3, 0.3e-3, 2),  # a static run that goes on
    ],
)
def test_a_row_shows_what_acted_up_to_the_time_when_it_is_due(due, time, dt, increments):
    assert increments_to(due, time, dt, END) == increments
