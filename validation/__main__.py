"""`python -m validation`: all scripts, one page."""

from validation import deflation_rate, displacement, inflation_radius, mode1_speed, mode2_speed
from validation.command import command

SCRIPTS = [
    inflation_radius.SCRIPT,
    mode1_speed.SCRIPT,
    mode2_speed.SCRIPT,
    displacement.SCRIPT,
    deflation_rate.SCRIPT,
]

if __name__ == "__main__":
    command(SCRIPTS)
