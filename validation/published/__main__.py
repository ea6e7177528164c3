"""`python -m validation.published`: all scripts on measurements of others, one page."""

from validation.command import command
from validation.published import rubber_multiaxial

SCRIPTS = [rubber_multiaxial.SCRIPT]

if __name__ == "__main__":
    command(SCRIPTS)
