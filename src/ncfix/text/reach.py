"""Text that a control never reaches: after the tape, after the program, in subprograms that nothing calls.

Text after the end of the tape is not parsed. In the other places an unreadable line does not disturb a control; it is
kept as opaque text of the kind `UNREAD`, and refused if it is reached after all, by a call or a jump.
"""

from __future__ import annotations

import re
from dataclasses import field

import numpy as np

from ncfix.arrays import Ints
from ncfix.text.tree import Comment, Constant, OWordLine, Skip, Template, Word
from ncfix.values import frozen, mutable

UNREAD = "unread"
"""Kind of an `Opaque` that could not be parsed and may never be reached."""

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
"""Blank lines and comments, which may contain brackets."""


def tape_end(source: bytes, blocks: Ints) -> int:
    """The block with the `%` that ends the tape; the number of blocks if there is none.

    It is the first `%` alone on its line with something before it. A `%` after only blank lines and comments starts the
    tape.
    """
    leader = LEADER.match(source, int(blocks[0, 0]))
    assert leader is not None, "it also matches an empty text"
    marks = np.flatnonzero(np.frombuffer(source, dtype=np.uint8) == ord("%"))
    for block in dict.fromkeys((np.searchsorted(blocks[:, 0], marks, side="right") - 1).tolist()):
        start, stop = blocks[block]
        if start > leader.end() and source[start:stop].strip() == b"%":
            return int(block)
    return len(blocks)


def whole_text(source: bytes, blocks: Ints) -> int:
    """Like `tape_end`, for languages without such a mark: everything after the program's end is parsed."""
    return len(blocks)


def runs_straight_on(template: Template) -> bool:
    """Whether blocks of this shape neither refer to other parts of the text nor are referred to."""
    return not any(isinstance(item, OWordLine) for item in template.items) and CALL not in template.m_codes


@frozen
class Deletable:
    """Properties of a block shape with block delete.

    switches  numbers of its block delete switches: `/` is one, `/2` another
    matters   whether the block can affect the path; coolant, stops and dwells cannot
    """

    switches: frozenset[int]
    matters: bool


def deletable(template: Template, dwell: str) -> Deletable | None:
    """The block delete properties of a shape; None without `/`. `dwell`: the letters of G4's duration."""
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
    """Tracks, in the order of the text, whether the control reaches the blocks of a program.

    ended  the program has ended: there was an M2 or M30 outside all o-words
    open   keywords and labels of the open o-words
    """

    ended: bool = False
    open: list[tuple[str, object]] = field(default_factory=list)

    @property
    def in_doubt(self) -> bool:
        """Whether the control may never reach the next block."""
        return self.ended or any(keyword == "sub" for keyword, _ in self.open)

    def follow(self, template: Template) -> None:
        """Process the next block."""
        for item in template.items:
            if isinstance(item, OWordLine):
                self.enter_or_leave(item)
        if not self.open and not PROGRAM_ENDS.isdisjoint(template.m_codes):
            self.ended = True

    def enter_or_leave(self, flow: OWordLine) -> None:
        """Process an o-word. `while` closes the `do` with the same label; otherwise it opens."""
        if flow.keyword in CLOSING or (flow.keyword == "while" and ("do", flow.label) in self.open):
            labels = [label for _, label in self.open]
            if flow.label in labels:
                del self.open[len(labels) - 1 - labels[::-1].index(flow.label) :]
        elif flow.keyword in OPENING:
            self.open.append((flow.keyword, flow.label))
