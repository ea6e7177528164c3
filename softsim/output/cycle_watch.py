"""A run that ends with a pressure cycle."""

from collections.abc import Mapping


class CycleWatch:
    """A watch that ends a run when so many pressure cycles are done."""

    name = "cycles"

    def __init__(self, cycles: int) -> None:
        self.cycles = cycles
        self.is_over = False

    def see_row(self, row: Mapping[str, float]) -> None:
        """A row of the history."""
        self.is_over = self.is_over or row["cycles_done"] >= self.cycles
