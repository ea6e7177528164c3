"""Taichi as softsim uses it: fields, nodes, terms, mass scaling, and the machine."""
