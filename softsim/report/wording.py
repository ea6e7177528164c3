"""Numbers as the commands write them."""


def degrees(angle: float) -> str:
    """An angle [rad] in degrees."""
    return f"{angle * 57.29577951308232:.0f} deg"


def duration(seconds: float) -> str:
    """A time span for people."""
    if seconds < 90.0:
        return f"{seconds:.1f} s"
    minutes = int(seconds // 60)
    if minutes < 90:
        return f"{minutes} min {int(seconds % 60)} s"
    return f"{minutes // 60} h {minutes % 60} min"
