"""Figures and tables from a run folder; nothing here needs the solver."""
