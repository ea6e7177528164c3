"""Structural components of a model: cables, layers, fibres, ties, cables through eyelets."""
