"""How fast softsim is: `python -m benchmarks`. Not part of the installed package."""
