"""What the second reader finds: how many blocks are proved, which are not and why, which are faulty.

Lines are counted from one, those of the corrected program and those of the original.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Set
from dataclasses import field
from itertools import islice
from typing import NamedTuple

from ncfix.certificate.text import StampFound
from ncfix.values import mutable


class BlockFault(NamedTuple):
    """What is wrong, with the line of the corrected program, and of the original (0: of none)."""

    text: str
    line: int
    original: int


@mutable
class BlockProof:
    """What was found.

    blocks   lines of the original that are not empty; `motions` of them move something
    proved, unproved   how many of each; the rest is faulty
    left     why blocks are not proved, by their lines
    """

    blocks: int = 0
    motions: int = 0
    proved: int = 0
    proved_motions: int = 0
    left: dict[int, str] = field(default_factory=dict)
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
        return len(self.left)

    @property
    def reasons(self) -> Counter[str]:
        """How many blocks are not proved, by the reason."""
        return Counter(self.left.values())

    def lines(self, why: str, most: int = 5) -> list[int]:
        """The lines of the first few blocks that are not proved for a reason."""
        return list(islice((line for line, reason in self.left.items() if reason == why), most))

    def fault(self, text: str, line: int, original: int) -> None:
        """Something is wrong."""
        self.faults.append(BlockFault(text, line, original))
        if original:
            self.faulty.add(original)

    def leave(self, why: str, line: int) -> None:
        """A block is not proved."""
        self.left.setdefault(line, why)

    def join(self, other: BlockProof, moving: Set[int]) -> None:
        """Take in what was found of the same programs in another position of block delete.

        moving  the lines of the original that move something
        """
        worse = (other.left.keys() | other.faulty) - self.left.keys() - self.faulty
        self.proved -= len(worse)
        self.proved_motions -= len(worse & moving)
        self.faults = sorted({*self.faults, *other.faults}, key=lambda fault: (fault.line, fault.original, fault.text))
        self.faulty |= other.faulty
        self.left = {line: why for line, why in {**other.left, **self.left}.items() if line not in self.faulty}
        self.largest_um = max(self.largest_um, other.largest_um)
        self.farthest_um = max(self.farthest_um, other.farthest_um)
