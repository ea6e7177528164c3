"""The table of verification results: each test records what it compared; pytest prints it last.

Under pytest-xdist every worker hands its rows to the one that reports.
"""

import pytest

COLLECTED: list[list] = []


@pytest.fixture
def record_verification(request):
    """Record a comparison: case, exact and computed value, observed order of convergence or None.

    The relative error is (computed - exact) / exact; where exact is zero, the computed value.
    """

    def record(case: str, exact: float, computed: float, order: float | None = None) -> None:
        error = (computed - exact) / exact if exact else computed
        # Plain floats: what pytest-xdist sends between processes.
        row = [case, float(exact), float(computed), float(error), order and float(order)]
        request.node.user_properties.append(("verification", row))

    return record


def pytest_runtest_logreport(report):
    if report.when == "call":
        COLLECTED.extend(row for name, row in report.user_properties if name == "verification")


def pytest_terminal_summary(terminalreporter):
    if not COLLECTED:
        return
    terminalreporter.section("verification")
    width = max(len(row[0]) for row in COLLECTED)
    terminalreporter.write_line(
        f"{'case':{width}}  {'exact':>12}  {'computed':>12}  {'error':>9}  order"
    )
    for case, exact, computed, error, order in sorted(COLLECTED):
        shown = "" if order is None else f"{order:5.2f}"
        terminalreporter.write_line(
            f"{case:{width}}  {exact:12.6g}  {computed:12.6g}  {100 * error:8.3f}%  {shown}"
        )
