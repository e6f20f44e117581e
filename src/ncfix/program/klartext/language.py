"""Heidenhain Klartext as a `Language`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ncfix.diagnostics import UsageError
from ncfix.program import stamp
from ncfix.program.flatten import FlatLine
from ncfix.program.klartext.blocks import parse_block
from ncfix.program.klartext.control import Control
from ncfix.program.klartext.interpreter import Interpreter
from ncfix.program.klartext.layout import layout_of, uses_comma
from ncfix.program.klartext.numbering import renumbered
from ncfix.program.klartext.render import render
from ncfix.program.klartext.shapes import scan, split, whole_text
from ncfix.program.klartext.unroll import unrolled
from ncfix.program.language import Language, Resolve
from ncfix.program.moves import Kinematics, Trace
from ncfix.program.setup import Setup
from ncfix.program.tree import Program


def follow(
    program: Program,
    setup: Setup,
    axes: tuple[str, ...],
    rotary: frozenset[str],
    resolve: Resolve | None,
    max_blocks: int,
    kinematics: Kinematics | None,
) -> Trace:
    """The motions of a Klartext program; raises what `trace` does."""
    control = Control(setup, axes, rotary, program.dialect, kinematics)
    Interpreter(control, program, resolve, max_blocks).run()
    lacking = (*control.foreign.values(), *control.knowledge.missing.values())
    if lacking:
        raise UsageError.collected(lacking)
    marked = stamp.find(program)
    return Trace(
        moves=replace(control.builder.moves(), pointing=control.pointing if control.points else None),
        messages=(*control.knowledge.assumed.values(), *control.messages.values()),
        assumed=tuple(control.knowledge.assumed),
        stamp="" if marked is None else program.text_of(marked),
    )


def unroll(
    program: Program,
    setup: Setup,
    axes: tuple[str, ...],
    rotary: frozenset[str],
    resolve: Resolve | None,
    max_blocks: int,
    kinematics: Kinematics | None,
    steps: Mapping[str, float],
    limit: int,
) -> Sequence[FlatLine]:
    """A program as it is executed; see `flatten.Unroll`."""
    control = Control(setup, axes, rotary, program.dialect, kinematics)
    return unrolled(Interpreter(control, program, resolve, max_blocks), steps, limit, uses_comma(program.source))


KLARTEXT = Language(
    split=split,
    end=whole_text,
    scan=scan,
    parse=parse_block,
    follow=follow,
    layout=layout_of,
    render=render,
    arc_pieces=True,
    renumber=renumbered,
    unroll=unroll,
)
