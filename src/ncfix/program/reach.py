"""Text that a control never gets to: what follows the end of the program, and the bodies of subprograms not called.

A line there may be anything, and a control does not mind. Such a line is kept as opaque text of the kind `UNREAD`;
whoever gets to it after all, by a call or a jump, has to refuse it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ncfix.program.tree import Flow, Template

UNREAD = "unread"
"""The kind of an `Opaque` that could not be read where nobody may need it."""

OPENING = frozenset({"sub", "if", "while", "repeat", "do"})
CLOSING = frozenset({"endsub", "endif", "endwhile", "endrepeat"})
PROGRAM_ENDS = frozenset({20, 300})
"""M2 and M30, in tenths."""


@dataclass(slots=True)
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
            if isinstance(item, Flow):
                self.enter_or_leave(item)
        if not self.open and not PROGRAM_ENDS.isdisjoint(template.m_codes):
            self.ended = True

    def enter_or_leave(self, flow: Flow) -> None:
        """Take note of an o-word. `while` closes the `do` of its label; other than that it opens."""
        if flow.keyword in CLOSING or (flow.keyword == "while" and ("do", flow.label) in self.open):
            labels = [label for _, label in self.open]
            if flow.label in labels:
                del self.open[len(labels) - 1 - labels[::-1].index(flow.label) :]
        elif flow.keyword in OPENING:
            self.open.append((flow.keyword, flow.label))
