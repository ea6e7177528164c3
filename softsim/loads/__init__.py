"""Loads: one file a load."""
