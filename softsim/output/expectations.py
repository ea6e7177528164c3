"""What a scene's `expect` block demands of a finished run."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from softsim.output.passage import Verdict
from softsim.scene.outputs import Expect, Range


def failed_expectations(expect: Expect, found: dict[str, Any]) -> str | None:
    """What `expect` demands and `found` (name -> value, or values that all count) does not keep.

    None if all is as expected.
    """
    wrong = [*other_verdict(expect, found), *outside_limits(expect, found)]
    return "not as the scene expects: " + "; ".join(wrong) if wrong else None


def other_verdict(expect: Expect, found: dict[str, Any]) -> Iterator[str]:
    """The verdict of a layout, where it is not the expected one; unfinished is never expected."""
    if expect.passes is None:
        return
    expected = Verdict.PASSED if expect.passes else Verdict.STUCK
    if "layout" not in found:
        yield f"verdict {expected.value}, found none"
    elif found["layout"]["verdict"] != expected.value:
        yield f"verdict {expected.value}, found {found['layout']['sentence']}"


def outside_limits(expect: Expect, found: dict[str, Any]) -> Iterator[str]:
    """Values outside the limits that the scene gives for them."""
    for name, limits in expect:
        if not isinstance(limits, Range):
            continue
        value = found.get(name)
        low = -np.inf if limits.min is None else limits.min
        high = np.inf if limits.max is None else limits.max
        for v in value if isinstance(value, list) else [value]:
            if v is None or not low <= v <= high:
                yield f"{name}: {v} is outside [{low:g}, {high:g}]"
