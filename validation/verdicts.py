"""Verdicts on claims, and on the statements of the thesis that the claims belong to.

A judge takes numbers and says AGREES or DISAGREES; a number that is not there (NaN, as of a run
that failed, or a curve that does not reach) makes it UNKNOWN.
"""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from validation.cases import Outcome
from validation.statements import Statement

AGREES, DISAGREES, UNKNOWN = "agrees", "disagrees", "undecided"
VERDICTS = (AGREES, DISAGREES, UNKNOWN)
IN_PART, UNEXAMINED = "agrees in part", "not examined"
VERDICTS_OF_STATEMENTS = (AGREES, IN_PART, DISAGREES, UNKNOWN, UNEXAMINED)

IN_SECTION, IN_SPACE, EQUATIONS = "plane section", "in space", "equations"
MODELS = (IN_SECTION, IN_SPACE, EQUATIONS)
TRIAL = "other constants"
"""Model with other constants than those of the scenes or the thesis; such rows do not count."""

RULE = (
    "A statement agrees if at least half of its sub-claims could be decided and all of these "
    "agree; it agrees in part if some agree and some disagree, disagrees if some disagree and none "
    "agrees, and is undecided otherwise. Sub-claims with other constants than those of the "
    "scenes or the thesis are listed but do not count."
)
MISSING = "not found"
LARGE = 10.0
"""Share above which `percent` shows no digits."""
Numbers = Sequence[float] | np.ndarray


@dataclass(frozen=True)
class Row:
    """One claim with its verdict; all fields but the statement are texts for readers.

    statement: of the thesis that this is a sub-claim of; None for published measurements.
    error, band: deviation from the reference and the largest one that counts as agreement, for
    published measurements; empty for others.
    model: one of MODELS, or TRIAL. script: its name. A script may leave both empty: they are then
    filled from `Script`.
    """

    statement: Statement | None
    claim: str
    reference: str
    computed: str
    verdict: str
    error: str = ""
    band: str = ""
    model: str = ""
    script: str = ""


@dataclass(frozen=True)
class Finding:
    """What was computed, as people read it, and the verdict."""

    computed: str
    verdict: str


def row(
    statement: Statement | None,
    claim: str,
    reference: str,
    finding: Finding,
    rests_on: Iterable[Outcome] = (),
    error: str = "",
    band: str = "",
    model: str = "",
) -> Row:
    """Return a row of the page.

    rests_on: the cases behind it; their failures are the reason where the verdict is unknown.
    """
    computed = finding.computed
    reasons = [outcome.failure.splitlines()[0] for outcome in rests_on if outcome.failure]
    if finding.verdict == UNKNOWN and reasons:
        computed = "; ".join(dict.fromkeys(reasons))
    return Row(statement, claim, reference, computed, finding.verdict, error, band, model)


def counts(rows: Iterable[Row]) -> dict[str, int]:
    """Return the number of rows of each verdict."""
    found = Counter(row.verdict for row in rows)
    return {verdict: found[verdict] for verdict in VERDICTS}


def verdict_of(rows: Iterable[Row]) -> str:
    """Return the verdict on a statement that has these rows, by RULE."""
    rows = list(rows)
    found = counts(row for row in rows if row.model != TRIAL)
    if found[DISAGREES]:
        return IN_PART if found[AGREES] else DISAGREES
    if found[AGREES] and found[AGREES] >= found[UNKNOWN]:
        return AGREES
    return UNKNOWN if rows else UNEXAMINED


def shown(value: float, unit: str = "") -> str:
    """A number with its unit; MISSING where there is none."""
    if math.isnan(value):
        return MISSING
    return f"{value:.3g} {unit}".rstrip()


def shown_list(values: Numbers, unit: str = "") -> str:
    """Numbers with their common unit; a dash where there is none."""
    texts = ("-" if math.isnan(value) else f"{value:.3g}" for value in values)
    return f"{', '.join(texts)} {unit}".rstrip()


def percent(share: float) -> str:
    """Return a share in per cent, without digits above LARGE."""
    return f"> {100.0 * LARGE:g} %" if share > LARGE else shown(100.0 * share, "%")


def signed(share: float) -> str:
    """Return a relative error in per cent, with its sign."""
    return MISSING if math.isnan(share) else f"{100.0 * share:+.3g} %"


def judged(holds: bool, computed: str, *needed: float) -> Finding:
    """A condition on numbers, all of which must be there."""
    if any(math.isnan(number) for number in needed):
        return Finding(computed, UNKNOWN)
    return Finding(computed, AGREES if holds else DISAGREES)


def within(value: float, reference: float, tolerance: float, unit: str = "") -> Finding:
    """`value` differs from `reference` by less than the share `tolerance` of it."""
    holds = abs(value - reference) < tolerance * abs(reference)
    return judged(holds, shown(value, unit), value, reference)


def within_factor(value: float, reference: float, factor: float, unit: str = "") -> Finding:
    """`value` lies between reference / factor and reference x factor."""
    return between(value, reference / factor, reference * factor, unit)


def between(value: float, low: float, high: float, unit: str = "") -> Finding:
    """low <= value <= high."""
    return judged(low <= value <= high, shown(value, unit), value, low, high)


def all_between(values: Numbers, low: float, high: float, unit: str = "") -> Finding:
    """low <= value <= high of each; a known one that is not disagrees, though others be missing."""
    known = [value for value in values if not math.isnan(value)]
    return _unless(all(low <= value <= high for value in known), values, unit)


def below(value: float, limit: float, unit: str = "") -> Finding:
    """value < limit."""
    return judged(value < limit, shown(value, unit), value, limit)


def above(value: float, limit: float, unit: str = "") -> Finding:
    """value > limit."""
    return judged(value > limit, shown(value, unit), value, limit)


def more_than(value: float, other: float, unit: str = "") -> Finding:
    """value > other, both computed."""
    return judged(value > other, f"{shown(value, unit)} against {shown(other, unit)}", value, other)


def at_most_share(value: float, of: float, share: float) -> Finding:
    """|value| is less than `share` of a positive `of`; shown in per cent of it."""
    if not of > 0.0 and not math.isnan(of):
        return judged(False, "there is nothing to take a share of", value)
    found = abs(value) / of
    return judged(found < share, shown(100.0 * found, "%"), found)


def rises(values: Numbers, unit: str = "", resolution: float = 0.0) -> Finding:
    """Each value is larger than the one before; a known one that is not disagrees, though others
    be missing. Less than `resolution` is no difference, but the last is larger than the first.
    """
    known = [value for value in values if not math.isnan(value)]
    steps = all(after > before - resolution for before, after in pairwise(known))
    grown = len(known) < 2 or known[-1] > known[0] + resolution
    return _unless(steps and grown, values, unit)


def falls(values: Numbers, unit: str = "") -> Finding:
    """The same for values each smaller than the one before."""
    known = [value for value in values if not math.isnan(value)]
    return _unless(all(after < before for before, after in pairwise(known)), values, unit)


def some_above(values: Numbers, limit: float, unit: str = "") -> Finding:
    """At least one value > limit; a known one agrees, though others be missing."""
    known = [float(value) for value in values if not math.isnan(value)]
    if not known or math.isnan(limit):
        return Finding(MISSING, UNKNOWN)
    found = shown(max(known), unit)
    return Finding(found, AGREES) if max(known) > limit else judged(False, found, *values)


def highest_at(
    names: Sequence[str], values: Numbers, wanted: Sequence[str], unit: str = ""
) -> Finding:
    """The largest value is one of those named in `wanted`; a known larger one disagrees, though
    others be missing.
    """
    known = {name: float(v) for name, v in zip(names, values, strict=True) if not math.isnan(v)}
    best = max(known, key=lambda name: known[name], default="")
    holds = best in wanted or not all(name in known for name in wanted)
    computed = f"{best}, {shown(known[best], unit)}" if best else MISSING
    return Finding(computed, _unless(holds, values, unit).verdict)


def _unless(holds: bool, values: Numbers, unit: str) -> Finding:
    """DISAGREES where known values contradict, else UNKNOWN if any is missing."""
    computed = shown_list(values, unit)
    return judged(True, computed, *values) if holds else Finding(computed, DISAGREES)
