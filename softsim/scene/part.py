"""What every part of a scene is."""

from pydantic import BaseModel, ConfigDict

from softsim.scene.quantities import written

ORIGIN = written("0 mm", "0 mm")
AT_REST = written("0 mm/s", "0 mm/s")


class Part(BaseModel):
    """Anything in a scene: frozen, and strict about its keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True)
