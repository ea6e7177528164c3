"""What every plot of a study marks: the best case, and the cases that have no result."""

from textwrap import fill
from typing import Any

import numpy as np
import polars
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from softsim.report.study.findings import Findings
from softsim.report.study.scale import Scale
from softsim.report.study.wording import BEST, best_in_words
from softsim.report.style import QUIET, RED
from softsim.study.cases import FAILED, LOST, PRUNED

LEGEND_ROOM = 100
"""Characters of a line of the legend, with what stands before its entries."""

CROWD = 60.0
"""Marks along an edge from which on they let each other shine through."""

STAR: dict[str, Any] = {"marker": "*", "markersize": 13.0, "color": RED, "markeredgecolor": "white"}

WITHOUT_RESULT = {"failed": ([FAILED, LOST], "x", RED), "pruned": ([PRUNED], "|", QUIET)}
"""Word -> statuses, marker and colour of cases that have no result."""


def mark_best(axes: Axes, findings: Findings, x: Scale, y: Scale) -> None:
    """A star where the best design point lies, and what it is in the legend."""
    if findings.best is None:
        return
    place = [scale.place(findings.best.values[scale.axis.column]) for scale in (x, y)]
    axes.plot(*place, linestyle="", zorder=6, clip_on=False, label=best_label(findings), **STAR)


def best_label(findings: Findings) -> str:
    """The best design point, as it fits in a legend."""
    return fill(best_in_words(findings), LEGEND_ROOM - 10)


def mark_without_result(axes: Axes, findings: Findings, x: Scale) -> None:
    """Small marks along the lower edge where cases failed or were pruned."""
    for word, (statuses, marker, colour) in WITHOUT_RESULT.items():
        cases = findings.table.filter(polars.col("status").is_in(statuses))
        places = x.places(cases[x.axis.column])
        places = places[np.isfinite(places)]
        if len(places):
            look: dict[str, Any] = {"marker": marker, "color": colour, "markersize": 4.5}
            axes.plot(
                places, np.full(len(places), 0.015), linestyle="", clip_on=False, zorder=5,
                alpha=min(1.0, CROWD / len(places)), transform=axes.get_xaxis_transform(), **look,
            )  # fmt: skip
            axes.plot([], [], linestyle="", label=f"{cases.height} {word}", **look)


def say_if_empty(axes: Axes, places: np.ndarray) -> None:
    """Where nothing can be drawn, say so."""
    if not np.isfinite(places).any():
        axes.set_yticks([])
        axes.text(
            0.5, 0.5, "no case has a result yet", transform=axes.transAxes, ha="center",
            va="center", color=QUIET,
        )  # fmt: skip


def add_legend(figure: Figure, axes: Axes) -> None:
    """What the marks mean above the figure, in as many columns as fit, the best below it."""
    handles, labels = axes.get_legend_handles_labels()
    places: dict[Any, bool] = {"outside upper center": False, "outside lower center": True}
    for place, of_best in places.items():
        shown = [k for k, label in enumerate(labels) if label.startswith(BEST) == of_best]
        if shown:
            longest = max(len(line) for k in shown for line in labels[k].split("\n"))
            figure.legend(
                [handles[k] for k in shown], [labels[k] for k in shown], loc=place,
                ncols=max(1, min(len(shown), LEGEND_ROOM // (longest + 8))), columnspacing=1.4,
            )  # fmt: skip
