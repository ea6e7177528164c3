"""softsim: explicit finite elements for soft robots."""
