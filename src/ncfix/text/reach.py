"""Text that a control never gets to: after the tape, after the program, in the bodies of subprograms not called.

What follows the end of the tape is not looked at. Elsewhere a line may be anything, and a control does not mind. Such a
line is kept as opaque text of the kind `UNREAD`; whoever gets to it after all, by a call or a jump, has to refuse it.
"""

from __future__ import annotations

import re
from dataclasses import field

import numpy as np

from ncfix.arrays import Ints
from ncfix.text.tree import Comment, Constant, OWordLine, Skip, Template, Word
from ncfix.values import frozen, mutable

UNREAD = "unread"
"""The kind of an `Opaque` that could not be read where nobody may need it."""

CALL = 980
"""M98 in tenths."""

DWELL = 40
"""G4 in tenths."""
PATHLESS = frozenset({0, 10, 70, 80, 90})
"""M0, M1 and coolant, in tenths."""

OPENING = frozenset({"sub", "if", "while", "repeat", "do"})
CLOSING = frozenset({"endsub", "endif", "endwhile", "endrepeat"})
PROGRAM_ENDS = frozenset({20, 300})
"""M2 and M30, in tenths."""


LEADER = re.compile(rb"(?:[ \t\r\n]|\([^()\r\n]*+(?:\([^()\r\n]*+\)[^()\r\n]*+)*+\)|;[^\r\n]*)*+")
"""Blank lines and comments, with brackets in them, too."""


def tape_end(source: bytes, blocks: Ints) -> int:
    """The block with the `%` that ends the tape; the number of blocks if there is none.

    It is the first `%` alone on its line that has something before it. A `%` after nothing but blank lines and
    comments starts the tape.
    """
    leader = LEADER.match(source, int(blocks[0, 0]))
    assert leader is not None, "it matches nothing, too"
    marks = np.flatnonzero(np.frombuffer(source, dtype=np.uint8) == ord("%"))
    for block in dict.fromkeys((np.searchsorted(blocks[:, 0], marks, side="right") - 1).tolist()):
        start, stop = blocks[block]
        if start > leader.end() and source[start:stop].strip() == b"%":
            return int(block)
    return len(blocks)


def whole_text(source: bytes, blocks: Ints) -> int:
    """As `tape_end` for languages without a mark that ends the text: what stands behind the program's end is read."""
    return len(blocks)


def runs_straight_on(template: Template) -> bool:
    """Whether nothing leads from a block of this shape to another part of the text, or from there to it."""
    return not any(isinstance(item, OWordLine) for item in template.items) and CALL not in template.m_codes


@frozen
class Deletable:
    """What blocks that may be skipped have in common.

    switches  of block delete: `/` is one, `/2` another
    matters   to the path: whether the coolant is on, the control stops or waits leads no axis elsewhere
    """

    switches: frozenset[int]
    matters: bool


def deletable(template: Template, dwell: str) -> Deletable | None:
    """Which switches decide over blocks of this shape, if any; `dwell`: the letters that say with G4 how long."""
    switches = frozenset(item.level for item in template.items if isinstance(item, Skip))
    if not switches:
        return None
    plain = all(isinstance(item, Word | Comment | Skip) for item in template.items)
    plain = plain and all(isinstance(word.value, Constant) for word in template.words if word.address in "GM")
    words = {word.address for word in template.words} - {"N", "G", "M"}
    waits = template.g_codes == (DWELL,) and words <= set(dwell)
    idle = plain and (waits or not (template.g_codes or words)) and PATHLESS.issuperset(template.m_codes)
    return Deletable(switches, not idle)


@mutable
class Reach:
    """Follows the blocks of a program in the order written.

    ended  the program has ended: an M2 or M30 stood outside all o-words
    open   the keywords and labels of the o-words that are open
    """

    ended: bool = False
    open: list[tuple[str, object]] = field(default_factory=list)

    @property
    def in_doubt(self) -> bool:
        """Whether the control may never get to the next block."""
        return self.ended or any(keyword == "sub" for keyword, _ in self.open)

    def follow(self, template: Template) -> None:
        """Take note of a block."""
        for item in template.items:
            if isinstance(item, OWordLine):
                self.enter_or_leave(item)
        if not self.open and not PROGRAM_ENDS.isdisjoint(template.m_codes):
            self.ended = True

    def enter_or_leave(self, flow: OWordLine) -> None:
        """Take note of an o-word. `while` closes the `do` of its label; other than that it opens."""
        if flow.keyword in CLOSING or (flow.keyword == "while" and ("do", flow.label) in self.open):
            labels = [label for _, label in self.open]
            if flow.label in labels:
                del self.open[len(labels) - 1 - labels[::-1].index(flow.label) :]
        elif flow.keyword in OPENING:
            self.open.append((flow.keyword, flow.label))
