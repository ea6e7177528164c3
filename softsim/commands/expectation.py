"""What `softsim check` says of the time that a run will take."""

from rich.table import Table

from softsim.commands.wording import duration
from softsim.duration import predicted_duration
from softsim.machine import Choice
from softsim.model import Model
from softsim.scene.loading import LoadedScene


def expected(loaded: LoadedScene, model: Model, choice: Choice) -> Table:
    """The expected duration, measured rates behind it, and what it is made of."""
    predicted = predicted_duration(loaded, model, choice)
    table = Table(show_header=False, box=None)
    workers = f"{predicted.threads} thread{'s' if predicted.threads > 1 else ''}"
    place = choice.device if choice.device == "cuda" else f"{choice.device}, {workers}"
    settling = " and the time until forces balance" if model.relaxation is not None else ""
    table.add_row(
        "expected",
        f"about {duration(predicted.total)}{settling}, at the time step of rest and the "
        f"{predicted.rate / 1e6:.1f} M element updates/s measured now ({place})",
    )
    table.add_row(
        "",
        f"start {duration(predicted.start)}, increments {duration(predicted.increments)}, output "
        f"and guards {duration(predicted.output)}, figures {duration(predicted.figures)}",
    )
    return table
