"""From a scene to a model: the only place where names become objects and numbers.

Needs no Taichi: `softsim check` answers at once. Whatever is wrong with a scene beyond its schema
is said here, at the key that says it.
"""

from softsim.builder.assembly import build_model
from softsim.builder.materials import library_material, library_names
from softsim.builder.profiles import built_profile

__all__ = ["build_model", "built_profile", "library_material", "library_names"]
