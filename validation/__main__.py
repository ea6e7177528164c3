"""`python -m validation`: all scripts, one page."""

from validation import inflation_radius, mode1_speed
from validation.command import command

SCRIPTS = [
    inflation_radius.SCRIPT,
    mode1_speed.SCRIPT,
]

if __name__ == "__main__":
    command(SCRIPTS)
