"""Richardson's estimate of results whose order is known."""

import pytest

from validation.richardson import estimate

RATIO = 2.0**0.5


@pytest.mark.parametrize("order", [1.0, 2.0, 3.0])
def test_order_and_limit(order):
    results = [7.0 + 0.3 * h**order for h in (2.0, RATIO, 1.0)]
    found = estimate(results, RATIO)
    assert found is not None
    assert found.order == pytest.approx(order, rel=1e-9)
    assert found.value == pytest.approx(7.0, rel=1e-9)


@pytest.mark.parametrize(
    "results",
    [
        (1.0, 2.0, 1.5),
        (1.0, 2.0, 3.5),
        (1.0, 1.0, 1.0),
        (1.0, 2.0, 2.0001),
        (1.0, 2.0, float("nan")),
    ],
    ids=["swings", "runs away", "no difference", "too steep", "missing"],
)
def test_none_where_nothing_converges(results):
    assert estimate(results, RATIO) is None
