"""Programs that go round for ever, or longer than anybody waits.

For ever: the same jump is made again, and nothing has changed that a jump depends on.

Which way a program goes depends on its variables alone, on the calls that are open, and on how often repetitions are
still to be made; where the axes stand does not matter unless the program reads it, which counts as a change here. So a
second jump of that kind shows that there will be a third. A loop that counts something has to be followed instead, up
to a bound on all that is executed.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field

from ncfix.control.faults import Fault

ENDLESS = "NCF233"
NEVER_ENDS = "the program never ends: it jumps back here again and again, and nothing changes in between"
WAITS = "the program goes round here until something changes that only the machine knows"
MOST = 100_000
"""Jumps that are remembered; from different calls, one jump is another."""


@dataclass(slots=True)
class Budget:
    """How much may still be executed; a hole of a cycle, and a subprogram that is gone through, count as blocks too.

    most  blocks beyond those of the text, for what is said
    left  blocks that may still be executed, those of the text included
    """

    most: int
    left: int

    def spend(self, blocks: int) -> None:
        """Count what is executed; raises `Fault` where it is too much."""
        self.foresee(blocks)
        self.left -= blocks

    def foresee(self, blocks: int) -> None:
        """Raise `Fault` at once where it will take more blocks than are left."""
        if blocks > self.left:
            text = f"the program seems to be endless: it executes more than {self.most:,} blocks"
            raise Fault(ENDLESS, text, "if it does end, most_blocks = ... in the setup file allows more")


@dataclass(slots=True)
class Recurrence:
    """The jumps back that a program has made: what had changed by then, as a count."""

    made: dict[Hashable, int] = field(default_factory=dict)

    def seen(self, jump: Hashable, changes: int) -> bool:
        """Note a jump back, and tell whether it was made before and nothing has changed since."""
        before = self.made.get(jump)
        if len(self.made) >= MOST:
            self.made.clear()
        self.made[jump] = changes
        return before == changes
