"""Finite elements: one file an element."""
