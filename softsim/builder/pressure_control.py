"""What a robot must have for its pressure to follow what it feels."""

from collections.abc import Iterator

from softsim.builder.names import Names
from softsim.loads.drive import ControlledPressure
from softsim.loads.pressure_control import EventCycles
from softsim.model import Model
from softsim.scene.tree import Keys

# Rows of the history by which a speed is told at least.
ROWS_OF_A_SPEED = 4


def refuse_what_cannot_be_felt(names: Names, model: Model) -> None:
    """A controlled pressure whose events the history does not show."""
    for keys, settings in controls(model):
        refuse_a_second_chamber(names, model, keys)
        refuse_no_motion(names, model, keys)
        refuse_missing_rows(names, model, settings, keys)
        refuse_a_short_window(names, settings, keys)


def controls(model: Model) -> Iterator[tuple[Keys, EventCycles]]:
    """The profile of each controlled pressure: its place in the scene, its settings."""
    for load in model.pressures:
        course = load.drive.course
        if isinstance(course, ControlledPressure):
            yield ("loads", load.name, "profile"), course.settings


def refuse_a_second_chamber(names: Names, model: Model, keys: Keys) -> None:
    """The history shows the pressure of one chamber, the robot's."""
    chamber = model.chamber
    if chamber is not None and keys[1] != chamber.name:
        raise names.loaded.error(
            keys,
            f"event_cycles can only drive the chamber of the robot, which is '{chamber.name}'",
            f"write robot: {{chamber: {keys[1]}}}",
        )


def refuse_no_motion(names: Names, model: Model, keys: Keys) -> None:
    """Motion is that of the frame, in real time."""
    if model.relaxation is not None:
        raise names.loaded.error(
            keys,
            "event_cycles respond to the motion of the robot, and a static procedure has none",
            "write time.procedure: dynamic, or a profile of kind cycles",
        )
    if not model.rigid_bodies:
        raise names.loaded.error(
            keys,
            "event_cycles need the motion of the robot's frame, and there is no frame",
            "add rigid_bodies, or write a profile of kind cycles",
        )


def refuse_missing_rows(names: Names, model: Model, settings: EventCycles, keys: Keys) -> None:
    """Rows that are not there never touch; contact that is lost was there before."""
    for key in ("contact_rows", "least_rows"):
        wanted = getattr(settings, key)
        if wanted > len(model.robot.rows):
            raise names.loaded.error(
                (*keys, key),
                f"{key} needs {wanted}, but robot.rows names {len(model.robot.rows)}",
                "name more node sets there, such as ['skin.j*[0-9]']; 0 switches the criterion off",
            )


def refuse_a_short_window(names: Names, settings: EventCycles, keys: Keys) -> None:
    """A speed is told by the places that rows of the history show."""
    least = ROWS_OF_A_SPEED * names.scene.output.history_interval
    if settings.motion_window < least:
        raise names.loaded.error(
            (*keys, "motion_window"),
            f"within {settings.motion_window * 1e3:.4g} ms the history has too few rows to "
            f"compute a speed: at least {ROWS_OF_A_SPEED} are needed",
            f"set at least {least * 1e3:.4g} ms, or a shorter output.history_interval",
        )
