"""Block delete: what a corrected program is in each position of the switches, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions, block_delete
from ncfix.compensate.checking import check_on
from ncfix.compensate.driver import Fixed, fix_flat, fix_program
from ncfix.compensate.following import traced
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import RefusedError, SourceError, UsageError
from ncfix.machine import Machine, load
from ncfix.text.reader import read

SETUP = Setup(
    work_offsets={"G54": dict.fromkeys("XYZ", 0.0), "G55": {"X": 20.0, "Y": -5.0, "Z": 0.0}, "PRESET": {}, "G500": {}},
    tools={0: Tool(0.0), 1: Tool(50.0)},
    initial={"X": 0.0, "Y": 0.0, "Z": 100.0},
    no_point="calculator",
)
RETRACTED = "G21 G90 G17\nG0 X0 Y0 Z0\nG1 X10 Y0 F500\n/G1 X60 Y90\nG1 X20 Y25 Z0\nG1 X30 Y25 Z5\nM2\n"
TOLERANCE = 1e-3
ROUNDING = 1e-3


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load(str(Path(__file__).parents[1] / "differential/machines/three.toml"))


def fixed(text: str, machine: Machine, dialect: str = "linuxcnc", setup: Setup = SETUP) -> Fixed:
    return fix_program(read(text.encode(), "p.ngc", dialect), machine, setup, FixOptions())


def in_position(text: str, on: bool) -> str:
    """The lines that are executed, without their marks."""
    lines = (line for line in text.splitlines() if not (on and line.startswith("/")))
    return "".join(line.removeprefix("/") + "\n" for line in lines)


def way(text: str, machine: Machine, dialect: str, actual: bool) -> np.ndarray:
    """Points of the tip along the feeds of a program without marks, (n, 3)."""
    moves = traced(read(text.encode(), "p.ngc", dialect), machine, SETUP).moves
    share = np.linspace(0, 1, 21)[:, None]
    q = np.concatenate([start + share * (end - start) for start, end in zip(moves.start, moves.end, strict=True)])
    return machine.actual(q)[:, :3, 3] if actual else machine.tip(q)


def off(points: np.ndarray, path: np.ndarray) -> float:
    """How far points are from a path at most."""
    start, step = path[:-1], np.diff(path, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-30)
    share = np.clip(np.einsum("pkj,kj->pk", points[:, None] - start, step) / square, 0, 1)
    return float(np.linalg.norm(start + share[..., None] * step - points[:, None], axis=2).min(axis=1).max())


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso", "fanuc", "siemens"])
def test_what_starts_behind_a_skipped_block_keeps_its_way(dialect: str, machine: Machine) -> None:
    source = RETRACTED.replace("M2", "M30").replace("G21", "G71" if dialect == "siemens" else "G21")
    done = fixed(source, machine, dialect)
    text = done.text.decode()
    assert done.report.refused == ()
    assert [line.startswith("/") for line in text.splitlines()].count(True) > 1
    for on in (False, True):
        meant, found = (
            way(in_position(each, on), machine, dialect, actual) for each, actual in ((source, False), (text, True))
        )
        assert off(found[21:], meant) < 3 * TOLERANCE + ROUNDING


def test_klartext_too(machine: Machine) -> None:
    text = (
        "BEGIN PGM P MM\nTOOL CALL 1 Z S1000\nL X+0 Y+0 Z+0 R0 FMAX\nL X+10 Y+0 F500\n/L X+60 Y+90\n"
        "L X+20 Y+25 Z+0\nL X+30 Y+25 Z+5\nEND PGM P MM\n"
    )
    done = fixed(text, machine, "heidenhain")
    assert done.report.refused == ()
    assert done.report.block_delete == ([], [1])
    lines = done.text.decode().splitlines()
    at = next(n for n, line in enumerate(lines) if line.startswith(("L X+19.9", "L X+20")))
    assert lines[at - 1].startswith("/")
    assert lines[at + 1].startswith(("L X+29.9", "L X+30"))


def test_both_positions_are_said_and_stamped(machine: Machine) -> None:
    done = fixed(RETRACTED, machine)
    assert b", block delete on or off" in done.text
    assert done.report.as_dict()["block_delete"] == [[], [1]]
    assert "NCF235" in [each.code for each in done.report.warnings]
    ways = ((True, b"on"), (False, b"off"), (frozenset({1}), b"on"), (frozenset({2}), b"off"))
    for stated, word in ways:
        setup = Setup(SETUP.work_offsets, SETUP.tools, SETUP.initial, block_skip=stated)
        only = fixed(RETRACTED, machine, setup=setup)
        assert b", block delete %s)" % word in only.text
        assert len(only.report.block_delete) == 1
        said = {each.code: each.text for each in only.report.warnings}["NCF235"]
        assert f"are taken as {'skipped' if word == b'on' else 'executed'}" in said


@pytest.mark.parametrize(
    ("between", "behind"),
    [
        ("/G1 X60 Y90", "G1 X20"),  # Y has no word, and stands elsewhere
        ("/G55", "G1 X20 Y25 Z0"),  # another offset
        ("/G91", "G1 X20 Y25 Z0"),  # increments, or not
        ("/G1 X60 Y90", "G91\nG1 X5 Y5 Z1\nG90"),  # increments from elsewhere
        ("/G20", "G1 X2 Y1 Z0"),  # inches, or not
    ],
)
def test_what_cannot_be_one_text_is_refused_with_its_line(between: str, behind: str, machine: Machine) -> None:
    text = f"G21 G90 G17\nG0 X0 Y0 Z0\nG1 X10 Y0 F500\n{between}\n{behind}\nG0 G54 G21 G90\nG0 X0 Y0 Z0\nM2\n"
    report = fixed(text, machine).report
    line = next(n for n, each in enumerate(text.splitlines(), 1) if n > 4 and "X" in each)
    (refused,) = [each for each in report.refused if each.line == line]
    assert refused.code == "NCF451"
    assert "(line 4)" in refused.reason


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc", "siemens"])
def test_a_rapid_leaves_axes_that_it_does_not_name_where_they_stand(dialect: str, machine: Machine) -> None:
    text = "G21 G90 G17\nG0 X0 Y0 Z0\nG1 X10 Y0 F500\n/G1 X10.4 Y0.4\nG0 Z80\nG0 X20 Y25\nG1 Z0 F500\nM30\n"
    text = text.replace("G21", "G71") if dialect == "siemens" else text
    done = fixed(text, machine, dialect)
    assert done.report.refused == ()
    (retract,) = [each for each in done.text.decode().splitlines() if each.startswith("G0 Z")]
    assert "X" not in retract
    assert "Y" not in retract
    left = {each.code: each.text for each in done.report.warnings}["NCF439"]
    assert "which cuts nothing" in left
    for on in (False, True):
        meant, found = (
            way(in_position(each, on), machine, dialect, actual)
            for each, actual in ((text, False), (done.text.decode(), True))
        )
        assert off(found[-21:], meant) < 3 * TOLERANCE + ROUNDING


def test_a_rapid_from_which_a_cut_begins_is_refused(machine: Machine) -> None:
    text = "G21 G90 G17\nG0 X0 Y0 Z90\nG1 X10 Y0 F500\n/G1 X10.4 Y0.4\nG0 Z10\nG1 X20 Y25\nM2\n"
    assert [each.line for each in fixed(text, machine).report.refused if each.code == "NCF451"] == [5]


def test_a_rapid_whose_own_words_differ_stays_as_it_is(machine: Machine) -> None:
    text = "G21 G90 G17\nG0 X0 Y0 Z0\nG1 X10 Y0 F500\n/G55\nG0 X20 Y25 Z80\n{}G54\nG0 X20 Y25 Z80\nG1 X30 F500\nM2\n"
    done = fixed(text.format(""), machine)
    assert done.report.refused == ()
    assert b"\n/G55\nG0 X20 Y25 Z80\nG54\n" in done.text
    assert done.report.passed_by_rule["rapid after a block with /"] == 1
    refused = fixed(text.format("G1 X21\n"), machine).report.refused
    assert refused[0].code == "NCF451"
    assert refused[0].line == 5, "a cut begins there"


def test_in_turned_coordinates_such_a_rapid_is_refused(machine: Machine) -> None:
    text = "G21 G90 G17\nG68 X0 Y0 R30\nG0 X0 Y0 Z0\nG1 X10 Y0 F500\n/G1 X60 Y90\nG0 X20\nG69\nG0 X0 Y0 Z80\nM30\n"
    refused = fixed(text, machine, "fanuc").report.refused
    assert refused[0].code == "NCF451"
    assert refused[0].line == 6


def test_words_that_only_one_position_needs_are_written(machine: Machine) -> None:
    """Z has to move behind the one, and not behind the other."""
    for way_there in ("/G1 X10.4 Y0.4", "/G1 X-80 Y70", "/G0 X50 Y-60"):
        text = RETRACTED.replace("/G1 X60 Y90", way_there).replace("G1 X20 Y25 Z0", "G1 X20 Y25")
        assert fixed(text, machine).report.refused == ()


def test_switches_with_numbers_are_followed_in_all_their_positions(machine: Machine) -> None:
    text = RETRACTED.replace("G1 X30", "/2 G1 X-40 Y40 Z3\nG1 X30")
    done = fixed(text, machine, "iso")
    assert done.report.block_delete == ([], [1], [2], [1, 2])
    assert done.report.refused == ()
    many = RETRACTED.replace("G1 X30", "".join(f"/{n} G1 X{n} Y{n} Z0\n" for n in range(2, 7)) + "G1 X30")
    with pytest.raises(RefusedError) as raised:
        fixed(many, machine, "iso")
    assert raised.value.code == "NCF452"


def test_a_position_in_which_the_control_stops_is_an_error_that_names_it(machine: Machine) -> None:
    text = "G21 G90 G17\nG0 X0 Y0 Z0\n/G1 X10 Y0 F500\nG2 X20 Y10 I0 J10 F500\nM2\n"
    with pytest.raises(SourceError) as raised:
        fixed(text, machine)
    assert "if blocks with /1 are skipped" in raised.value.messages[0].text
    assert raised.value.messages[0].place is not None
    assert raised.value.messages[0].place.line == 4


def test_what_any_position_lacks_is_asked_for(machine: Machine) -> None:
    text = RETRACTED.replace("/G1 X60 Y90", "/G56 X1 Y1")
    with pytest.raises(UsageError):
        fixed(text, machine)


def test_jumps_and_program_ends_are_followed_in_both_positions(machine: Machine) -> None:
    text = RETRACTED.replace("/G1 X60 Y90", "/M2")
    assert fixed(text, machine).report.block_delete == ([], [1])
    jump = RETRACTED.replace("/G1 X60 Y90", "/GOTO 9\nG1 X60 Y90 Z0").replace("G1 X20", "N9 G1 X20")
    done = fixed(jump.replace("M2", "M30"), machine, "fanuc")
    assert done.report.refused == ()
    assert done.report.block_delete == ([], [1])


def test_blocks_that_change_no_path_ask_no_switch(machine: Machine) -> None:
    plain = RETRACTED.replace("/G1 X60 Y90", "G1 X60 Y90")
    text = plain.replace("G1 X20", "/M8\n/M1\n/G4 P1\nG1 X20")
    assert fixed(text, machine).report.block_delete == ()
    stamp, *lines = fixed(text, machine).text.splitlines()
    assert b"block delete" not in stamp
    assert [line for line in lines if line[:1] != b"/"] == fixed(plain, machine).text.splitlines()[1:]


@pytest.mark.parametrize("steps", [10, 40])
def test_a_chain_of_blocks_that_differ_takes_no_attempt_for_each(
    steps: int, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each increment begins where the one before ends, and is found to differ when that one is refused."""
    made = list[object]()
    plan = block_delete.plan_and_write
    monkeypatch.setattr(
        block_delete, "plan_and_write", lambda *given, **more: (made.append(0), plan(*given, **more))[1]
    )
    chain = "".join(f"{'/' if k % 3 == 0 else ''}{'XYZ'[k % 2]}{k % 5 + 1}\n" for k in range(steps))
    found = fixed(f"G21 G90 G17\nG0 X0 Y0 Z0\nG1 X1 F99\nG91\n{chain}G90\nG0 Z9\nM2\n", machine)
    assert found.report.refused
    assert len(made) <= 24


def test_check_looks_at_both_positions(machine: Machine) -> None:
    text = RETRACTED.replace("G1 X20 Y25 Z0", "G1 X20")
    found = check_on(read(text.encode(), "p.ngc", "linuxcnc"), machine, SETUP)
    assert {"NCF235", "NCF451"} <= {each.code for each in found.findings}


VARIABLE = (
    "o1 sub\nG1 X#1 Y#2 F200\no1 endsub\n#3=80\nG0 X0 Y0 Z10\nG1 Z0 F100\n"
    "o1 call [10] [5]\n/#3=20\no1 call [#3] [25]\nM2\n"
)


def test_a_flat_program_would_have_the_numbers_of_one_position(machine: Machine) -> None:
    program = read(VARIABLE.encode(), "p.ngc", "linuxcnc")
    both = fix_flat(program, machine, SETUP, FixOptions())
    assert both.report.refused
    assert "NCF447" in [warning.code for warning in both.report.warnings]
    for skipped, end in ((True, "X80"), (False, "X20")):
        one = fix_flat(program, machine, replace(SETUP, block_skip=skipped), FixOptions())
        assert not one.report.refused
        assert end in one.text.decode() or f"X{int(end[1:]) - 1}.9" in one.text.decode()


@pytest.mark.parametrize(
    ("structure", "found"),
    [
        ("IF R1>4\nG1 X11\n/ELSE\nG1 X12\nENDIF", False),
        ("/IF R1>4\nG1 X11\nELSE\nG1 X12\nENDIF", False),
        ("FOR R2=1 TO 2\nG1 X=R2\n/ENDFOR", False),
        ("/IF R1>4\n/G1 X11\n/ENDIF", True),
    ],
)
def test_a_structure_of_which_a_part_is_skipped_is_not_followed(structure: str, found: bool, machine: Machine) -> None:
    """Where ELSE is skipped the control looks for it, or does not: millimetres between the two."""
    text = f"G17 G71 G90 G94 G54\nR1=2\nG1 X10 Y0 Z5 F500\n{structure}\nG1 X20 Y25 Z0\nM30\n"
    if found:
        assert fixed(text, machine, "siemens").changed
    else:
        with pytest.raises(SourceError) as raised:
            fixed(text, machine, "siemens")
        assert raised.value.code == "NCF230"
    assert fixed(text, machine, "siemens", replace(SETUP, block_skip=False)).changed
