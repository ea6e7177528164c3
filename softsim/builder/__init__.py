"""Builder that turns a scene into a model: it resolves names to objects and numbers.

Errors of a scene beyond its schema are raised here, with the key at which they occur.
"""

from softsim.builder.assembly import build_model

__all__ = ["build_model"]
