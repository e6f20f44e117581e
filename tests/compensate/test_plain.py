"""Parts of plain motions come out as by the long way, and limits and bounds are those of the columns there."""

from __future__ import annotations

import random
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compensate import streaming
from compensate import test_stream_others as others
from compensate.test_stream import OPTIONS, streamed
from conftest import require_core, some, use_form
from ncfix import core
from ncfix.compensate import FixOptions, driver, plain
from ncfix.compensate.parts import ContinuedPart
from ncfix.compensate.plain import PlainPlan, Planner
from ncfix.compensate.plan.deviation import straight_bounds
from ncfix.compensate.solve import SelfCheckError
from ncfix.control.moves import MotionKind
from ncfix.control.trace import NotInPartsError
from ncfix.machine import Machine, load
from ncfix.text.writer import Splices, spliced

FIGURES = ("error_before_um", "error_after_um")


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(root / "benchmarks" / "five_axis.toml")


@pytest.fixture
def compiled() -> None:
    use_form(True)


AMONG = (
    "G0 Z60.\nG1",
    "(PASS 3)",
    "/G4 P0.1",
    "G1 X20. Y20.\nG2 X22. Y22. I2. J0.\nG1",
    "G1 X20. Y20.\nG3 I2. J.5\nG3 I2. J.5\nG4 P1\nG1",
    "G1 X20. Y20.\nG2 X60. Y60. I40. J0. Z12.\nG4 P.2\nG1 X[20.+#100]",
    "G1 C[20.]\nG1",
)
"""What may interrupt plain motions without leading a part the long way."""
ODDS = (*AMONG, "G91\nG1 X.5\nX-.5\nG90")


def winding(seed: int, lines: int, odd: float = 0.0, odds: Sequence[str] = ODDS) -> bytes:
    """A path that winds about, X in every block, the other words in all or only where they change."""
    rng = random.Random(seed)
    full, at = seed % 2 == 0, [20.0, 20.0, 5.0, 10.0, 30.0]
    out = ["%", "G21 G90 G94 G54 G17 F800.", "G0 X20. Y20. Z5. B10. C30.", "G1"]
    for k in range(lines):
        if rng.random() < odd:
            out += rng.choice(odds).splitlines()
        at = [value + rng.uniform(-1, 1) * rng.choice((0.1, 0.3, 2.0)) for value in at]
        chosen = [i for i in range(5) if full or i == 0 or rng.random() < 0.5]
        words = " ".join(f"{'XYZBC'[i]}{at[i]:.{rng.choice((3, 4))}f}" for i in chosen)
        out.append(f"N{10 * k} G1 {words}" if full else words)
    return ("\r\n" if seed % 3 == 0 else "\n").join([*out, "M30", "%", ""]).encode()


def counted(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether each part, in turn, was planned as one of plain motions."""
    plan, found = Planner.plan, []

    def watched(self: Planner, continued: ContinuedPart) -> PlainPlan | None:
        course = plan(self, continued)
        found.append(course is not None)
        return course

    monkeypatch.setattr(Planner, "plan", watched)
    return found


@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize(
    ("seed", "odd", "options"),
    [
        (0, 0.0, OPTIONS),
        (1, 0.0, OPTIONS),
        (2, 0.006, OPTIONS),
        (3, 0.0, FixOptions(tolerance_um=1.5, allow_refused=True, split_rapids=True)),
        (4, 0.0, FixOptions(tolerance_um=20.0, allow_refused=True, figures=False)),
    ],
)
def test_as_by_the_long_way(
    seed: int, odd: float, options: FixOptions, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = winding(seed, 260, odd)
    plainly = counted(monkeypatch)
    found = streamed(source, machine, 2500, options)
    assert sum(plainly) >= (3 if odd == 0 else 1)
    assert_as_by_the_long_way(found, source, machine, 2500, options, monkeypatch)


@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize("seed", range(some(6)))
def test_arcs_and_dwells_among_plain_motions(seed: int, machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    options = replace(OPTIONS, split_rapids=seed % 2 == 0)
    source = winding(seed, 600, 0.02, AMONG)
    plainly = counted(monkeypatch)
    found = streamed(source, machine, 6000, options)
    assert sum(plainly) >= 2
    assert_as_by_the_long_way(found, source, machine, 6000, options, monkeypatch)


@pytest.mark.usefixtures("compiled")
def test_arcs_are_planned_with_plain_motions(machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    source = winding(2, 600, 0.03, AMONG[2:4])
    plan, begun = Planner.plan, []

    def watched(self: Planner, continued: ContinuedPart) -> PlainPlan | None:
        course = plan(self, continued)
        begun.append((course is not None, int(continued.part.moves.kind[0])))
        return course

    with monkeypatch.context() as patched:
        patched.setattr(plain, "by_the_long_way", None)
        patched.setattr(Planner, "plan", watched)
        found = streamed(source, machine, 8220)
    assert all(planned for planned, _ in begun[1:])
    assert (True, MotionKind.ARC) in begun
    assert_as_by_the_long_way(found, source, machine, 8220, OPTIONS, monkeypatch)


LED = {
    "short": (rb"^", rb""),
    "long": (rb"(?m)^(N\d*50 G1 X)1(.*) C[\d.]+", rb"\g<1>2\2 C140."),
    "turning": (rb"(?m)^(N\d*[37]00 G1 .*) C[\d.]+", rb"\1 C300."),
}
"""Changes to a program under TCP: none, long motions, and some that a control with roll-over may do otherwise."""


@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize("siemens", [False, True], ids=["fanuc", "sinumerik"])
@pytest.mark.parametrize("change", list(LED))
def test_led_tips(change: str, siemens: bool, machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    source = re.sub(*LED[change], others.program(3, 200, 0.0, siemens=siemens))
    given = (source, machine, "siemens") if siemens else (source, machine, "fanuc")
    plainly, setup = counted(monkeypatch), streaming.SETUP if siemens else others.CALCULATOR
    found = streaming.streamed(*given, 8000, setup=setup)
    assert sum(plainly) >= 2
    assert ("must not be split" in str(found[1])) == (change == "turning")
    assert (found[1]["inserted_blocks"] > 9) == (change == "long")
    monkeypatch.setattr(driver.Planner, "of", lambda *given: None)
    streaming.assert_alike(found, streaming.streamed(*given, 8000, setup=setup))


def assert_as_by_the_long_way(
    found: tuple[bytes, dict[str, Any]],
    source: bytes,
    machine: Machine,
    size: int,
    options: FixOptions,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The same bytes and words, figures but for their last digit."""
    text, report = found
    monkeypatch.setattr(driver.Planner, "of", lambda *given: None)
    expected, reference = streamed(source, machine, size, options)
    assert text == expected
    for name, value in reference.items():
        if name in FIGURES:
            assert report[name] == pytest.approx(value, abs=2e-4), name
        else:
            assert report[name] == value, name


@pytest.mark.usefixtures("compiled")
def test_axes_that_rest_beside_an_offset_contour(machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    rng, at, blocks = random.Random(1), [20.0, 20.0, 5.0, 10.0, 30.0], []
    for k in range(150):
        ways = [rng.uniform(0.01, 0.2) for _ in at]
        at = [value + way * (k % 7 > 0 or axis > 1) for axis, (value, way) in enumerate(zip(at, ways, strict=True))]
        blocks.append("G1 " + " ".join(f"{letter}{value:.3f}" for letter, value in zip("XYZBC", at, strict=True)))
    head = ["%", "G21 G90 G94 G54 G17 F800.", "G0 X20. Y20. Z5. B10. C30.", "G41"]
    source = "\n".join([*head, *blocks, "G40", "M30", "%", ""]).encode()
    found = streamed(source, machine, 2500)
    assert_as_by_the_long_way(found, source, machine, 2500, OPTIONS, monkeypatch)


def test_what_comes_near_a_limit_goes_the_long_way(machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    source = winding(0, 200)
    far = source.replace(b"M30", b"".join(b"G1 X%d Y20 Z5 B0 C0\n" % (440 + k) for k in range(30)) + b"M30")
    plainly = counted(monkeypatch)
    report = streamed(far, machine, 1500)[1]
    assert plainly.count(True) >= 2
    assert not plainly[-1]
    assert report["refused"]


@pytest.mark.parametrize("word", [rb"N\d", rb"X-?\d+\.\d"])
def test_a_writer_that_gets_a_character_wrong_is_caught(
    word: bytes, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a number that was written, and in what should have stayed as it was."""
    require_core()
    plainly, source = counted(monkeypatch), winding(0, 200)

    def wrong(source: bytes, splices: Splices) -> bytes:
        text = spliced(source, splices)
        place = list(re.finditer(word, text))[-2].end() - 1
        return text if len(plainly) < 3 else text[:place] + bytes([text[place] ^ 1]) + text[place + 1 :]

    monkeypatch.setattr(driver, "spliced", wrong)
    core.use("compiled")
    with pytest.raises((NotInPartsError, SelfCheckError)):
        streamed(source, machine, 1500)
    assert plainly == [False, True, True]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.usefixtures("compiled")
def test_limits_and_bounds_are_those_of_columns(seed: int, machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bounds but for rounding."""
    planner = Planner.of(machine, OPTIONS)
    assert planner is not None
    assert machine.bow is not None
    rng, linear = np.random.default_rng(seed), ~machine.rotary
    course = course_of(winding(seed, 300), machine, monkeypatch)
    moves, lengths = course.part.moves, course.intent.lengths(np.arange(1))
    meant = np.concatenate([moves.start[:1], moves.end])
    done = meant.copy()
    done[:, linear] += rng.uniform(-0.01, 0.01, (len(meant), 3))
    shift = (done - meant)[:, linear]
    bounds = straight_bounds(machine.bow, done[:-1], done[1:], (shift[:-1], shift[1:]), lengths, linear)
    assert planner._bounds(meant, done, lengths) == pytest.approx(bounds, rel=1e-12)
    assert planner._within_limits(meant, done)
    x, b = machine.axis_names.index("X"), machine.axis_names.index("B")
    for row, axis, much in ((1, x, 0.06), (2, b, 1.0), (3, x, np.nan)):
        wrong = done.copy()
        wrong[row, axis] += much
        assert not planner._within_limits(meant, wrong)


def course_of(source: bytes, machine: Machine, monkeypatch: pytest.MonkeyPatch) -> PlainPlan:
    """The plan of the longest part of a program."""
    plan, courses = Planner.plan, []

    def watched(self: Planner, continued: ContinuedPart) -> PlainPlan | None:
        courses.append(plan(self, continued))
        return courses[-1]

    monkeypatch.setattr(Planner, "plan", watched)
    streamed(source, machine, 4000)
    monkeypatch.undo()
    found = [course for course in courses if course is not None]
    return max(found, key=lambda course: len(course.part.moves))
