"""How the thesis's pipes look in every figure."""

from typing import Any

from softsim.report.style import BLUE, GREEN, ORANGE

LOOKS: dict[int, dict[str, Any]] = {
    30: {"color": BLUE, "marker": "o"},
    36: {"color": ORANGE, "marker": "s"},
    41: {"color": GREEN, "marker": "^"},
}
"""Pipe [mm] -> what matplotlib's plot takes."""
