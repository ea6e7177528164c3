"""What a study's table has columns for, what is drawn of it, and what counts as best in it."""

from dataclasses import dataclass


def column(name: str, unit: str = "") -> str:
    """Heading of a column: "rate [kPa/s]", "passes"."""
    return f"{name} [{unit}]" if unit else name


@dataclass(frozen=True)
class Axis:
    """A factor or a measure. unit: of its column, empty for labels and bare numbers. logarithmic:
    it is spaced, and drawn, so. about: in words, for axes and headings of figures.
    """

    name: str
    unit: str = ""
    is_label: bool = False
    logarithmic: bool = False
    about: str = ""

    @property
    def column(self) -> str:
        """Heading of its column."""
        return column(self.name, self.unit)


@dataclass(frozen=True)
class Plot:
    """A figure: kind is curve, heat_map or scatter; x, y, by, colour are names of axes. by: a curve
    each; colour: what a heat map or the points of a scatter show.
    """

    kind: str
    x: str
    y: str
    by: str | None = None
    colour: str | None = None


@dataclass(frozen=True)
class Goal:
    """What is best: sense is "maximize" or "minimize"; measure names a measure."""

    measure: str
    sense: str
