"""A stretch of corrected motions as text, compiled: one pass over its words, digits put where they belong.

What `bulk.Stretch` does by columns, with the same operations on each number, so that the bytes are the same; a test
holds the two together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library
from ncfix.text.number_kernels import HELPERS, copied, put_all, put_in_style, put_new
from ncfix.text.number_text import ROUNDED
from ncfix.writer.bulk_layouts import LED_HEAD

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Rows = NDArray[np.int32]
Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Changes = tuple[Ints, Ints, Ints]
"""Start, stop and length of edits, as in `Splices`."""
Axes = tuple[Floats, Floats, Mask]
"""By axis, (axes,): numbers at the end of a piece and where it stands now, and whether it was told to move."""

Digits = tuple[Ints, Floats, int]
"""By axis, (axes,): decimals that the least increment needs, half output steps; and whether numbers carry signs."""
Lines = tuple[Bytes, Ints, Bytes, Bytes]
"""Of further pieces: the end of a line, and `leads`, `openings`, `closings` of `Layouts`."""

LIBRARY = Library(__name__, HELPERS)


@LIBRARY.helper
def put_line(
    data: Bytes,
    at: int,
    text: Bytes,
    lead: tuple[int, int],
    lines: Lines,
    shape: int,
    by_letter: Ints,
    heads: Bytes,
    axes: Axes,
    digits: Digits,
) -> int:
    """Write a further piece of a motion on a line of its own, and take the axes there; -1 where that is not clear.

    A piece that moves nothing is not: it is for `BlockWriter` to say. `heads` (axes, 2) are those of the shape, `lead`
    the bytes of `text` that the line repeats.
    """
    (wanted, now, told), (decimals, half, signed), (end_of_line, _, openings, closings) = axes, digits, lines
    at = copied(data, at, end_of_line, 0, len(end_of_line))
    at = copied(data, at, text, lead[0], lead[1])
    at = put_all(data, at, openings[shape])
    begun, moved = 0 if openings[shape, 0] else 1, False
    for axis in by_letter:
        off = abs(wanted[axis] - now[axis])
        if not off >= half[axis]:
            continue
        if heads[axis, 1] == 0:
            if not off <= ROUNDED * half[axis]:
                return -1
            continue
        at, now[axis] = put_new(data, at, heads[axis, begun:], wanted[axis], decimals[axis], signed)
        if at < 0:
            return -1
        told[axis], begun, moved = True, 0, True
    return put_all(data, at, closings[shape]) if moved else -1


@LIBRARY.helper
def note(changes: Changes, edits: int, start: int, stop: int, length: int) -> int:
    """Note an edit; how many there are."""
    changes[0][edits], changes[1][edits], changes[2][edits] = start, stop, length
    return edits + 1


@LIBRARY.helper
def rewrite_words(
    pen: tuple[Bytes, Changes],
    edits: int,
    size: int,
    text: Bytes,
    number: int,
    numbers: tuple[Floats, Ints],
    places: tuple[Ints, Ints],
    axes: Axes,
    several: bool,
    digits: Digits,
) -> tuple[int, int]:
    """Write the words of a block anew whose values change, all of them if `several` pieces follow.

    edits, size  how many edits there are so far, and their bytes
    number       the first number of the block
    places       `slots` and `by_place` of its shape

    Returns how many edits there are, and their bytes; -1 if it is not clear.
    """
    (data, changes), (values, spans), (slots, by_place), (decimals, half, signed) = pen, numbers, places, digits
    wanted, now, told = axes
    for axis in by_place:
        if axis < 0:
            break
        word = number + slots[axis]
        now[axis], told[axis] = values[word], True
        if abs(wanted[axis] - now[axis]) >= half[axis] or several:
            begin, end = spans[word, 0], spans[word, 1]
            at, now[axis] = put_in_style(data, size, text, begin, end, wanted[axis], decimals[axis], signed)
            if at < 0:
                return edits, -1
            edits, size = note(changes, edits, begin, end, at - size), at
    return edits, size


@LIBRARY.helper
def add_words(
    pen: tuple[Bytes, Changes],
    edits: int,
    size: int,
    place: int,
    by_letter: Ints,
    heads: Bytes,
    axes: Axes,
    digits: Digits,
) -> tuple[int, int]:
    """Add words at `place` for axes that must move and have none; as `rewrite_words`."""
    (data, changes), (wanted, now, told), (decimals, half, signed) = pen, axes, digits
    for axis in by_letter:
        if heads[axis, 1] == LED_HEAD:
            now[axis], told[axis] = wanted[axis], True
        off = abs(wanted[axis] - now[axis])
        if told[axis] or off < half[axis]:
            continue
        if heads[axis, 1] == 0:
            if not off <= ROUNDED * half[axis]:
                return edits, -1
            continue
        at, now[axis] = put_new(data, size, heads[axis], wanted[axis], decimals[axis], signed)
        if at < 0:
            return edits, -1
        told[axis] = True
        edits, size = note(changes, edits, place, place, at - size), at
    return edits, size


@LIBRARY.helper
def place_of(anchor: Ints, edges: Ints, spans: Ints, number: int) -> int:
    """The byte that an anchor stands for; `edges` of the block, `number` is its first one."""
    slot = anchor[0]
    place: int = anchor[1] + (spans[number + slot, 1] if slot >= 0 else edges[-1 - slot])
    return place


@LIBRARY.helper
def to_numbers(commands: Floats, frame: tuple[Floats, Floats], out: Floats) -> None:
    """What a program writes for commands, (axes,)."""
    offset, scale = frame
    for axis in range(len(out)):
        out[axis] = (commands[axis] - offset[axis]) / scale[axis]


@LIBRARY.helper
def to_commands(now: Floats, told: Mask, here: Floats, frame: tuple[Floats, Floats], out: Floats) -> None:
    """Commands (axes,) of the numbers `now` of axes that were told to move; the others stay `here`."""
    offset, scale = frame
    for axis in range(len(out)):
        out[axis] = now[axis] * scale[axis] + offset[axis] if told[axis] else here[axis]


@LIBRARY.helper
def set_out(here: Floats, target: Floats, frame: tuple[Floats, Floats], axes: Axes) -> None:
    """Put down the numbers of where the axes stand and where they shall be; none has been told to move yet."""
    wanted, now, told = axes
    to_numbers(here, frame, now)
    to_numbers(target, frame, wanted)
    told[:] = False


@LIBRARY.helper
def put_lines(
    data: Bytes,
    at: int,
    text: Bytes,
    lead: tuple[int, int],
    lines: Lines,
    shape: int,
    style: tuple[Ints, Bytes, Axes, Digits],
    standing: tuple[Floats, tuple[Floats, Floats]],
    ends: Floats,
    commands: Floats,
) -> int:
    """Write the further pieces of a motion, each as `put_line` does, by `style` (its last four arguments).

    standing  where the control stands before the motion, and the frame
    ends      (k, axes) commands at the ends of the pieces; `commands`: room for those that are written
    """
    (by_letter, heads, axes, digits), (here, frame) = style, standing
    wanted, now, told = axes
    for piece in range(len(ends)):
        to_numbers(ends[piece], frame, wanted)
        at = put_line(data, at, text, lead, lines, shape, by_letter, heads, axes, digits)
        if at < 0:
            break
        to_commands(now, told, here, frame, commands[piece])
    return at


@LIBRARY.kernel(
    "u1[:]",
    ("i8[:,:]", "i4[:]", "i8[:]", "i4[:]"),
    ("f8[:]", "i8[:,:]"),
    ("i8[:,:]", "i8[:,:]", "i8[:]", "i8[:,:]", "u1[:,:,:]"),
    "f8[:,:]",
    "i8[:]",
    "f8[:]",
    ("f8[:]", "f8[:]"),
    ("i8[:]", "f8[:]", "i8"),
    ("u1[:]", "i8[:,:]", "u1[:,:]", "u1[:,:]"),
    ("f8[:,:]", "i8[:]", "i8[:]", "i8[:]", "u1[:]"),
    ("f8[:]", "f8[:]", "b1[:]", "i8[:]"),
)
def write(
    text: Bytes,
    blocks: tuple[Ints, Rows, Ints, Rows],
    numbers: tuple[Floats, Ints],
    layouts: tuple[Ints, Ints, Ints, Ints, Bytes],
    ends: Floats,
    pieces: Ints,
    here: Floats,
    frame: tuple[Floats, Floats],
    digits: Digits,
    lines: Lines,
    found: tuple[Floats, Ints, Ints, Ints, Bytes],
    room: tuple[Floats, Floats, Mask, Ints],
) -> int:
    """Write motions up to the first one that is not clear; how many pieces are written.

    blocks    of the program: their spans, which of them are written (k,), the first number and the shape of each
    numbers   of the program: values and spans
    layouts   slots, by_place, by_letter, anchors, heads of `Layouts`
    ends      (m, axes) commands at the ends of their pieces
    pieces    (k + 1,) the first piece of each motion, and m
    here      (axes,) where the control stands before; afterwards where it stands then
    frame     offset and scale (axes,): a command is `offset + scale * number`
    digits    decimals that the least increment needs, half output steps (axes,), and whether numbers carry signs
    lines     the end of a line, and leads, openings, closings of `Layouts`
    found     room for the commands at the ends of the pieces written, and what changes in the source, as in `Splices`
    room      for three rows (axes,), and for counts: edits and bytes
    """
    (edges, rows, first, shapes), (_, spans) = blocks, numbers
    slots, by_place, by_letter, anchors, heads = layouts
    (commands, start, stop, length, data), (now, wanted, told, counts) = found, room
    pen, by_axis, leads = (data, (start, stop, length)), (wanted, now, told), lines[1]
    edits, size, done = 0, 0, 0
    for row in range(len(rows)):
        block, before, was, first_piece, last_piece = rows[row], edits, size, pieces[row], pieces[row + 1] - 1
        shape, number, several = shapes[block], first[block], first_piece < last_piece
        set_out(here, ends[first_piece], frame, by_axis)
        places = slots[shape], by_place[shape]
        edits, size = rewrite_words(pen, edits, size, text, number, numbers, places, by_axis, several, digits)
        if size >= 0:
            place = place_of(anchors[shape], edges[block], spans, number)
            edits, size = add_words(pen, edits, size, place, by_letter, heads[shape], by_axis, digits)
        to_commands(now, told, here, frame, commands[first_piece])
        lines_from = size
        if several and size >= 0:
            lead = edges[block, 0], place_of(leads[shape], edges[block], spans, number)
            rest, into = ends[first_piece + 1 : last_piece + 1], commands[first_piece + 1 : last_piece + 1]
            style = by_letter, heads[shape], by_axis, digits
            size = put_lines(data, size, text, lead, lines, shape, style, (here, frame), rest, into)
        if size < 0:
            edits, size = before, was
            break
        if several:
            edits = note(pen[1], edits, edges[block, 1], edges[block, 1], size - lines_from)
        done = last_piece + 1
        for axis in range(len(here)):
            here[axis] = commands[last_piece, axis]
    counts[0], counts[1] = edits, size
    return done


@LIBRARY.kernel("u1[:]", "i8[:]", "i8[:]", "i8[:]", "u1[:]", "u1[:]")
def spliced(source: Bytes, start: Ints, stop: Ints, length: Ints, data: Bytes, out: Bytes) -> None:
    """Put a text into `out` with many edits made: as `writer.spliced`."""
    at, done, taken = 0, 0, 0
    for edit in range(len(start)):
        at = copied(out, at, source, done, start[edit])
        at = copied(out, at, data, taken, taken + length[edit])
        done, taken = stop[edit], taken + length[edit]
    copied(out, at, source, done, len(source))
