"""Analysis of a run: measures, motion, passage through a pipe."""
