"""Following a program of SINUMERIK part by part.

Jumps, labels, loops and subprograms in the text lead anywhere: a program with one of them is no program for parts, and
`runs_straight_on` sees it by the shape of a block. Two rules look at the whole text: with an M6 anywhere, T does not
change the tool by itself; and where a block has only one of AP and RP, all blocks that have them depend on each other.
"""

from __future__ import annotations

from ncfix.control.following import PartFollower
from ncfix.text import reach
from ncfix.text.dialect import Dialect
from ncfix.text.language import Run
from ncfix.text.tree import Program, Template
from ncfix_siemens.sinumerik.interpreter import SinumerikInterpreter
from ncfix_siemens.sinumerik.poles import polar_words
from ncfix_siemens.sinumerik.state import Sinumerik


def runs_straight_on(template: Template) -> bool:
    """Whether a block of this shape has nothing to do with others elsewhere in the text."""
    return reach.runs_straight_on(template) and len(polar_words(template)) != 1


class SinumerikFollower(PartFollower):
    """See `parts.Follower`."""

    control: Sinumerik

    def __init__(self, dialect: Dialect, run: Run) -> None:
        super().__init__(Sinumerik(run, dialect), run)

    @property
    def to_the_last(self) -> bool:
        """A name may be that of a subprogram behind the end of the program."""
        return True

    def begin(self, program: Program) -> SinumerikInterpreter:
        """What goes through the program, of which this is the first part."""
        return SinumerikInterpreter(self.control, program, self.run, in_parts=True)
