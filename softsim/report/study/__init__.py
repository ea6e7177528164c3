"""Figures and page of a study, from its folder alone."""
