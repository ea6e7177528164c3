"""Arrays as short texts: places as 16-bit steps, colours as numbers in a palette, in base64."""

from base64 import b64encode

import numpy as np

STEPS, LOST = 32767, -32768
"""Steps from the middle of a box to its side, and what stands for a place that is not finite."""

SHADES = 128
"""Colours of a palette; the number SHADES stands for a value that is not finite."""


def steps(places: np.ndarray, size: float) -> np.ndarray:
    """Places within -size to size as whole steps, LOST where they are not finite."""
    finite = np.isfinite(places)
    return np.where(finite, np.rint(np.where(finite, places, 0.0) / size * STEPS), LOST)


def shades(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Numbers in the palette of values between the limits; beyond them that of the nearest one."""
    finite = np.isfinite(values)
    share = (np.where(finite, values, low) - low) / ((high - low) or 1.0)
    return np.where(finite, np.rint(share.clip(0.0, 1.0) * (SHADES - 1)), SHADES)


def packed(numbers: np.ndarray, kind: type[np.generic]) -> str:
    """Whole numbers as text: base64 of their little-endian bytes, row by row."""
    return b64encode(numbers.astype(np.dtype(kind).newbyteorder("<")).tobytes()).decode("ascii")
