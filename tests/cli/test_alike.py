"""Messages that say the same of several lines are told once, with all of them."""

from __future__ import annotations

from ncfix.cli.console import MAX_MESSAGES_PER_CODE, keeping, said_once, tell_some
from ncfix.diagnostics import Message, Place, lines_named


def said(*lines: int, text: str = "why", path: str = "p.nc") -> list[Message]:
    return [Message("NCF432", text, Place(path, line)) for line in lines]


def test_one_text_is_said_once_where_it_first_stands() -> None:
    (only,) = said_once(said(8, 11, 12, 13, 19))
    assert only.text == "why (5 times, lines 8, 11 to 13, 19)"
    assert only.place == Place("p.nc", 8)


def test_other_texts_and_other_programs_stay_apart_and_in_order() -> None:
    found = said_once(
        [*said(3), *said(4, text="other"), *said(5, path="q.nc"), Message("NCF409", "x"), Message("NCF409", "x")]
    )
    assert [message.text for message in found] == ["why", "other", "why", "x", "x"]


def test_texts_that_differ_in_how_much_are_said_once_where_it_is_most() -> None:
    sizes = {3: "9.5", 4: "10.25", 5: "1.2e+03", 6: "0.5"}
    (only,) = said_once(
        [
            message
            for line, size in sizes.items()
            for message in said(line, text=f"axis X goes {size} mm beyond its range")
        ]
    )
    assert only.text == "axis X goes 1.2e+03 mm beyond its range (4 times, lines 3 to 6; the largest is shown)"
    assert only.place == Place("p.nc", 5)


def test_other_axes_rates_and_several_figures_stay_apart() -> None:
    texts = [
        "axis X goes 1 mm beyond",
        "axis Y goes 2 mm beyond",
        "1 mm at the start and 2 mm",
        "1 mm at the start and 3 mm",
    ]
    texts += ["9 mm/min", "8 mm/min", "'1.2.3 mm' is not a number", "'1.2.4 mm' is not a number"]
    found = said_once([message for line, text in enumerate(texts, start=1) for message in said(line, text=text)])
    assert [message.text for message in found] == texts


def test_many_stretches_are_only_bounded() -> None:
    assert lines_named([(2, 2), (4, 6)]) == "lines 2, 4 to 6"
    assert lines_named([(7, 7)]) == "line 7"
    assert lines_named([(line, line) for line in range(2, 40, 2)]) == "between lines 2 and 38"


def test_of_many_that_say_something_else_the_first_are_said_and_the_rest_is_counted() -> None:
    with keeping() as lines:
        tell_some(
            [message for line in range(1, MAX_MESSAGES_PER_CODE + 31) for message in said(line, text=f"axis {line}")]
        )
    text = "\n".join(lines)
    assert text.count(" axis ") == MAX_MESSAGES_PER_CODE
    assert " and 30 more like these" in text
