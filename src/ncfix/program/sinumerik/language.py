"""SINUMERIK as a `Language`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnostics import UsageError
from ncfix.program import stamp
from ncfix.program.flatten import FlatLine
from ncfix.program.language import BulkLayout, Language, Resolve
from ncfix.program.moves import Kinematics, Trace
from ncfix.program.setup import Setup
from ncfix.program.shapes import split_blocks
from ncfix.program.sinumerik.blocks import parse_block
from ncfix.program.sinumerik.interpreter import Interpreter
from ncfix.program.sinumerik.layout import layout_of
from ncfix.program.sinumerik.render import render
from ncfix.program.sinumerik.scanning import scan
from ncfix.program.sinumerik.state import Sinumerik
from ncfix.program.sinumerik.unroll import Recorder
from ncfix.program.tree import Literal, Program


def whole_text(source: bytes, blocks: NDArray[np.int64]) -> int:
    """There is no mark that ends the text: subprograms may follow the program."""
    return len(blocks)


def follow(
    program: Program,
    setup: Setup,
    axes: tuple[str, ...],
    rotary: frozenset[str],
    resolve: Resolve | None,
    max_blocks: int,
    kinematics: Kinematics | None,
) -> Trace:
    """The motions of a program of this family; raises what `trace` does."""
    control = Sinumerik(setup, axes, rotary, program.dialect, kinematics)
    moves = Interpreter(control, program, resolve, max_blocks).run()
    lacking = (*control.foreign.values(), *control.knowledge.missing.values())
    if lacking:
        raise UsageError.collected(lacking)
    marked = stamp.find(program)
    return Trace(
        moves=replace(moves, pointing=control.pointing) if control.points else moves,
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
    """The blocks of a program of this family as they are executed."""
    control = Sinumerik(setup, axes, rotary, program.dialect, kinematics)
    return Interpreter(control, program, resolve, max_blocks).unrolled(Recorder(steps, limit))


def in_bulk(program: Program, block: int) -> BulkLayout | None:
    """What is needed to write motions like that of a block many at a time; None if they need the renderer."""
    layout = layout_of(program, block)
    if layout is None or not layout.axes or layout.polar or layout.vector:
        return None
    slots = {letter: word.value.slot for letter, word in layout.axes.items() if isinstance(word.value, Literal)}
    if len(slots) < len(layout.axes):
        return None
    at = program.position(block, layout.code_at)
    return BulkLayout(slots, layout.words_at, layout.blank, program.source[at : at + 1].islower())


SINUMERIK = Language(
    split=split_blocks,
    end=whole_text,
    scan=scan,
    parse=parse_block,
    follow=follow,
    layout=layout_of,
    render=render,
    arc_pieces=True,
    unroll=unroll,
    bulk=in_bulk,
)
