"""Stretches of corrected motions, straight ones and arcs, written all at once.

What the emitter and `BlockWriter` do motion by motion, done as columns, byte for byte; a test holds the two together.
A motion qualifies if its block is words with plain numbers, is executed once, and becomes one block with the same
motion code. Whatever is not clear to the last digit (a value in the middle between two outputs, a position that is
not on the digits) ends a stretch, and the emitter takes it by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ncfix import core
from ncfix.control.moves import Frame, MotionKind, Moves
from ncfix.text.spelling import (
    ROUNDED,
    NumberColumns,
    Styles,
    in_style,
    is_plain,
    laid_out,
    plain,
    rounded,
    rules,
    styles_of,
)
from ncfix.text.tree import Program
from ncfix.text.writer import Splices
from ncfix.writer.bulk_arcs import CentreWords, OutputSteps, whole_arcs
from ncfix.writer.bulk_fit import qualified, sound, with_dwells
from ncfix.writer.bulk_layouts import CLOSING, NONE, OPENING, Layouts, lines_of, with_lines
from ncfix.writer.language import WrittenLanguage
from ncfix.writer.pieces import Pieces
from ncfix.writer.target import FrameMap

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Mask = NDArray[np.bool_]

SHORTEST = 16
"""Stretches of fewer motions go one by one."""
SWAPPED = bytes.maketrans(b".,", b",.")
LONGEST = 1 << 14
"""Motions that are taken at once; where one is not clear, those behind it were taken in vain."""


@dataclass
class Bulk:
    """The stretches of one emission.

    stop     (n + 1,) for each motion, the first one from there on that does not qualify
    layouts  the layout of each shape that qualifies
    added    lines that were put in
    """

    program: Program
    moves: Moves
    pieces: Pieces
    first_piece: IntArray
    layouts: Layouts
    stop: IntArray
    parts: list[Splices] = field(default_factory=list)
    added: int = 0

    @classmethod
    def of(
        cls,
        language: WrittenLanguage,
        program: Program,
        moves: Moves,
        pieces: Pieces,
        frame: NDArray[np.int32],
        frames: tuple[Frame, ...],
        jumps: Mask,
    ) -> Bulk:
        """Find the stretches. `frame`, `frames` are those in which the control reads the motions."""
        first_piece = np.append(np.flatnonzero(np.diff(pieces.move, prepend=-1)), len(pieces))
        layouts = Layouts.of(language, program, moves)
        fit = qualified(program, moves, pieces, first_piece, layouts)
        fit &= np.array([_is_plain(each) for each in frames], dtype=np.bool_)[frame] if len(moves) else False
        if language.one_by_one is not None and fit.any():
            fit &= ~language.one_by_one(program, moves, pieces, first_piece)
        if moves.spelled is not None:
            fit &= ~moves.spelled.any(axis=1)
        fit = with_dwells(fit, program, moves, pieces, first_piece, layouts)
        stop = _stops(fit & ~jumps.any(axis=1) if jumps.any() else fit)
        changes = np.append(np.flatnonzero((np.diff(frame) != 0) | _silenced(moves)) + 1, len(moves))
        stop[:-1] = np.minimum(stop[:-1], changes[np.searchsorted(changes, np.arange(len(moves)), side="right")])
        return cls(program, moves, pieces, first_piece, layouts, stop)

    @cached_property
    def wordless(self) -> Mask | None:
        """(n, n_axes) axes that must get no word: no stretch begins where one of them stands elsewhere. None: none."""
        wordless = self.moves.wordless
        return wordless if wordless.any() else None

    @property
    def text(self) -> NDArray[np.uint8]:
        """The source, with decimal points where it has commas."""
        comma, source = self.layouts.spelling.comma, self.program.source
        return np.frombuffer(source.translate(SWAPPED) if comma else source, dtype=np.uint8)

    def put(self, splices: Splices) -> None:
        """Take in what changes, with commas if the program has such."""
        comma = self.layouts.spelling.comma
        self.parts.append(replace(splices, data=splices.data.translate(SWAPPED)) if comma else splices)

    @classmethod
    def among(
        cls,
        language: WrittenLanguage,
        program: Program,
        moves: Moves,
        pieces: Pieces,
        first_piece: IntArray,
        plain: Mask,
    ) -> Bulk | None:
        """The stretches of `plain` motions (n,), all of one frame; None if the frame does not allow any.

        first_piece  (n + 1,) the first piece of each motion, and how many there are
        """
        layouts = Layouts.of(language, program, moves)
        if not _is_plain(moves.frames[int(moves.frame[0])]):
            return None
        shapes = program.template[moves.block]
        fit = plain & layouts.known[shapes]
        several = np.flatnonzero(np.diff(first_piece) > 1)
        fit[several] &= layouts.further[shapes[several]]
        if (moves.kind == MotionKind.ARC).any():
            fit |= sound(moves, pieces, first_piece) & whole_arcs(program, moves, pieces, first_piece[:-1], layouts)
        if language.one_by_one is not None:
            fit &= ~language.one_by_one(program, moves, pieces, first_piece)
        fit = with_dwells(fit, program, moves, pieces, first_piece, layouts)
        return cls(program, moves, pieces, first_piece, layouts, _stops(fit))

    def take(self, row: int, position: FloatArray, frame: FrameMap, decimals: IntArray) -> FloatArray | None:
        """Write the stretch that begins with motion `row`, as far as it is clear, but for centres of arcs.

        position  (n_axes,) the command at which the control stands
        decimals  (n_axes,) digits that the least increment needs

        Returns the commands at the ends of the pieces written, (k, n_axes); None if there are none.
        """
        if self.stop[row] == row:
            return None
        if (
            self.wordless is not None
            and (self.wordless[row] & (position != self.pieces.end[self.first_piece[row]])).any()
        ):
            return None
        write = self._compiled if core.engaged() else self._in_columns
        found = write(row, position, frame, self._steps_for(decimals))
        if found is None:
            return None
        ends, splices = found
        self.put(splices)
        self.added += len(ends) - int(np.searchsorted(self.first_piece, self.first_piece[row] + len(ends))) + row
        return ends

    def turn(
        self, rows: IntArray, ends: tuple[FloatArray, FloatArray], frame: FrameMap, decimals: IntArray
    ) -> tuple[Mask, FloatArray]:
        """Write the centre words of arcs `rows` (k,) that were taken; of one that is not clear nothing stays written.

        ends  (k, n_axes) the commands at their starts and ends, as they were written

        Returns which are clear, (k,), and the centres of these, (c, 3), command coordinates, mm.
        """
        steps, centre = self._steps_for(decimals), self.pieces.centre[self.first_piece[rows]]
        words = CentreWords.of(self.program, self.layouts, self.moves, rows, ends, centre, frame, steps)
        clear = words.clear
        if not clear.all():
            spans = self.program.blocks[words.block[~clear]]
            self.parts[:] = [part.outside(spans) for part in self.parts]
            words = words.rows(clear)
        self.put(words.splices(self.program, self.layouts, steps))
        return clear, words.centre

    def alone(self, row: int, stop: int) -> list[int]:
        """The arcs from motion `row` up to `stop` that `BlockWriter` writes."""
        alone = self.layouts.alone
        if not alone.any():
            return []
        found: list[int] = (row + np.flatnonzero(alone[self.program.template[self.moves.block[row:stop]]])).tolist()
        return found

    def take_out(self, rows: list[int]) -> None:
        """Nothing stays written of some motions of the stretch that was taken last."""
        if rows:
            self.parts[-1] = self.parts[-1].outside(self.program.blocks[self.moves.block[rows]])
            self.added -= int(np.diff(self.first_piece)[rows].sum()) - len(rows)

    def _steps_for(self, decimals: IntArray) -> OutputSteps:
        return OutputSteps(self.text, decimals, _halves(decimals), self.layouts.spelling.signed)

    def _in_columns(
        self, row: int, position: FloatArray, frame: FrameMap, steps: OutputSteps
    ) -> tuple[FloatArray, Splices] | None:
        """The commands at the ends of the pieces of a stretch, (k, n_axes), and what changes in the words of axes."""
        stop = min(int(self.stop[row]), row + LONGEST)
        if stop - row < SHORTEST:
            return None
        stretch = WrittenStretch.of(self, row, stop, position, frame, steps).clear_head()
        return (stretch.commands(), stretch.splices()) if len(stretch.block) else None

    def _compiled(
        self, row: int, position: FloatArray, frame: FrameMap, steps: OutputSteps
    ) -> tuple[FloatArray, Splices] | None:
        """As `_in_columns`, compiled."""
        from ncfix.core import words

        stop, program, layouts = int(self.stop[row]), self.program, self.layouts
        pieces = self.first_piece[row : stop + 1]
        ends, axes = self.pieces.end[pieces[0] : pieces[-1]], len(position)
        edits = (stop - row) * (axes + 1)
        blocks = self.moves.block[row:stop]
        commands, data = np.empty_like(ends), np.empty(self._room(pieces, blocks, axes * words.ROOM), dtype=np.uint8)
        start, end, length = (np.empty(edits, dtype=np.int64) for _ in range(3))
        pen = words.Pen(
            rules(),
            steps.text,
            program.blocks,
            program.first_number,
            program.template,
            program.numbers,
            program.number_spans,
            *layouts.arrays,
            np.frombuffer(program.line_end, dtype=np.uint8),
            frame.frame.offset,
            frame.scale,
            steps.decimals,
            steps.half,
            steps.signed,
            position.copy(),
            np.empty(axes),
            np.empty(axes),
            np.empty(axes, dtype=np.int64),
        )
        done = pen.write(blocks, ends, pieces - pieces[0], commands, start, end, length, data)
        if not done:
            return None
        edits, size = pen.edits, pen.size
        return commands[:done], Splices(start[:edits], end[:edits], length[:edits], data[:size].tobytes())

    def _room(self, pieces: IntArray, blocks: NDArray[np.int32], words: int) -> int:
        """Bytes that the words and lines of some motions take at most; `words`: those of a piece."""
        lines, line = int(pieces[-1] - pieces[0]), words + len(b"\r\n") + OPENING + CLOSING
        if not self.layouts.lined:
            return lines * line
        several = np.diff(pieces) - 1
        rows = blocks[several > 0].astype(np.int64)
        leads = self.layouts.lead_ends(self.program, rows) - self.program.blocks[rows, 0]
        return lines * line + int((several[several > 0] * leads).sum())


def _stops(fit: Mask) -> IntArray:
    """(n + 1,) for each motion, and behind the last one, the first from there on that is not `fit` (n,)."""
    ends = np.append(np.flatnonzero(~fit), len(fit))
    return np.repeat(ends, np.diff(ends, prepend=-1))


def _silenced(moves: Moves) -> Mask:
    """(n - 1,) motions but the first in which an axis must get no word that might have got one in the motion before."""
    wordless = moves.wordless
    return np.asarray((wordless[1:] & ~wordless[:-1]).any(axis=1))


def _halves(decimals: IntArray) -> FloatArray:
    """Half output steps."""
    halves: FloatArray = 0.5 * 10.0 ** -decimals.astype(float)
    return halves


def _is_plain(frame: Frame) -> bool:
    """Whether each number in a frame stands for one axis, with a point or without."""
    turned = bool((frame.rotation != np.eye(3)).any())
    return not (turned or frame.diameter) and frame.increments == (1.0, 1.0)


@dataclass(slots=True)
class WrittenStretch:
    """One stretch while it is written; k pieces of its motions, columns by axis.

    block     (k,) the block of the motion
    further   (k,) the piece is not the first one of its motion: it gets a line of its own
    words     (k, n_axes) index of the number of each axis word, -1 where there is none
    wanted    (k, n_axes) program numbers of the corrected ends
    values    (k, n_axes) what will stand there: as written now, as written anew, or where the axis is left
    rewrite   words that get another value
    add       axes that get a word
    styles    of the words that get another value, in the order of `words[rewrite]`
    """

    bulk: Bulk
    block: IntArray
    further: Mask
    position: FloatArray
    frame: FrameMap
    decimals: IntArray
    words: IntArray
    wanted: FloatArray
    values: FloatArray
    rewrite: Mask
    add: Mask
    styles: Styles
    clear: Mask

    @classmethod
    def of(
        cls, bulk: Bulk, row: int, stop: int, position: FloatArray, frame: FrameMap, steps: OutputSteps
    ) -> WrittenStretch:
        """Work out which words change."""
        program, decimals = bulk.program, steps.decimals
        rows = slice(bulk.first_piece[row], bulk.first_piece[stop])
        move = bulk.pieces.move[rows]
        block = bulk.moves.block.take(move).astype(np.int64)
        further = np.diff(move, prepend=-1) == 0
        words = _words(bulk, block, further)
        worded, present = words >= 0, words != NONE
        wanted = frame.program(bulk.pieces.end[rows])
        half, digits = np.tile(steps.half, (len(block), 1)), np.tile(decimals, (len(block), 1))
        original = np.where(worded, program.numbers.take(words, mode="clip"), wanted)
        rewrite = np.abs(wanted - original) >= half
        rewrite[np.flatnonzero(further[1:])] = True
        rewrite &= present
        anew = np.flatnonzero(worded & rewrite)
        spans = program.number_spans.take(words.ravel().take(anew), axis=0)
        styles = styles_of(steps.text, spans, signed=steps.signed)
        digits.ravel()[anew] = np.maximum(digits.ravel().take(anew), styles.decimals)
        kept = present & ~rewrite
        clear = is_plain(wanted, digits) | kept
        clear.ravel()[anew] &= styles.clear
        values = np.where(kept, original, rounded(wanted, digits))
        add = np.zeros_like(present)
        if not present.all():
            start, stood = frame.program(position), frame.program(frame.command(values))
            stays = ~present & bulk.layouts.nameless(program, block)
            for axis in range(len(position)):
                near = with_those_before(np.flatnonzero(~present[:, axis]), len(block))
                cells = near, axis
                add[cells], clear[cells] = missing(
                    start[axis], stood[cells], present[cells], wanted[cells], clear[cells], stays[cells], half[0, axis]
                )
            alone = np.flatnonzero(further)
            clear[alone[~add[alone].any(axis=1)]] = False
            still = np.flatnonzero(bulk.moves.kind[move] == MotionKind.DWELL)
            add[still], clear[still] = False, True
        return cls(bulk, block, further, position, frame, decimals, words, wanted, values, rewrite, add, styles, clear)

    def clear_head(self) -> WrittenStretch:
        """The motions up to the first one that is not clear in all its pieces."""
        if self.clear.all():
            return self
        fine = np.asarray(self.clear.all(axis=1))
        count = int(np.flatnonzero(~self.further[: int(np.argmin(fine)) + 1])[-1])
        styles = self.styles.rows(np.arange(np.count_nonzero(self.rewrite[:count])))
        columns = ("block", "further", "words", "wanted", "values", "rewrite", "add", "clear")
        return replace(self, styles=styles, **{name: getattr(self, name)[:count] for name in columns})

    def commands(self) -> FloatArray:
        """The commands at the ends of the pieces, (k, n_axes): an axis that is not told to move stays where it was."""
        told = (self.words != NONE) | self.add
        commands = self.frame.command(self.values)
        if told.all():
            return commands
        for axis in range(len(self.position)):
            near = with_those_before(np.flatnonzero(~told[:, axis]), len(told))
            commands[near, axis] = last_told(commands[near, axis], told[near, axis], self.position[axis])
        return commands

    def splices(self) -> Splices:
        """What changes in the source."""
        spans, new = self._rewritten()
        rows, places, added = self._added()
        start, stop = np.concatenate((spans[:, 0], places)), np.concatenate((spans[:, 1], places))
        order = np.argsort(2 * start + (stop > start), kind="stable")
        texts = laid_out(new.and_then(added, order))
        words = Splices(start.take(order), stop.take(order), texts.length, texts.data)
        lined = self.bulk.layouts.lined and self.further.any()
        return self._in_lines(words, rows, np.argsort(order)[len(spans) :]) if lined else words

    def _rewritten(self) -> tuple[IntArray, NumberColumns]:
        """The words that get another value: where they stand, (m, 2), and how they are to be written."""
        cells = np.flatnonzero(self.rewrite)
        values, decimals = self.wanted.ravel().take(cells), self.decimals.take(cells % len(self.decimals))
        spans = self.bulk.program.number_spans.take(self.words.ravel().take(cells), axis=0)
        return spans, in_style(values, self.styles, decimals)

    def _added(self) -> tuple[IntArray, IntArray, NumberColumns]:
        """The words that are missing, and those of further pieces, in the order in which programs write them.

        Returns the row of each, the place where it is put in, and how it is to be written.
        """
        program, layouts = self.bulk.program, self.bulk.layouts
        rows, columns = np.divmod(np.flatnonzero(self.add[:, layouts.by_letter]), len(self.decimals))
        columns = layouts.by_letter.take(columns)
        blocks, further = self.block.take(rows), self.further.take(rows)
        at = np.where(further, program.blocks[blocks, 1], layouts.places(program, blocks))
        heads = np.zeros((len(rows), 4), dtype=np.uint8)
        heads[:, 2:] = layouts.heads[program.template[blocks], columns]
        if not layouts.lined:
            begins = further & (np.diff(rows, prepend=-1) != 0)
            heads[begins, :3] = np.frombuffer(program.line_end.rjust(2, b"\0") + b"\0", dtype=np.uint8)
        values, decimals = self.wanted[rows, columns], self.decimals.take(columns)
        return rows, at, plain(values, decimals, heads, signed=layouts.spelling.signed)

    def _in_lines(self, words: Splices, rows: IntArray, places: IntArray) -> Splices:
        """Words with what else stands on lines of further pieces; added ones are of `rows`, at `places` among all."""
        program, further = self.bulk.program, self.further.take(rows)
        first = np.flatnonzero(further & (np.diff(rows, prepend=-1) != 0))
        last = np.flatnonzero(further & (np.diff(rows, append=-1) != 0))
        texts = lines_of(program, self.bulk.layouts, self.block.take(rows.take(first)), program.line_end)
        return with_lines(words, *texts, (places.take(first), places.take(last)))


def _words(bulk: Bulk, block: IntArray, further: Mask) -> IntArray:
    """(k, n_axes) the number of each axis word of pieces; `NONE`, or `LED` for what is led without one."""
    found = bulk.layouts.slots.take(bulk.program.template.take(block), axis=0)
    found[np.flatnonzero(further)] = NONE
    first = np.repeat(bulk.program.first_number.take(block), found.shape[1]).reshape(found.shape)
    words: IntArray = np.where(found >= 0, first + found, found)
    return words


# -- words that axes lack which have to stand elsewhere than where the program leaves them -----------------------------


def with_those_before(rows: IntArray, n: int) -> IntArray | slice:
    """Rows and those just before them, of n; all, if they are many."""
    if 4 * len(rows) > n:
        return slice(None)
    return np.flatnonzero(np.bincount(np.concatenate((rows, np.maximum(rows - 1, 0)))))


def last_told(values: FloatArray, told: Mask, start: float) -> FloatArray:
    """What was told last in each row (k,), `start` before the first time."""
    last = np.maximum.accumulate(np.where(told, np.arange(len(told)), -1))
    found: FloatArray = np.where(last >= 0, values[last], start)
    return found


def missing(
    start: float, values: FloatArray, present: Mask, wanted: FloatArray, clear: Mask, stays: Mask, half: float
) -> tuple[Mask, Mask]:
    """Where an axis without a word must stand elsewhere by half an output step, (k,), and what is `clear` then.

    start   program number of where the control stands before the stretch
    values  program numbers of where it stands behind each piece, if that tells it to go there
    rows of pieces that have a word may be left out, unless one that lacks it comes next
    stays  it gets no word; where it must stand elsewhere by more than what rounding does to it, that is not clear

    After its last word an axis is left there until it is off by half a step; from then on it is on the digits, and gets
    a word whenever the nearest digits change.
    """
    rows = np.arange(len(values))
    last_word = np.maximum.accumulate(np.where(present, rows, -1))
    left_at = last_told(values, present, start)
    away = ~(np.abs(wanted - left_at) < half)
    last_away = np.maximum.accumulate(np.where(away & ~present, rows, -1))
    held = np.append(-1, last_away[:-1]) <= last_word
    before = np.where(held, left_at, np.append(start, values[:-1]))
    add = ~present & ~(np.abs(wanted - before) < half) & ~stays
    clear = clear | (~present & held & ~away)
    clear[stays] = (np.abs(wanted - left_at) <= ROUNDED * half)[stays]
    return add, clear


# -- arcs in a stretch that are written by themselves all the same -----------------------------------------------------
# While a stretch is written they count as straight: their words of axes say where the motions behind them begin. Some
# end elsewhere, by some digits; what behind one relies on that, having no word for an axis, is written by itself, too.


def write_alone(
    arcs: Sequence[int], stop: int, start: FloatArray, named: Mask, write: Callable[[int], FloatArray]
) -> list[int]:
    """Write arcs of a stretch that ends before motion `stop`, in order, and what relies on where they end.

    start  (n, n_axes) the commands at which motions begin; put right
    named  (n, n_axes) axes for which a motion has a word
    write  writes a motion from its start on; returns the command at its end

    Returns the motions that were written.
    """
    rows: list[int] = []
    for arc in arcs:
        row, relies = arc, not rows or arc > rows[-1]
        while relies:
            end = write(row)
            rows.append(row)
            row += 1
            relies = row < stop and bool(((end != start[row]) & ~named[row]).any())
            if row < stop:
                start[row] = end
    return rows
