"""Stable time step: upper bound of the stiffness, its largest eigenvalue, and a schedule."""
