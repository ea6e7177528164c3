"""Meshes: what they are, how they are read, what makes one fit to compute with."""
