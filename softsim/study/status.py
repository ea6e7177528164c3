"""What became of a case."""

DONE = "done"
"""Its run ended."""

FAILED = "failed"
"""A guard stopped it, or it is no scene."""

PRUNED = "pruned"
"""The optimiser stopped it."""

LOST = "lost"
"""Its process died, each time that it was tried."""

WAITING = "waiting"
"""It was not run yet."""
