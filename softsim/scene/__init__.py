"""Scenes: input files of the user, as a validated tree of values in SI units."""
