"""Entry point of `python -m softsim.cli`, for systems without the installed script."""

from softsim.cli import main

main()
