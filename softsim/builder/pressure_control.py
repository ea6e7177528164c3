"""Checks that a robot has what a pressure controlled by events needs."""

from collections.abc import Iterator

from softsim.builder.names import Names
from softsim.loads.drive import ControlledPressure
from softsim.loads.pressure_control import EventCycles
from softsim.model import Model
from softsim.scene.tree import Keys

# Rows of the history by which a speed is told at least.
ROWS_OF_A_SPEED = 4


def refuse_what_cannot_be_felt(names: Names, model: Model) -> None:
    """Raise SceneError if a controlled pressure needs events that the history does not record."""
    for keys, settings in controls(model):
        refuse_a_second_chamber(names, model, keys)
        refuse_no_motion(names, model, keys)
        refuse_missing_rows(names, model, settings, keys)
        refuse_a_short_window(names, settings, keys)


def controls(model: Model) -> Iterator[tuple[Keys, EventCycles]]:
    """Yield the keys and the settings of the profile of each controlled pressure."""
    for load in model.pressures:
        course = load.drive.course
        if isinstance(course, ControlledPressure):
            yield ("loads", load.name, "profile"), course.settings


def refuse_a_second_chamber(names: Names, model: Model, keys: Keys) -> None:
    """Raise SceneError if the pressure is not that of the robot's chamber.

    The history records no other pressure.
    """
    chamber = model.chamber
    if chamber is not None and keys[1] != chamber.name:
        raise names.loaded.error(
            keys,
            f"event_cycles can only drive the chamber of the robot, which is '{chamber.name}'",
            f"write robot: {{chamber: {keys[1]}}}",
        )


def refuse_no_motion(names: Names, model: Model, keys: Keys) -> None:
    """Raise SceneError if the model is static or has no frame whose motion could be measured."""
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
    """Raise SceneError if a criterion needs more rows of spikes than the robot has."""
    for key in ("contact_rows", "least_rows"):
        wanted = getattr(settings, key)
        if wanted > len(model.robot.rows):
            raise names.loaded.error(
                (*keys, key),
                f"{key} needs {wanted}, but robot.rows names {len(model.robot.rows)}",
                "name more node sets there, such as ['skin.j*[0-9]']; 0 switches the criterion off",
            )


def refuse_a_short_window(names: Names, settings: EventCycles, keys: Keys) -> None:
    """Raise SceneError if the motion window has too few rows of the history to compute a speed."""
    least = ROWS_OF_A_SPEED * names.scene.output.history_interval
    if settings.motion_window < least:
        raise names.loaded.error(
            (*keys, "motion_window"),
            f"within {settings.motion_window * 1e3:.4g} ms the history has too few rows to "
            f"compute a speed: at least {ROWS_OF_A_SPEED} are needed",
            f"set at least {least * 1e3:.4g} ms, or a shorter output.history_interval",
        )
