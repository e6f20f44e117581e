"""Following a Klartext program part by part.

Labels, calls and jumps lead anywhere: a program with one of them is no program for parts. What the writing of a block
takes from elsewhere in the text is the manner of its numbers (points or commas), poles, and whether rotary axes ever go
below zero or past a full turn: a program in which that differs from part to part, or reaches over from one to the
next, is taken as a whole, too.
"""

from __future__ import annotations

import math

import numpy as np

from ncfix.control.following import PartFollower
from ncfix.control.moves import Moves
from ncfix.control.parts import NotInPartsError
from ncfix.text.dialect import Dialect
from ncfix.text.language import Run
from ncfix.text.tree import Command, Program, Template
from ncfix_heidenhain.klartext.control import Control
from ncfix_heidenhain.klartext.interpreter import KlartextInterpreter
from ncfix_heidenhain.klartext.layout import axis_numbers, poles_move
from ncfix_heidenhain.klartext.poles import relies_at_once
from ncfix_heidenhain.klartext.turns import FULL

POLES = frozenset({"c", "cc", "cp", "ctp", "lp"})
"""Path functions that set a pole or go by one; approaches and departures in polar words do, too."""


def has_to_do_with_poles(template: Template) -> bool:
    """Whether blocks of a shape set a pole or may go by one."""
    names = (item.name for item in template.items if isinstance(item, Command))
    return any(name in POLES or name.startswith(("appr p", "dep p")) for name in names)


class KlartextFollower(PartFollower):
    """See `parts.Follower`.

    comma   the parts so far have decimal commas; None before the first one
    shapes  how many shapes have been looked at, and
    polar   those of them that have to do with poles
    """

    control: Control
    comma: bool | None = None
    shapes: int = 0

    def __init__(self, dialect: Dialect, run: Run) -> None:
        super().__init__(Control(run, dialect), run)
        self.polar: list[int] = []

    @property
    def to_the_last(self) -> bool:
        """What stands behind the end of the program may be its labels."""
        return True

    def begin(self, program: Program) -> KlartextInterpreter:
        """What goes through the program, of which this is the first part."""
        return KlartextInterpreter(self.control, program, self.run, in_parts=True)

    def follow(self, program: Program, last: bool) -> Moves:
        """The motions of the next part."""
        self._check_manner(program.source)
        self._check_poles(program)
        moves = super().follow(program, last)
        self._check_turns(program, moves)
        return moves

    def _check_manner(self, source: bytes) -> None:
        """Raise `NotInPartsError` where numbers have points and commas."""
        commas, points = axis_numbers(source)
        if (commas and points) or self.comma not in (None, bool(commas)):
            raise NotInPartsError("the program has decimal points and commas")
        self.comma = bool(commas)

    def _check_poles(self, program: Program) -> None:
        """Raise `NotInPartsError` where a pole was set in an earlier part, or counts from where the tool stands."""
        templates = program.templates
        self.polar += [shape for shape in range(self.shapes, len(templates)) if has_to_do_with_poles(templates[shape])]
        self.shapes = len(templates)
        blocks = np.flatnonzero(np.isin(program.template, self.polar)) if self.polar else np.empty(0, np.int64)
        if not len(blocks):
            return
        relies = self.interpreter is not None and relies_at_once(program.text_of(int(blocks[0])).encode("latin-1"))
        if relies or poles_move(program.source):
            raise NotInPartsError("what a pole is depends on an earlier part")

    def _check_turns(self, program: Program, moves: Moves) -> None:
        """Raise `NotInPartsError` where a rotary axis comes from beyond zero or a full turn, and stays within them."""
        for column in np.flatnonzero(moves.rotary).tolist() if len(moves) else ():
            words = program.column(moves.axes[column])
            words = words[~np.isnan(words)]
            offset = moves.frames[int(moves.frame[0])].offset[column]
            began = math.degrees(moves.start[0, column] - offset)
            if len(words) and (began < 0.0 <= words.min() or words.max() < FULL <= began):
                raise NotInPartsError(f"{moves.axes[column]} comes back from beyond a turn")
