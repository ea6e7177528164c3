"""Optional scripts that compute published cases with other programs.

python -m validation.published.others.pyelastica_rod
python -m validation.published.others.felupe_membrane

The programs must be installed: `pip install -e '.[test,others]'`. Each script prints a table and
writes a figure to runs/validation/others. No verdict depends on them.
"""

from pathlib import Path

OUT = Path("runs/validation/others")
"""Folder of the figures and of the runs."""
