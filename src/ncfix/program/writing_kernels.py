"""A stretch of corrected motions as text, compiled: one pass over its words, digits put where they belong.

What `bulk.Stretch` does by columns, with the same operations on each number, so that the bytes are the same; a test
holds the two together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library
from ncfix.program.bulk_layouts import LED_HEAD
from ncfix.program.number_text import LARGEST, LONGEST, MINUS, MOST_DECIMALS, PLUS, TENS, TIE, ZERO
from ncfix.program.numbers import POINT, POWERS

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

LIBRARY = Library(__file__)

ROUNDED = 1.01
"""Half output steps by which an axis may stand off its place for nothing but rounding."""

MOST_STEPS = 18
"""Decimals of the finest output step that is written here."""
ROOM = LONGEST + MOST_STEPS + 4
"""Bytes that a word takes at most: its head, a sign, digits before the point and behind it."""


@LIBRARY.helper
def copied(out: Bytes, at: int, data: Bytes, start: int, stop: int) -> int:
    """Copy some bytes to `at`; where the next one goes."""
    for place in range(start, stop):
        out[at + place - start] = data[place]
    return at + stop - start


@LIBRARY.helper
def style_of(text: Bytes, start: int, stop: int, signed: int) -> tuple[int, bool, bool, int, bool]:
    """Decimals, point, plus, digits before the point of the number at a span, and whether it is nothing but that.

    `signed`: a minus sign counts as one, too: what had a sign keeps one.
    """
    first = start + (text[start] == PLUS or text[start] == MINUS)
    point = -1
    for place in range(first, stop):
        character = text[place]
        if character == POINT and point < 0:
            point = place
        elif character < ZERO or character > ZERO + 9:
            return 0, False, False, 0, False
    decimals = stop - point - 1 if point >= 0 else 0
    clear = stop - first <= LONGEST and decimals <= MOST_DECIMALS
    plus = text[start] == PLUS or (signed != 0 and text[start] == MINUS)
    return decimals, point >= 0, plus, stop - first - decimals - (point >= 0), clear


@LIBRARY.helper
def steps_of(value: float, decimals: int) -> int:
    """The output steps of a number; -1 where it is too large, or too near to the middle between two outputs."""
    if decimals > MOST_STEPS:
        return -1
    steps = abs(value) * POWERS[decimals]
    if not (steps < LARGEST and abs(steps - np.floor(steps) - 0.5) > TIE * steps):
        return -1
    return int(np.rint(steps))


@LIBRARY.helper
def put(data: Bytes, at: int, steps: int, decimals: int, sign: int, least: int, point: bool) -> int:
    """Write a number at `at`; where the next byte goes. `least`: digits before the point, -1 for none if it is zero."""
    whole, fraction = steps // TENS[decimals], steps % TENS[decimals]
    if sign:
        data[at] = sign
        at += 1
    count = max(least, 0 if whole == 0 and least < 0 and decimals > 0 else 1)
    while count < 18 and whole >= TENS[count]:
        count += 1
    for place in range(at + count - 1, at - 1, -1):
        data[place] = ZERO + whole % 10
        whole //= 10
    at += count
    if point or decimals > 0:
        data[at] = POINT
        at += 1
    for place in range(at + decimals - 1, at - 1, -1):
        data[place] = ZERO + fraction % 10
        fraction //= 10
    return at + decimals


@LIBRARY.helper
def put_in_style(
    data: Bytes, at: int, text: Bytes, start: int, stop: int, value: float, decimals: int, signed: int
) -> tuple[int, float]:
    """Write a value in the style of the number at a span, as `NumberStyle.write`; -1 where that is not clear.

    Returns where the next byte goes, and what a reader makes of the number.
    """
    own, point, plus, whole, clear = style_of(text, start, stop, signed)
    if not clear:
        return -1, 0.0
    most = max(own, decimals)
    steps = steps_of(value, most)
    if steps < 0:
        return -1, 0.0
    read = np.copysign(steps / POWERS[most], value) + 0.0
    while most > own and steps % 10 == 0:
        steps //= 10
        most -= 1
    sign = MINUS if value < 0 and steps != 0 else PLUS if plus else 0
    padded = whole > 1 and text[stop - own - point - whole] == ZERO
    least = whole if padded else -1 if whole == 0 else 1
    return put(data, at, steps, most, sign, least, point), read


@LIBRARY.helper
def put_all(data: Bytes, at: int, characters: Bytes) -> int:
    """Write all of some bytes that are not 0; where the next byte goes."""
    for character in characters:
        if character:
            data[at] = character
            at += 1
    return at


@LIBRARY.helper
def put_new(data: Bytes, at: int, head: Bytes, value: float, decimals: int, signed: int) -> tuple[int, float]:
    """Write a missing word: what stands before its number, and the number with all decimals; -1 if not clear."""
    steps = steps_of(value, decimals)
    if steps < 0:
        return -1, 0.0
    at = put_all(data, at, head)
    sign = MINUS if np.signbit(value) else 0
    if signed != 0:
        sign = MINUS if value < 0 and steps != 0 else PLUS
    return put(data, at, steps, decimals, sign, 1, False), np.copysign(steps / POWERS[decimals], value)


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

    A piece that moves nothing is not: it is for the renderer to say. `heads` (axes, 2) are those of the shape, `lead`
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
    room      for three rows (axes,), and for counts: edits, bytes, and lines that were added
    """
    (edges, rows, first, shapes), (_, spans) = blocks, numbers
    slots, by_place, by_letter, anchors, heads = layouts
    (commands, start, stop, length, data), (now, wanted, told, counts) = found, room
    pen, by_axis, leads = (data, (start, stop, length)), (wanted, now, told), lines[1]
    edits, size, done, added = 0, 0, 0, 0
    for row in range(len(rows)):
        block, before, was, first_piece, last_piece = rows[row], edits, size, pieces[row], pieces[row + 1] - 1
        shape, number, several = shapes[block], first[block], first_piece < last_piece
        to_numbers(here, frame, now)
        to_numbers(ends[first_piece], frame, wanted)
        told[:] = False
        places = slots[shape], by_place[shape]
        edits, size = rewrite_words(pen, edits, size, text, number, numbers, places, by_axis, several, digits)
        if size >= 0:
            place = place_of(anchors[shape], edges[block], spans, number)
            edits, size = add_words(pen, edits, size, place, by_letter, heads[shape], by_axis, digits)
        to_commands(now, told, here, frame, commands[first_piece])
        lines_from, lead = size, (edges[block, 0], edges[block, 0])
        if several:
            lead = edges[block, 0], place_of(leads[shape], edges[block], spans, number)
        for piece in range(first_piece + 1, last_piece + 1):
            if size < 0:
                break
            to_numbers(ends[piece], frame, wanted)
            size = put_line(data, size, text, lead, lines, shape, by_letter, heads[shape], by_axis, digits)
            to_commands(now, told, here, frame, commands[piece])
        if size < 0:
            edits, size = before, was
            break
        if several:
            edits = note(pen[1], edits, edges[block, 1], edges[block, 1], size - lines_from)
            added += last_piece - first_piece
        done = last_piece + 1
        for axis in range(len(here)):
            here[axis] = commands[last_piece, axis]
    counts[0], counts[1], counts[2] = edits, size, added
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
