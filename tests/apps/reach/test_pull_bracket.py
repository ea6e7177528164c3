"""The bracket of a pull that is known."""

import math

import pytest

from softsim.apps.reach.trials import LEAST, MOST, Bracket, bracket, next_drag, trials_left


def sought(pull: float, ratio: float = 1.2) -> tuple[Bracket, int]:
    """The bracket found of a robot that gets on with less than `pull` [N], and after how many
    trials, which were foretold.
    """
    seen: dict[float, bool] = {}
    foretold = trials_left(seen, ratio)
    while (drag := next_drag(seen, ratio)) is not None:
        assert trials_left(seen, ratio) > 0
        seen[drag] = drag < pull
    assert trials_left(seen, ratio) == 0
    assert len(seen) <= foretold
    return bracket(seen), len(seen)


@pytest.mark.parametrize("pull", [0.012, 0.0717, 0.3, 1.5])
def test_a_pull_lies_in_its_bracket(pull: float) -> None:
    found, trials = sought(pull)
    assert found.low <= pull <= found.high
    assert found.high / found.low <= 1.2
    assert trials == 5
    assert sought(pull, 1.05)[1] == 7


def test_a_pull_out_of_range() -> None:
    """Stronger than what is tried: no upper end. Weaker: it walks without a drag, or not."""
    strong, _ = sought(10.0 * MOST)
    assert math.isinf(strong.high)
    assert strong.low == pytest.approx(MOST, rel=0.2)
    weak, trials = sought(0.1 * LEAST)
    assert weak.low == 0.0
    assert weak.high == pytest.approx(LEAST, rel=0.2)
    assert trials == 6
    assert sought(-1.0)[0] == Bracket(0.0, 0.0)
