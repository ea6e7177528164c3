"""What a scene's `expect` block demands of a finished run."""

from typing import Any

import numpy as np

from softsim.scene.outputs import Expect


def failed_expectations(expect: Expect, found: dict[str, Any]) -> str | None:
    """What `expect` demands and `found` (name -> value, or values that all count) does not keep.

    None if all is as expected.
    """
    wrong = []
    for name, limits in expect:
        if limits is None:
            continue
        value = found.get(name)
        values = value if isinstance(value, list) else [value]
        for v in values:
            low = -np.inf if limits.min is None else limits.min
            high = np.inf if limits.max is None else limits.max
            if v is None or not low <= v <= high:
                wrong.append(f"{name}: {v} is outside [{low:g}, {high:g}]")
    return "not as the scene expects: " + "; ".join(wrong) if wrong else None
