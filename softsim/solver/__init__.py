"""Explicit solver: time integration, stable step, energy balance and guards."""
