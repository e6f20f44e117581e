"""Codes and cycles that a dialect adds to its family: they do what the family's own codes would."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ncfix.cli.listings import own_codes
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import MotionKind, Moves, Rule
from ncfix.control.operations import ALL_AXES, Lose, Rapid, Refuse, Resume, SetTool, Suspend, like
from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.diagnostics import PluginError, SourceError
from ncfix.machine import Machine, load
from ncfix.plugin import family
from ncfix.testing import Pair, check_language, gcode_statements
from ncfix.text.dialect import CycleTable, Dialect
from ncfix.text.reader import read

FIXTURE = "the fixture's frame (G120)"
CODES = {
    "G100": [SetTool("T"), Rapid()],
    "G168": [like("G68.2", I="A", J="B", K="C", P=0)],
    "G120": [Suspend(FIXTURE)],
    "G121": [Resume(FIXTURE)],
    "G130": [Lose("Z", "the retraction (G130)")],
    "G131": [Refuse("the turret turns (G131)")],
    "G187": [],
    "M180": [],
    "M160": [SetTool("T")],
}
CYCLES = {
    "G177": CycleTable(level="E", needs="Q", returns="level"),
    "G178": CycleTable(returns="initial", modal=False),
}
OWN = family("fanuc").derive("own", title="Own", codes=CODES, cycles=CYCLES)
SETUP = Setup(assume_zero=True)


@pytest.fixture(scope="module")
def dmu50(root: Path) -> Machine:
    return load(root / "examples/machines/dmu50.toml")


def moves_of(text: str, machine: Machine, dialect: Dialect = OWN) -> Moves:
    program = read(text.encode(), "part.nc", dialect=dialect)
    return trace(program, SETUP, machine.axis_names, frozenset("ABC") & {*machine.axis_names}).moves


def fixed(text: str, machine: Machine, dialect: Dialect = OWN) -> Fixed:
    options = FixOptions(allow_refused=True)
    return fix_program(read(text.encode(), "part.nc", dialect=dialect), machine, SETUP, options)


def numbers(program: bytes) -> list[str]:
    """What stands behind the axis letters of a program, the level as R; without its stamp."""
    code = re.sub(rb"\(.*?\)", b"", program).replace(b"E", b"R")
    return [word.decode() for word in re.findall(rb"[XYZRBC]-?[\d.]+", code)]


HEAD = "G21 G17 G90 G54\nT2 M6\nG0 X10. Y20. Z100.\nG43 H2 Z50.\nS1000 M3\n"
FAMILY = HEAD + (
    "G99 G83 X30. Y30. Z-10. R2. Q3. F100.\nX40. Y35.\nR3. X50.\nG80\nG1 X0. Y0. Z10. F500.\n"
    "G68.2 X10. Y0. Z0. I0. J30. K0.\nG53.1\nG1 X5. Y5. Z0. F300.\nG69\nM30\n"
)


def test_own_codes_are_corrected_as_those_of_the_family(dmu50: Machine) -> None:
    own = HEAD + (
        "G177 X30. Y30. Z-10. E2. Q3. F100.\nX40. Y35.\nE3. X50.\nG80\nG187 P1\nG1 X0. Y0. Z10. F500.\nM180\n"
        "G168 X10. Y0. Z0. A0. B30. C0.\nG53.1\nG1 X5. Y5. Z0. F300.\nG69\nM30\n"
    )
    meant, found = fixed(FAMILY, dmu50, family("fanuc")), fixed(own, dmu50)
    assert not found.report.refused
    assert [w for w in numbers(found.text) if w not in ("B30.", "C0.")] == numbers(meant.text)
    assert b"G168 X10. Y0. Z0. A0. B30. C0." in found.text


def test_a_tool_change_leads_to_its_words_in_rapid(dmu50: Machine) -> None:
    text = "G90 G54 G1 F100. X0. Y0. Z10.\nG100 T3 X10. Y20. Z100.\nX11.\nM30\n"
    moves = moves_of(text, dmu50)
    assert [MotionKind(kind) for kind in moves.kind] == [MotionKind.FEED, MotionKind.RAPID, MotionKind.FEED]
    assert (moves.rule == Rule.CORRECT).all()
    again = fixed(text, dmu50).text
    assert re.search(rb"\nG100 T3 X[\d.]+ Y[\d.]+ Z[\d.]+\n", again)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("G120\nG1 X5.", FIXTURE),
        ("G130\nG1 X5.", "the retraction (G130)"),
        ("G131\nG1 X5.", "the turret turns (G131)"),
    ],
)
def test_what_is_not_followed_is_refused_with_its_reason(dmu50: Machine, line: str, reason: str) -> None:
    text = f"G90 G54 G0 X0. Y0. Z10. B0. C0.\nF100.\n{line}\nM30\n"
    moves = moves_of(text, dmu50)
    assert moves.rule[-1] == Rule.REFUSE
    assert reason in moves.reasons[moves.reason[-1]]


def test_a_mode_ends(dmu50: Machine) -> None:
    moves = moves_of("G90 G54 G0 X0. Y0. Z10. B0. C0.\nG120\nX5.\nG121\nX6. Y0. Z9. B0. C0.\nG1 F10. X7.\n", dmu50)
    assert [Rule(rule) for rule in moves.rule] == [Rule.CORRECT, Rule.REFUSE, Rule.CORRECT, Rule.CORRECT]


def test_a_cycle_that_is_not_modal(dmu50: Machine) -> None:
    moves = moves_of("G90 G54 G0 X0. Y0. Z10. B0. C0.\nF100.\nG178 X1. Y1. Z-5. R1.\nX9.\nM30\n", dmu50)
    assert [MotionKind(kind) for kind in moves.kind] == [MotionKind.RAPID, MotionKind.CYCLE, MotionKind.RAPID]
    assert np.isclose(moves.start[2][dmu50.axis_names.index("Z")], 10.0)


def test_a_cycle_lacks_a_word(dmu50: Machine) -> None:
    with pytest.raises(SourceError, match="Q is missing: G177 needs it"):
        moves_of("G90 G54 G0 X0. Y0. Z10.\nG177 X1. Y1. Z-5. E1. F10.\n", dmu50)


def test_a_word_in_the_place_of_a_renamed_one(dmu50: Machine) -> None:
    with pytest.raises(SourceError, match="I is not a word of G168"):
        moves_of("G90 G54 G0 X0. Y0. Z10.\nG168 X1. Y1. I5. A0. B1. C0.\n", dmu50)


@pytest.mark.parametrize("code", ["G1", "G90", "H5", "G100.25", "g100", "G05", "M06", "G5.0", "G"])
def test_codes_that_no_dialect_can_have(code: str) -> None:
    with pytest.raises(ValueError, match="cannot be a code of a dialect's own"):
        OWN.derive("x", title="X", codes={code: []})


def test_codes_in_a_language_that_takes_none() -> None:
    with pytest.raises(PluginError, match="takes none"):
        read(b"G0 X0\n", dialect=family("siemens").derive("x", title="X", codes={"G150": []}))


WRONG = {
    "like beside another": ({"codes": {"G150": [SetTool("T"), like("G69")]}}, "G150: like.* stands alone"),
    "no operation": ({"codes": {"G150": ["G69"]}}, "'G69' is no operation"),
    "an operation that is not called": ({"codes": {"G150": [SetTool]}}, r"G150: SetTool is no .*: write SetTool\("),
    "an operation outside a list": ({"codes": {"G150": SetTool("T")}}, "G150: .* is no list of operations"),
    "an M code like a G code": ({"codes": {"M77": [like("G69")]}}, "M77: like.'G69'.: a G code is like"),
    "a motion by an M code": ({"codes": {"M150": [Rapid()]}}, "'M150' .*: an M code takes no axis words"),
    "what the families rely on": ({"codes": {"G1": []}}, "'G1' .*: the families rely on"),
    "a cycle that is no table": ({"cycles": {"G150": {"level": "R"}}}, "G150: .* is no CycleTable"),
    "a cycle by an M code": ({"cycles": {"M150": CycleTable()}}, "'M150' .*: cycles are G codes"),
    "a field that is not there": ({"suffix": (".nak",)}, "a dialect has no suffix: did you mean suffixes"),
    "text for a number": ({"line_limit": "128"}, "'128' cannot be the line_limit"),
    "another feed": ({"feed_of": "rotary"}, "'rotary' cannot be feed_of"),
    "a signature that is text": ({"signature": ("G150",)}, "signature is a tuple of bytes"),
    "a sentence in no tuple": ({"passes": "G150"}, "passes is a tuple of str"),
    "a suffix without its point": ({"suffixes": ("nak",)}, "'nak' cannot be a suffix"),
    "a suffix that is no tuple": ({"suffixes": ".nak"}, "suffixes is a tuple of str, not '.nak'"),
    "capital letters": ({"suffixes": (".NAK",)}, "'.NAK' cannot be a suffix"),
    "a sign of comments": ({"comment": "' {}"}, "no comment can be written"),
    "a comment without its text": ({"comment": "()"}, "no comment can be written"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_no_dialect_can_have(name: str) -> None:
    changes, said = WRONG[name]
    with pytest.raises(ValueError, match=f"x: .*{said}"):
        OWN.derive("x", title="X", **changes)


@pytest.mark.parametrize(
    ("code", "words"), [("g68.2", {}), ("G68.20", {}), ("T", {}), ("G68.2", {"I": "AB"}), ("G68.2", {"Q": "123"}),
                        ("G68.2", {"i": "A"})],
)  # fmt: skip
def test_what_is_like_nothing(code: str, words: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="like"):
        like(code, **words)


@pytest.mark.parametrize("comment", ["({})", "; {}", ";{}", "(NCFIX {})"])
def test_signs_of_comments(comment: str) -> None:
    assert OWN.derive("x", title="X", comment=comment).comment == comment


@pytest.mark.parametrize("address", ["X", "B", "W", "G", "N", "TT", "t", ""])
def test_addresses_that_are_no_tool(address: str) -> None:
    with pytest.raises(ValueError, match="cannot be the address of a tool"):
        SetTool(address)


@pytest.mark.parametrize("axes", ["", "XQ", "x", "X Y"])
def test_letters_that_are_no_axes(axes: str) -> None:
    with pytest.raises(ValueError, match="are not axes"):
        Lose(axes, "it")


@pytest.mark.parametrize(
    "field", [{"repeats": "X"}, {"repeats": ("K", "L")}, {"repeats": "E", "level": "E"}, {"needs": ("Q",)},
              {"needs": "q"}, {"returns": "top"}],
)  # fmt: skip
def test_fields_that_no_cycle_has(field: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="cycle"):
        CycleTable(**field)


HOME = OWN.derive("home", title="Home", codes={"G110": [SetTool("T"), Lose(ALL_AXES, "the tool change (G110)")]})


def test_words_that_a_code_like_another_takes_lead_nowhere() -> None:
    leads = gcode_statements(OWN).leads
    assert not leads("G168", ("X10.", "R25."), 0)
    assert leads("G100", ("X10.",), 0)
    assert leads("G177", ("X10.",), 0)


def test_all_axes_are_lost_until_each_is_named(dmu50: Machine) -> None:
    lines = "F100.\nG110 T3\nG1 X6.\nG0 X1. Y1. Z5.\nB0. C0.\nG1 X7.\nM30\n"
    moves = moves_of(f"G90 G54 G0 X0. Y0. Z10. B0. C0.\n{lines}", dmu50, HOME)
    assert [Rule(rule) for rule in moves.rule] == [Rule.CORRECT, Rule.REFUSE, Rule.PASS, Rule.CORRECT, Rule.CORRECT]
    assert "the tool change (G110)" in moves.reasons[moves.reason[1]]


@pytest.mark.parametrize(("line", "known"), [("Z9.", True), ("G53 Z9.", True), ("G91 Z9.\nG90", False)])
def test_how_a_lost_axis_becomes_known(dmu50: Machine, line: str, known: bool) -> None:
    moves = moves_of(f"G90 G54 G0 X0. Y0. Z10. B0. C0.\nF100.\nG130\n{line}\nG1 X5.\nM30\n", dmu50)
    assert (moves.rule[-1] == Rule.CORRECT) == known


def test_a_tool_that_is_set_leaves_the_axes_where_they_are(dmu50: Machine) -> None:
    moves = moves_of("G90 G54 G0 X0. Y0. Z10. B0. C0.\nF100.\nM160 T3\nG1 X6.\nM30\n", dmu50)
    assert (moves.rule == Rule.CORRECT).all()
    assert np.isclose(moves.start[1][dmu50.axis_names.index("Z")], 10.0)


def test_a_tool_that_is_set_at_run_time_has_no_length(dmu50: Machine) -> None:
    moves = moves_of("G90 G54 G0 X0. Y0. Z10. B0. C0.\nF100.\nM160 T#500\nG1 X6.\nM30\n", dmu50)
    assert [Rule(rule) for rule in moves.rule] == [Rule.CORRECT, Rule.REFUSE]


def test_motions_before_a_refusal_are_corrected(dmu50: Machine) -> None:
    moves = moves_of("G90 G54 G0 X0. Y0. Z10. B0. C0.\nG1 X5. F100.\nG131\nX6.\nM30\n", dmu50)
    assert [Rule(rule) for rule in moves.rule] == [Rule.CORRECT, Rule.CORRECT, Rule.REFUSE]


def test_what_own_codes_do_in_words() -> None:
    assert own_codes(HOME)[-3:] == [
        "G110: the tool T is changed into the spindle; "
        "the position of the axes after the tool change (G110) is not known",
        "G177: drilling cycle, level E, needs Q, returns to the level",
        "G178: drilling cycle, level R, returns to the initial level, in its block only",
    ]
    assert {"G168: as G68.2, A as I, B as J, C as K, P0", "G187: moves nothing"} < {*own_codes(OWN)}


@pytest.mark.parametrize("level", ["H", "L", "X", "EE"])
def test_addresses_that_are_no_level(level: str) -> None:
    with pytest.raises(ValueError, match="cannot be the address of the level"):
        CycleTable(level=level)


def test_the_contract_in_a_tilted_plane() -> None:
    tilted = Pair(on=("G168 X1. Y2. Z3. A10. B20. C0.",), off=("G69",))
    found = check_language(OWN, replace(gcode_statements(OWN), frames=(tilted,)), count=5)
    assert found["right"] > 20


def test_dialects_of_a_derived_one() -> None:
    again = OWN.derive("again", title="Again", codes={"G187": [Refuse("no")]}, cycles={"G121": CycleTable()})
    assert dict(again.codes)["G187"] == (Refuse("no"),)
    assert "G121" not in dict(again.codes)
    assert again.variant_of == "fanuc"


@pytest.mark.parametrize(("code", "words"), [("G1", {"X": "U"}), ("G01", {"Z": -5})])
def test_words_of_places_keep_their_addresses(code: str, words: dict[str, str | float]) -> None:
    """The writer rewrites them, so a block has to show them."""
    with pytest.raises(ValueError, match="cannot be renamed"):
        like(code, **words)


def test_an_alias_means_the_same_in_short_and_long_programs(dmu50: Machine) -> None:
    dialect = family("fanuc").derive("fed", title="Fed", codes={"G101": [like("G1", F=500)]})
    head = "G21G90G54G0X0.Y0.Z5.B0.C0.\nG1X1.F100.\n"
    for count in (5, 500):
        moves = moves_of(head + "G101X2.\nG1X3.\n" * count, dmu50, dialect)
        assert set(moves.feed[2:].tolist()) == {500.0}


@pytest.mark.parametrize("axis", ["C", "Z"])
def test_under_tcp_a_lost_axis_loses_the_tip(root: Path, axis: str) -> None:
    dialect = family("fanuc").derive("lost", title="Lost", codes={"G131": [Lose(axis, "the change of pallets (G131)")]})
    machine = load(root / "examples/machines/wCAYFXZSt.toml")
    text = f"G21G90G43.4H1G0X0.Y0.Z5.A30.C40.\nG131\nG0{axis}4.\nG1Y5.F100.\nM30\n"
    program = read(text.encode(), "part.nc", dialect=dialect)
    setup = Setup(assume_zero=True, no_point="calculator")
    moves = follow(program, machine, setup).trace.moves
    assert moves.rule[-1] == Rule.REFUSE
