"""What the pen of the core writes for a motion, and that it refuses tables which do not belong together.

`program/test_bulk.py` holds it together with the writer of single blocks.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from conftest import require_core
from ncfix import core
from ncfix.writer.bulk import EditRoom

TEXT = b"N1 X1.5 Y-2.25 F9\nX3.\n"
ROOM = 38
"""Bytes of a word: its head, 16 digits and point, a sign, 18 decimals and what belongs to them."""
AXES = 2


@pytest.fixture(params=["plain", "compiled"], autouse=True)
def form(request: pytest.FixtureRequest) -> Iterator[str]:
    if request.param == "compiled":
        require_core()
    core.use(request.param)
    yield request.param
    core.use(None)


def ints(*rows: Any) -> np.ndarray:
    return np.array(rows, dtype=np.int64)


def characters(*rows: Any) -> np.ndarray:
    return np.array([[list(each) for each in row] for row in rows], dtype=np.uint8)


def tables(**other: Any) -> dict[str, Any]:
    """Two blocks of `TEXT`: X and Y stand in the first, X in the second; what `other` names is another."""
    found = {
        "text": np.frombuffer(TEXT, dtype=np.uint8),
        "edges": ints((0, 17), (18, 21)),
        "first": ints(0, 4),
        "template": np.array([0, 1], dtype=np.int32),
        "values": np.array([1.0, 1.5, -2.25, 9.0, 3.0]),
        "spans": ints((1, 2), (4, 7), (9, 14), (16, 17), (19, 21)),
        "slots": ints((1, 2), (0, -1)),
        "by_place": ints((0, 1), (0, -1)),
        "by_letter": ints(0, 1),
        "anchors": ints((2, 0), (0, 0)),
        "heads": characters([b" X", b" Y"], [b" X", b" Y"]),
        "leads": ints((0, 1), (-1, 0)),
        "openings": np.zeros((2, 3), dtype=np.uint8),
        "closings": np.zeros((2, 4), dtype=np.uint8),
        "line_end": np.frombuffer(b"\n", dtype=np.uint8),
        "offset": np.zeros(AXES),
        "scale": np.ones(AXES),
        "least": ints(3, 3),
        "half": np.full(AXES, 5e-4),
        "signed": False,
        "here": np.zeros(AXES),
        "wanted": np.empty(AXES),
        "now": np.empty(AXES),
        "told": np.empty(AXES, dtype=np.int64),
    }
    assert found.keys() >= other.keys()
    return found | other


def rules(powers: int = 19, longest: int = 16) -> Any:
    return core.loops("words").NumberRules(10.0 ** np.arange(powers), longest, 9, 1e15, 1e-12, 1.5)


def pen(room: EditRoom | None = None, **other: Any) -> Any:
    return core.loops("words").WordPrinter(rules(), (room or EditRoom(9, 400)).buffer, *tables(**other).values())


def written(ends: Any, pieces: Any, *, rows: Any = (0, 1), room: Any = (9, 400), **other: Any) -> tuple[Any, ...]:
    """How many pieces are written, the text then, and the commands."""
    into, ends = EditRoom(*room), np.array(ends, dtype=np.float64)
    commands = np.zeros((len(ends), AXES))
    done = pen(into, **other).write(np.array(rows, dtype=np.int32), ends, np.array(pieces), commands)
    edits, text, at, taken = into.splices, b"", 0, 0
    for start, stop, length in zip(edits.start, edits.stop, edits.length, strict=True):
        text += TEXT[at:start] + edits.data[taken : taken + length]
        at, taken = int(stop), taken + int(length)
    assert taken == len(edits.data)
    return done, text + TEXT[at:], commands[:done]


ENDS = [[0.6, -1.25], [1.6, -2.2501], [3.25, 0.5], [4.0, 0.5]]
"""Of two pieces of each block of `TEXT`."""
LINES = b"N1 X0.6 Y-1.25 F9\nN1 X1.600 Y-2.250\nX3.25 Y0.500\nX4.000\n"


def test_numbers_are_written_where_they_stand_missing_words_behind_them_and_pieces_on_lines_of_their_own() -> None:
    done, text, commands = written([ENDS[1], ENDS[2]], [0, 1, 2])
    assert (done, text) == (2, b"N1 X1.6 Y-2.25 F9\nX3.25 Y0.500\n")
    assert commands.tolist() == [[1.6, -2.25], [3.25, 0.5]]
    done, text, commands = written(ENDS, [0, 2, 4])
    assert (done, text) == (4, LINES)
    assert commands.tolist() == [[0.6, -1.25], [1.6, -2.25], [3.25, 0.5], [4.0, 0.5]]


def test_numbers_are_in_the_frame_of_the_program_and_commands_are_not() -> None:
    """An inch is 25.4 mm, and Y is counted from 10 mm."""
    frame = {"offset": np.array([0.0, 10.0]), "scale": np.array([25.4, 1.0])}
    done, text, commands = written([[50.8, 12.0]], [0, 1], rows=[0], here=np.array([0.0, 10.0]), **frame)
    assert (done, text) == (1, b"N1 X2.0 Y2.00 F9\nX3.\n")
    assert commands.tolist() == [[50.8, 12.0]]


def test_words_may_be_added_at_the_end_of_a_block() -> None:
    assert written([[3.25, 0.5]], [0, 1], rows=[1], anchors=ints((2, 0), (-2, 0)))[1].endswith(b"X3.25 Y0.500\n")
    assert written([ENDS[1]], [0, 1], rows=[0], slots=ints((1, -1), (0, -1)), by_place=ints((0, -1), (0, -1)),
        anchors=ints((-2, 0), (0, 0)))[1].startswith(b"N1 X1.6 Y-2.25 F9 Y-2.250\n")  # fmt: skip


def test_openings_and_closings_stand_around_the_words_of_a_line() -> None:
    around = {
        "openings": np.array([list(b"G1 "), [0, 0, 0]], dtype=np.uint8),
        "closings": np.array([list(b" Q2;"), [0, 0, 0, 0]], dtype=np.uint8),
    }
    text = written(ENDS, [0, 2, 4], **around)[1]
    assert text == LINES.replace(b"N1 X1.600 Y-2.250", b"N1 G1  X1.600 Y-2.250 Q2;")


def test_an_axis_that_cannot_be_named_may_be_off_by_rounding_only() -> None:
    """Of half a step, 0.0005: three of them are one and a half as many as `rounded` of the rules says."""
    heads = characters([b" X", b" Y"], [b" X", b"\0\0"])
    least = {"heads": heads, "half": np.full(AXES, 5e-4)}
    assert written([[3.25, 0.0007]], [0, 1], rows=[1], **least)[0] == 1
    assert written([[3.25, 0.0008]], [0, 1], rows=[1], **least)[0] == 0
    assert written([[3.25, 0.0], [4.0, 0.0007]], [0, 2], rows=[1], **least)[0] == 2
    done, text, _ = written([ENDS[1], [3.25, -2.25], [4.0, -2.2508]], [0, 1, 3], **least)
    assert (done, text) == (1, b"N1 X1.6 Y-2.25 F9\nX3.\n")  # nothing of a motion that is not clear


def test_a_component_of_a_vector_is_written_by_others() -> None:
    heads = characters([b" X", b" Y"], [b" X", b" \1"])
    done, text, commands = written([[3.25, 0.5]], [0, 1], rows=[1], heads=heads)
    assert (done, text) == (1, b"N1 X1.5 Y-2.25 F9\nX3.25\n")
    assert commands.tolist() == [[3.25, 0.5]]


def test_a_piece_that_moves_nothing_is_not_clear() -> None:
    assert written([ENDS[0], ENDS[0]], [0, 2], rows=[0])[0] == 0


@pytest.mark.parametrize(
    ("number", "value", "signed", "text"),
    [
        (b"1.5", 1.23456, False, b"1.235"),
        (b"1.5", -0.0001, False, b"0.0"),
        (b"1.5", -0.25, True, b"-0.25"),
        (b"+1.5", 2.0, False, b"+2.0"),
        (b"-1.5", 2.0, False, b"2.0"),
        (b"-1.5", 2.0, True, b"+2.0"),
        (b"-1.5", -0.0001, True, b"+0.0"),
        (b"007.5", 2.25, False, b"002.25"),
        (b"12.5", 2.25, False, b"2.25"),
        (b".5", 0.25, False, b".25"),
        (b".5", 0.0, False, b".0"),
        (b".5", 1.25, False, b"1.25"),
        (b"7.", 2.0, False, b"2."),
        (b"7", 2.0, False, b"2"),
        (b"7", 2.5, False, b"2.5"),
        (b"1.50000", 2.25, False, b"2.25000"),
        (b"1.5.", 2.0, False, None),
        (b"1 5", 2.0, False, None),
        (b"1,5", 2.0, False, None),
        (b"1:5", 2.0, False, None),
        (b"1.0123456789", 2.0, False, None),
        (b"12345678901234567", 2.0, False, None),
        (b"1.5", 0.0005 + 1e-18, False, None),
        (b"1.5", 1e13, False, None),
    ],
)
def test_a_number_keeps_its_style(number: bytes, value: float, signed: bool, text: bytes | None) -> None:
    """None: that is for the writer of single blocks; a value is too near to the middle of two, or too large."""
    source = b"X" + number + b"\n"
    program = {
        "text": np.frombuffer(source, dtype=np.uint8),
        "edges": ints((0, len(source) - 1)),
        "first": ints(0),
        "template": np.array([0], dtype=np.int32),
        "values": np.array([99.0]),
        "spans": ints((1, len(source) - 1)),
        "slots": ints((0, -1), (0, -1)),
        "by_place": ints((0, -1), (0, -1)),
        "anchors": ints((0, 0), (0, 0)),
        "leads": ints((-1, 0), (-1, 0)),
    }
    room, commands = EditRoom(5, 99), np.zeros((1, AXES))
    own = pen(room, **program, signed=signed)
    done = own.write(np.zeros(1, np.int32), np.array([[value, 0.0]]), np.array([0, 1]), commands)
    assert (room.splices.data if done else None) == text
    if text is not None:
        assert commands[0, 0] == float(text)


# -- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("powers", "longest", "right"), [(19, 16, True), (18, 16, False), (19, 17, False)])
def test_rules_are_those_of_numbers_that_there_is_room_for(powers: int, longest: int, right: bool) -> None:
    if right:
        assert rules(powers, longest).room == ROOM
    else:
        with pytest.raises(IndexError):
            rules(powers, longest)


def cut(name: str, *axis_sizes: int) -> Any:
    """A table of another size."""
    table = tables()[name]
    return np.ascontiguousarray(np.resize(table, axis_sizes))


@pytest.mark.parametrize(
    ("name", "sizes"),
    [
        *(
            ("edges", (2, 3)),
            ("first", (1,)),
            ("template", (1,)),
            ("values", (4,)),
            ("spans", (5, 3)),
            ("spans", (4, 2)),
        ),
        *(("slots", (2, 3)), ("slots", (3, 2)), ("by_place", (2, 3)), ("by_place", (1, 2)), ("by_letter", (1,))),
        *(("anchors", (2, 3)), ("anchors", (1, 2)), ("heads", (1, 2, 2)), ("heads", (2, 3, 2)), ("heads", (2, 2, 3))),
        *(("leads", (2, 1)), ("leads", (3, 2)), ("openings", (1, 3)), ("closings", (3, 4))),
        *((name, (3,)) for name in ("offset", "scale", "least", "half", "here", "wanted", "now", "told")),
        *((name, (1,)) for name in ("offset", "scale", "least", "half", "here", "wanted", "now", "told")),
    ],
)
def test_tables_of_other_sizes_are_refused(name: str, sizes: tuple[int, ...]) -> None:
    with pytest.raises(IndexError):
        pen(**{name: cut(name, *sizes)})


@pytest.mark.parametrize(
    "other",
    [
        {"by_letter": ints(0, 2)},
        {"by_letter": ints(2, 0)},
        {"by_letter": ints(0, -1)},
        {"by_letter": ints(-1, 0)},
        {"least": ints(3, -1)},
        {"least": ints(-1, 3)},
        *({"by_place": table} for table in (ints((0, 2), (0, -1)), ints((-2, 1), (0, -1)), ints((0, 1), (2, -1)))),
        {"by_place": ints((0, 1), (0, -2))},
    ],
)
def test_axes_that_there_are_not_are_refused(other: dict[str, Any]) -> None:
    assert pen(least=ints(0, 18))
    with pytest.raises(IndexError):
        pen(**other)


@pytest.mark.parametrize(
    "other",
    [
        *({"edges": ints(edge, (18, 21))} for edge in ((-1, 17), (0, 23), (17, 0))),
        *({"template": np.array([shape, 1], dtype=np.int32)} for shape in (-1, 2)),
        *({"first": ints(first, 4)} for first in (-1, 3, 4)),
        *({"spans": ints((1, 2), span, (9, 14), (16, 17), (19, 21))} for span in ((7, 4), (4, 4), (-1, 7), (4, 23))),
        *({name: ints((slot, 0), (0, 0))} for name in ("anchors", "leads") for slot in (-3, 5)),
        {"slots": ints((1, 5), (0, -1))},
    ],
)
def test_blocks_whose_words_are_not_in_the_text_are_refused(other: dict[str, Any]) -> None:
    with pytest.raises(IndexError):
        written(ENDS[:1], [0, 1], rows=[0], **other)


@pytest.mark.parametrize(
    ("rows", "pieces"),
    [([2], [0, 1]), ([-1], [0, 1]), ([0], [0, 5]), ([0], [-1, 1]), ([0], [1, 1]), ([0, 1], [0, 1]), ([0], [0])],
)
def test_blocks_and_pieces_that_there_are_not_are_refused(rows: list[int], pieces: list[int]) -> None:
    with pytest.raises(IndexError):
        written(ENDS, pieces, rows=rows)


def test_there_has_to_be_room_for_all_that_may_be_written() -> None:
    """Of each piece for all its words, and a line that repeats the head of its block; of each block for its edits."""
    around = 1 + 3 + 4  # the end of a line, and what stands around its words
    most = 2 * (AXES * ROOM + around) + len(b"N1 ")
    for edits in (3, 4):
        assert written(ENDS[:2], [0, 2], rows=[0], room=(edits, most))[0] == 2
    for room in ((2, most), (4, most - 1)):
        with pytest.raises(IndexError):
            written(ENDS[:2], [0, 2], rows=[0], room=room)
    for ends in ([[1.0]], [[1.0, 2.0, 3.0]]):
        with pytest.raises(IndexError):
            written(ends, [0, 1], rows=[0])


def centred(other: dict[str, Any], wanted: tuple[float, float] = (2.5, 0.25), **arguments: Any) -> tuple[Any, ...]:
    """Whether the centre words of an arc are certain, the text with them, and the centre; the F of `TEXT` is its I."""
    given = {
        "rows": np.array([0], dtype=np.int32),
        "plane": ints((0, 1)),
        "spatial": ints(0, 1, 1),
        "places": np.array([[(0.0, 0.0), (1.5, -2.25), wanted, (0.0, 0.0)]]),
        "slots": ints((3, -1, -1), (-1, -1, -1)),
        "heads": characters([b" I", b" J", b" K"], [b" I", b" J", b" K"]),
        "radius": ints(-1, -1),
        "taken": ints(((2, 0), (3, 0)), ((-1, 0), (-1, 0))),
        "room": (3, 2 * ROOM),
        "centre": np.zeros((1, 2)),
        "clear": np.zeros(1, dtype=np.uint8),
    }
    assert given.keys() >= arguments.keys()
    given |= arguments
    room = EditRoom(*given.pop("room"))
    words = core.loops("words").CentreWords(*(given.pop(name) for name in ("slots", "heads", "radius", "taken")))
    centre, clear = given.pop("centre"), given.pop("clear")
    pen(room, **other).write_centres(*given.values(), words, centre, clear)
    text, edits = TEXT, room.splices
    start, stop, length = edits.start, edits.stop, edits.length
    for k in sorted(range(len(start)), key=lambda k: (start[k], stop[k] > start[k], k), reverse=True):
        at = int(length[:k].sum())
        text = text[: start[k]] + edits.data[at : at + length[k]] + text[stop[k] :]
    assert len(edits.data) == length.sum()
    return bool(clear[0]), text.splitlines()[0], centre[0].tolist()


BY_RADIUS = {"slots": ints((-1, -1, -1), (-1, -1, -1)), "radius": ints(3, -1)}


def test_centre_words_are_rewritten_or_added() -> None:
    assert centred({}) == (True, b"N1 X1.5 Y-2.25 J0.250 F2.5", [2.5, 0.25])
    assert centred({}, (9.0004, 0.0)) == (True, b"N1 X1.5 Y-2.25 F9", [9.0, 0.0])


def test_a_radius_that_means_another_centre_gives_way_to_centre_words() -> None:
    assert centred({}, **BY_RADIUS) == (True, b"N1 X1.5 Y-2.25 I2.500 J0.250", [2.5, 0.25])


@pytest.mark.parametrize("side", [-1, 1])
def test_a_radius_that_means_the_wanted_centre_stays(side: int) -> None:
    half = np.hypot(1.5, -2.25) / 2
    height = side * np.sqrt(81 - half * half) / (2 * half)
    wanted = (0.75 + height * 2.25, -1.125 + height * 1.5)
    certain, text, centre = centred({}, wanted, **BY_RADIUS)
    assert (certain, text) == (True, b"N1 X1.5 Y-2.25 F9")
    assert centre == pytest.approx(wanted)


def test_centres_that_are_not_certain_are_left_as_they_are() -> None:
    """A centre halfway between two outputs, and a radius of half the chord."""
    values = np.array([1.0, 1.5, -2.25, np.hypot(1.5, -2.25) / 2, 3.0])
    for found in (centred({}, (2.0625, 0.0)), centred({"values": values}, **BY_RADIUS)):
        assert found[:2] == (False, b"N1 X1.5 Y-2.25 F9")


@pytest.mark.parametrize(
    "other",
    [
        {"rows": np.array([2], dtype=np.int32)},
        {"rows": np.array([-1], dtype=np.int32)},
        *({"plane": ints(plane)} for plane in ((0, 3), (-1, 1))),
        *({"spatial": ints(*columns)} for columns in ((0, 2, 1), (-1, 1, 1))),
        *({"slots": ints((slot, -1, -1), (-1, -1, -1))} for slot in (5, -2)),
        *({"radius": ints(slot, -1)} for slot in (5, -2)),
        *({"taken": ints(((slot, 0), (3, 0)), ((-1, 0), (-1, 0)))} for slot in (5, -3)),
        *({"taken": ints(((2, 0), (slot, 0)), ((-1, 0), (-1, 0)))} for slot in (5, -3)),
        *({"room": room} for room in ((2, 2 * ROOM), (3, 2 * ROOM - 1))),
        {"centre": np.zeros((0, 2))},
        {"clear": np.zeros(0, dtype=np.uint8)},
        {"places": np.zeros((1, 3, 2))},
        {"heads": characters([b" I", b" J"], [b" I", b" J"])},
        {"slots": ints((3, -1, -1))},
        {"radius": ints(-1)},
        {"taken": ints(((2, 0), (3, 0)))},
    ],
)
def test_arcs_that_are_not_in_the_text_are_refused(other: dict[str, Any]) -> None:
    with pytest.raises(IndexError):
        centred({}, **other)


def test_the_columns_of_edits_have_one_length() -> None:
    columns = [np.zeros(size, dtype=np.int64) for size in (2, 2, 3)]
    for k in range(3):
        with pytest.raises(IndexError):
            core.loops("edits").EditBuffer(*columns[k:], *columns[:k], np.zeros(9, dtype=np.uint8))
