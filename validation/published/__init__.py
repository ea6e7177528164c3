"""Measurements of others, predicted: one script per data set, one page.

    python -m validation.published [--quick] [--only NAME]... [--json FILE] [--out DIR]

The docstring of a script is its protocol: which constants from which test, which comparison, which
band. It is committed before the first run, and nothing is adjusted afterwards. The data are read
from `REFERENCE`, which a public clone does not have; a script without its data is skipped.
"""

from pathlib import Path

REFERENCE = Path(__file__).resolve().parents[3] / "shared" / "reference"
MEASURED = REFERENCE / "measured"
