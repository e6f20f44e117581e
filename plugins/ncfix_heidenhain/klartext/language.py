"""Heidenhain Klartext as a `Language`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

from ncfix.control.finish import finished
from ncfix.control.flatten import FlatLine
from ncfix.control.following import Follower
from ncfix.control.moves import Trace
from ncfix.text.dialect import Dialect
from ncfix.text.language import Language, Run
from ncfix.text.reach import whole_text
from ncfix.text.tree import Program
from ncfix_heidenhain.klartext.blocks import parse_block
from ncfix_heidenhain.klartext.bulk import in_bulk, one_by_one
from ncfix_heidenhain.klartext.control import Control
from ncfix_heidenhain.klartext.flatten import unrolled
from ncfix_heidenhain.klartext.interpreter import KlartextInterpreter
from ncfix_heidenhain.klartext.layout import layout_of, uses_comma
from ncfix_heidenhain.klartext.numbering import renumbered
from ncfix_heidenhain.klartext.render import render
from ncfix_heidenhain.klartext.shapes import scan, split


def following(program: Program, run: Run) -> KlartextInterpreter:
    """The control's walk through a program, before its first step."""
    control = Control(run, program.dialect)
    return KlartextInterpreter(control, program, run)


def follower(dialect: Dialect, run: Run) -> Follower:
    """See `Language`."""
    return Follower(Control(run, dialect), run, partial(KlartextInterpreter, in_parts=True))


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
    follower=follower,
)
