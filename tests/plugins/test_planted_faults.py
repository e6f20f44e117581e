"""Faults that a plugin's author may make: the contracts find them.

A grammar of a plugin's own that makes no tree of words is the plugin's fault, and text that nobody knows is refused.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ncfix.plugin import Compensation, MakeUp, SetLength, SetTool, family, like, own_terms
from ncfix.testing import check_control, check_language, check_places
from ncfix.text.dialect import Dialect
from ncfix.text.reader import read

BEGIN = "G21 G17 G90 G94 G54\nG0 X0 Y0 Z50\nT1 M6\nG0 X0 Y0 Z50\n"
TEXT = "%import {family} ({imports})\n"


def dialect(tmp_path: Path, grammar: str, base: str = "fanuc", **changes: object) -> Dialect:
    path = tmp_path / "own.lark"
    path.write_text(grammar)
    return family(base).derive("planted", title="Planted", grammar=str(path), **changes)


def kept(tmp_path: Path, pattern: str) -> Dialect:
    """Fanuc, with one sort of text more that is kept as it is."""
    return dialect(tmp_path, f"%import fanuc (block, OUTPUT)\n%override OUTPUT.5: {pattern}\n")


@pytest.mark.parametrize("pattern", [r"/F[-+\d.]+/i", r"/B[-+\d.]+/i", "/G4[0-9]/i", "/G91/i", "/R25.*/i", r"/#.*/"])
def test_a_grammar_that_swallows_words(tmp_path: Path, pattern: str) -> None:
    with pytest.raises(AssertionError, match="is passed over"):
        check_language(kept(tmp_path, pattern), count=2)


STATEMENT = """
%import common (word, ADDRESS, COMMENT)
block: (word | TEST | COMMENT)*
TEST: /[#$].*/s
"""


@pytest.mark.parametrize("base", ["iso", "fanuc"])
def test_text_of_a_terminal_that_nobody_knows_is_not_passed_over(tmp_path: Path, base: str) -> None:
    own = dialect(tmp_path, STATEMENT, base)
    check_places(own, f"{BEGIN}G1 X1. F100\n$IF P1 == 2\nG1 X5.\nM30\n", {5: {"X": 1.0}, 7: None})


ALIEN = """
%import common (value, parameter, ADDRESS, NUMBER, COMMENT, CODE)
block: (word | COMMENT)*
word: {word} | CODE -> code
%override parameter: SIGN value
SIGN.5: "VC"
SLASH: ":"
"""


@pytest.mark.parametrize("base", ["iso", "fanuc"])
@pytest.mark.parametrize(
    ("word", "block"), [("ADDRESS value", "G1 XVC1"), ("ADDRESS SLASH NUMBER", "G1 X:1"), ("NUMBER", "5")]
)
def test_a_tree_of_another_kind_is_the_fault_of_the_grammar(tmp_path: Path, base: str, word: str, block: str) -> None:
    with pytest.raises(ValueError, match=r"own\.lark: the grammar has to make a tree of words .*, from '"):
        read(f"{block}\n".encode(), "part", dialect(tmp_path, ALIEN.format(word=word), base))


@pytest.mark.parametrize("grammar", ["%import iso (block)\n%override parameter: NUMBER\n", "block: nothing\n"])
def test_a_grammar_that_is_none_says_why(tmp_path: Path, grammar: str) -> None:
    with pytest.raises(ValueError, match=r"own\.lark: GrammarError: "):
        read(b"G1 X1\n", "part", dialect(tmp_path, grammar, "iso"))


WORDS = """
%import common (word, ADDRESS, NUMBER, COMMENT)
block: (word | statement | COMMENT)*
statement: STATEMENT -> code
STATEMENT.6: /#TIPON|#TIPOFF|GOTO0/i
"""


@pytest.mark.parametrize("base", ["iso", "fanuc", "linuxcnc"])
def test_keywords_beside_codes(tmp_path: Path, base: str) -> None:
    own = dialect(tmp_path, WORDS, base, keywords={"#TIPON": "G43", "#TIPOFF": "G49", "GOTO0": "G0"})
    program = "T1 M6\nG21 G17 G90 G94 G54\nG0 X0. Y0. Z50.\n#TIP ON\nGOTO 0 Z1.\n#TIP OFF\nG1 Z2. F100.\nM2\n"
    check_places(own, program, {3: {"Z": 50.0}, 5: {"Z": 21.0}, 7: {"Z": 2.0}})


# -- operations -------------------------------------------------------------------------------------------------------

OWN = family("iso").derive(
    "tools",
    title="Tools",
    codes={
        "M6": [SetTool("T"), SetLength()],
        "G243": [SetLength("D")],
        "G8": [MakeUp("the arc tangent to the motion before it (G8)")],
        "G73": [like("G68", R=("Q", 0), X=("I", 0), Y=("J", 0))],
    },
)


def test_the_length_of_a_tool_without_a_code_for_it() -> None:
    check_places(OWN, f"{BEGIN}G1 Z1. F100.\nG243 D2\nG1 Z1.\n", {2: {"Z": 50.0}, 4: {"Z": 70.0}, 7: {"Z": 41.0}})


def test_a_motion_that_the_control_makes_up_is_refused_alone() -> None:
    program = f"{BEGIN}G1 X1. F100.\nG8 X5. Y5.\nG1 X7.\nG1 X7. Y8. Z9.\nG1 X8.\n"
    check_places(OWN, program, {5: {"X": 1.0}, 6: None, 7: None, 8: None, 9: {"X": 8.0, "Y": 8.0}})


def test_words_that_a_block_may_leave_out() -> None:
    program = f"{BEGIN}G1 X1. Y1. F100.\nG73 Q90\nX3. Y2.\nG73\nX3. Y2.\nG73 Q90 I1.\nX3. Y2.\n"
    check_places(OWN, program, {7: {"X": -2.0, "Y": 3.0}, 9: {"X": 3.0, "Y": 2.0}, 11: {"X": -1.0, "Y": 2.0}})


@pytest.mark.parametrize("word", [("Q",), ("Q", "J"), (0, "Q"), ("QQ", 0), ("Q", 0, 1)])
def test_what_a_word_cannot_be(word: tuple[object, ...]) -> None:
    with pytest.raises(ValueError, match="is not allowed: a letter for a letter"):
        like("G68", R=word)  # type: ignore[arg-type]


def test_places_that_are_not_as_the_manual_has_them() -> None:
    with pytest.raises(AssertionError, match=r"line 7, 'X3. Y2.': X stands at -2, not at 3"):
        check_places(OWN, f"{BEGIN}G1 X1. Y1. F100.\nG73 Q90\nX3. Y2.\n", {7: {"X": 3.0}})
    with pytest.raises(AssertionError, match="its motion is refused"):
        check_places(OWN, f"{BEGIN}G8 X1. Y1. F100.\n", {5: {"X": 1.0}})
    with pytest.raises(AssertionError, match="its motion is not refused"):
        check_places(OWN, f"{BEGIN}G1 X1. Y1. F100.\n", {5: None})


# -- tables -----------------------------------------------------------------------------------------------------------

Change = Callable[..., tuple[np.ndarray, ...]]


@pytest.fixture
def tables(root: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(root / "examples/third_party_plugin")
    import ncfix_nakano.tables

    yield ncfix_nakano.tables
    for name in [name for name in sys.modules if name.startswith("ncfix_nakano")]:
        del sys.modules[name]


def one_of_many_further(place: np.ndarray, *errors: np.ndarray) -> tuple[np.ndarray, ...]:
    """128 even points, each with what belongs to the one before it: a straight error shows it, a curve does not."""
    nodes = np.linspace(place[0], place[-1], 128)
    even = [np.interp(nodes, place, each) for each in errors]
    return nodes, *(np.concatenate((each[:1], each[:-1])) for each in even)


READERS: dict[str, tuple[str, Change]] = {
    "the sign": ("EXX", lambda place, ahead, back: (place, -ahead, -back)),
    "a point further": ("EXX", lambda place, ahead, back: (place, np.roll(ahead, 1), np.roll(back, 1))),
    "one of many points further": ("straight", one_of_many_further),
    "the ways swapped": ("play", lambda place, ahead, back: (place, back, ahead)),
    "one way for both": ("play", lambda place, ahead, back: (place, ahead, ahead)),
    "millimetres for micrometres": ("EXX", lambda place, ahead, back: (place, ahead / 1000, back / 1000)),
    "whole micrometres": ("straight", lambda place, ahead, back: (place, ahead.round(), back.round())),
}


@pytest.mark.parametrize("fault", READERS)
def test_tables_that_are_read_wrong(tables: ModuleType, fault: str) -> None:
    told, change = READERS[fault]

    class Wrong(tables.NakanoPitch):  # type: ignore[misc,name-defined]
        def read(self, files):  # type: ignore[no-untyped-def]
            document, remarks = tables.read_form(tables.FORM, tables.FILE, files[tables.FILE])
            remarks.check()
            terms = []
            for axis, rows in document.sections("axis").items():
                place, ahead, back = change(*np.array(rows).T)
                terms += own_terms(axis, place, -ahead / 1000, -back / 1000)
            return Compensation(tuple(terms))

    with pytest.raises(AssertionError, match=told):
        check_control(Wrong())


def test_a_reader_that_passes_over_what_it_cannot_read(tables: ModuleType) -> None:
    class Lenient(tables.NakanoPitch):  # type: ignore[misc,name-defined]
        def read(self, files):  # type: ignore[no-untyped-def]
            document, _ = tables.read_form(tables.FORM, tables.FILE, files[tables.FILE])
            terms = []
            for axis, rows in document.sections("axis").items():
                place, ahead, back = np.array(rows).T
                terms += own_terms(axis, place, -ahead / 1000, -back / 1000)
            return Compensation(tuple(terms))

        def lint(self, files):  # type: ignore[no-untyped-def]
            return ()

    with pytest.raises(AssertionError, match="made unreadable"):
        check_control(Lenient())
