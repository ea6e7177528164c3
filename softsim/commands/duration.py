"""What `softsim check` says of the time that a run will take."""

from rich.table import Table

from softsim.machine import Choice
from softsim.model import Model
from softsim.report.readable import duration
from softsim.run.pilot import predicted_duration
from softsim.scene.loading import LoadedScene


def duration_table(loaded: LoadedScene, model: Model, choice: Choice) -> Table:
    """The predicted duration, measured rates behind it, and what it is made of."""
    predicted = predicted_duration(loaded, model, choice)
    table = Table(show_header=False, box=None)
    workers = f"{predicted.threads} thread{'s' if predicted.threads > 1 else ''}"
    place = choice.device if choice.device == "cuda" else f"{choice.device}, {workers}"
    settling = ", and the time until forces balance" if model.relaxation is not None else ""
    table.add_row(
        "expected",
        f"about {duration(predicted.total)}{settling}: start {duration(predicted.start)}, "
        f"{predicted.increment_count:.3g} increments {duration(predicted.loop)}, figures "
        f"{duration(predicted.figures)}",
    )
    seen = "all" if predicted.covered == 1.0 else f"the first {100.0 * predicted.covered:.0f} %"
    table.add_row(
        "measured",
        f"{predicted.rate / 1e6:.1f} M element updates/s ({place}), in a pilot that saw {seen} of "
        "the loads' course, played faster",
    )
    return table
