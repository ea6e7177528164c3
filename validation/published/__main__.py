"""`python -m validation.published`: all scripts on measurements of others, one page."""

from validation.command import command
from validation.published import (
    ds10_beam,
    falling_rod,
    flat_strip,
    rubber_multiaxial,
    silicone_compression,
    soft_tentacle,
    spa_membranes,
)

SCRIPTS = [
    rubber_multiaxial.SCRIPT,
    silicone_compression.SCRIPT,
    spa_membranes.SCRIPT,
    soft_tentacle.SCRIPT,
    ds10_beam.SCRIPT,
    flat_strip.SCRIPT,
    falling_rod.SCRIPT,
]

if __name__ == "__main__":
    command(SCRIPTS)
