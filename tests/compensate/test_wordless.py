"""No axis gets a word that the program itself has not brought to where it stands: it might be led into the part."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from compensate.streaming import run
from conftest import some
from ncfix import core
from ncfix.compensate import FixOptions
from ncfix.compensate.checking import check_on
from ncfix.compensate.driver import Fixed, fix_flat, fix_program
from ncfix.compensate.following import Task, follow
from ncfix.compensate.plan.intent import Intent
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import NotInPartsError
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, State, loads
from ncfix.text.dialect import get
from ncfix.text.reader import read

MACHINE = Path(__file__).parents[2] / "examples/machines/wCBXFZYSt.toml"
ASSUMED = Setup(assume_zero=True, no_point="calculator")
GIVEN = Setup(work_offsets={"G54": {}}, initial=dict.fromkeys("XYZBC", 0.0), tools={0: Tool(0.0), 1: Tool(0.0)})


def fixed(
    text: str,
    dialect: str = "linuxcnc",
    setup: Setup = ASSUMED,
    strategy: str = "rotary-then-linear",
    tolerance_um: float = 1.0,
) -> Fixed:
    program = read(text.encode(), "part.nc", dialect)
    return fix_program(program, smooth_machine(), setup, FixOptions(strategy=strategy, tolerance_um=tolerance_um))


COARSE = 50.0
"""um; nothing is split."""


@cache
def smooth_machine() -> Machine:
    """A machine of five axes without lost motion, so that few blocks are split."""
    return loads(MACHINE.read_text(encoding="utf-8").replace("coefficients = [0.0015]", "coefficients = [0.0]"))


def letters(line: str) -> set[str]:
    """The axes that a line names."""
    return set(re.findall(r"(?<![A-Z$_])I?([XYZBC])(?=[-+=\[.0-9])", re.sub(r"\(.*?\)|;.*", "", line)))


def block_letters(text: bytes, before: str) -> list[set[str]]:
    """For each line of the program the axes that it names in the corrected one; nothing must be put in."""
    lines = [line for line in text.decode().splitlines() if "ncfix" not in line.lower()]
    assert len(lines) == len(before.splitlines())
    return [letters(line) for line in lines]


RS274 = [
    "G10 L2 P1 Z0",
    "G53 G0 Z0",
    "G28 G91 Z0\nG90",
    "G30 G91 Z0\nG90",
    "G43 H1",
    "G49",
    "G55",
    "T2 M6",
    "G38.2 Z-5 F50",
    "G91 G0 Z5\nG90",
]
AFTER_RS274 = "G0 X10 Y20\nZ30\n{}\nG0 X50 Y60\nG1 X70 F100\nG2 X80 Y70 R10\nG0 Z5\nX20\nM2\n"


@pytest.mark.parametrize("event", RS274)
@pytest.mark.parametrize("dialect", ["linuxcnc", "iso", "fanuc", "haas", "mitsubishi"])
def test_after_what_a_g_code_control_does_by_itself(dialect: str, event: str) -> None:
    event = event.replace("G38.2", "G31") if dialect != "linuxcnc" else event
    if event == "G49":
        event = "G43 H1 Z20\nG49"
    stays = "G91 G0" not in event
    text = "G21 G90 G17 G94\n" + AFTER_RS274.format(event)
    found = block_letters(fixed(text, dialect).text, text)
    away, cut, arc, down, on = found[-6:-1]
    assert found[1] == {"X", "Y"}
    assert "Z" in down
    assert "Z" in on
    if stays:
        assert "Z" not in away | cut | arc
    else:
        assert "Z" in away


SIEMENS = ["SUPA Z0", "G53 Z0", "G74 Z1=0", "G75 Z1=0", "D2", "T2 M6", "G55", "G500", "MEAS=1 Z-5 F50"]


@pytest.mark.parametrize("event", SIEMENS)
def test_after_what_a_sinumerik_does_by_itself(event: str) -> None:
    text = f"G54 G90\nT1 M6\nG0 X10 Y20 Z30\n{event}\nG0 X50 Y60\nG1 X70 F100\nG2 X80 Y70 CR=10\nG0 Z5\nX20\nM30\n"
    found = block_letters(fixed(text, "siemens").text, text)
    away, cut, arc, down, on = found[-6:-1]
    assert "Z" not in away | cut | arc
    assert "Z" in down
    assert "Z" in on


HEIDENHAIN = ["L Z+250 FMAX M91", "TOOL CALL 1 Z", "CYCL DEF 247 PRESET Q339=+1", "L M140 MB MAX"]


@pytest.mark.parametrize("event", HEIDENHAIN)
def test_after_what_a_tnc_does_by_itself(event: str) -> None:
    body = f"L X+10 Y+20 FMAX\nL Z+30 FMAX\n{event}\nL X+50 Y+60 FMAX\nL Z+5 FMAX\nL X+45 F500"
    text = f"BEGIN PGM A MM\n{body}\nEND PGM A MM\n"
    found = block_letters(fixed(text, "heidenhain", tolerance_um=COARSE).text, text)
    assert found[1] == {"X", "Y"}
    assert "Z" not in found[4]
    assert "Z" in found[5]
    assert "Z" in found[6]


def test_an_increment_does_not_say_where_an_axis_stands() -> None:
    text = "G21 G91 G94\nG0 X100 Y50\nG1 Z-5 F100\nX50\nG2 X5 Y5 I5\nG90 G1 Z10\nG91 X5\nM2\n"
    found = block_letters(fixed(text, tolerance_um=COARSE).text, text)
    assert found[1:5] == [{"X", "Y"}, {"Z"}, {"X"}, {"X", "Y"}]
    assert found[5] == {"Z"}
    assert "Z" in found[6]


def test_holes_whose_depth_is_a_word_of_another_block_have_it_corrected() -> None:
    text = "G21 G90 G94 G98\nG0 X10 Y20\nG81 X100 Y200 Z-5 R2 F100\nX150\nG80 G0 X50\nZ10\nM2\n"
    found = block_letters(fixed(text).text, text)
    assert "Z" in found[3]
    assert "Z" not in found[4]


def test_shifts_that_the_program_states_leave_axes_where_it_has_put_them() -> None:
    for dialect, shift in (("fanuc", "G52 Z5."), ("linuxcnc", "G92 Z5."), ("siemens", "TRANS Z5")):
        text = f"G54 G90 G94\nG0 X10. Y20. Z30.\n{shift}\nG0 X150. Y160.\nM30\n"
        assert "Z" in block_letters(fixed(text, dialect).text, text)[3]


def test_a_rotary_axis_gets_no_word_either() -> None:
    """Nor does the tip suffer for it: X Y Z are those of the rotary axes where they stand."""
    text = "G21 G90 G94\nG0 X100 Y50 Z20\nG1 X50 F100\nB10\nX20 Z50\nT1 M6\nG0 X10 Y20 Z30\nG1 X20\nB0 C0\nX50\nM2\n"
    report = fixed(text, strategy="full")
    lines = [line for line in report.text.decode().splitlines() if "ncfix" not in line]
    named, change, both = (next(k for k, line in enumerate(lines) if w in line) for w in ("B", "M6", "C"))
    assert not any({"B", "C"} & letters(line) for line in lines[:named] + lines[change:both])
    assert not any("C" in letters(line) for line in lines[:both])
    assert report.report.error_after_um["max"] < 1.5  # type: ignore[operator]


def test_what_the_user_gives_counts_as_long_as_nothing_is_assumed() -> None:
    text = "G21 G90 G94\nG0 X100 Y50\nM2\n"
    assert block_letters(fixed(text, setup=GIVEN).text, text)[1] == {"X", "Y", "Z"}
    assert block_letters(fixed(text).text, text)[1] == {"X", "Y"}


def test_what_is_left_is_counted_and_told() -> None:
    report = fixed("G21 G90 G94\nG0 X100 Y50\nX200\nG1 Z-5 F100\nX100\nM2\n").report
    (left,) = report.left
    assert (left.axis, left.motions, left.cuts, left.first, left.last) == ("Z", 2, 0, 2, 3)
    (warning,) = (each for each in report.warnings if each.code == "NCF439")
    assert "Z gets no word in 2 motions (lines 2 to 3), none of which cut, and is up to" in warning.text
    (entry,) = report.as_dict()["left_where_it_stands"]  # type: ignore[misc]
    assert entry["max_um"] == pytest.approx(left.most * 1e3, abs=1e-4)
    assert report.error_after_um["max"] < 1.0  # type: ignore[operator]


def test_the_error_that_is_left_is_what_is_told() -> None:
    """Read again and judged by itself: the tip is off by as much as the report says, and along Z."""
    machine = smooth_machine()
    text = "G21 G90 G94\nG0 X100 Y50\nX200\nG1 Z-5 F100\nM2\n"
    done = fixed(text)
    first, second = (
        follow(read(each, "part.nc", "linuxcnc"), machine, ASSUMED).trace.moves for each in (text.encode(), done.text)
    )
    assert len(first) == len(second) == 3
    off = Intent(machine, first, State()).gap(np.arange(3), np.ones(3), second.end)
    assert abs(off[:, :2]).max() < 0.3e-3
    assert abs(off[:2, 2]).max() == pytest.approx(done.report.left[0].most, abs=0.1e-3)
    assert abs(off[2]).max() < 0.3e-3


@pytest.mark.parametrize("arc", ["G2 I6 J2", "G2 Y224 I6 J2"])
def test_the_centre_of_an_arc_goes_with_the_axis_that_is_left(arc: str) -> None:
    """Else the radius would be another by what is left: where the other axes turn round, the tip would be off by it."""
    done = fixed(f"G21 G90 G94 F500\nG0 X100 Y50 Z20\nT1 M6\nG1 Y220 Z30\n{arc}\nM2\n")
    (left,) = done.report.left
    (word,) = re.findall(r"I([\d.]+)", done.text.decode())
    assert left.axis == "X"
    assert left.most > 4e-3
    assert float(word) == pytest.approx(6, abs=1e-3)
    assert done.report.error_after_um["max"] < 1.0  # type: ignore[operator]


def test_what_is_left_on_the_way_is_told_though_the_end_is_right() -> None:
    text = "G21 G90 G94 F500\nG0 X-150 Y50 Z20\nT1 M6\nG1 X104\nM2\n"
    done = fixed(text, tolerance_um=COARSE)
    first, second = (
        follow(read(each, "part.nc", "linuxcnc"), smooth_machine(), ASSUMED).trace.moves
        for each in (text.encode(), done.text)
    )
    cut, fraction = np.ones(99, dtype=np.intp), np.linspace(0.01, 1.0, 99)
    commands = second.start[1] + fraction[:, None] * (second.end - second.start)[1]
    off = Intent(smooth_machine(), first, State()).gap(cut, fraction, commands)
    left = next(each for each in done.report.left if each.axis == "Z")
    assert abs(off[-1, 2]) < 0.5e-3
    assert abs(off[:, 2]).max() == pytest.approx(left.most, abs=0.1e-3)
    assert left.most > 2e-3


# -- any program ------------------------------------------------------------------------------------------------------


class Oracle:
    """A second opinion on plain RS274: which axes an absolute word has brought to their place since the last event."""

    def __init__(self) -> None:
        self.known: set[str] = set()
        self.incremental = False

    def may_have(self, line: str) -> set[str]:
        """The axes that may have a word in the corrected line; takes the line in."""
        if line.startswith(("G90", "G91")):
            self.incremental = line.startswith("G91")
        named = letters(line)
        allowed = named | self.known
        if line.startswith(("G53", "G28")):
            self.known -= named
        elif line.startswith(("T", "G54", "G55")):
            self.known = set()
        elif line.startswith(("G43", "G49")):
            self.known -= {"Z"}
        elif not self.incremental:
            self.known |= named
        return allowed


numbers = st.integers(1, 280)
LINES = st.one_of(
    st.builds(lambda x, y: f"G0 X{x} Y{y}", numbers, numbers),
    st.builds(lambda x: f"G1 X{x}", numbers),
    st.builds(lambda y: f"G1 Y{y}", numbers),
    st.builds(lambda z: f"G1 Z-{z}", numbers),
    st.builds(lambda x, z: f"G0 X{x} Z-{z}", numbers, numbers),
    st.builds(lambda b, c: f"G1 B{b % 30} C{c % 30}", numbers, numbers),
    st.sampled_from(["G53 G0 Z0", "T1 M6", "G54", "G55", "G43 H1", "G43 H2", "G49", "G28 Z0", "G91 G1 X1 Y-1", "G90"]),
)


@settings(max_examples=some(60), deadline=None, derandomize=True, phases=(Phase.explicit, Phase.generate))
@given(st.lists(LINES, min_size=4, max_size=14), st.sampled_from(["rotary-then-linear", "full"]))
def test_every_added_word_names_an_axis_that_the_program_has_brought_there(lines: list[str], strategy: str) -> None:
    body = [line for each in lines for line in ([each, "G90"] if each.startswith("G91") else [each])]
    text = "\n".join(["G21 G90 G94 F500", *body, "M2", ""])
    oracle = Oracle()
    allowed = [oracle.may_have(line) for line in text.splitlines()]
    corrected = [line for line in fixed(text, strategy=strategy).text.decode().splitlines() if "ncfix" not in line]
    row = -1
    for line in corrected:
        if row + 1 < len(allowed) and begins_like(line, text.splitlines()[row + 1]):
            row += 1
        assert letters(line) <= allowed[row], (line, text.splitlines()[row])
    assert row == len(allowed) - 1


def begins_like(line: str, original: str) -> bool:
    """Whether a corrected line is the original one, or a further piece of the one before."""
    return line.split()[:1] == original.split()[:1] and ("G" in line or "T" in line or "M" in line)


@settings(max_examples=some(15), deadline=None, derandomize=True, phases=(Phase.explicit, Phase.generate))
@given(st.lists(LINES, min_size=20, max_size=60))
def test_part_by_part_and_compiled_make_the_same_bytes(lines: list[str]) -> None:
    body = [line for each in lines for line in ([each, "G90"] if each.startswith("G91") else [each])]
    text = "\n".join(["G21 G90 G94 F500", *body, "M2", ""]).encode()
    machine, options = smooth_machine(), FixOptions(allow_refused=True)
    whole = fix_program(read(text, "part.nc", "linuxcnc"), machine, ASSUMED, options)
    try:
        written, done = run(Task(machine, ASSUMED, options, None, "part.nc", get("linuxcnc"), 200), text, 1)
    except NotInPartsError:
        return
    assert without_stamp(written) == without_stamp(whole.text)
    assert done.report.left == whole.report.left
    core.use("plain")
    plain = fix_program(read(text, "part.nc", "linuxcnc"), machine, ASSUMED, options)
    core.use(None)
    assert plain.text == whole.text


def without_stamp(text: bytes) -> bytes:
    return b"".join(line for line in text.splitlines(keepends=True) if b"ncfix" not in line)


def flat(text: str) -> bytes:
    """A program written out flat, and corrected."""
    options = FixOptions(flatten=True, allow_refused=True)
    written = fix_flat(read(text.encode(), "part.nc", "linuxcnc"), smooth_machine(), ASSUMED, options).text
    assert isinstance(written, bytes)
    return written


def test_holes_that_are_written_out_name_no_other_axis() -> None:
    found = flat("G21 G90 G94 F100\nG0 X5 Z9\nG81 X10 Z-5 R2 L2\nG80\nM2\n").decode()
    assert not any("Y" in letters(line) for line in found.splitlines() if "ncfix" not in line)


@pytest.mark.parametrize("line", ["G91 G81 X10 Z-5 R2 L3", "G91 G0 X5\nG1 @10 ^5"])
def test_increments_from_nowhere_are_not_written_out(line: str) -> None:
    with pytest.raises(NcfixError, match=", so it cannot be written out flat"):
        flat(f"G21 G90 G94 F100\nG0 Z9\n{line}\nM2\n")


def test_check_tells_only_of_cuts() -> None:
    def found(text: str) -> bool:
        checked = check_on(read(text.encode(), "part.nc", "linuxcnc"), smooth_machine(), GIVEN)
        return any(each.code == "NCF439" for each in checked.findings)

    assert not found("G21 G90 G94\nG0 X1 Y2 Z3\nT1 M6\nG0 X100 Y50\nZ5\nG1 X7 F100\nM2\n")
    assert found("G21 G90 G94\nG0 X1 Y2 Z3\nT1 M6\nG0 X100 Y50\nG1 X7 F100\nM2\n")


@pytest.mark.parametrize(("between", "said"), [("G43 H2\n", False), ("G43 H2\nG0 Z5\n", True), ("", True)])
def test_behind_another_tool_length_z_is_not_where_the_program_has_brought_it(between: str, said: bool) -> None:
    setup = Setup(assume_zero=True, work_offsets={"G54": {}}, tools={1: Tool(50.0), 2: Tool(80.0)})
    text = f"G54\nG43 H1\nG0 X0 Y0 Z5 B0 C0\n{between}G1 X300 F100\nM2\n"
    lines = fixed(text, setup=setup, tolerance_um=50.0).text.splitlines()
    (cut,) = (line for line in lines if line.startswith(b"G1 X300."))
    assert (b" Z" in cut) is said
