"""A program corrected part by part comes out, byte for byte, as one that is corrected as a whole."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from compensate.streaming import run
from conftest import FULL, require_core, some, use_form
from ncfix import core
from ncfix.compensate import FixOptions, driver
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import Task
from ncfix.compensate.solve import SelfCheckError
from ncfix.control.setup import Setup
from ncfix.control.trace import NotInPartsError
from ncfix.diagnostics import NcfixError, SourceError
from ncfix.machine import Effect, Machine, load
from ncfix.machine.basis import Backlash
from ncfix.text.dialect import get
from ncfix.text.reader import read
from ncfix.text.writer import Splices, spliced

OPTIONS = FixOptions(tolerance_um=5.0, allow_refused=True)
SETUP = Setup(assume_zero=True)
SIZES = (150, 1500)


def streamed(
    source: bytes, machine: Machine, size: int, options: FixOptions = OPTIONS, jobs: int = 1
) -> tuple[bytes, dict[str, Any]]:
    task = Task(machine, SETUP, options, None, "p.ngc", get("linuxcnc"), size)
    text, done = run(task, source, jobs)
    stamp = done.stamp
    assert text[stamp.at : stamp.at + len(stamp.written)] == stamp.written
    return text[: stamp.at] + stamp.wanted + text[stamp.at + len(stamp.written) :], done.report.as_dict()


def whole(source: bytes, machine: Machine, options: FixOptions = OPTIONS) -> tuple[bytes, dict[str, Any]]:
    fixed = fix_program(read(source, "p.ngc", "linuxcnc"), machine, SETUP, options)
    return fixed.text, fixed.report.as_dict()


def assert_same(
    source: bytes,
    machine: Machine,
    size: int,
    options: FixOptions = OPTIONS,
    known: tuple[bytes, dict[str, Any]] | None = None,
) -> bool:
    """Whether it could be done in parts; if so it is the same as the whole, if that is known already."""
    try:
        text, report = streamed(source, machine, size, options)
    except NotInPartsError:
        return False
    expected, reference = known or whole(source, machine, options)
    assert text.decode("latin-1") == expected.decode("latin-1")
    for name, value in reference.items():
        if name in ("error_before_um", "error_after_um", "max_correction_um"):
            assert report[name] == pytest.approx(value, abs=2e-4), name
        else:
            assert report[name] == value, name
    return True


ODDS = (
    "G0 Z60.",
    "(PASS 3 POINT 7)",
    "",
    "M5",
    "T2 M6",
    "/G4 P0.1",
    "#100=3.5 (SAFE)\nG0 Z[#100+5.]",
    "G91\nG1 X.5 Y-.25\nX-.5 Y.25\nG90",
    "G1 X20. Y20. Z5. B0. C0.\nG2 X22. Y22. I2. J0.\nG3 X20. Y20. Z4. I-2. J0.\nG1",
    "G81 X5. Y5. Z-2. R2. F100.\nX10.\nX15.\nG80\nG1",
    "G53 G0 Z90.",
    "G93\nG1 X3. B4. F20.\nG94\nF500.",
    "G55\nG54",
    "G1 X9000.",
)


def program(seed: int, lines: int, odd: float) -> bytes:
    """A path that winds about, with all words or only those that change, and now and then something else."""
    rng = random.Random(seed)
    full = rng.random() < 0.5
    at = [20.0, 20.0, 5.0, 10.0, 30.0]
    out = ["%", "(PART)", "G21 G90 G94 G54 G17 F800.", "G0 X20. Y20. Z5. B10. C30.", "G1"]
    for k in range(lines):
        if rng.random() < odd:
            out.append(rng.choice(ODDS))
        at = [value + rng.uniform(-1, 1) * rng.choice((0.0, 0.3, 2.0)) for value in at]
        chosen = [i for i in range(5) if full or rng.random() < 0.5] or [0]
        words = " ".join(f"{'XYZBC'[i]}{at[i]:.{rng.choice((3, 4))}f}" for i in chosen)
        out.append(f"N{10 * k} G1 {words}" if full else words)
    return rng.choice(("\n", "\r\n")).join([*out, "M30", "%", "what follows X1", ""]).encode()


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(root / "benchmarks" / "five_axis.toml")


@pytest.mark.parametrize("seed", range(some(8)))
def test_parts_as_the_whole(seed: int, machine: Machine) -> None:
    source = program(seed, 80, 0.0 if seed < 2 else 0.1)
    known = whole(source, machine)
    for size in SIZES:
        assert_same(source, machine, size, known=known)


def test_plain_programs_are_done_in_parts(machine: Machine) -> None:
    assert all(assert_same(program(seed, 60, 0.0), machine, 300) for seed in (1, 5))


def test_a_program_without_motions(machine: Machine) -> None:
    for jobs in (1, 2):
        text, report = streamed(b"G21 G90\n" + b"(nothing)\n" * 50 + b"M2\n", machine, 150, jobs=jobs)
        assert text.count(b"nothing") == 50
        assert not report["changed"]


@pytest.mark.parametrize("jobs", [2, 3])
def test_several_processes_give_the_same_bytes(jobs: int, machine: Machine) -> None:
    for seed in (5, 7):
        source = program(seed, 200, 0.05)
        assert streamed(source, machine, 2000, jobs=jobs) == streamed(source, machine, 2000)


def test_a_fault_in_a_part_of_another_process_is_told(machine: Machine) -> None:
    source = program(5, 200, 0.0).replace(b"M30", b"G92 X1\nG1 X2 Y2 Z5 B0 C0\nX3\nX4\nM30")
    for jobs in (1, 2, 3):
        with pytest.raises(NotInPartsError, match="the position of the machine"):
            streamed(source, machine, 900, jobs=jobs)
        with pytest.raises(SourceError, match="NCF1"):
            streamed(program(5, 200, 0.0).replace(b"M30", b"G1 X?\nM30"), machine, 900, jobs=jobs)


def test_the_compiled_core_gives_the_same_bytes(machine: Machine) -> None:
    require_core()
    source = program(5, 300, 0.05)
    plain = streamed(source, machine, 4000)[0]
    core.use("compiled")
    assert streamed(source, machine, 4000)[0] == plain


def with_a_digit_wrong(text: bytes, rng: random.Random) -> bytes:
    """In one of the axis words of the text's second half, the first digit or the last."""
    word = rng.choice(list(re.finditer(rb"[XYZBC]-?(\d+\.\d+)", text[len(text) // 2 :])))
    place = len(text) // 2 + rng.choice((word.start(1), word.end(1) - 1))
    return text[:place] + b"%d" % ((int(text[place : place + 1]) + 1) % 10) + text[place + 1 :]


@pytest.mark.parametrize("compiled", [False, True])
def test_a_writer_that_gets_one_digit_wrong_is_caught(
    compiled: bool, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In whatever part: the proof reads what is really written."""
    use_form(compiled)
    source, rng, parts = program(5, 60, 0.0), random.Random(2), 0

    def wrong(source: bytes, splices: Splices) -> bytes:
        nonlocal parts
        parts += 1
        text = spliced(source, splices)
        return with_a_digit_wrong(text, rng) if parts == broken else text

    monkeypatch.setattr(driver, "spliced", wrong)
    try:
        for broken in (1, 2, 3, 1, 2, 3, 1, 2, 3):
            parts = 0
            with pytest.raises((NotInPartsError, SelfCheckError)):
                streamed(source, machine, 500)
            assert parts == broken
    finally:
        core.use("plain")


def test_play_remembers_the_way_across_parts(root: Path) -> None:
    machine = load(root / "examples" / "machines" / "wCBXFZYSt.toml")
    assert any(effect.basis.needs_direction for effect in machine.effects)
    source = b"G21 G90 G94 F800\nG0 X0 Y0 Z100 B0 C0\n" + b"".join(
        b"G1 X%.3f Y%.3f\n" % (20 * (k % 7), -15 * (k % 5)) if k % 2 else b"G1 X%.3f Z%.3f\n" % (20 * (k % 7), 100 + k)
        for k in range(40)
    )
    known = whole(source + b"M2\n", machine)
    assert all(assert_same(source + b"M2\n", machine, size, known=known) for size in (150, 400))
    assert streamed(source + b"M2\n", machine, 150, jobs=2) == streamed(source + b"M2\n", machine, 150)


def test_play_of_axes_that_rest_while_others_turn_round(root: Path) -> None:
    """Z rests on one side of its play from the first part on, when X turns round and C gets a word there."""
    machine = load(root / "examples" / "machines" / "wCBXFZYSt.toml")
    machine = machine.replace(effects=(*machine.effects, *(Effect(f"E{a}{a}", (0.005,), Backlash()) for a in "XYZ")))
    source = b"G21 G90 G94 F800\nG0 X0 Y0 Z50 B0 C0\nG1 X5 Y5 Z5\n" + b"".join(
        b"X%.3f C%.3f\n" % (5 + k % 2, 10 + 0.1 * k) for k in range(60)
    )
    known = whole(source + b"M2\n", machine)
    assert all(assert_same(source + b"M2\n", machine, size, known=known) for size in (150, 220))


def test_what_looks_at_the_whole_path_is_not_done_in_parts(machine: Machine) -> None:
    source = program(1, 30, 0.0)
    with pytest.raises(NotInPartsError):
        streamed(source, machine, 300, replace(OPTIONS, strategy="full"))
    with pytest.raises(NotInPartsError):
        streamed(source.replace(b"(PART)", b"o1 sub\no1 endsub"), machine, 300)
    with pytest.raises(NotInPartsError, match="the position of the machine"):
        streamed(source.replace(b"M30", b"G92 X1\nG1 X2 Y2 Z5 B0 C0\nX3\nX4\nM30"), machine, 300)


def test_a_refusal_that_reaches_back_is_seen(machine: Machine) -> None:
    lines = b"".join(b"X%d.\n" % (k % 9) for k in range(200))
    source = b"G21 G90 G94 F800 G17\nG1 X0 Y0 Z5 B0 C0\n" + lines + b"G2 X0 Y9000. R5000.\nM2\n"
    for jobs, size in ((1, 100), (2, 100), (2, 130), (3, 100)):
        with pytest.raises(NotInPartsError, match="reaches back"):
            streamed(source, machine, size, jobs=jobs)


def test_a_refusal_that_reaches_back_through_refused_motions_is_seen(machine: Machine) -> None:
    lines = b"".join(b"X%d.\n" % (9000 + k % 9) for k in range(200))
    source = b"G21 G90 G94 F800 G17\nG1 X0 Y0 Z5 B0 C0\n" + lines + b"G2 X0 Y9000. R9000.\nM2\n"
    with pytest.raises(NotInPartsError, match="reaches back"):
        streamed(source, machine, 100)


def test_a_path_that_strays_is_not_written_in_parts(machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver, "strays", lambda errors: errors.after.max > 0)
    with pytest.raises(NotInPartsError, match="strays"):
        streamed(program(1, 30, 0.0), machine, 300)


def test_errors_are_those_of_the_whole(machine: Machine) -> None:
    source = program(1, 60, 0.0)
    for wrong in (b"G1 X1 X2", b"G1 X%", b"G2 X1 Y1 I5 J5", b"U5", b"G84.5"):
        broken = source.replace(b"M30", wrong + b"\nM30")
        errors = []
        for way in (lambda text: streamed(text, machine, 200), lambda text: whole(text, machine)):
            with pytest.raises(NcfixError) as caught:
                way(broken)
            errors.append([str(message) for message in caught.value.messages])
        assert errors[0] == errors[1]


def test_a_stamp_is_found_in_any_part(machine: Machine) -> None:
    stamped = program(1, 60, 0.0).replace(b"M30", b"(ncfix 1.0.0 machine abc)\nM30")
    with pytest.raises(NcfixError, match="NCF430"):
        streamed(stamped, machine, 200)


def test_corpus(shared: Callable[[str], Path], machine: Machine, figures: Callable[[str], None]) -> None:
    """Programs of the corpus that this machine can follow: in parts as the whole, or not in parts."""
    done = tried = 0
    for path in sorted(shared("corpus").glob("linuxcnc/*"))[: 120 : 2 if FULL else 6]:
        source = path.read_bytes()
        if not 300 < len(source) < 20_000:
            continue
        try:
            whole(source, machine)
        except NcfixError:
            continue
        tried += 1
        done += assert_same(source, machine, 500)
    figures(f"{done} of {tried} programs of the corpus corrected in parts, with the same bytes")
    assert tried


def test_new_lines_end_as_the_first_of_the_file(machine: Machine) -> None:
    """Whatever the lines of a part end with."""
    lines = program(5, 80, 0.0).replace(b"\r\n", b"\n").splitlines()
    for first, rest in ((b"\r\n", b"\n"), (b"\n", b"\r\n")):
        ends = [first] * 20 + [rest] * len(lines)
        source = b"".join(line + end for line, end in zip(lines, ends, strict=False))
        source = source.replace(b"M30", b"X90. Y60. Z40. B60. C90." + rest + b"M30")
        assert assert_same(source, machine, 500)
        text, report = streamed(source, machine, 500, jobs=2)
        assert (text, report) == streamed(source, machine, 500)
        assert report["inserted_blocks"] > 0


def test_arcs_that_just_reach_in_parts_of_other_processes(machine: Machine) -> None:
    """These are followed as programmed, and so from where they begin as programmed: X and Y are not named there."""
    turn = b"G1 X30. Y20.\n" + b"Z1.\nZ2.\n" * 6 + b"G2 X%d. Y20. R5.\nG1 X30. Y40.\n"
    turns = b"".join(turn % x for x in (20, 40) * 6)
    source = b"G21 G90 G94 F800 G17\nG1 X30. Y20. Z5. B0. C0.\n" + turns + b"M2\n"
    for size in (200, 230, 260):
        assert assert_same(source, machine, size)
        assert streamed(source, machine, size, jobs=2) == streamed(source, machine, size)


def test_what_is_said_of_motions_beyond_a_range_does_not_depend_on_parts(machine: Machine) -> None:
    """Those that begin beyond one and end beyond another: their blocks are more or fewer in different parts."""
    turn = b"X%d. Y-900. Z5.\nX%d. Y10. Z-300.\nX%d. Y0. Z5.\nX%d. Y1.\n"
    turns = b"".join(turn % (k, k + 1, k + 2, k + 3) for k in range(20))
    source = b"G21 G90 G94 F800 G17\nG1 X0 Y0 Z5 B0 C0\n" + turns + b"M2\n"
    known = whole(source, machine)
    assert all(
        assert_same(source, machine, size, known=known) for size in (90, 100, 110, 120, 130)[:: 1 if FULL else 2]
    )
