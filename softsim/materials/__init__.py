"""Constitutive laws: one file a law, written as plain arithmetic that numpy and Taichi both run."""
