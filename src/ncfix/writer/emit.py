"""Writes corrected motions into the program text: the bytes that change, and the path the control will read.

The emitter follows the motions in order of execution and tracks the state of the control: its position (as written,
rounded to digits) and the motion code in force. A block that is executed several times must be written the same each
time; if not, the block is reported as a conflict, and the caller keeps it unchanged.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.control.moves import FeedMode, Kinematics, MotionKind, Moves, Rule
from ncfix.control.tcp import jumps, passed_through, renamed
from ncfix.control.turns import UNTIMED, minutes, turn_alone, turns_alone, written_feed
from ncfix.text.language import BlockLayout, language_of
from ncfix.text.tree import Program, view
from ncfix.text.writer import Edit, Splices, overlong
from ncfix.values import frozen
from ncfix.writer.block import OTHER_WAY, STRAIGHT_AND_ARCS
from ncfix.writer.bulk import Bulk, write_alone
from ncfix.writer.language import WrittenLanguage
from ncfix.writer.pieces import Pieces, SecondReading
from ncfix.writer.target import TANGENTIAL, FrameMap, Rendered, RetractLevels, Target, plane_across

NOWHERE = np.full(3, np.nan)
SEVERAL_STATES = "the block is executed from several states that need different corrections"
FLOW = "the block has text that is not plain words"
TOO_LONG = "the corrected line would have {} characters, but the control accepts {}"
MODE_LOST = (
    "written as lines it would leave G1 in force, and a later block without a G code, which must stay unchanged, "
    "depends on the code of this block"
)


@frozen
class Emission:
    """Result of writing.

    splices    replacements and insertions in the source, sorted
    end        (m, n_axes) the command at the end of each piece as the control will read it
    centre     (m, 3) the centre of each arc piece, likewise
    start      (n, n_axes) the command at the start of each motion, likewise
    conflicts  block -> why it cannot be written; the text must not be used if there are any
    added_blocks  number of lines added
    timed      motions that turn only rotary axes and were written in inverse time (G93), ascending
    """

    splices: Splices
    end: Array
    centre: Array
    start: Array
    conflicts: dict[int, str]
    added_blocks: int
    timed: tuple[int, ...] = ()

    @property
    def edits(self) -> tuple[Edit, ...]:
        """The replacements and insertions one by one."""
        return tuple(self.splices.edits())


def emit(
    program: Program,
    moves: Moves,
    pieces: Pieces,
    least_increment: Array,
    reading: SecondReading | None = None,
    done: Array | None = None,
    kinematics: Kinematics | None = None,
    bulk: Bulk | None = None,
) -> Emission:
    """Write `pieces` into the program.

    least_increment  (n_axes,) mm and rad: resolution of the control
    reading          how a control read an earlier attempt, if not as intended
    done             (n_axes,) the command at the end of the first motion, if that is already written
    kinematics       the machine's kinematics, for TCP being switched; without them an attempt shows the result
    bulk             the stretches of contiguous motions, if known; then `done` is the command at which they begin
    """
    reading = reading or SecondReading(moves.frame, moves.frames)
    emitter = _Emitter(program, moves, pieces, least_increment, reading, kinematics, bulk)
    return emitter.run(done, 0 if done is None or bulk is not None else 1)


class _Emitter:
    """Follows and writes the motions; `run()` is called once.

    forgets      (n,) motions after which the level R of a canned cycle is no longer in force
    relies       (n,) motions that, if unchanged, rely on the motion code in force
    position     (n_axes,) the command at which the control stands, as written
    jumps        (n, n_axes) where a motion does not start at the end of the one before
    replaced     the motion code in force, in tenths, if it is not the program's own; else None
    replaced_by  the block that changed it
    cycle_end    (n_axes,) the bottom of the last hole in a series of canned cycles; None elsewhere
    levels       the level R of canned cycles
    in_stretch   (n,) motions written in bulk
    written      block -> what was written of each other block
    latest       blocks of `written` whose edits have not been collected yet
    end, centre, start, conflicts  as in `Emission`
    """

    def __init__(
        self,
        program: Program,
        moves: Moves,
        pieces: Pieces,
        least_increment: Array,
        reading: SecondReading,
        kinematics: Kinematics | None,
        bulk: Bulk | None,
    ) -> None:
        self.program, self.kinematics, self.least_increment = program, kinematics, least_increment
        self.language = language_of(program.dialect, WrittenLanguage)
        self.spelling = self.language.spelling(program)
        self.moves, self.pieces, self.reading = moves, pieces, reading
        self.nominal_frames = [FrameMap(frame, moves.axes, moves.rotary) for frame in moves.frames]
        self.frames = [FrameMap(frame, moves.axes, moves.rotary) for frame in reading.frames]
        self.decimals = [frame.decimals(least_increment) for frame in self.frames]
        self.jumps = jumps(moves) if bulk is None else np.zeros(moves.start.shape, dtype=bool)
        self.bulk = bulk or Bulk.of(self.language, program, moves, pieces, reading.frame, reading.frames, self.jumps)
        self.first_piece = self.bulk.first_piece
        self.kind, self.rotary = view(moves.kind), tuple(moves.rotary.tolist())
        plain = np.isin(moves.kind, (MotionKind.RAPID, MotionKind.FEED, MotionKind.ARC)) & (moves.rule != Rule.PASS)
        self.forgets, self.relies = (view(mask) for mask in (moves.kind != MotionKind.DWELL, plain))
        self.idle, self.increments = moves.idle, moves.increments
        x, y, z = (moves.axes.index(c) if c in moves.axes else -1 for c in "XYZ")
        self.spatial = (x, y, z)
        self.layouts: dict[int, BlockLayout | None] = {}
        self.position = moves.start[0].copy() if len(moves) else np.zeros(0)
        self.replaced: int | None = None
        self.cycle_end: Array | None = None
        self.levels = RetractLevels(moves, pieces)
        self.written: dict[int, Rendered] = {}
        self.latest, self.timed, self.added = list[int](), list[int](), 0
        self.in_stretch = np.zeros(len(moves), dtype=bool)
        self.conflicts, self.replaced_by = dict[int, str](), -1
        self.end, self.centre, self.start = pieces.end.copy(), pieces.centre.copy(), moves.start.copy()

    def run(self, done: Array | None, row: int) -> Emission:
        """Write all motions from `row` on; `done` (n_axes,): the command at which the control stands, if given."""
        self.position = self.position if done is None else done.copy()
        while row < len(self.moves):
            count = self._stretch(row)
            if count:
                row += count
                continue
            self._resync(row)
            self.start[row] = self.position
            if self.pieces.unchanged[self.first_piece[row]]:
                self._leave(row)
            else:
                self._write(row)
            if self.kind[row] == MotionKind.CYCLE:
                self.cycle_end = self.position
                self._retract(row)
            elif self.kind[row] != MotionKind.DWELL:
                self.cycle_end = None
                self.levels.forget()
            row += 1
        self._write_centres()
        splices = Splices.joined([*self.bulk.parts, Splices.of(self._edits())])
        limit = self.program.dialect.line_limit
        for block, length in overlong(self.program.source, self.program.blocks, splices, limit).items():
            self.conflicts.setdefault(block, TOO_LONG.format(length, limit))
        added = self.added + self.bulk.added
        return Emission(splices, self.end, self.centre, self.start, self.conflicts, added, tuple(self.timed))

    @cached_property
    def moved(self) -> Mask:
        """(n, n_axes) axes that each motion moves to its end; computed at the first unchanged motion."""
        return self.moves.moved

    @cached_property
    def turns(self) -> Mask:
        """(n,) motions that turn only rotary axes."""
        return turns_alone(self.moves)

    def _stretch(self, row: int) -> int:
        """Write the stretch of motions that begins here in bulk; returns the number of motions written."""
        if self.replaced is not None:
            return 0
        frame, before = self.reading.frame[row], len(self.bulk.parts)
        ends = self.bulk.take(row, self.position, self.frames[frame], self.decimals[frame])
        if ends is None:
            return 0
        if self.latest:
            self.bulk.parts.insert(before, Splices.of(self._edits()))
        first = self.first_piece[row]
        stop = int(np.searchsorted(self.first_piece, first + len(ends)))
        self.end[first : first + len(ends)] = ends
        self.start[row] = self.position
        self.start[row + 1 : stop] = ends.take(self.first_piece[row + 1 : stop] - 1 - first, axis=0)
        self.in_stretch[row:stop], self.cycle_end = True, None
        alone = write_alone(self.bulk.alone(row, stop), stop, self.start, self.moves.programmed, self._written)
        if alone:
            self.in_stretch[alone] = False
            self.bulk.take_out(alone)
        self.replaced = self.replaced if stop - 1 in alone[-1:] else None
        self.position = self.end[first + len(ends) - 1].copy()
        return stop - row

    def _written(self, row: int) -> Array:
        """Write a single motion from its start; returns the command at its end."""
        self.position, self.replaced = self.start[row], None
        (self._leave if self.pieces.unchanged[self.first_piece[row]] else self._write)(row)
        return np.asarray(self.position)

    def _write_centres(self) -> None:
        """Write the centres of the arcs in stretches; an arc whose centre is not certain is written by itself."""
        rows = self.pieces.move[np.flatnonzero(self.pieces.arc)]
        rows = rows[self.in_stretch[rows]]
        frames = self.reading.frame[rows]
        for frame in sorted(set(frames.tolist())):
            own = rows[frames == frame]
            at = self.first_piece[own]
            ends = self.start[own], self.end[at]
            clear, centre = self.bulk.turn(own, ends, self.frames[frame], self.decimals[frame])
            self.centre[at[clear]] = centre
            for row in own[~clear].tolist():
                self._written(row)

    # -- the control's book -------------------------------------------------------------------------------------------

    def _resync(self, row: int) -> None:
        """Take over the control's own position where it moved by itself (in its cycles, to reference points)."""
        jump = self.jumps[row]
        if jump.any():
            began = self.reading.start
            read = self.moves.start[row] if began is None else began[row]
            still = renamed(self.moves, row, self.position, self.kinematics) if began is None else None
            self.position = np.where(jump, read, self.position) if still is None else still

    def _retract(self, row: int) -> None:
        """Set the position after a canned cycle: where it started, or at R; if neither, a second reading shows it."""
        if row + 1 == len(self.moves) or self.reading.start is not None:
            return
        moves, risen = self.moves, self.levels.returns(row)
        if self.levels.approach is not None:
            self.position = np.where(risen, self.levels.approach, self.position)
        back = (moves.start[row + 1] == moves.start[row]) & (moves.end[row] != moves.start[row])
        self.position = np.where(back & ~risen, self.start[row], self.position)
        self.jumps[row + 1] &= ~(back | risen)

    def _leave(self, row: int) -> None:
        moves = self.moves
        if self.forgets[row]:
            self.levels.forget()
        moved, began, ended = self.moved[row], self.reading.start, self.reading.end
        if began is not None and ended is not None:  # a departure goes on along a line that is now a corrected one
            moved = moved | (np.abs(ended[row] - began[row]) > 0)
        passed = passed_through(moves, row, self.position, self.kinematics) if began is None else None
        self.position = np.where(moved, self._unchanged_end(row), self.position) if passed is None else passed
        self.end[self.first_piece[row]] = self.position
        if self.relies[row]:
            self._check_code(row)

    def _unchanged_end(self, row: int) -> Array:
        moves = self.moves
        if self.reading.end is not None:
            return np.asarray(self.reading.end[row])
        way = moves.end[row] - moves.start[row]
        return np.asarray(np.where(self.increments[row], self.position + way, moves.end[row]))

    def _check_code(self, row: int) -> None:
        """Report a conflict if an unchanged motion relies on a motion code that was replaced."""
        layout = self._layout(int(self.moves.block[row]))
        lost = self.replaced not in (None, int(self.moves.modal[row])) and (layout is None or layout.motion is None)
        if lost and self.replaced_by not in self.conflicts:
            self.conflicts[self.replaced_by] = MODE_LOST
        self.replaced = None

    # -- writing a motion ---------------------------------------------------------------------------------------------

    def _write(self, row: int) -> None:
        block = int(self.moves.block[row])
        layout = self._layout(block)
        if layout is None:
            self.conflicts.setdefault(block, FLOW)
            self._leave(row)
            return
        rows = slice(self.first_piece[row], self.first_piece[row + 1])
        target = self._target(row, rows)
        if target.turn_by_feed and target.inverse_time and turn_alone(self.moves, row) > 0:
            target = target.at_their_pace()
        if target.is_dragged and math.isinf(target.turn_minutes):
            self.conflicts.setdefault(block, UNTIMED)
        elif target.is_dragged and not target.turn_by_feed:
            self.timed.append(row)
        rendered = self.language.writer(self.program, block, layout, target, self.spelling).write()
        if rendered.conflict:
            self.conflicts.setdefault(block, rendered.conflict)
        if rendered.conflict == OTHER_WAY:
            self._keep_start(row)
        ends, frame = np.array(rendered.ends), self.frames[self.reading.frame[row]]
        self.end[rows] = frame.command(ends)
        if rendered.centre is not None:
            self.centre[rows.start] = frame.command_point(rendered.centre)
        for piece, centre in rendered.centres.items():
            self.centre[rows.start + piece] = frame.command_point(centre)
        self.levels.note(int(self.reading.frame[row]), frame, target, rendered)
        still = frame.still(ends[-1] == target.start)
        self.position = np.where(still, self._before(row), self.end[rows.stop - 1])
        self.end[rows.stop - 1] = self.position
        code = target.last_code if rendered.code is None else rendered.code
        self.replaced = code if code != int(self.moves.modal[row]) and code in STRAIGHT_AND_ARCS else None
        self.replaced_by = block
        if block not in self.written:
            self.written[block] = rendered
            self.latest.append(block)
        elif self.written[block].text != rendered.text:
            self.conflicts.setdefault(block, SEVERAL_STATES)

    def _keep_start(self, row: int) -> None:
        """Keep the motions before a row, too, that say where its rotary axes start: only from there it goes its way."""
        pointing = self.moves.pointing
        assert pointing is not None
        free = True
        while free and row:
            row -= 1
            self.conflicts.setdefault(int(self.moves.block[row]), OTHER_WAY)
            free = pointing.at_pole(pointing.direction(self.moves.end[row]))

    def _target(self, row: int, rows: slice) -> Target:
        moves, pieces = self.moves, self.pieces
        at = int(self.reading.frame[row])
        frame = self.frames[at]
        as_programmed = self.nominal_frames[moves.frame[row]]
        start = frame.program(self._before(row).copy())
        nominal_start = as_programmed.program(moves.start[row].copy())
        nominal = as_programmed.program(moves.end[row].copy())
        arc, modal, kind = bool(pieces.arc[rows.start]), int(moves.modal[row]), self.kind[row]
        straight = modal if modal in (0, 10) or kind == MotionKind.CYCLE else 10
        fractions, ends, wordless = pieces.fraction[rows], frame.program(pieces.end[rows].copy()), self.idle[row]
        if wordless.any():
            ends[:, wordless] = start[wordless]
        call = moves.call_of(row)
        if call is not None and call.led and self.reading.end is not None:  # the blocks that do may have been refused
            columns = [moves.axes.index(letter) for letter in call.led]
            ends[:, columns] = frame.program(self.reading.end[row].copy())[columns]
        shares = np.diff(fractions, prepend=0.0) if len(fractions) > 1 else fractions
        arcs = pieces.arc[rows] if len(fractions) > 1 and pieces.arc[rows].any() else None
        return Target(
            letters=moves.axes,
            resolved=self.least_increment / frame.scale,
            decimals=self.decimals[at],
            start=start,
            nominal=nominal,
            original=nominal - nominal_start if moves.incremental[row] else nominal,
            ends=ends,
            arc=arc,
            centre=frame.program_point(pieces.centre[rows.start]) if arc else NOWHERE,
            original_centre=as_programmed.program_point(moves.centre[row]) if kind == MotionKind.ARC else NOWHERE,
            origin=as_programmed.point_of(nominal_start),
            plane=plane_across(frame.frame.rotation.T @ moves.normal[row]) if kind == MotionKind.ARC else (0, 1, 2),
            spatial=self.spatial,
            diameter=frame.frame.diameter,
            incremental=bool(moves.incremental[row]),
            centre_absolute=bool(moves.arc_absolute[row]),
            shares=shares if pieces.share is None else pieces.share[rows],
            inverse_time=int(moves.feed_mode[row]) == FeedMode.INVERSE_TIME and modal != 0,
            code=modal if arc else straight,
            active_code=modal if self.replaced is None else self.replaced,
            feed=written_feed(moves, row),
            turn_minutes=self._turn_minutes(row),
            turn_by_feed=self.program.dialect.feed_of == "linear",
            arcs=arcs,
            centres=None if arcs is None else frame.program_point(pieces.centre[rows]),
            arc_code=TANGENTIAL.get(modal, modal),
            increments=frame.frame.increments,
            rotary=self.rotary,
            pointing=moves.pointing,
            rotation=frame.frame.rotation,
            offset=frame.frame.offset,
            wordless=tuple(wordless.tolist()),
            call=call,
            measured=tuple(moves.measured[row].tolist()),
            spelled=tuple(moves.spelled[row].tolist()),
            level=self.levels.wanted(
                row, rows.start, at, frame, as_programmed, self.position, self.program.dialect.cycle_of(modal).level
            ),
        )

    def _turn_minutes(self, row: int) -> float:
        """The time, min, of a rotation of rotary axes alone, if linear axes might take over its feed; else NaN."""
        if self.program.dialect.feed_of == "all" or not self.turns[row]:
            return float("nan")
        return minutes(self.moves, row)

    def _before(self, row: int) -> Array:
        """The positions of axes that the block does not name; in a canned cycle, the depth of the last hole."""
        if self.cycle_end is not None and self.kind[row] == MotionKind.CYCLE:
            return self.cycle_end
        return self.position

    def _layout(self, block: int) -> BlockLayout | None:
        key = int(self.program.template[block]) if self.language.same_per_shape else block
        if key not in self.layouts:
            self.layouts[key] = self.language.layout(self.program, block)
        return self.layouts[key]

    # -- the result ---------------------------------------------------------------------------------------------------

    def _edits(self) -> list[Edit]:
        """The edits of blocks written one by one since the last call."""
        edits, end_of_line = list[Edit](), self.program.line_end.decode()
        for block in sorted(self.latest):
            rendered = self.written[block]
            edits.extend(Edit(start, stop, text.encode("latin-1")) for start, stop, text in rendered.edits)
            if lines := rendered.lines_before(self.written.get(block + 1)):
                at = int(self.program.blocks[block, 1])
                edits.append(Edit(at, at, "".join(end_of_line + line for line in lines).encode("latin-1")))
            self.added += len(lines) + rendered.opens
        self.latest = []
        return edits
