"""Observers of a run: what they write is the run folder."""
