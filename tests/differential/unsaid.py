"""Programs in which an axis is not said again after something has led it elsewhere, and a judge of their corrections.

Every frame (a plane, a swivelled head or table, a rotation, the tip led) meets everything that leaves axes unsaid (a
cycle, the end of radius compensation, machine coordinates, a change of tool, the end of its length), and then go
motions that name one axis each, or all of them. Both texts are followed by the second controls, with the second model
of the machine.
"""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import groupby, product
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np

from differential import errors, fanuc, sinumerik, test_fanuc_control, test_siemens, test_tnc_swivel, unsaid_rs274
from differential.sinumerik_frames import Floats
from differential.sinumerik_motions import Path as Way
from differential.test_siemens import apart
from differential.test_tnc import PRESETS
from differential.test_tnc_five import LENGTHS
from differential.tnc_swivel import Swivel
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import MotionKind, Pass, Rule
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, load
from ncfix.text.reader import read
from ncfix.text.tree import Program

FRAMES = ("plane", "swivel", "rotation", "tcp")
EVENTS = ("cycle", "side", "machine", "tool", "length")
NAMED = ("one", "all")
STRATEGIES = ("position", "rotary-then-linear", "full")


class Step(NamedTuple):
    """One motion by a second control: its mark, line, sort (rapid, cut, hole, fixed), and the tip (n, 3) mm."""

    mark: int
    line: int
    sort: str
    tip: Floats


@dataclass(frozen=True, slots=True)
class Language:
    """How programs of a language are made, and followed by the second control, as meant or as a machine does it.

    at_ends  mm: rounding of three linear axes, and what half a step of a rotary axis moves the tip by
    frames   the frames that the language has
    events   what leaves axes unsaid in it
    on_the_way  mm: the tolerance asked for, rounding, and the chords of the samples
    turned   mm: what half a step of a rotary axis that the strategy moves comes to
    """

    write: Callable[[str, str, str, random.Random], list[str]]
    setup: Setup
    file: Path
    steps: Callable[[str, bool], list[Step]]
    marked: Callable[[str], str]
    tolerance_um: float
    at_ends: float
    frames: tuple[str, ...] = FRAMES
    events: tuple[str, ...] = EVENTS
    on_the_way: float = 1.8e-3
    turned: float = 0.0


# -- programs ---------------------------------------------------------------------------------------------------------


def number(dice: random.Random, low: float = -25.0, high: float = 25.0) -> str:
    """A number with three decimals."""
    return f"{dice.uniform(low, high):.3f}"


def singly(dice: random.Random, many: str) -> list[dict[str, str]]:
    """Words of the motions behind an event: one axis each, or all."""
    heights = {"Z": (12.0, 30.0)}
    letters = [dice.choice("XYZ") for _ in range(4)] + ["X", "Y"]
    if many == "one":
        return [{letter: number(dice, *heights.get(letter, (-25.0, 25.0)))} for letter in letters]
    return [{letter: number(dice, *heights.get(letter, (-25.0, 25.0))) for letter in "XYZ"} for _ in range(3)]


def somewhere(dice: random.Random) -> str:
    """Some axes that machine coordinates lead elsewhere."""
    return dice.choice(("Z", "XY", "X", "Y", "XYZ"))


def fanuc_text(frame: str, event: str, many: str, dice: random.Random) -> list[str]:
    """A Fanuc program."""

    def words(given: dict[str, str]) -> str:
        return " ".join(f"{letter}{value}" for letter, value in given.items())

    at = f"X{number(dice)} Y{number(dice)}"
    angles = (number(dice, -20, 20), number(dice, 5, 25), number(dice, -20, 20))
    frames = {
        "plane": ["G0 A5. C10.", "G68.2 X2. Y3. Z1. I{} J{} K{}".format(*angles), "G53.1"],
        "swivel": ["G0 A5. C10.", "G68.2 P1 Q123 X2. Y3. Z1. I{1} J{0} K{2}".format(*angles), "G53.1"],
        "rotation": [f"G68 X3. Y-4. R{number(dice, -80, 80)}"],
        "tcp": ["G0 A0. C0.", "G49", "G43.4 H1 X0. Y0. Z40.", "G1 X1. Y2. Z40. A12. C20."],
    }
    machine = " ".join({"X": "X20.", "Y": "Y-15.", "Z": "Z250."}[letter] for letter in somewhere(dice))
    events = {
        "cycle": [f"G98 G81 {at} Z-2. R5.", f"X{number(dice)}", "G80"],
        "side": [f"G41 D1 G1 X{number(dice)} Y{number(dice)}", f"X{number(dice)}", dice.choice(("G40 Z25.", "G40"))],
        "machine": [f"G53 G{dice.choice('001')} {machine}"],
        "tool": ["T2 M6", "G43.4 H2" if frame == "tcp" else "G43 H2"],
        "length": ["G49"],
    }
    tail = [f"G{dice.choice('0111')} {words(given)}" for given in singly(dice, many)]
    if event == "cycle" or dice.random() < 0.3:
        tail.insert(dice.randint(0, len(tail)), f"G98 G81 {at if many == 'all' else 'X7.'} Z-2. R6.\nG80\nG1")
    head = ["%", "O1", "G17 G21 G40 G49 G80 G90 G94", "T1 M6", "G54", "G43 H1", "G0 X0. Y0. Z60. A5. C10. F1000."]
    start = f"G0 X{number(dice)} Y{number(dice)} Z30."
    return [*head, *frames[frame], start, "G1 Z26.", *events[event], *"\n".join(tail).split("\n"), "M30", "%"]


def siemens_text(frame: str, event: str, many: str, dice: random.Random) -> list[str]:
    """A SINUMERIK program."""

    def words(given: dict[str, str]) -> str:
        return " ".join(f"{letter}{value}" for letter, value in given.items())

    at, angles = f"X{number(dice)} Y{number(dice)}", [number(dice, 4, 20) for _ in range(3)]
    frames = {
        "plane": [f"ROT X{angles[0]} Y-{angles[1]} Z{angles[2]}"],
        "swivel": [f'CYCLE800(1,"T",0,57,0,0,0,{angles[0]},{angles[1]},{angles[2]},0,0,0,-1)'],
        "rotation": [f"ROT RPL={number(dice, -80, 80)}"],
        "tcp": ["TRAORI", "G0 X0 Y0 Z40 A=12 C=20"],
    }
    machine = " ".join({"X": "X20", "Y": "Y-15", "Z": "Z240"}[letter] for letter in somewhere(dice))
    where = dice.choice(("SUPA", "G53", "G153"))
    events = {
        "cycle": ["MCALL CYCLE81(45,0,2,2)", f"G0 {at}", f"X{number(dice)}", "MCALL"],
        "side": [f"G41 G1 X{number(dice)} Y{number(dice)}", f"X{number(dice)}", dice.choice(("G40 Z25", "G40"))],
        "machine": [f"{where} G{dice.choice('001')} {machine}"],
        "tool": ["T2 D1 M6"],
        "length": ["D0"],
    }
    tail = [f"G{dice.choice('0111')} {words(given)}" for given in singly(dice, many)]
    start = f"G0 X{number(dice)} Y{number(dice)} Z30" + ("" if frame == "swivel" else " A=12 C=20")
    head = ["G17 G40 G90 G94 G710", "T1 D1 M6", "G54", "G0 X0 Y0 Z40 A0 C0 F1000"]
    return [*head, *frames[frame], start, "G1 Z26", *events[event], *tail, "M30"]


def klartext(frame: str, event: str, many: str, dice: random.Random) -> list[str]:
    """A Klartext program."""

    def signed(text: str) -> str:
        return text if text.startswith("-") else "+" + text

    def words(given: dict[str, str]) -> str:
        return " ".join(f"{letter}{signed(value)}" for letter, value in given.items())

    at = f"X{signed(number(dice))} Y{signed(number(dice))}"
    a, b, c = (signed(number(dice, 5, 20)) for _ in range(3))
    frames = {
        "plane": [f"PLANE SPATIAL SPA{a} SPB{b} SPC{c} TURN FMAX SEQ+"],
        "swivel": [f"PLANE EULER EULPR{a} EULNU{b} EULROT{c} TURN FMAX SEQ+"],
        "rotation": ["CYCL DEF 10.0 ROTATION", f"CYCL DEF 10.1 ROT{signed(number(dice, -80, 80))}"],
        "tcp": ["M128", "L X+1 Y+2 Z+60 B+12 C+20 F1000"],
    }
    machine = " ".join({"X": "X+20", "Y": "Y-15", "Z": "Z+380"}[letter] for letter in somewhere(dice))
    pecking = ["CYCL DEF 1.0 PECKING", "CYCL DEF 1.1 SET UP 2", "CYCL DEF 1.2 DEPTH -8"]
    off = dice.choice(("L Z+55 R0 F500", f"L X{signed(number(dice))} R0 F500"))
    events = {
        "cycle": [*pecking, f"L {at} FMAX M99", f"L X{signed(number(dice))} FMAX M99"],
        "side": [f"L {at} RL F500", f"L X{signed(number(dice))}", off],
        "machine": [f"L {machine} R0 {dice.choice(('FMAX', 'FMAX', 'F2000'))} M91"],
        "tool": ["TOOL CALL 2 Z S900"],
    }
    tail = [f"L {words(given)} {dice.choice(('FMAX', 'F700', 'F700'))}" for given in singly(dice, many)]
    start = f"L {at} Z+60 R0 FMAX"
    head = ["BEGIN PGM U MM", "TOOL CALL 1 Z S1000", "L X+10 Y+5 Z+250 R0 FMAX", "L B+0 C+0 FMAX"]
    return [*head, *frames[frame], start, "L Z+50 F800", *events[event], *tail, "END PGM U MM"]


# -- the second controls ----------------------------------------------------------------------------------------------


@dataclass(slots=True)
class LinedSwivel(Swivel):
    """The second TNC, and in which lines its travels are."""

    lines: list[int] = field(default_factory=list)

    def block(self, block: str) -> bool:
        ended = Swivel.block(self, block)
        self.lines += [self.line] * (len(self.travels) - len(self.lines))
        return ended


def by_cradle(module: ModuleType, text: str, actual: bool) -> list[Step]:
    """What the second Fanuc or SINUMERIK makes of a program; the radius of the cutter is zero."""
    found = module.by_mark(CRADLE, re.sub(r"G4[12] D\d", "", text), actual)
    return [Step(mark[1], ways[0].line, sort_of(ways), points) for mark, (ways, points) in found.items()]


def sort_of(ways: list[Way]) -> str:
    """The sort of the motions of a block: a hole if they end in one."""
    return "hole" if any(way.sort == "hole" for way in ways) else ways[0].sort


def by_tnc(text: str, actual: bool) -> list[Step]:
    """What the second TNC makes of a program; the radius of the cutter is zero."""
    start = np.array([0.0, 0.0, 300.0])
    control = LinedSwivel(dict(LENGTHS), dict(PRESETS), start, model=TABLES)
    control.run(re.sub(r" RL\b", "", text))
    tip = TABLES.actual_tip if actual else TABLES.tip
    sorts, marks, mark = {"path": "cut", "machine": "fixed"}, [0], 0
    for line in text.splitlines():
        mark = int(found[1]) if (found := re.search(r";#(\d+)", line)) else mark
        marks.append(mark)
    steps = [
        Step(marks[line], line, sorts.get(each.kind, each.kind), tip(each.axes, np.full(len(each.axes), each.length)))
        for line, each in zip(control.lines, control.travels, strict=True)
    ]
    groups = (list(group) for _, group in groupby(steps, key=lambda step: (step.mark, step.sort)))
    return [group[0]._replace(tip=np.concatenate([step.tip for step in group])) for group in groups]


def marked_tnc(text: str) -> str:
    """The program with a mark at the end of every line."""
    return "".join(f"{line} ;#{n}\n" for n, line in enumerate(text.splitlines()))


def by_linuxcnc(text: str, actual: bool) -> list[Step]:
    """What LinuxCNC makes of a program; the radius of the cutter is zero."""
    found = unsaid_rs274.steps(TRUNNION_MODEL, re.sub(r"G4[12] D\d", "", text), actual)
    return [Step(*motion) for motion in found]


TRUNNION = Path(__file__).parent / "machines" / "five_ac.toml"
TRUNNION_MODEL = errors.load(TRUNNION)
LINUXCNC_SETUP = Setup(
    work_offsets={name: dict(zip("XYZ", shift, strict=True)) for name, shift in unsaid_rs274.OFFSETS.items()},
    tools={number: Tool(length, 0.0) for number, length in unsaid_rs274.LENGTHS.items()},
    initial=dict(zip("XYZAC", (0.0, 0.0, 250.0, 0.0, 0.0), strict=True)),
)
STEEP = Path(__file__).parent / "machines" / "steep_ca.toml"
CRADLE = errors.load(STEEP)
TABLES = test_tnc_swivel.MODEL
LANGUAGES = {
    "fanuc": Language(
        fanuc_text,
        test_fanuc_control.SETUP,
        STEEP,
        partial(by_cradle, test_fanuc_control),
        fanuc.marked,
        1.0,
        0.4e-3,
    ),
    "siemens": Language(
        siemens_text,
        test_siemens.SETUP,
        STEEP,
        partial(by_cradle, test_siemens),
        sinumerik.marked,
        1.0,
        0.4e-3,
    ),
    "heidenhain": Language(
        klartext,
        test_tnc_swivel.SETUP,
        test_tnc_swivel.FILE,
        by_tnc,
        marked_tnc,
        1.0,
        1e-3,
        events=EVENTS[:-1],
        on_the_way=2.4e-3,
    ),
    "linuxcnc": Language(
        unsaid_rs274.text,
        LINUXCNC_SETUP,
        TRUNNION,
        by_linuxcnc,
        fanuc.marked,
        1.0,
        1e-3,
        unsaid_rs274.FRAMES,
        EVENTS[:-1],
        1.95e-3,
        1e-3,
    ),
}
LANGUAGES["iso"] = LANGUAGES["fanuc"]


# -- the verdict ------------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class Found:
    """Motions by what became of them, programs by why they were not followed, and every silent fault."""

    motions: Counter[str] = field(default_factory=Counter)
    stopped: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    worst: float = 0.0


def texts(dialect: str, seeds: range) -> Iterator[tuple[str, str]]:
    """Names and texts of programs: all that meets all, for each seed."""
    language = LANGUAGES[dialect]
    for seed, frame, event, many in product(seeds, language.frames, language.events, NAMED):
        name = f"{frame}, {event}, {many}, {seed}"
        yield name, language.marked("\n".join(language.write(frame, event, many, random.Random(name))) + "\n")


JUMP = 0.1
"""mm: farther than any correction here."""
FIGURE = 0.05e-3
"""mm: to so much figures in messages are rounded."""


def judge(dialect: str, strategy: str, name: str, text: str, found: Found) -> None:
    """Correct a program, follow it before and after, and note what became of its motions."""
    language = LANGUAGES[dialect]
    machine = load(str(language.file))
    options = FixOptions(strategy=strategy, tolerance_um=language.tolerance_um)
    try:
        program = read(text.encode(), name, dialect)
        fixed = fix_program(program, machine, language.setup, options)
    except NcfixError as error:
        found.stopped[f"{error.messages[0].code} {error.messages[0].text}"] += 1
        return
    claims = Claims.of(program, machine, language.setup, fixed)
    found.faults += [f"{name}: line {line}: a motion that is no rapid passes" for line in claims.unlawful]
    meant, done = language.steps(text, False), language.steps(fixed.text.decode(), True)
    assert [(step.mark, step.sort) for step in meant] == [(step.mark, step.sort) for step in done], name
    fresh, stood = True, None
    for wanted, made in zip(meant, done, strict=True):
        if stood is None or np.abs(wanted.tip[0] - stood).max() > JUMP:
            fresh = True  # another tool, whose tip no motion has led to where it stands
        stood = wanted.tip[-1]
        fate = claims.fate(wanted)
        found.motions[fate] += 1
        if fate != "corrected":
            fresh = True
            continue
        turned, left = language.turned if strategy == "full" else 0.0, claims.left.get(wanted.line, {})
        off, excused = beyond(wanted.tip[-1] - made.tip[-1], left, led=name.startswith("tcp") and "length" not in name)
        allowed = language.at_ends + turned + excused
        if wanted.sort == "cut":
            begins = float(np.linalg.norm(wanted.tip[0] - made.tip[0])) if fresh else 0.0
            allowed_along = language.on_the_way + turned + sum(left.values()) + begins
            allowed_along += claims.whole.get(wanted.line, 0.0)
            along = max(apart(wanted.tip, made.tip[1:]), apart(made.tip, wanted.tip[1:]))
            off = max(off, allowed * along / allowed_along)
        found.worst = max(found.worst, off - allowed + language.at_ends)
        if off > allowed:
            found.faults.append(f"{name}: line {wanted.line}: {off * 1e3:.2f} um, {allowed * 1e3:.2f} allowed")
        fresh = wanted.sort == "hole" or wanted.line in claims.left  # what follows begins beside its way


def beyond(off: Floats, left: dict[str, float], *, led: bool) -> tuple[float, float]:
    """How far off a tip is, mm, and how far it may be for axes that were left where they stand.

    If the tip is led, these axes are known to be X, Y and Z of the workpiece: nothing is excused across them.
    """
    if not led:
        return float(np.linalg.norm(off)), sum(left.values())
    most = np.array([left.get(letter, 0.0) for letter in "XYZ"])
    return float(np.linalg.norm(np.maximum(np.abs(off) - most, 0.0))), 0.0


@dataclass(frozen=True, slots=True)
class Claims:
    """What the product says that it did not do, by lines.

    left   mm, by axes
    whole  mm: by so much it says that the way leaves its path
    """

    refused: frozenset[int]
    passed: frozenset[int]
    unlawful: frozenset[int]
    left: dict[int, dict[str, float]]
    whole: dict[int, float]

    @classmethod
    def of(cls, program: Program, machine: Machine, setup: Setup, fixed: Fixed) -> Claims:
        report, moves = fixed.report, follow(program, machine, setup).trace.moves
        lines, passed = program.lines(moves.block), (moves.rule == Rule.PASS) & (moves.kind != MotionKind.DWELL)
        left: dict[int, dict[str, float]] = {}
        for axis in report.left:
            for line in (line for first, last in axis.stretches for line in range(first, last + 1)):
                left.setdefault(line, {})[axis.axis] = 0.0 if axis.rotary else axis.most
        whole: dict[int, float] = {}
        for note in report.warnings:
            if note.place and (note.code == "NCF416" or "must not be split" in note.text):
                figure = re.search(r"([\d.]+) um", note.text)
                most = JUMP if figure is None else float(figure[1]) / 1e3 + FIGURE
                whole[note.place.line] = max(whole.get(note.place.line, 0.0), most)
        cuts = passed & (moves.kind != MotionKind.RAPID)
        lawful = np.isin(moves.passing, list(LAWFUL))
        return cls(
            frozenset(refusal.line for refusal in report.refused),
            frozenset(lines[passed].tolist()),
            frozenset(lines[cuts & ~lawful].tolist()),
            left,
            whole,
        )

    def fate(self, step: Step) -> str:
        """What became of a motion."""
        if step.line in self.refused:
            return "refused"
        if step.line in self.passed:
            return "passed"
        return "corrected"


LAWFUL = {Pass.MACHINE_COORDINATES, Pass.ROTARY_ALONE}
"""Rules by which something else than a rapid may pass in these programs."""


def study(dialect: str, strategy: str, seeds: range) -> Found:
    """All programs of a language by one strategy."""
    found = Found()
    for name, text in texts(dialect, seeds):
        judge(dialect, strategy, name, text, found)
    return found
