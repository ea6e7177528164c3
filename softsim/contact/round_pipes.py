"""Straight pipes of circular section in space."""

from dataclasses import dataclass

import numpy as np

from softsim.sharing import Own


@dataclass(frozen=True)
class RoundPipes:
    """Round pipes, free inside: names, points on the axes (p, 3), unit axes (p, 3), radii (p,)
    [m].
    """

    names: tuple[str, ...]
    points: Own[np.ndarray]
    axes: Own[np.ndarray]
    radii: Own[np.ndarray]

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Signed gap (n,) [m] of places x (n, 3) to each pipe, by its name."""
        found = {}
        for name, point, axis, radius in zip(
            self.names, self.points, self.axes, self.radii, strict=True
        ):
            across = (x - point) - np.outer((x - point) @ axis, axis)
            found[name] = radius - np.linalg.norm(across, axis=1)
        return found

    @property
    def stored_numbers(self) -> int:
        """None in a table."""
        return 0

    def touched_at_once(self) -> tuple[float, float]:
        """All of them, perhaps from the same side."""
        return len(self.names), float(len(self.names))

    def drawn(self) -> dict[str, np.ndarray]:
        """A point on the axis, its direction and the radius of each."""
        return {"pipes": np.concatenate([self.points, self.axes, self.radii[:, None]], axis=1)}
