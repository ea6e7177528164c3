"""Scenes: what a user writes, as a validated tree of values in SI units."""
