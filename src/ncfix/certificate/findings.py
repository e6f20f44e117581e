"""What the second reader finds: how many blocks are proved, which are not and why, which are faulty.

Lines are counted from one, those of the corrected program and those of the original.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

from ncfix.certificate.text import StampFound


class BlockFault(NamedTuple):
    """What is wrong, with the line of the corrected program, and of the original (0: of none)."""

    text: str
    line: int
    original: int


@dataclass(slots=True)
class BlockProof:
    """What was found.

    blocks   lines of the original that are not empty; `motions` of them move something
    proved, unproved   how many of each; the rest is faulty
    reasons  of what is not proved: how many blocks, and the lines of the first few
    """

    blocks: int = 0
    motions: int = 0
    proved: int = 0
    proved_motions: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    lines: dict[str, list[int]] = field(default_factory=dict)
    faults: list[BlockFault] = field(default_factory=list)
    faulty: set[int] = field(default_factory=set)
    largest_um: float = 0.0
    """The largest change of a command of X, Y or Z that was looked at."""
    farthest_um: float = 0.0
    """The farthest that the tip was found from the intended way, on the way of proved motions."""
    stamp: StampFound | None = None

    @property
    def unproved(self) -> int:
        """Blocks that are neither proved nor faulty."""
        return sum(self.reasons.values())

    def fault(self, text: str, line: int, original: int) -> None:
        """Something is wrong."""
        self.faults.append(BlockFault(text, line, original))
        if original:
            self.faulty.add(original)

    def leave(self, why: str, line: int) -> None:
        """A block is not proved."""
        self.reasons[why] += 1
        self.lines.setdefault(why, [])
        if len(self.lines[why]) < 5:
            self.lines[why].append(line)
