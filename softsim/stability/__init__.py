"""The stable time step: an upper bound of the stiffness, its largest eigenvalue, a schedule."""
