"""Follows a program as the control would execute it, from blocks to motions: whole (`trace`) or in parts.

A long program is read (`PartReader`) and followed (`Follower`) part by part, so that memory does not grow with its
length. A part ends between two blocks of plain words, where no cycle, call or loop can be active. Parts keep the line
numbers of the file, and the numbers of templates, frames and reasons are the same in all parts, so that parts can be
joined. A `Checkpoint` is the state of the control between two parts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, fields, replace
from typing import Any

import numpy as np

from ncfix.arrays import Array, Index, Mask
from ncfix.control.control import ProgramControl
from ncfix.control.interpreter import FollowedLanguage, Interpreter
from ncfix.control.moves import Kinematics, MotionKind, Moves, Rule, Trace
from ncfix.control.setup import Run, Setup
from ncfix.diagnostics import Message, SourceError, UsageError
from ncfix.text import stamp
from ncfix.text.dialect import Dialect, check_content, check_zeros, header_length
from ncfix.text.language import Language, language_of
from ncfix.text.layout import AXIS_LETTERS
from ncfix.text.reader import ProgramReading, moved_by
from ncfix.text.tree import Program, Skip, Template
from ncfix.values import frozen, mutable

TABLES = frozenset({"axes", "rotary", "frames", "reasons", "pointing", "angles", "calls"})
"""Fields of `Moves` that do not have one row per motion."""


class NotInPartsError(Exception):
    """The program cannot be processed in parts and must be read as a whole."""


@mutable
class PartReader:
    """Reads a program part by part.

    head        first bytes of the text, from which its kind is recognised; if not given, those of the first part
    first_line  line number at which the next part begins
    line_end    the first line end of the first part
    plain       shape -> whether a part may end before or after a block of this shape
    """

    path: str
    dialect: Dialect
    head: bytes = b""
    first_line: int = 1
    line_end: bytes = b""
    language: Language = field(init=False)
    templates: list[Template] = field(default_factory=list)
    index: dict[bytes | None, int] = field(default_factory=dict)
    plain: dict[int, bool] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.language = language_of(self.dialect, Language)

    def read(self, source: bytes) -> Program:
        """The part that begins on `first_line`. Raises as `reader.read`, and `NotInPartsError` for program flow."""
        begun = self.first_line > 1
        check_zeros(source, self.path, self.first_line)
        if not begun:
            check_content(self.head or source, self.path, self.dialect)
        blocks = self.language.split(source)
        if not begun:
            blocks[0, 0] = header_length(source)
        end = len(blocks)
        if not begun:
            end = self.language.end(source, blocks)
        elif b"%" in source:
            head = b"X\n"  # as behind a first block
            end = self.language.end(head + source, np.vstack(([[0, 1]], blocks + len(head)))) - 1
        reading = ProgramReading(
            source, self.path, self.dialect, self.language, blocks, end, self.templates, self.index
        )
        reading.first_line, reading.line_end = self.first_line, self.line_end
        before = len(self.templates)
        program = reading.program()
        self.line_end = program.line_end
        if not all(map(self.language.straight, self.templates[before:])):
            raise NotInPartsError("the program does not run straight from its first line to its last")
        return program

    def last_cut(self, program: Program) -> int:
        """The last block before which a part may end; 0 if there is none."""
        pairs = ((block, block - 1) for block in range(len(program) - 1, 0, -1))
        return next((pair[0] for pair in pairs if all(self._is_plain(program, each) for each in pair)), 0)

    def _is_plain(self, program: Program, block: int) -> bool:
        shape, bulk = int(program.template[block]), self.language.bulk
        if shape not in self.plain:
            template = program.templates[shape]
            alone = not (template.m_codes or any(isinstance(item, Skip) for item in template.items))
            self.plain[shape] = alone and bulk is not None and bulk(program, block) is not None
        return self.plain[shape]


def stretch(program: Program, start: int, stop: int) -> Program:
    """The blocks from `start` up to `stop` as a program of its own, including its line end."""
    ends = (0 if start == 0 else int(program.blocks[start, 0]), len(program.source))
    if stop < len(program):
        ends = ends[0], int(program.blocks[stop, 0])
    numbers = slice(program.first_number[start], program.first_number[stop])
    return Program(
        source=program.source[slice(*ends)],
        path=program.path,
        dialect=program.dialect,
        templates=program.templates,
        template=program.template[start:stop],
        blocks=moved_by(program.blocks[start:stop], -ends[0]),
        first_number=moved_by(program.first_number[start : stop + 1], -int(program.first_number[start])),
        number_spans=moved_by(program.number_spans[numbers], -ends[0]),
        numbers=program.numbers[numbers],
        first_line=program.first_line + program.lines_ended_before(ends[0]),
        line_end=program.line_end,
    )


def joined_programs(parts: list[Program]) -> Program:
    """Consecutive parts joined to one program."""
    if len(parts) == 1:
        return parts[0]
    bytes_before = np.cumsum([0, *(len(part.source) for part in parts)])
    numbers_before = np.cumsum([0, *(len(part.numbers) for part in parts)])
    shifted = list(zip(parts, bytes_before.tolist(), numbers_before.tolist(), strict=False))
    return Program(
        source=b"".join(part.source for part in parts),
        path=parts[0].path,
        dialect=parts[0].dialect,
        templates=parts[-1].templates,
        template=np.concatenate([part.template for part in parts]),
        blocks=np.concatenate([part.blocks + at for part, at, _ in shifted]),
        first_number=np.concatenate([part.first_number[:-1] + n for part, _, n in shifted] + [numbers_before[-1:]]),
        number_spans=np.concatenate([part.number_spans + at for part, at, _ in shifted]),
        numbers=np.concatenate([part.numbers for part in parts]),
        first_line=parts[0].first_line,
        line_end=parts[0].line_end,
    )


def joined_moves(parts: list[Moves], blocks: list[int]) -> Moves:
    """The motions of consecutive parts joined; `blocks`: number of blocks of each part."""
    if len(parts) == 1:
        return parts[0]
    before = np.cumsum([0, *blocks[:-1]])
    columns: dict[str, Any] = {
        each.name: np.concatenate([getattr(part, each.name) for part in parts])
        for each in fields(Moves)
        if each.name not in TABLES
    }
    shifted = [part.block + at for part, at in zip(parts, before.tolist(), strict=True)]
    columns["block"] = np.concatenate(shifted).astype(np.int32)
    return Moves(**columns, **{name: getattr(parts[-1], name) for name in TABLES})


def last_of(program: Program, moves: Moves) -> tuple[Program, Moves]:
    """The last motion and its block, as copies that keep no other data alive."""
    block = int(moves.block[-1])
    found = stretch(program, block, block + 1)
    columns = ("template", "blocks", "first_number", "number_spans", "numbers")
    alone = replace(found, **{name: getattr(found, name).copy() for name in columns})
    motion = motions_at(moves, np.array([len(moves) - 1]))
    return alone, replace(motion, block=motion.block - np.int32(block))


def motions_at(moves: Moves, rows: Index) -> Moves:
    """The motions `rows` (k,)."""
    columns = ((each.name, getattr(moves, each.name)) for each in fields(Moves) if each.name not in TABLES)
    return replace(moves, **{name: column.take(rows, axis=0) for name, column in columns if column is not None})


@frozen
class Checkpoint:
    """The state of a control before the last block of a part that has changed nothing else permanently.

    It can be sent to another process.

    position    (n_axes,) the command, mm and rad
    feed        the feed in force; `feed_given`: whether one is set
    motion      the motion code in force, in tenths
    variables   variables that the program may have set, in the form of the language
    """

    position: list[float]
    feed: float
    feed_given: bool
    motion: int
    variables: Any


class Follower:
    """Follows a program that comes in parts; control and interpreter keep their state between parts.

    walk     makes the interpreter for the first part
    watched  whether to find out what the next part changes, as `checkpoint` requires
    """

    def __init__(
        self, control: ProgramControl, run: Run, walk: Callable[[Any, Program, Run], Interpreter[Any]]
    ) -> None:
        self.control, self.run, self.walk = control, run, walk
        self.interpreter: Interpreter[Any] | None = None
        self.watched = self.unchanged = False

    @property
    def to_the_last(self) -> bool:
        """Whether text after the end of the program matters, because something was searched that may be there."""
        return self.interpreter is not None and self.interpreter.to_the_last

    @property
    def ended(self) -> bool:
        """Whether the control has reached the end of the program."""
        return self.interpreter is not None and self.interpreter.ended

    def follow(self, program: Program, last: bool) -> Moves:
        """The motions of the next part; `last`: it is the last one."""
        control, interpreter = self.control, self.interpreter
        begun = control.lasting() if self.watched and interpreter is not None else None
        if interpreter is None:
            interpreter = self.interpreter = self.walk(control, program, self.run)
        else:
            interpreter.next_part(program, self.run.budget(program))
        control.builder.clear()
        interpreter.check_part(program)
        interpreter.last = last
        interpreter.run()
        if control.switches:
            raise NotInPartsError("blocks with / may be skipped, and ncfix checks all positions of block delete")
        moves = control.moves()
        check_reach(program, moves)
        control.note_rolling(program)
        interpreter.note_uncorrected(program, moves)
        interpreter.check_motions(program, moves)
        self.unchanged = begun is not None and begun == control.lasting()
        return moves

    def checkpoint(self, moves: Moves) -> Checkpoint | None:
        """The state that the last part, with these motions, has left; None if a checkpoint cannot hold all of it.

        The last two blocks of the part must be straight motions.
        """
        control, modal = self.control, self.control.modal
        if not self.unchanged or control.unknown or control.builder.winding is not None or len(moves) < 2:
            return None
        straight = np.isin(moves.kind[-2:], (MotionKind.RAPID, MotionKind.FEED)) & np.isin(moves.modal[-2:], (0, 10))
        if not straight.all() or moves.block[-2] + 1 != moves.block[-1]:
            return None
        tool, length = moves.tool, moves.tool_length  # what is lacking is said of each tool, and of each length of it
        same = (tool == tool[-1]) & ((length == length[-1]) | (np.isnan(length) & np.isnan(length[-1])))
        if not same.all():
            return None
        before = moves.start[-1].tolist(), float(moves.feed[-2]), modal.feed_given, int(moves.modal[-2])
        return Checkpoint(*before, control.set_variables())

    def resume(self, state: Checkpoint) -> None:
        """Continue as if a part had been followed up to its last block, which comes next."""
        modal = self.control.modal
        self.stand(np.array(state.position))
        modal.feed, modal.feed_given = state.feed, state.feed_given
        modal.motion = modal.straight = state.motion
        modal.cycle.initial = None
        self.control.take_variables(state.variables)

    def stand(self, position: Array) -> None:
        """Set the axis positions to a command (n_axes,), mm and rad, at which the corrected program has left them."""
        self.control.position = list(self.control.position)
        for column, value in zip(self.control.builder.columns, position.tolist(), strict=True):
            self.control.position[column] = value

    @property
    def lacking(self) -> tuple[Message, ...]:
        """Errors for data that the program used and the setup does not give, and for axes that the machine lacks."""
        return self.control.lacking

    @property
    def messages(self) -> tuple[Message, ...]:
        """All remarks so far."""
        return self.control.remarks

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names of data taken as zero so far."""
        return tuple(self.control.knowledge.assumed)


MAX_POSITION = 1e9
"""Largest position, mm or rad: no machine goes beyond it, and doubles of that size no longer resolve micrometres."""
TOO_FAR = "NCF248"


def check_reach(program: Program, moves: Moves) -> None:
    """Raise SourceError for the first motion that ends beyond the reach of any machine."""
    far, arcs = _are_far(moves.end), np.flatnonzero(moves.kind == MotionKind.ARC)
    far[arcs] |= _are_far(moves.centre[arcs])
    rows = np.flatnonzero(far & (moves.rule != Rule.REFUSE))
    if rows.size:
        text = "this position is beyond 1e9 mm or 1e9 radians"
        raise SourceError.of(
            TOO_FAR,
            text,
            program.place(int(moves.block[rows[0]])),
            "check the numbers of the block, and the increments, shifts and scale factors before it",
        )


def _are_far(places: Array) -> Mask:
    """(n,) whether each row of `places` (n, k) is out of reach."""
    rows = np.zeros(len(places), dtype=np.bool_)
    if not places.size or max(places.max(), -places.min()) <= MAX_POSITION:
        return rows
    rows[np.flatnonzero(np.abs(places) > MAX_POSITION) // places.shape[1]] = True
    return rows


def finished(control: ProgramControl, program: Program, moves: Moves) -> Trace:
    """The trace of a program that has been followed; raises UsageError with all missing data."""
    check_reach(program, moves)
    control.note_rolling(program)
    if control.lacking:
        raise UsageError.collected(control.lacking)
    marked = stamp.find(program)
    return Trace(
        moves=moves,
        messages=control.remarks,
        assumed=tuple(control.knowledge.assumed),
        stamp="" if marked is None else program.text_of(marked),
        switches=frozenset(control.switches),
    )


NO_LETTER = "NCF207"


def trace(
    program: Program,
    setup: Setup,
    axes: tuple[str, ...],
    rotary: frozenset[str],
    resolve: Callable[[str], bytes | None] | None = None,
    kinematics: Kinematics | None = None,
) -> Trace:
    """Follow a program: its motions in order of execution, as commands in mm and rad with all offsets included.

    `axes` are the machine's axis letters, the columns of the motions; `rotary` those of rotary axes. `resolve` returns
    the text of a subprogram file by its name (`foo` for `o<foo> call`, `100` for `M98 P100`), or None. `kinematics` are
    the machine's; without them, positions after TCP is switched are known only while the rotary axes are at zero.

    Raises SourceError NCF2xx at the first block at which the control would stop, UsageError with all data that the
    program uses and the setup does not give, and with every axis that the program moves and the machine lacks.
    """
    strangers = [axis for axis in axes if axis not in AXIS_LETTERS]
    if strangers:
        raise UsageError.of(NO_LETTER, f"the axis {strangers[0]} has no letter that a program can move")
    interpreter = interpreter_of(program, Run(setup, axes, rotary, resolve, kinematics))
    interpreter.run()
    moves = interpreter.moves()
    interpreter.note_uncorrected(program, moves)
    return finished(interpreter.control, program, moves)


def interpreter_of(program: Program, run: Run) -> Interpreter[Any]:
    """The interpreter of a program, before its first block."""
    language = language_of(program.dialect, FollowedLanguage)
    return language.interpreter(language.control(run, program.dialect), program, run)
