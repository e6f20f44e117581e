"""The findings of the proof: the number of proved blocks, those not proved and why, and the faulty ones.

Lines are counted from 1, in the corrected program and in the original.
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
    """A fault, with its line in the corrected program, and in the original (0: none)."""

    text: str
    line: int
    original: int


@mutable
class BlockProof:
    """The result of a proof.

    blocks   number of lines of the original that are not empty; `motions`: those of them that move axes
    proved   number of proved blocks; `proved_motions`: those of them that move axes
    left     line of a block that is not proved -> the reason
    faulty   lines of faulty blocks
    """

    blocks: int = 0
    motions: int = 0
    proved: int = 0
    proved_motions: int = 0
    left: dict[int, str] = field(default_factory=dict)
    faults: list[BlockFault] = field(default_factory=list)
    faulty: set[int] = field(default_factory=set)
    largest_um: float = 0.0
    """The largest correction of a command of X, Y or Z, um."""
    farthest_um: float = 0.0
    """The largest distance of the tip from the intended way along proved motions, um."""
    stamp: StampFound | None = None

    @property
    def unproved(self) -> int:
        """Number of blocks that are neither proved nor faulty."""
        return len(self.left)

    @property
    def reasons(self) -> Counter[str]:
        """Reason -> number of blocks that are not proved for it."""
        return Counter(self.left.values())

    def lines(self, why: str, most: int = 5) -> list[int]:
        """The lines of the first few blocks that are not proved for a reason."""
        return list(islice((line for line, reason in self.left.items() if reason == why), most))

    def fault(self, text: str, line: int, original: int) -> None:
        """Add a fault; `original` 0: it belongs to no line of the original."""
        self.faults.append(BlockFault(text, line, original))
        if original:
            self.faulty.add(original)

    def leave(self, why: str, line: int) -> None:
        """Note that the block in a line of the original is not proved, and why."""
        self.left.setdefault(line, why)

    def join(self, other: BlockProof, moving: Set[int]) -> None:
        """Join the result for the same programs in another position of block delete.

        moving  lines of the original that move axes
        """
        worse = (other.left.keys() | other.faulty) - self.left.keys() - self.faulty
        self.proved -= len(worse)
        self.proved_motions -= len(worse & moving)
        self.faults = sorted({*self.faults, *other.faults}, key=lambda fault: (fault.line, fault.original, fault.text))
        self.faulty |= other.faulty
        self.left = {line: why for line, why in {**other.left, **self.left}.items() if line not in self.faulty}
        self.largest_um = max(self.largest_um, other.largest_um)
        self.farthest_um = max(self.farthest_um, other.farthest_um)
