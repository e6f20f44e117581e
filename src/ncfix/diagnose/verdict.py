"""What the whole amounts to, in one of four words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ncfix.diagnose.noise import Floor

if TYPE_CHECKING:
    from ncfix.diagnose.findings import Finding

NOTHING, FOUND, AMBIGUOUS, UNKNOWN = "nothing-missing", "found", "ambiguous", "unknown-effect"
EXCESS_UM = 2.0
"""What has no name decides nothing below this, rms: machines have a little of everything."""
MUCH = 1 / 3
"""Nor below this share of what all names together show."""
LACKING = 1e-3
"""Probability of what is left by chance, below which something is missing that follows no pattern either."""

NO_PATTERN = "something that follows no pattern that was looked for"


@dataclass(frozen=True, slots=True)
class Rest:
    """What the names leave.

    pattern_um  of it what rivals without a name explain, rms, and `titles` what those are
    beyond_um   of it what is beyond the noise, and `p_left` how likely that is by chance, None where it is not known
    """

    pattern_um: float
    titles: tuple[str, ...]
    beyond_um: float
    p_left: float | None

    @property
    def size_um(self) -> float:
        """How much has no name, rms."""
        lacking = self.p_left is not None and self.p_left < LACKING and self.beyond_um > EXCESS_UM
        return max(self.pattern_um, self.beyond_um) if lacking else self.pattern_um

    @property
    def kind(self) -> str:
        """What it depends on."""
        return " and ".join(self.titles) or (NO_PATTERN if self.size_um else "")


def of(findings: Sequence[Finding], rest: Rest, told_um: float, floor: Floor, noise_um: float) -> str:
    """The verdict, where the names show `told_um`.

    Without repeats a smooth rest may as well be the part's or the instrument's: only a large one decides.
    """
    doubtful = floor.source == "neighbours"
    decides = rest.size_um > (max(EXCESS_UM, noise_um) if doubtful else EXCESS_UM)
    if decides and rest.size_um >= (1.0 if doubtful else MUCH) * told_um * bool(findings):
        return UNKNOWN
    if not findings:
        return NOTHING
    return AMBIGUOUS if any(each.aliases for each in findings) else FOUND
