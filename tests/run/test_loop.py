"""Blocks of increments and callbacks between them, without a solver."""

from types import SimpleNamespace

import pytest

from softsim.run.loop import Callback, Run, increments_to

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


class Noted(Callback):
    """Callback that notes when it acts."""

    def __init__(self, name, left, notes):
        self.name, self.left, self.notes = name, left, notes

    def increments_left(self):
        return self.left

    def before_block(self):
        self.notes.append(f"{self.name} before")

    def check_block(self):
        self.notes.append(f"{self.name} checks")

    def act(self):
        self.notes.append(f"{self.name} acts")


def test_a_block_ends_where_the_first_callback_has_to_act():
    """At the start callbacks act in order; after a block all check before the first acts."""
    loaded = SimpleNamespace(scene=SimpleNamespace(output=None))
    run = Run(SimpleNamespace(model=None, loaded=loaded), None, None, None, None)
    notes = []
    run.stepping = SimpleNamespace(next_block=lambda longest: longest, is_complete=lambda: False)
    run.callbacks = [Noted("a", 7, notes), Noted("b", 5, notes), Callback()]
    run.act()
    assert notes == ["a acts", "b acts"]
    notes.clear()
    assert run.next_block() == 5
    run.end_block()
    assert notes == ["a before", "b before", "a checks", "b checks", "a acts", "b acts"]
    assert not run.finished and run.callback(Noted).name == "a"
