"""SINUMERIK and Fanuc programs corrected part by part come out, byte for byte, as those corrected as a whole."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from compensate.streaming import SETUP, compared, streamed, whole
from conftest import FULL, require_core, use_form
from ncfix import core
from ncfix.compensate.following import traced
from ncfix.control.lanes.lane import take
from ncfix.diagnostics import NcfixError
from ncfix.machine import Effect, Machine, load
from ncfix.machine.basis import Backlash
from ncfix.text.reader import read
from ncfix.writer import emit
from ncfix_siemens.sinumerik import orientation as orienting
from ncfix_siemens.sinumerik.language import SINUMERIK

CALCULATOR = replace(SETUP, no_point="calculator")
ELSEWHERE = "the program does not run straight from its first line to its last"

S_START = ("G0 X150. Y150. Z50. B10. C30.", "G1 Z5. F2000.")
S_HEAD = (
    "%_N_PART_MPF",
    ";$PATH=/_N_WKS_DIR/_N_TEST_WPD",
    "N10 G17 G40 G71 G90 G94",
    'N20 T="BALL_8" M6',
    "N30 D1 S12000 M3",
    "N40 G54",
    "N50 CYCLE832(0.01,_FINISH,1)",
    "N60 TRAORI",
    "N70 ORIWKS ORIAXES",
    "N80 G642 COMPCAD FFWON",
    *S_START,
)
S_ODDS = (
    ("; PASS 3", 'MSG("POINT 7")', ""),
    ("G0 X=150.5 Y=150.5 M8", "G1"),
    ("TRAFOOF", "G0 Z200. D0", 'T="BALL_6" M6', "D1", "TRAORI", *S_START),
    ("TRAFOOF", "SUPA G0 Z300. D0", "T2 M6", "D1", "TRAORI", *S_START),
    ("TRAFOOF", 'CYCLE800(1,"T",0,57,0,0,0,0,0,10,0,0,0,1)', "G0 X150. Y150. Z60.", "CYCLE800()", "TRAORI", *S_START),
    ("TRAFOOF", "G0 X150. Y150. Z50. B0. C0.", "MCALL CYCLE81(10,0,2,-3)", "X155. Y150.", "MCALL", "TRAORI", *S_START),
    ("G91", "G1 X.5 Y-.25", "X-.5 Y.25", "G90"),
    ("G1 X150. Y150. Z5. B0. C0.", "G2 X152. Y152. I2. J0.", "G3 X150. Y150. CR=2.", "G1"),
    ("R1=7.5", "G1 Z=R1", "DEF REAL OWN=1", "Z=AC(8.)"),
    ("TRANS X10.", "G1 X150. Y150.", "TRANS"),
    ("G1 X150. Y150. Z5. A3=0.1 B3=0 C3=1", "X150.5 A3=0.11 B3=0.01 C3=1"),
    ("MY_CYCLE(1,2)", *S_START),
    ("TOOLS", *S_START),
    ("G93 G1 X151. B11. F20.", "G94 F500."),
    ("X151. Y151. CT", "G1"),
    ("G1 X9000.",),
    ("STOPRE", "M1", "G4 F0.1", "/G4 F0.2"),
)
S_FILES = {"TOOLS": b"SUPA G0 Z300.\nM17\n"}

F_START = ("G0 X150. Y150. B10. C30.", "G43.4 H1 Z50.", "G1 Z5. F2000.")
F_HEAD = (
    "%",
    "O1234(PART)",
    "N10 G17 G21 G40 G49 G80 G90 G94",
    "N20 T1 M6",
    "N30 S12000 M3",
    "N40 G54",
    "N50 G5.1 Q1",
    *F_START,
)
F_ODDS = (
    ("(PASS 3)", ""),
    ("G0 Z60. M8", "G1"),
    ("G49", "G53 G0 Z300.", "T2 M6", *F_START),
    ("G49", "M98 P8000", "T2 M6", *F_START),
    ("G49", "G65 P8001 A5.", *F_START),
    ("G49", "G0 B0. C0.", "G68.2 X10. Y10. Z0. I0. J0. K0.", "G53.1", "G0 X140. Y140. Z60.", "G69", *F_START),
    ("G49", "G0 B0. C0.", "G68.2 X10. Y10. Z0. I0. J10. K0.", "G53.1", "G0 X140. Y140. Z60.", "G69", *F_START),
    ("G49", "G0 X150. Y150. Z50. B0. C0.", "G81 X155. Y150. Z-3. R2. F200.", "X156.", "G80", *F_START),
    ("G91", "G1 X.5 Y-.25", "X-.5 Y.25", "G90"),
    ("G1 X150. Y150. Z5. B0. C0.", "G2 X152. Y152. I2. J0.", "G3 X150. Y150. R2.", "G1"),
    ("#100=7.5", "G1 Z[#100+1.]"),
    ("G1 X150 Y150",),
    ("G93 G1 X151. B11. F20.", "G94 F500."),
    ("G49", "G91 G28 Z0.", "G90", *F_START),
    ("G1 X9000.",),
    ("M1", "G4 P100", "/G4 P200"),
)
F_FILES = {"8000": b"O8000\nG91 G28 Z0.\nG90\nM99\n", "8001": b"O8001\nIF [#1 GT 3.] GOTO 5\nG0 Z10.\nN5 M99\n"}


def program(seed: int, lines: int, odd: float, *, siemens: bool, vectors: bool = False) -> bytes:
    """A path that winds about, with all words or only those that change, and now and then something else."""
    rng = random.Random(seed)
    full, at = rng.random() < 0.5 or vectors, [150.0, 150.0, 5.0, 10.0, 30.0]
    out = list(S_HEAD if siemens else F_HEAD)
    for k in range(lines):
        if rng.random() < odd:
            out += rng.choice(S_ODDS if siemens else F_ODDS)
        at = [value + rng.uniform(-1, 1) * rng.choice((0.0, 0.3, 1.0)) for value in at]
        chosen = [i for i in range(5) if full or rng.random() < 0.5] or [0]
        words = " ".join(f"{'XYZBC'[i]}{at[i]:.{rng.choice((3, 4))}f}" for i in chosen[: 3 if vectors else 5])
        out.append(f"N{10 * k % 9990 + 100} G1 {words}{direction(at) if vectors else ''}" if full else words)
    out += ["TRAFOOF", "G0 Z200.", "M30", ""] if siemens else ["G49", "G53 G0 Z300.", "M30", "%", ""]
    return rng.choice(("\n", "\r\n")).join(out).encode()


def coarse(source: bytes) -> bytes:
    """With motions so long that they become several."""
    return re.sub(
        rb"(?m)^(.*)X1[45]\d(\.\d+)", lambda word: word[1] + b"X%d" % (len(word[0]) * 37 % 200 + 80) + word[2], source
    )


def direction(at: list[float]) -> str:
    """The direction of the tool at these angles of B and C, as a vector."""
    tilt, turn = math.radians(at[3]), math.radians(at[4])
    return (
        f" A3={math.sin(tilt) * math.cos(turn):.6f} B3={-math.sin(tilt) * math.sin(turn):.6f} C3={math.cos(tilt):.6f}"
    )


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(root / "benchmarks" / "five_axis.toml")


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("siemens", [True, False], ids=["sinumerik", "fanuc"])
def test_parts_as_the_whole(seed: int, siemens: bool, machine: Machine) -> None:
    source = program(seed, 50, 0.0 if seed < 1 else 0.12, siemens=siemens)
    dialect, setup, files = ("siemens", SETUP, S_FILES) if siemens else ("fanuc", CALCULATOR, F_FILES)
    expected = whole(source, machine, dialect, setup, files)
    for size in (200, 1500)[seed % 2 :]:
        compared(source, machine, dialect, size, setup=setup, files=files, expected=expected)


def test_what_interrupts_them_leaves_them_in_parts(machine: Machine) -> None:
    """Each by itself, but for what the machine cannot do."""
    for dialect, head, odds, files, start in (
        ("siemens", S_HEAD, S_ODDS, S_FILES, ("TRAFOOF", "M30")),
        ("fanuc", F_HEAD, F_ODDS, F_FILES, ("G49", "M30", "%")),
    ):
        cut = [f"G1 X{150 + k % 5}. Y{150 + k % 7}. Z{5 + k % 3}.5" for k in range(20)]
        for odd in odds[:-1] if FULL else odds[:-1][dialect == "fanuc" :: 3]:
            if "X9000" in " ".join(odd):
                continue
            source = "\n".join([*head, *cut, *odd, *cut, *start, ""]).encode()
            assert compared(source, machine, dialect, 200, setup=CALCULATOR, files=files) == "", odd


def test_vectors_are_done_in_parts(machine: Machine) -> None:
    source = program(1, 120, 0.0, siemens=True, vectors=True)
    expected = whole(source, machine, "siemens")
    for size in (300, 3000):
        assert compared(source, machine, "siemens", size, expected=expected) == ""


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("orientation", ["ORIAXES", "ORIVECT"])
def test_blocks_with_vectors_are_followed_at_once_as_one_by_one(
    orientation: str, compiled: bool, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = program(1, 150, 0.02, siemens=True, vectors=True).replace(b"ORIAXES", orientation.encode())
    source = source.replace(b"\r", b"").replace(b"TRAFOOF", b"X150. A3=0.4 B3=0 C3=1\nX150.5 A3=0 B3=0 C3=1\nTRAFOOF")
    use_form(compiled)
    taken = []
    try:
        monkeypatch.setattr(orienting, "take", lambda *given: (taken.append(given), take(*given)))
        at_once = traced(read(source, "p", "siemens"), machine, SETUP)
    finally:
        core.use("plain")
    assert taken
    monkeypatch.setattr(orienting, "is_ready", lambda control: False)
    singly = traced(read(source, "p", "siemens"), machine, SETUP)
    assert at_once.messages == singly.messages
    for each in fields(at_once.moves):
        one, other = getattr(at_once.moves, each.name), getattr(singly.moves, each.name)
        if isinstance(one, np.ndarray):
            assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f"), each.name


@pytest.mark.parametrize("compiled", [False, True])
def test_blocks_are_written_in_bulk_as_one_by_one(
    compiled: bool, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    sources = [program(seed, 150, 0.02, siemens=True, vectors=seed < 3) for seed in (1, 2, 3, 4)]
    sources += [coarse(source) for source in sources[2:]]
    use_form(compiled)
    found = [whole(source, machine, "siemens", files=S_FILES)[0] for source in sources]
    layouts = [SINUMERIK.bulk(read(each, "p", "siemens"), 15) for each in sources[:2] if SINUMERIK.bulk is not None]
    assert all(layout is not None and layout.by_vector for layout in layouts)
    monkeypatch.setattr(emit, "language_of", lambda dialect, part: replace(SINUMERIK, bulk=None))
    assert [whole(source, machine, "siemens", files=S_FILES)[0] for source in sources] == found


UNTIMED = {
    "one behind another": "G1 X158. C12.\nG93\nG1 X158.121 Z65.740 C12.162\nG1 X158.115\nG1 X158.116 B-2.848 C11.656\n"
    "G1 X161.213 Z65.737 C11.679\nG1 X161.211 B-4.026\nG94\nG1 Z99. F500.\nG1 X50.\n",
    "whole parts": "G1 Y151.\nG93\n"
    + "".join(f"G1 X{150 + k % 2}. Z{50 - k % 2}.\n" for k in range(12))
    + "G94\nG1 X155. F500.\nG1 Z80.\n",
}


@pytest.mark.parametrize("body", UNTIMED.values(), ids=UNTIMED)
def test_motions_that_are_refused_for_their_text_where_parts_meet(body: str, machine: Machine) -> None:
    """In G93 without an F they cannot be split.

    One that begins where a refused one ends may not need that any more, and is refused all the same, as in the whole
    program; and what stands beside its place stays there.
    """
    machine = machine.replace(effects=tuple(Effect(f"E{axis}{axis}", (0.005,), Backlash()) for axis in "XYZ"))
    source = f"G21 G90 G94 G54 F500.\nG0 X150. Y150. Z50. B0. C0.\n{body}M30\n".encode()
    expected = whole(source, machine, "fanuc")
    for size in (60, 80, 100, 150):
        assert compared(source, machine, "fanuc", size, expected=expected) == ""
    assert compared(source, machine, "fanuc", 60, jobs=2, expected=expected) == ""


def test_a_part_that_is_planned_again_begins_with_what_was_refused_at_first(machine: Machine) -> None:
    """The plan that is made before a part before it is done stays what it is, however often the part is written."""
    machine = machine.replace(effects=tuple(Effect(f"E{axis}{axis}", (0.005,), Backlash()) for axis in "XYZ"))
    cut = [f"G1 X{150 + k % 5}. Y{150 + k % 7}. Z{5 + k % 3}.5" for k in range(8)]
    timed = ["G93", *["G1 X150. Z50.", "G1 X151. Z49."] * 3, "G94", "G1 X155. F500.", "G1 Z80."]
    lines = [*F_HEAD, *cut, "G49", "G0 X150. Y150. Z50. B0. C0.", "G1 Y151.", *timed, *F_ODDS[5]]
    source = "\n".join([*lines, *["G1 X150. Y150."] * 5, "G49", "M30", "%", ""]).encode()
    expected = whole(source, machine, "fanuc", CALCULATOR)
    for size in (150, 500, 700):
        assert compared(source, machine, "fanuc", size, setup=CALCULATOR, expected=expected) == ""


def test_tools_without_a_length_are_named_in_the_order_of_the_program(machine: Machine) -> None:
    """In the stamp and in what is said; the second has the lower number."""
    cut = [f"G1 X{150 + k % 5}. Y{150 + k % 7}. Z{5 + k % 3}.5" for k in range(20)]
    lines = ["G21 G90 G94 G54 F500.", "T2 M6", "G0 X150. Y150. Z50. B0. C0.", *cut, "T1 M6", *cut, "M30", ""]
    source = "\n".join(lines).encode()
    assert compared(source, machine, "fanuc", 200, setup=CALCULATOR) == ""
    text, report = streamed(source, machine, "fanuc", 200, setup=CALCULATOR)
    assert b"LENGTH OF TOOL 2, LENGTH OF TOOL 1)" in text
    assert [each["line"] for each in report["warnings"] if each["code"] == "NCF437"] == [3, 25]


@pytest.mark.parametrize("siemens", [True, False], ids=["sinumerik", "fanuc"])
def test_two_processes_give_the_same_bytes(siemens: bool, machine: Machine) -> None:
    dialect, files = ("siemens", S_FILES) if siemens else ("fanuc", F_FILES)
    start = (*S_ODDS[2], "TOOLS") if siemens else F_ODDS[3]
    first = program(5, 60, 0.0, siemens=siemens).split(b"\n")
    source = b"\n".join([*first[:40], *(line.encode() for line in start), *first[14:]])
    assert compared(source, machine, dialect, 900, 2, setup=CALCULATOR, files=files) == ""


@pytest.mark.parametrize("siemens", [True, False], ids=["sinumerik", "fanuc"])
def test_the_compiled_core_gives_the_same_bytes(siemens: bool, machine: Machine) -> None:
    require_core()
    dialect = "siemens" if siemens else "fanuc"
    sources = [program(seed, 200, 0.0, siemens=siemens, vectors=siemens and seed == 1) for seed in (0, 1)]
    plain = [streamed(source, machine, dialect, 4000, setup=CALCULATOR)[0] for source in sources]
    core.use("compiled")
    assert [streamed(source, machine, dialect, 4000, setup=CALCULATOR)[0] for source in sources] == plain
    assert [whole(source, machine, dialect, setup=CALCULATOR)[0] for source in sources] == plain


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("LOOP_1:", ELSEWHERE),
        ("IF R1==1 GOTOF LOOP_1", ELSEWHERE),
        ("REPEAT LOOP_1 P=3", ELSEWHERE),
        ("%_N_SUB_SPF", "several programs"),
        ("PROC OTHER(REAL A)", "several programs"),
        ("G1 AP=30", ELSEWHERE),
        ("L77\n%_N_L77_SPF", "several programs"),
        ("BRANCHES", "at run time"),
        ("M30\n\nSUB: X1", ELSEWHERE),
    ],
)
def test_what_leads_elsewhere_in_sinumerik_is_not_done_in_parts(line: str, why: str, machine: Machine) -> None:
    files = {"BRANCHES": b"IF $AA_IW[X]>1\nG0 X1\nENDIF\nM17\n"}
    source = program(0, 36, 0.0, siemens=True).replace(b"\r", b"")
    for at in (40, 20):
        lines = source.decode().split("\n")
        text = "\n".join([*lines[:at], line, *lines[at:]]).encode()
        assert why in compared(text, machine, "siemens", 400, files=files)


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("N77 GOTO 78", ELSEWHERE),
        ("IF [#1 GT 2] THEN #3=4", ELSEWHERE),
        ("WHILE [#1 LT 2] DO1\nEND1", ELSEWHERE),
        ("O77", "several programs"),
        ("<SUB>", "several programs"),
        ("M98 P77", "further down"),
        ("M98 P1234", "calls itself"),
        ("M97 P10", ELSEWHERE),
        ("M99", ELSEWHERE),
        ("G1 X150. ,R2.", ELSEWHERE),
        ("M98 P8000\nM30\nO9\nM30", "several programs"),
    ],
)
def test_what_leads_elsewhere_in_fanuc_is_not_done_in_parts(line: str, why: str, machine: Machine) -> None:
    source = program(0, 36, 0.0, siemens=False).replace(b"\r", b"")
    for at in (40, 20):
        lines = source.decode().split("\n")
        text = "\n".join([*lines[:at], line, *lines[at:]]).encode()
        assert why in compared(text, machine, "fanuc", 400, setup=CALCULATOR, files=F_FILES)


def test_what_is_said_of_axes_that_may_roll_over_comes_last(machine: Machine) -> None:
    """However far before other remarks such a turn is: as a whole it is known only when all has been followed."""
    odd = {20: b"G91 C170.\nC170.\nG90 X151. C300.\n", 30: b"X151. C300.\nX151.5 C30.\n", 40: b"/G4 F0.1\n"}
    lines = program(2, 50, 0.0, siemens=True).replace(b"\r\n", b"\n").splitlines(keepends=True)
    source = b"".join(odd.get(k, b"") + line for k, line in enumerate(lines))
    assert compared(source, machine, "siemens", 200) == ""
    said = [message["code"] for message in streamed(source, machine, "siemens", 200)[1]["warnings"]]
    assert said.count("NCF247") == 2
    assert "NCF205" in said[: said.index("NCF247")]


def test_text_behind_the_end_that_may_belong_to_a_program_is_looked_at(machine: Machine) -> None:
    plain = program(0, 40, 0.0, siemens=True).replace(b"\r", b"")
    cut = b"".join(b"G1 X%d. Y150.\n" % (150 + k % 5) for k in range(60))
    assert "after its end" in compared(plain + cut, machine, "siemens", 400)
    assert compared(plain + b"\n \n" * 300, machine, "siemens", 400) == ""
    fanuc = program(0, 40, 0.0, siemens=False).replace(b"\r", b"")
    called = fanuc.replace(b"G5.1 Q1", b"M98 P8000")
    assert "after its end" in compared(
        called.removesuffix(b"%\n") + cut, machine, "fanuc", 400, setup=CALCULATOR, files=F_FILES
    )
    assert compared(fanuc + cut, machine, "fanuc", 400, setup=CALCULATOR) == ""


def test_a_cycle_that_goes_on_in_the_next_part_is_seen(machine: Machine) -> None:
    head = program(0, 20, 0.0, siemens=True).replace(b"\r", b"").split(b"TRAFOOF")[0]
    holes = b"".join(b"G0 X%d. Y150.\n" % (150 + k) for k in range(40))
    text = (
        head
        + b"TRAFOOF\nG0 X150. Y150. Z50. B0. C0.\nMCALL CYCLE81(10,0,2,-3)\n"
        + holes
        + b"MCALL\n"
        + holes
        + b"M30\n"
    )
    assert "goes on in the next part" in compared(text, machine, "siemens", 300)
    assert compared(text, machine, "siemens", 40_000) == ""


def test_an_m6_further_down_makes_a_t_before_it_mean_something_else(machine: Machine) -> None:
    source = program(0, 60, 0.0, siemens=True).replace(b"\r", b"").replace(b'T="BALL_8" M6', b'T="BALL_8"')
    assert compared(source, machine, "siemens", 400) == ""
    late = source.replace(b"TRAFOOF", b'TRAFOOF\nT="BALL_6" M6')
    assert "M6" in compared(late, machine, "siemens", 400)
    assert compared(late.replace(b'T="BALL_8"\n', b"\n"), machine, "siemens", 400) == ""


@pytest.mark.parametrize(("folder", "dialect"), [("siemens", "siemens"), ("fanuc", "fanuc")])
def test_corpus(
    folder: str, dialect: str, shared: Callable[[str], Path], machine: Machine, figures: Callable[[str], None]
) -> None:
    """Programs of the corpus that this machine can follow, or every second: in parts as the whole, or not in parts."""
    done = tried = 0
    for path in sorted((shared("corpus") / folder).iterdir())[:: 1 if FULL else 2]:
        source = path.read_bytes()
        if not 300 < len(source) < 8000:
            continue
        try:
            expected = whole(source, machine, dialect, setup=CALCULATOR)
        except NcfixError:
            continue
        tried += 1
        done += compared(source, machine, dialect, 400, setup=CALCULATOR, expected=expected) == ""
    figures(f"{done} of {tried} programs of {folder} corrected in parts, with the same bytes")
    assert tried
