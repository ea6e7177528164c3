"""`python -m validation.published`: all scripts on measurements of others, one page."""

from validation.command import command
from validation.published import rubber_multiaxial, silicone_compression

SCRIPTS = [rubber_multiaxial.SCRIPT, silicone_compression.SCRIPT]

if __name__ == "__main__":
    command(SCRIPTS)
