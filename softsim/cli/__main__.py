"""`python -m softsim.cli`: the command where no script is installed."""

from softsim.cli import main

main()
