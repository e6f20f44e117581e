"""Writes stretches of corrected motions, straight ones and arcs, at once in the compiled core.

The result is identical, byte for byte, to that of the emitter and `BlockWriter`; a test compares them. A motion
qualifies if its block consists of words with plain numbers, is executed once, and becomes one block with the same
motion code. Whatever is not certain to the last digit (a value halfway between two outputs, a position that is not a
whole number of output steps) ends a stretch, and is left to the emitter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix import core
from ncfix.arrays import Array, Bytes, Ints, Mask, stops
from ncfix.control.moves import FeedMode, Frame, MotionKind, Moves, Rule
from ncfix.control.turns import turns_alone
from ncfix.text.spelling import rules
from ncfix.text.tree import Program
from ncfix.text.writer import Splices
from ncfix.values import mutable
from ncfix.writer.bulk_layouts import CLOSING, NONE, OPENING, Layouts, places_of
from ncfix.writer.language import WrittenLanguage
from ncfix.writer.pieces import Pieces
from ncfix.writer.target import FrameMap

SWAPPED = bytes.maketrans(b".,", b",.")
PLANES = np.array(((1, 2), (2, 0), (0, 1)))
"""The axes of a plane (indices of X Y Z), in the order in which their words are added, by the axis across it."""
CIRCLE_MM = 1e-3
"""Smallest distance of start and end of an arc written in bulk, mm: below it `BlockWriter` decides on a full circle."""


class EditRoom:
    """Room for so many edits with so many bytes together, which the core fills in."""

    def __init__(self, edits: int, size: int) -> None:
        self.columns = tuple(np.empty(edits, dtype=np.int64) for _ in range(3))
        self.data = np.empty(size, dtype=np.uint8)
        self.buffer = core.loops("edits").EditBuffer(*self.columns, self.data)

    @property
    def splices(self) -> Splices:
        """The edits so far."""
        start, stop, length = (column[: self.buffer.count] for column in self.columns)
        return Splices(start, stop, length, self.data[: self.buffer.size].tobytes())


@mutable(slots=False)
class Bulk:
    """The stretches of one emission.

    stop     (n + 1,) for each motion, the first one from there on that does not qualify
    layouts  the layouts of the shapes that qualify
    added    number of inserted lines
    """

    program: Program
    moves: Moves
    pieces: Pieces
    first_piece: Ints
    layouts: Layouts
    stop: Ints
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
        """Find the stretches. `frame`, `frames`: the frames in which the control reads the motions."""
        first_piece = np.append(np.flatnonzero(np.diff(pieces.move, prepend=-1)), len(pieces))
        layouts = Layouts.of(language, program, moves)
        fit = qualified(program, moves, pieces, first_piece, layouts)
        fit &= np.array([_is_plain(each) for each in frames], dtype=np.bool_)[frame] if len(moves) else False
        if language.one_by_one is not None and fit.any():
            fit &= ~language.one_by_one(program, moves, pieces, first_piece)
        fit &= ~moves.spelled.any(axis=1)
        fit = with_dwells(fit, program, moves, pieces, first_piece, layouts)
        stop = stops(fit & ~jumps.any(axis=1) if jumps.any() else fit)
        wordless = moves.wordless
        silenced = (wordless[1:] & ~wordless[:-1]).any(axis=1)  # an axis gets no word behind a motion that may give one
        changes = np.append(np.flatnonzero((np.diff(frame) != 0) | silenced) + 1, len(moves))
        stop[:-1] = np.minimum(stop[:-1], changes[np.searchsorted(changes, np.arange(len(moves)), side="right")])
        return cls(program, moves, pieces, first_piece, layouts, stop)

    @cached_property
    def wordless(self) -> Mask | None:
        """(n, n_axes) axes that must get no word: no stretch begins where one of them is displaced. None: none."""
        wordless = self.moves.wordless
        return wordless if wordless.any() else None

    @property
    def text(self) -> Bytes:
        """The source, with decimal commas replaced by points."""
        comma, source = self.layouts.spelling.comma, self.program.source
        return np.frombuffer(source.translate(SWAPPED) if comma else source, dtype=np.uint8)

    def put(self, splices: Splices) -> None:
        """Record changes, with decimal commas if the program has them."""
        comma = self.layouts.spelling.comma
        self.parts.append(replace(splices, data=splices.data.translate(SWAPPED)) if comma else splices)

    @classmethod
    def among(
        cls,
        language: WrittenLanguage,
        program: Program,
        moves: Moves,
        pieces: Pieces,
        first_piece: Ints,
        plain: Mask,
    ) -> Bulk | None:
        """The stretches of `plain` motions (n,), all in one frame; None if the frame does not allow any.

        first_piece  (n + 1,) the first piece of each motion, and the number of pieces
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
        return cls(program, moves, pieces, first_piece, layouts, stops(fit))

    def take(self, row: int, position: Array, frame: FrameMap, decimals: Ints) -> Array | None:
        """Write the stretch that begins with motion `row` as far as it is certain, without the centres of arcs.

        position  (n_axes,) the command at which the control stands
        decimals  (n_axes,) number of decimals that the least increment needs

        Returns the commands at the ends of the pieces written, (k, n_axes); None if there are none.
        """
        if self.stop[row] == row:
            return None
        if (
            self.wordless is not None
            and (self.wordless[row] & (position != self.pieces.end[self.first_piece[row]])).any()
        ):
            return None
        found = self._written(row, position, frame, decimals)
        if found is None:
            return None
        ends, splices = found
        self.put(splices)
        self.added += len(ends) - int(np.searchsorted(self.first_piece, self.first_piece[row] + len(ends))) + row
        return ends

    def turn(self, rows: Ints, ends: tuple[Array, Array], frame: FrameMap, decimals: Ints) -> tuple[Mask, Array]:
        """Write the centre words of arcs `rows` (k,) that `take` has written; an arc that is not certain is taken back.

        ends  (k, n_axes) the commands at their starts and ends, as written

        Returns which arcs are certain, (k,), and the centres of these, (c, 3), command coordinates, mm.
        """
        program, layouts, n, each = self.program, self.layouts, len(rows), np.arange(len(rows))[:, None]
        block, plane, columns = self.moves.block[rows], planes(self.moves, rows), spatial(self.moves)
        centre = frame.program_point(self.pieces.centre[self.first_piece[rows]])
        start, end = (frame.program(each_end)[each, columns[plane]] for each_end in ends)
        fixed = layouts.fixed[program.template[block][:, None], plane] | self.moves.arc_absolute[rows, None]
        places = np.stack((start, end, centre[each, plane], np.where(fixed, 0.0, start)), axis=1)
        words = core.loops("words").CentreWords(layouts.centre, layouts.centre_heads, layouts.radius, layouts.taken)
        room = EditRoom(3 * n, 2 * rules().room * n)
        printer = self._printer(room, np.zeros(len(self.moves.axes)), frame, decimals)
        found, clear = np.empty((n, 2)), np.empty(n, dtype=np.uint8)
        printer.write_centres(block, plane, columns, places, words, found, clear)
        certain = clear.astype(np.bool_)
        if not certain.all():
            spans = program.blocks[block[~certain]]
            self.parts[:] = [part.outside(spans) for part in self.parts]
        self.put(room.splices)
        centre[each, plane] = found
        return certain, frame.command_point(centre[certain])

    def alone(self, row: int, stop: int) -> list[int]:
        """The arcs from motion `row` up to `stop` that `BlockWriter` must write."""
        alone = self.layouts.alone
        if not alone.any():
            return []
        return (row + np.flatnonzero(alone[self.program.template[self.moves.block[row:stop]]])).tolist()

    def take_out(self, rows: list[int]) -> None:
        """Remove some motions from the stretch written last."""
        self.parts[-1] = self.parts[-1].outside(self.program.blocks[self.moves.block[rows]])
        self.added -= int(np.diff(self.first_piece)[rows].sum()) - len(rows)

    def _printer(self, room: EditRoom, position: Array, frame: FrameMap, decimals: Ints) -> Any:
        """What writes words in the core, into `room`, from a command at which the control stands."""
        program, layouts, axes = self.program, self.layouts, len(position)
        return core.loops("words").WordPrinter(
            rules(),
            room.buffer,
            self.text,
            program.blocks,
            program.first_number,
            program.template,
            program.numbers,
            program.number_spans,
            *layouts.arrays,
            np.frombuffer(program.line_end, dtype=np.uint8),
            frame.frame.offset,
            frame.scale,
            decimals,
            0.5 * 10.0 ** -decimals.astype(float),
            layouts.spelling.signed,
            position.copy(),
            np.empty(axes),
            np.empty(axes),
            np.empty(axes, dtype=np.int64),
        )

    def _written(self, row: int, position: Array, frame: FrameMap, decimals: Ints) -> tuple[Array, Splices] | None:
        """The commands at the ends of the pieces of a stretch, (k, n_axes), and the edits to its axis words."""
        stop = int(self.stop[row])
        pieces = self.first_piece[row : stop + 1]
        ends, blocks = self.pieces.end[pieces[0] : pieces[-1]], self.moves.block[row:stop]
        room = EditRoom((stop - row) * (len(position) + 1), self._room(pieces, blocks, len(position) * rules().room))
        commands = np.empty_like(ends)
        done = self._printer(room, position, frame, decimals).write(blocks, ends, pieces - pieces[0], commands)
        return (commands[:done], room.splices) if done else None

    def _room(self, pieces: Ints, blocks: NDArray[np.int32], words: int) -> int:
        """Upper bound of the bytes of words and lines of some motions; `words`: bytes of the words of a piece."""
        lines, line = int(pieces[-1] - pieces[0]), words + len(b"\r\n") + OPENING + CLOSING
        if not self.layouts.lined:
            return lines * line
        several = np.diff(pieces) - 1
        rows = blocks[several > 0].astype(np.int64)
        leads = places_of(self.program, rows, self.layouts.leads) - self.program.blocks[rows, 0]
        return lines * line + int((several[several > 0] * leads).sum())


def _is_plain(frame: Frame) -> bool:
    """Whether in the frame each number stands for one axis, and a decimal point makes no difference."""
    turned = bool((frame.rotation != np.eye(3)).any())
    return not (turned or frame.diameter) and frame.increments == (1.0, 1.0)


# -- arcs within a stretch that are written by themselves --------------------------------------------------------------
# While the stretch is written they count as straight: their axis words define where the next motions begin. Some end a
# few digits elsewhere; then a following motion that has no word for such an axis is written by itself, too.


def write_alone(arcs: Sequence[int], stop: int, start: Array, named: Mask, write: Callable[[int], Array]) -> list[int]:
    """Write arcs of a stretch that ends before motion `stop`, in order, and motions that depend on where they end.

    start  (n, n_axes) the commands at which motions begin; updated
    named  (n, n_axes) axes for which a motion has a word
    write  writes a motion from its start; returns the command at its end

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


# -- which motions may be written all at once, as far as their own data say -------------------------------------------


def qualified(program: Program, moves: Moves, pieces: Pieces, first_piece: Ints, layouts: Layouts) -> Mask:
    """(n,) straight motions and arcs that can be written in bulk; `first_piece` (n + 1,) as in `Bulk`."""
    first = first_piece[:-1]
    fit: Mask = ((moves.kind == MotionKind.RAPID) & (moves.modal == 0)) | (
        (moves.kind == MotionKind.FEED) & (moves.modal == 10)
    )
    fit &= ~turns_alone(moves) & _writable_pieces(program, moves, pieces, first_piece, layouts)
    fit |= whole_arcs(program, moves, pieces, first, layouts)
    fit &= layouts.known[program.template[moves.block]] & sound(moves, pieces, first_piece)
    rising = moves.block[1:] > moves.block[:-1]
    if not rising.all():
        fit &= np.bincount(moves.block, minlength=len(program))[moves.block] == 1
        fit[1:] &= rising
    return fit


def whole_arcs(program: Program, moves: Moves, pieces: Pieces, first: Ints, layouts: Layouts) -> Mask:
    """(n,) arcs that stay one arc and whose words can be written in bulk.

    Arcs that `BlockWriter` writes may become more than one.

    first  (n,) the first piece of each motion
    """
    fit: Mask = moves.kind == MotionKind.ARC
    if not fit.any() or not {"X", "Y", "Z"} <= set(moves.axes):
        return np.zeros(len(moves), dtype=np.bool_)
    shapes = program.template[moves.block]
    alone, single = layouts.alone[shapes], pieces.fraction[first] == 1
    fit &= np.where(alone, single | layouts.further[shapes], single & pieces.arc[first])
    fit &= layouts.round[shapes] & ((moves.modal == 20) | (moves.modal == 30))
    rows = np.flatnonzero(fit)
    plane = spatial(moves)[planes(moves, rows)]
    chord = np.take_along_axis(moves.end[rows] - moves.start[rows], plane, axis=1)
    known = np.isfinite(pieces.centre[first[rows]]).all(axis=1) | ~pieces.arc[first[rows]]
    fit[rows] = known & (np.abs(chord) >= CIRCLE_MM).any(axis=1)
    return fit


def planes(moves: Moves, rows: Ints) -> Ints:
    """(k, 2) the axes (indices of X Y Z) of the planes of arcs `rows`, in a frame that is not rotated."""
    planes: Ints = PLANES.take(np.abs(moves.normal[rows]).argmax(axis=1), axis=0)
    return planes


def spatial(moves: Moves) -> Ints:
    """The columns of X, Y and Z."""
    return np.array([moves.axes.index(letter) for letter in "XYZ"])


def sound(moves: Moves, pieces: Pieces, first_piece: Ints) -> Mask:
    """(n,) motions that are corrected, have absolute words, and end at known positions."""
    first = first_piece[:-1]
    fit: Mask = (moves.rule == Rule.CORRECT) & ~moves.incremental & ~pieces.unchanged[first] & pieces.known[first]
    wordless = moves.wordless
    if wordless.any():  # such axes must stand where the program believes them to be
        fit &= ~(wordless & (pieces.end.take(first_piece[1:] - 1, axis=0) != moves.end)).any(axis=1)
    return fit


def with_dwells(fit: Mask, program: Program, moves: Moves, pieces: Pieces, first_piece: Ints, layouts: Layouts) -> Mask:
    """Motions `fit` (n,), and dwells directly after them at which the axes stay where these motions leave them.

    Nothing is written for such a dwell. It must have a block of its own without axis words (times, and motions combined
    with a dwell, may use these letters).
    """
    rows = np.flatnonzero(moves.kind[1:] == MotionKind.DWELL) + 1
    at, block = first_piece[rows], moves.block[rows]
    alone = (block != moves.block[rows - 1]) & (block != np.append(moves.block, -1)[rows + 1])
    wordless = (layouts.slots[program.template[block]] == NONE).all(axis=1)
    stays = pieces.unchanged[at] & (pieces.end[at] == pieces.end[at - 1]).all(axis=1)
    rows = rows[fit[rows - 1] & stays & alone & wordless]
    found = fit.copy()
    found[rows] = True
    return found


def _writable_pieces(program: Program, moves: Moves, pieces: Pieces, first_piece: Ints, layouts: Layouts) -> Mask:
    """(n,) motions with one straight piece, or with several straight ones that need only axis words."""
    single: Mask = (np.diff(first_piece) == 1) & ~pieces.arc[first_piece[:-1]]
    several = np.flatnonzero(~single)
    if len(several):
        straight = np.add.reduceat(pieces.arc, first_piece[:-1], dtype=np.int64)[several] == 0
        timed = (moves.feed_mode[several] == FeedMode.INVERSE_TIME) & (moves.modal[several] != 0)
        finite = np.logical_and.reduceat(pieces.known, first_piece[:-1])[several]
        single[several] = straight & ~timed & finite & layouts.further[program.template[moves.block[several]]]
    return single
