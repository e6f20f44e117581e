"""The RS274 family as a `Language`: LinuxCNC, plain ISO code and their like."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ncfix.diagnostics import UsageError
from ncfix.program import stamp
from ncfix.program.flatten import FlatLine
from ncfix.program.language import BulkLayout, Language, Resolve
from ncfix.program.layout import AXIS_LETTERS, Layout, has_free_text, layout_of
from ncfix.program.moves import Kinematics, Trace
from ncfix.program.reach import tape_end
from ncfix.program.render import BlockRenderer
from ncfix.program.rs274.blocks import parse_block
from ncfix.program.rs274.control import Control
from ncfix.program.rs274.following import RS274Follower
from ncfix.program.rs274.interpreter import Interpreter
from ncfix.program.rs274.unroll import unrolled
from ncfix.program.setup import Setup
from ncfix.program.shapes import scan, split_blocks
from ncfix.program.target import Rendered, Target
from ncfix.program.tree import Literal, Program, Word


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
    control = Control(setup, axes, rotary, program.dialect, kinematics)
    Interpreter(control, program, resolve, max_blocks).run()
    return finished(control, program)


def finished(control: Control, program: Program) -> Trace:
    """What was found when a program has been followed; raises UsageError with all that was not given."""
    lacking = (*control.foreign.values(), *control.knowledge.missing.values())
    if lacking:
        raise UsageError.collected(lacking)
    marked = stamp.find(program)
    return Trace(
        moves=control.builder.moves(),
        messages=(*control.knowledge.assumed.values(), *control.messages.values()),
        assumed=tuple(control.knowledge.assumed),
        stamp="" if marked is None else program.text_of(marked),
    )


def writable(program: Program, block: int) -> Layout | None:
    """The layout of a block of words, None for flow control and text that is passed over."""
    return None if has_free_text(program, block) else layout_of(program, block)


def render(program: Program, block: int, layout: Layout, target: Target) -> Rendered:
    """The text of a corrected motion."""
    return BlockRenderer(program, block, layout, target).render()


def words_of(program: Program, block: int) -> tuple[Word, ...]:
    """The words of a block."""
    return program.templates[int(program.template[block])].words


def in_bulk(program: Program, block: int) -> BulkLayout | None:
    """What is needed to write motions like that of a block many at a time; None if they need the renderer."""
    layout = writable(program, block) if any(w.address in AXIS_LETTERS for w in words_of(program, block)) else None
    if layout is None:
        return None
    slots = {letter: word.value.slot for letter, word in layout.axes.items() if isinstance(word.value, Literal)}
    if len(slots) < len(layout.axes):
        return None
    at = program.position(block, layout.code_at)
    return BulkLayout(slots, layout.words_at, layout.blank, program.source[at : at + 1].islower())


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
    control = Control(setup, axes, rotary, program.dialect, kinematics)
    return unrolled(Interpreter(control, program, resolve, max_blocks), steps, limit)


RS274 = Language(
    split=split_blocks,
    end=tape_end,
    scan=scan,
    parse=parse_block,
    follow=follow,
    layout=writable,
    render=render,
    lenient=True,
    unroll=unroll,
    arc_pieces=True,
    bulk=in_bulk,
    follower=RS274Follower,
)
