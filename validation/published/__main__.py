"""`python -m validation.published`: all scripts on measurements of others, one page."""

from validation.command import command
from validation.script import Script

SCRIPTS: list[Script] = []

if __name__ == "__main__":
    command(SCRIPTS)
