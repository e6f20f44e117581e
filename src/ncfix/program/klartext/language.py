"""Heidenhain Klartext as a `Language`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ncfix.program.flatten import FlatLine
from ncfix.program.follow.finish import finished
from ncfix.program.klartext.blocks import parse_block
from ncfix.program.klartext.bulk import in_bulk, one_by_one
from ncfix.program.klartext.control import Control
from ncfix.program.klartext.following import KlartextFollower
from ncfix.program.klartext.interpreter import Interpreter
from ncfix.program.klartext.layout import layout_of, uses_comma
from ncfix.program.klartext.numbering import renumbered
from ncfix.program.klartext.render import render
from ncfix.program.klartext.shapes import scan, split
from ncfix.program.klartext.unroll import unrolled
from ncfix.program.language import Language, Run
from ncfix.program.moves import Trace
from ncfix.program.reach import whole_text
from ncfix.program.tree import Program


def following(program: Program, run: Run) -> Interpreter:
    """The control's walk through a program, before its first step."""
    control = Control(run, program.dialect)
    return Interpreter(control, program, run.resolve, run.budget(program))


def follow(program: Program, run: Run) -> Trace:
    """The motions of a Klartext program; raises what `trace` does."""
    walk = following(program, run)
    walk.run()
    return finished(walk.control, program, walk.control.moves())


def unroll(program: Program, run: Run, steps: Mapping[str, float], limit: int) -> Sequence[FlatLine]:
    """A program as it is executed; see `flatten.Unroll`."""
    return unrolled(following(program, run), steps, limit, uses_comma(program.source))


KLARTEXT = Language(
    split=split,
    end=whole_text,
    scan=scan,
    parse=parse_block,
    follow=follow,
    layout=layout_of,
    render=render,
    arc_pieces=True,
    bulk=in_bulk,
    one_by_one=one_by_one,
    renumber=renumbered,
    unroll=unroll,
    follower=KlartextFollower,
)
