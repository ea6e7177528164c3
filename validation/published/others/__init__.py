"""The same cases computed by other programs, which must be installed: optional scripts.

python -m validation.published.others.pyelastica_rod
python -m validation.published.others.felupe_membrane

Each prints a table and writes a figure to runs/validation/others. They judge nothing: their figures
show how far programs differ from each other.
"""

from pathlib import Path

OUT = Path("runs/validation/others")
"""Folder of the figures and of the runs."""
