"""Messages have a code, a place, the source line with a caret, and a hint; error classes carry the exit code."""

from __future__ import annotations

import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ncfix.diagnostics import (
    EXCERPT,
    ConfigError,
    ExitCode,
    Message,
    NcfixError,
    Place,
    PluginError,
    RefusedError,
    SourceError,
    UsageError,
)


def test_a_message_shows_place_code_line_caret_and_hint() -> None:
    message = Message("NCF104", "unknown word", Place("part.ngc", 12, 5, "G1 X?10"), "X needs a number")
    assert str(message).splitlines() == [
        "part.ngc:12:5: NCF104: unknown word",
        "    G1 X?10",
        "        ^",
        "  hint: X needs a number",
    ]


@pytest.mark.parametrize(
    ("place", "shown"),
    [(Place("f"), "f"), (Place("f", 3), "f:3"), (Place("f", 3, 2), "f:3:2"), (Place("f", 0, 2), "f")],
)
def test_a_place_shows_what_is_known(place: Place, shown: str) -> None:
    assert str(place) == shown


@given(st.text(st.characters(codec="latin-1"), min_size=1, max_size=400), st.data())
def test_the_caret_stands_under_its_character_and_nothing_reaches_the_terminal_raw(
    text: str, data: st.DataObject
) -> None:
    column = data.draw(st.integers(1, len(text)))
    _head, source, caret, *rest = str(Message("NCF100", "bad", Place("f", 1, column, text))).split("\n")
    assert not rest
    assert source.isprintable()
    assert len(source) <= EXCERPT + 4 + 6
    shown, meant = source[caret.index("^")], text[column - 1]
    assert shown == (meant if meant.isprintable() else " " if meant == "\t" else "?")


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (UsageError, ExitCode.USAGE),
        (SourceError, ExitCode.UNREADABLE),
        (ConfigError, ExitCode.UNREADABLE),
        (RefusedError, ExitCode.REFUSED),
        (PluginError, ExitCode.FAULT),
    ],
)
def test_each_class_has_its_exit_code_and_survives_a_process_boundary(error: type[NcfixError], code: ExitCode) -> None:
    raised = error.collected([Message("NCF301", "one"), Message("NCF302", "two")])
    assert raised.exit_code == code
    copy = pickle.loads(pickle.dumps(raised))
    assert (type(copy), copy.messages, copy.code) == (error, raised.messages, "NCF301")
    assert str(copy) == "NCF301: one\nNCF302: two"
