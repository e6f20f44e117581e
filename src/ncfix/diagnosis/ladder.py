"""The ladder of a diagnosis: how each kind of finding reduces the misfit, from the given machine file to the noise.

Each rung explains a share of the squared misfit of the given file. Its evidence is the natural logarithm of how much
likelier the data are with it, less its price; all rungs are on that scale. The last residual is noise if noise alone
leaves so much by chance; otherwise the excess over the noise is unexplained.
"""

from __future__ import annotations

import numpy as np

from ncfix.diagnosis.diagnosis import CONSTANT_FAMILY, Diagnosis
from ncfix.values import frozen

GIVEN, MISTAKES, CONSTANTS, NAMED, UNNAMED, UNEXPLAINED, NOISE = (
    "file as given",
    "mistakes",
    "constants of the file",
    "named effects",
    "without a name",
    "not explained",
    "noise",
)


@frozen
class Rung:
    """One row of the ladder.

    name        kind of finding; found: names of the findings
    left_um     rms residual below it, um; holdout_um: the same on held-out poses, NaN if unknown
    share       part of the squared misfit of the given file that it explains; for the noise: that remains
    log_odds    its evidence; NaN for the first rung and the last two
    """

    name: str
    left_um: float
    holdout_um: float
    share: float
    log_odds: float
    found: tuple[str, ...] = ()


def ladder(diagnosis: Diagnosis) -> tuple[Rung, ...]:
    """All rungs in order; a rung without findings is included."""
    gap, wrong, none = diagnosis.gap, diagnosis.mistake, float("nan")
    first = gap.given if wrong is None else wrong.given_um
    names = {each.candidate.name: each.candidate.family for each in diagnosis.findings}
    mistakes = (wrong.name,) if wrong else ()
    constants = tuple(name for name, family in names.items() if family == CONSTANT_FAMILY)
    named = tuple(name for name in names if name not in (*mistakes, *constants))
    below = float(np.sqrt(max(gap.after**2 - diagnosis.rest.pattern_um**2, 0.0)))
    steps = [
        (MISTAKES, gap.given, gap.holdout_given, wrong.odds if wrong else 0.0, mistakes),
        (CONSTANTS, gap.before, gap.holdout_before, max(diagnosis.constants.odds, 0.0), constants),
        (NAMED, gap.after, gap.holdout_after, diagnosis.named_odds, named),
        (UNNAMED, below, none, diagnosis.rest.odds, diagnosis.rest.titles),
    ]
    found, above = [Rung(GIVEN, first, gap.holdout_given if wrong is None else none, 0.0, none)], first
    for name, left, held, odds, names_on_rung in steps:
        found.append(Rung(name, left, held, _share(above**2 - left**2, first), odds, names_on_rung))
        above = min(left, above)
    noise = min(gap.floor, above) if diagnosis.rest.lacking else above
    found.append(Rung(UNEXPLAINED, noise, none, _share(above**2 - noise**2, first), none))
    found.append(Rung(NOISE, gap.floor, none, _share(noise**2, first), none))
    return tuple(found)


def _share(squares: float, given: float) -> float:
    return max(squares, 0.0) / given**2 if given else 0.0


def in_words(rungs: tuple[Rung, ...]) -> list[tuple[str, str, str, str, str, str]]:
    """The rows of a table: rung, residual, held-out residual, share, evidence, findings."""
    rows = []
    for rung in rungs:
        held = "" if np.isnan(rung.holdout_um) else f"{rung.holdout_um:.2f}"
        share = "" if rung.name == GIVEN else f"{100 * rung.share:.0f} %"
        odds = "" if np.isnan(rung.log_odds) else f"{rung.log_odds:.0f}"
        rows.append((rung.name, f"{rung.left_um:.2f}", held, share, odds, ", ".join(rung.found)))
    return rows
