"""Figures and tables from a run folder, independent of the solver."""
