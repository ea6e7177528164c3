"""Parametric bodies, each a function from dimensions to a mesh with named sets."""
