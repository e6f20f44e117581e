"""Writes the centre words of arcs in stretches, once their axis words are known.

The result is identical, byte for byte, to that of `block.BlockWriter._kept_arc`; a test compares them. An arc qualifies
if it stays one arc, by G2 or G3, and has a plain R or plain I J K; a full circle does not.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from ncfix.arrays import Array, Bytes, Ints, Mask
from ncfix.control.moves import MotionKind, Moves
from ncfix.text.spelling import Styles, in_style, is_plain, laid_out, plain, rounded, styles_of
from ncfix.text.tree import Program
from ncfix.text.writer import Splices
from ncfix.values import frozen
from ncfix.writer.bulk_layouts import NONE, Layouts, places_of
from ncfix.writer.pieces import Pieces
from ncfix.writer.target import FrameMap

PLANES = np.array(((1, 2), (2, 0), (0, 1)))
"""The axes of a plane (indices of X Y Z), in the order in which their words are added, by the axis across it."""
CIRCLE_MM = 1e-3
"""Smallest distance of start and end of an arc written in bulk, mm: below it `BlockWriter` decides on a full circle."""
SEMICIRCLE = 1e-6
"""Smallest difference, program units, between radius and half chord: below it the radius does not define the centre."""
TIE_MARGIN_HALF_STEPS = 1e-4
"""Margin, in half output steps, around the allowed distance of centres within which `BlockWriter` decides."""


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
    plane = _spatial(moves)[_planes(moves, rows)]
    chord = np.take_along_axis(moves.end[rows] - moves.start[rows], plane, axis=1)
    known = np.isfinite(pieces.centre[first[rows]]).all(axis=1) | ~pieces.arc[first[rows]]
    fit[rows] = known & (np.abs(chord) >= CIRCLE_MM).any(axis=1)
    return fit


def _planes(moves: Moves, rows: Ints) -> Ints:
    """(k, 2) the axes (indices of X Y Z) of the planes of arcs `rows`, in a frame that is not rotated."""
    planes: Ints = PLANES.take(np.abs(moves.normal[rows]).argmax(axis=1), axis=0)
    return planes


def _spatial(moves: Moves) -> Ints:
    """The columns of X, Y and Z."""
    return np.array([moves.axes.index(letter) for letter in "XYZ"])


@frozen
class OutputSteps:
    """How numbers are written: the text that contains them, decimals for the least increment, half output steps.

    decimals, half  (n_axes,)
    signed          whether numbers always have a sign
    """

    text: Bytes
    decimals: Ints
    half: Array
    signed: bool


@frozen
class CentreWords:
    """Changes to the centre words of k arcs in order; columns for the two axes of each arc's plane.

    block    (k,) the block of each arc
    plane    (k, 2) its axes
    words    (k, 2) index of each centre word's number, `NONE` if there is no word
    wanted   (k, 2) intended values, program numbers
    rewrite  (k, 2) words that get another value; `styles`: their number styles, in this order
    add      (k, 2) words that are added
    given_up (k,) R is replaced by centre words
    centre   (k, 3) the resulting centre, command coordinates, mm
    clear    (k,) everything is certain to the last digit
    """

    block: Ints
    plane: Ints
    words: Ints
    wanted: Array
    decimals: Ints
    rewrite: Mask
    styles: Styles
    add: Mask
    given_up: Mask
    centre: Array
    clear: Mask

    @classmethod
    def of(
        cls,
        program: Program,
        layouts: Layouts,
        moves: Moves,
        rows: Ints,
        ends: tuple[Array, Array],
        centre: Array,
        frame: FrameMap,
        steps: OutputSteps,
    ) -> CentreWords:
        """Determine which words of arcs `rows` change.

        ends    (k, n_axes) the commands at their starts and ends, as written
        centre  (k, 3) their intended centres, command coordinates
        """
        block = moves.block.take(rows).astype(np.int64)
        shape, plane, each = program.template.take(block), _planes(moves, rows), np.arange(len(rows))[:, None]
        columns, first = _spatial(moves)[plane], program.first_number.take(block)[:, None]
        half, decimals = steps.half[columns], steps.decimals[columns]
        start, end = (frame.program(each_end)[each, columns] for each_end in ends)
        point = frame.program_point(centre)
        slots, radius = layouts.centre[shape[:, None], plane], layouts.radius[shape]
        words = np.where(slots >= 0, first + slots, NONE)
        by_radius = np.where(radius >= 0, np.abs(program.numbers.take(first[:, 0] + radius, mode="clip")), np.nan)
        meant, off = _nearest_centre(by_radius, start, end, point[each, plane])
        says = off <= 2 * half[:, 0]
        fixed = layouts.fixed[shape[:, None], plane] | moves.arc_absolute[rows, None]
        base = np.where(fixed, 0.0, start)
        wanted = point[each, plane] - base
        original = np.where(words >= 0, program.numbers.take(words, mode="clip"), 0.0)
        changes = (np.abs(wanted - original) >= half) & ~says[:, None]
        rewrite, digits = changes & (words >= 0), decimals.copy()
        anew = np.flatnonzero(rewrite)
        spans = program.number_spans.take(words.ravel().take(anew), axis=0)
        styles = styles_of(steps.text, spans, signed=steps.signed)
        digits.ravel()[anew] = np.maximum(digits.ravel().take(anew), styles.decimals)
        clear = is_plain(wanted, digits) | ~changes
        clear.ravel()[anew] &= styles.clear
        point[each, plane] = np.where(says[:, None], meant, base + np.where(changes, rounded(wanted, digits), original))
        sure = ~(np.abs(by_radius - np.hypot(*(end - start).T) / 2) < SEMICIRCLE)
        sure &= ~(np.abs(off - 2 * half[:, 0]) < TIE_MARGIN_HALF_STEPS * half[:, 0])
        return cls(
            block,
            plane,
            words,
            wanted,
            decimals,
            rewrite,
            styles,
            changes & ~rewrite,
            (radius >= 0) & ~says,
            frame.command_point(point),
            sure & clear.all(axis=1),
        )

    def rows(self, chosen: Mask) -> CentreWords:
        """Those of the chosen arcs."""
        styles = self.styles.rows(np.flatnonzero(chosen[np.flatnonzero(self.rewrite) // 2]))
        columns = {each.name: getattr(self, each.name)[chosen] for each in fields(self) if each.name != "styles"}
        return CentreWords(styles=styles, **columns)

    def splices(self, program: Program, layouts: Layouts, steps: OutputSteps) -> Splices:
        """The changes in the source."""
        shape = program.template.take(self.block)
        old, rows = np.flatnonzero(self.rewrite), np.flatnonzero(self.given_up)
        spans = program.number_spans.take(self.words.ravel().take(old), axis=0)
        new = in_style(self.wanted.ravel().take(old), self.styles, self.decimals.ravel().take(old))
        lacking = np.flatnonzero(self.add)
        owner = lacking // 2
        heads = np.zeros((len(lacking), 4), dtype=np.uint8)
        heads[:, 2:] = layouts.centre_heads[shape.take(owner), self.plane.ravel().take(lacking)]
        wanted, decimals = self.wanted.ravel().take(lacking), self.decimals.ravel().take(lacking)
        added = plain(wanted, decimals, heads, signed=steps.signed)
        at = layouts.places(program, self.block.take(owner))
        start, stop = np.concatenate((spans[:, 0], at)), np.concatenate((spans[:, 1], at))
        order = np.argsort(2 * start + (stop > start), kind="stable")
        texts = laid_out(new.and_then(added, order))
        gone = [places_of(program, self.block.take(rows), layouts.taken[:, edge]) for edge in (0, 1)]
        words = Splices(start.take(order), stop.take(order), texts.length, texts.data)
        return Splices.joined([words, Splices(gone[0], gone[1], np.zeros(len(rows), np.int64), b"")])


def _nearest_centre(radius: Array, start: Array, end: Array, wanted: Array) -> tuple[Array, Array]:
    """The centre (k, 2) defined by a radius, of the two the one nearer to `wanted`, and its distance from it, (k,).

    As `block.BlockWriter._centre_by_radius`. Infinitely far if there is no radius (NaN), or if it is too short.
    """
    way = end - start
    half_chord = np.hypot(way[:, 0], way[:, 1]) / 2
    able = (radius > half_chord) & (half_chord > 0)
    height = np.sqrt(np.where(able, radius * radius - half_chord * half_chord, 0.0))
    across = np.stack((-way[:, 1], way[:, 0]), axis=1)
    rise = height[:, None] * across / (2 * np.where(able, half_chord, 1.0))[:, None]
    sides = [(start + end) / 2 + side * rise for side in (1, -1)]
    off = [np.hypot(*(side - wanted).T) for side in sides]
    nearest = np.where((off[1] < off[0])[:, None], sides[1], sides[0])
    return nearest, np.where(able, np.minimum(*off), np.inf)
