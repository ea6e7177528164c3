"""Equilibrium by Newton's method, and what follows from the tangent stiffness."""
