"""Meshes: data, reading from files, and checks."""
