"""Loads on nodes, facets and rigid bodies: one module for each kind."""
