"""Messages that say the same of several lines are told once, with all of them."""

from __future__ import annotations

from ncfix.cli.alike import gathered, named
from ncfix.diagnostics import Message, Place


def said(*lines: int, text: str = "why", path: str = "p.nc") -> list[Message]:
    return [Message("NCF432", text, Place(path, line)) for line in lines]


def test_one_text_is_said_once_where_it_first_stands() -> None:
    (only,) = gathered(said(8, 11, 12, 13, 19))
    assert only.text == "why (5 times, lines 8, 11 to 13, 19)"
    assert only.place == Place("p.nc", 8)


def test_other_texts_and_other_programs_stay_apart_and_in_order() -> None:
    found = gathered(
        [*said(3), *said(4, text="other"), *said(5, path="q.nc"), Message("NCF409", "x"), Message("NCF409", "x")]
    )
    assert [message.text for message in found] == ["why", "other", "why", "x", "x"]


def test_many_stretches_are_only_bounded() -> None:
    assert named([2, 4]) == "lines 2, 4"
    assert named([7]) == "line 7"
    assert named(range(2, 40, 2)) == "between lines 2 and 38"
