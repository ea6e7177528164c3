"""Builder that turns a scene into a model: it resolves names to objects and numbers.

It needs no Taichi, so `softsim check` answers at once. Errors of a scene beyond its schema are
raised here, with the key at which they occur.
"""

from softsim.builder.assembly import build_model
from softsim.builder.conditions import built_profile

__all__ = ["build_model", "built_profile"]
