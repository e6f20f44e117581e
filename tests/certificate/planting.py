"""Programs of five languages as a CAM system posts them, their corrections, and faults planted into these.

    PYTHONPATH=tests python -m certificate.planting --programs 1000 --faults 1000

counts how many faults the second reader finds and how many good programs it calls faulty.
"""

from __future__ import annotations

import argparse
import random
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from ncfix.certificate.coordinates import Given
from ncfix.certificate.proof import BlockProof, prove
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.setup import Setup, Tool
from ncfix.machine import Machine, load
from ncfix.text.dialect import get
from ncfix.text.reader import read

ROOT = Path(__file__).parents[2]
LANGUAGES = ("linuxcnc", "iso", "fanuc", "siemens", "heidenhain")
SETUP = Setup(
    work_offsets={name: {"X": 10.0, "Y": -5.0, "Z": 40.0} for name in ("G54", "G55", "PRESET")},
    tools={1: Tool(80.0, 3.0)},
    initial={"X": 0.0, "Y": 0.0, "Z": 350.0, "A": 0.0, "B": 0.0, "C": 0.0},
)
GIVEN = Given(offsets=SETUP.work_offsets, tools={1: 80.0}, initial=SETUP.initial)
STEP = 0.001
"""mm, the last digit in which all these programs are written; the machines resolve as much or less."""
CYCLE_NUMBERS = re.compile(r"(?<=CYCLE8\d)\(|(?<=CYCL DEF 200) |^ +Q2|(?<=FN [12]: Q203)|(?<=G8[123]) | R(?=-?\d+\.)")
"""Where the numbers of a drilling cycle begin in a line."""
CALLS_HOLE = re.compile("MCALL|FN [12]")
DIGITS = re.compile(r"(?<![\dQ])[+-]?\d+\.?\d*")
LETTER = re.compile(r"(?<![A-Z])([XYZAC])(=?)([+-]?\d+\.?\d*)")


def machine(name: str) -> Machine:
    """One of the machines of the goldens: `three` without rotary axes, `table` with A and C."""
    return load(str(ROOT / "tests" / "goldens" / "machines" / f"{name}.toml"))


@dataclass(slots=True)
class Writer:
    """Writes random motions as one language does.

    numbered  every block has its number
    frame     "turned" or "tilted": now and then the coordinates are turned in their plane, or a plane is tilted
    formulas  some words are formulas of a variable
    loops     some of its motions are made several times
    """

    language: str
    rng: random.Random
    numbered: bool
    five: bool
    at: dict[str, float]
    lines: list[str]
    frame: str = ""
    formulas: bool = False
    loops: bool = False

    @property
    def klartext(self) -> bool:
        return self.language == "heidenhain"

    def put(self, text: str) -> None:
        if self.klartext:
            self.lines.append(f"{len(self.lines)} {text}" if self.numbered else text)
        elif self.numbered and not text.startswith(("%", "O")):
            self.lines.append(f"N{10 * (len(self.lines) + 1)} {text}")
        else:
            self.lines.append(text)

    def word(self, axis: str, value: float) -> str:
        self.at[axis] = round(value, 3)
        if self.formulas and self.rng.random() < 0.2:
            return self.formula(axis, self.at[axis])
        digits = f"{self.at[axis]:+.3f}" if self.klartext else f"{self.at[axis]:.3f}"
        if not self.klartext and self.rng.random() < 0.2 and "." in digits:
            digits = digits.rstrip("0")
        return axis + digits

    def formula(self, axis: str, value: float) -> str:
        """A word that has a variable in it, which the head of the program has given the value 12.5."""
        more, half = f"{value - 12.5:+.3f}", f"{value - 6.25:+.3f}"
        if self.klartext:
            sign = self.rng.choice("+-")
            text = f"Q1 {more[0]} {more[1:]}" if self.rng.random() < 0.5 else f"( Q1 / 2 ) {half[0]} {half[1:]}"
            name = f"Q{2 + 'XYZAC'.index(axis)}"
            self.put(f"{name} = {text}" if sign == "+" else f"FN 2: {name} = {-value + 12.5:+.3f} - +Q1")
            return f"{axis}{sign}{name}"
        if self.language == "siemens":
            return self.rng.choice((f"{axis}=R1{more}", f"{axis}=(R1/2){half}"))
        return self.rng.choice((f"{axis}[#101{more}]", f"{axis}[[#101/2]{half}]", f"{axis}[{value}]"))

    def motion(self, rapid: bool, axes: str, feed: str = "") -> None:
        words = " ".join(self.word(axis, self.place(axis)) for axis in axes)
        if self.klartext:
            self.put(f"L {words} {'FMAX' if rapid else feed}".strip())
        else:
            self.put(f"G{0 if rapid else 1} {words}{' ' + feed if feed and not rapid else ''}")

    def place(self, axis: str) -> float:
        spread = {"X": 90, "Y": 90, "Z": 25, "A": 30, "C": 60}[axis]
        return self.rng.uniform(-spread, spread)

    def arc(self) -> None:
        """A circle's part about a centre nearby, its end to three digits."""
        i, j = (round(self.rng.uniform(-25, 25), 3) for _ in "IJ")
        x, y = self.at["X"] + i, self.at["Y"] + j
        if abs(i) < 1 or abs(j) < 1:
            return
        self.at["X"], self.at["Y"] = x + i, self.rng.choice((y + j, y - j))
        sense = self.rng.choice((2, 3))
        if self.klartext:
            self.put(f"CC X{x:+.3f} Y{y:+.3f}")
            self.put(f"C {self.word('X', self.at['X'])} {self.word('Y', self.at['Y'])} DR{'-' if sense == 2 else '+'}")
        else:
            self.put(f"G{sense} {self.word('X', self.at['X'])} {self.word('Y', self.at['Y'])} I{i:.3f} J{j:.3f}")

    def drill(self) -> None:
        """Some holes in a row, down from a level and up to it, or higher."""
        rng = self.rng
        level, deep, feed = (rng.randint(*span) for span in ((20, 40), (2, 30), (50, 300)))
        bottom, high = round(level - deep - rng.random(), 3), level + rng.choice((0, 60))
        places = rng.choice((["XY"], ["XY", "X", "XY"], ["XY", "Y"]))
        if self.language == "siemens":
            way = rng.choice((f"{bottom}", f",{round(level - bottom, 3)}"))
            cycle = rng.choice((f"CYCLE81({high},{level},2,{way})", f"CYCLE82({high},{level},1.5,{bottom},,0.4)"))
            if rng.random() < 0.4:
                cycle = f"CYCLE83({high},{level},2,{bottom},,{round(level - 1.5, 3)},,{min(deep, 3)},0.5,0,1,0)"
            if rng.random() < 0.3:
                self.motion(True, "XY")
                self.put(cycle)
            else:
                self.put(f"MCALL {cycle}")
                for axes in places:
                    self.motion(True, axes)
                self.put("MCALL")
        elif self.klartext:
            words = [f"Q200=+{rng.choice((1, 2.5))}", f"Q201={bottom - level:+.3f}", f"Q206=+{feed}", "Q202=+5"]
            words += ["Q210=+0", f"Q203={level:+}", f"Q204=+{high - level}", "Q211=+0"]
            lines = rng.random() < 0.5
            self.put("CYCL DEF 200 DRILLING ~" if lines else f"CYCL DEF 200 DRILLING {' '.join(words)}")
            self.lines += [f"    {word} ;VALUE{'' if word is words[-1] else ' ~'}" for word in words] if lines else []
            for axes in places:
                self.motion(True, axes)
                if rng.random() < 0.3:
                    self.put("CYCL CALL")
                else:
                    self.lines[-1] += " M99"
        else:
            code = rng.choice(("G81", "G82 P200", "G83 Q3."))
            self.put(
                f"{rng.choice(('G98', 'G99'))} {code} {self.word('X', self.place('X'))} "
                f"{self.word('Y', self.place('Y'))} Z{bottom:.3f} R{level}. F{feed}"
            )
            for axes in places[1:]:
                self.put(" ".join(self.word(axis, self.place(axis)) for axis in axes))
            self.put("G80")
        self.motion(True, "XYZ")

    def note(self, text: str) -> None:
        plain = self.language in ("siemens", "heidenhain")
        self.put(f"; {text}" if plain else f"({text})")

    def program(self, blocks: int) -> bytes:
        """A program of about so many blocks."""
        rng = self.rng
        self.head()
        every = "XYZAC" if self.five else "XYZ"
        self.motion(True, every)
        self.motion(False, every, "F500")
        ends: list[str] = []
        for k in range(blocks):
            if self.frame and k % 9 == 3:
                self.turn()
            if self.loops and k % 6 == 2 and self.language != "iso":
                lines, ends = (ends, []) if ends else self._loop(k // 12)
                for line in lines:
                    self.put(line)
                self.motion(False, rng.choice((every, every, "XY")))
            choice = rng.random()
            if choice < 0.12 and not self.five:
                self.arc()
            elif choice < 0.15 and not self.five:
                self.drill()
            elif choice < 0.2:
                self.motion(True, "".join(rng.sample("XYZ", 2)))
            elif choice < 0.25:
                self.note(f"PASS {rng.randint(1, 99)}")
            elif choice < 0.3:
                self.put(rng.choice(("M8", "M9")))
            else:
                axes = [axis for axis in every if rng.random() < 0.7] or ["X"]
                self.motion(False, "".join(axes), rng.choice(("", "", "F800", "F1200")))
        for line in ends:
            self.put(line)
        self.put({"heidenhain": "END PGM PART MM"}.get(self.language, "M30"))
        return ("\n".join(self.lines) + "\n").encode()

    def _loop(self, number: int) -> tuple[list[str], list[str]]:
        """The lines before and behind what is made several times."""
        times, name = self.rng.randint(1, 3), f"{1 + number}"
        match self.language:
            case "heidenhain":
                return [f"LBL {name}"], [f"CALL LBL {name} REP {times}"]
            case "siemens" if self.rng.random() < 0.5:
                return [f"AGAIN_{name}:"], [f"REPEAT AGAIN_{name} P={times}"]
            case "siemens":
                return ["R9=0", f"AGAIN_{name}:"], ["R9=R9+1", f"IF R9<{times} GOTOB AGAIN_{name}"]
            case "fanuc":
                return ["#109=0", f"WHILE [#109 LT {times}] DO1"], ["#109=#109+1", "END1"]
            case _:
                return [f"O10{name} REPEAT [{times}]"], [f"O10{name} ENDREPEAT"]

    def turn(self) -> None:
        """Coordinates are turned, or a plane is tilted, and the tool goes there; or they are not turned any more."""
        x, y, z, first, tilt, last = (round(self.rng.uniform(-most, most), 3) for most in (20, 20, 20, 90, 60, 90))
        for line in self._turn_lines(self.rng.random() < 0.2, (x, y, z), (first, tilt, last)):
            self.put(line)
        self.motion(True, "XY")
        self.motion(True, "Z")

    def _turn_lines(self, ends: bool, origin: Sequence[float], angles: Sequence[float]) -> list[str]:
        (x, y, z), (first, tilt, last), tilted = origin, angles, self.frame == "tilted"
        match self.language:
            case "heidenhain" if tilted:
                begin = f"PLANE SPATIAL SPA{tilt:+} SPB{first / 4:+} SPC{last:+} "
                sign = self.rng.choice(("SEQ+", "SEQ-"))
                if ends:
                    return ["PLANE RESET STAY"]
                if self.rng.random() < 0.5:
                    return [f"{begin}TURN FMAX {sign}"]
                return [f"{begin}STAY {sign}", "L A+Q120 C+Q122 R0 FMAX"]
            case "heidenhain":
                return ["CYCL DEF 10.0 ROTATION", f"CYCL DEF 10.1 ROT{0.0 if ends else first:+}"]
            case "siemens" if tilted:
                places = f"{x},{y},{z},{tilt},{first / 4},{last},0,0,{z / 2}"
                call = f'CYCLE800(0,"TABLE",200000,57,{places},{self.rng.choice((-1, 1))})'
                return ["CYCLE800()" if ends else call]
            case "siemens":
                shift = [] if ends or self.rng.random() < 0.5 else [f"TRANS X{x} Y{y}"]
                angle = f" RPL={first}" if self.rng.random() < 0.5 else f" Z{first}"
                return [*shift, ("AROT" if shift else "ROT") + ("" if ends else angle)]
            case _ if tilted:
                plane = f"G68.2 X{x} Y{y} Z{z} I{first} J{tilt} K{last}"
                return ["G69", *([] if ends else [plane, "G53.1"])]
            case _:
                return ["G69", *([] if ends else [f"G68 X{x} Y{y} R{first}"])]

    def head(self) -> None:
        match self.language:
            case "heidenhain":
                self.put("BEGIN PGM PART MM")
                self.put("TOOL CALL 1 Z S8000")
                self.put("L X+0 Y+0 Z+200 R0 FMAX M3")
                if self.five:
                    self.put("L A+0 C+0 FMAX")
                    self.put("M128")
            case "siemens":
                self.put("G17 G40 G90 G94 G71")
                self.put("T1 D1")
                self.put("M6")
                self.put("G54")
                self.put("S8000 M3")
                self.put("G0 X0 Y0 Z200" + (" A0 C0" if self.five else ""))
                if self.five:
                    self.put("TRAORI")
            case _:
                if self.language == "fanuc":
                    self.put("%")
                    self.put("O1000(PART)")
                self.put("G21 G17 G40 G49 G80 G90 G94")
                self.put("T1 M6")
                self.put("G54")
                self.put("S8000 M3")
                lead = "G43.4" if self.five else "G43"
                rotary = " A0. C0." if self.five else ""
                self.put(f"G0 X0. Y0.{rotary}")
                self.put(f"{lead} H1 Z200.")
        if self.formulas:
            self.put({"heidenhain": "FN 0: Q1 = +12.5", "siemens": "R1=12.5"}.get(self.language, "#101=[25./2.]"))
        self.at.update(X=0.0, Y=0.0, Z=200.0, A=0.0, C=0.0)


class Case(NamedTuple):
    """A program and its correction."""

    language: str
    original: bytes
    corrected: bytes
    machine: Machine
    numbered: bool


def cases(count: int, seed: int) -> Iterator[Case]:
    """Programs of all languages in turn, and their corrections."""
    rng = random.Random(seed)
    machines = {False: machine("three"), True: machine("table")}
    made = 0
    while made < count:
        language = LANGUAGES[made % len(LANGUAGES)]
        five = rng.random() < 0.3 and language in ("fanuc", "iso", "siemens", "heidenhain")
        numbered = rng.random() < 0.6
        turns = {"linuxcnc": ("",), "iso": ("", "turned")}.get(language, ("", "turned", "tilted"))
        frame = "" if five or rng.random() < 0.6 else rng.choice(turns)
        formulas = language != "iso" and rng.random() < 0.3
        loops = not frame and rng.random() < 0.3
        writer = Writer(language, rng, numbered, five, {}, [], frame, formulas, loops)
        original = writer.program(rng.randint(8, 40))
        known = machines[five or frame == "tilted"]
        program = read(original, "part", get(language))
        fixed = fix_program(program, known, SETUP, FixOptions(figures=False, allow_refused=True))
        made += 1
        yield Case(language, original, fixed.text, known, numbered)


# -- faults -----------------------------------------------------------------------------------------------------------


class Draft:
    """The lines of a corrected program, and which of them belong together."""

    def __init__(self, case: Case, rng: random.Random) -> None:
        self.rng = rng
        self.lines = case.corrected.decode().splitlines()
        known = set(case.original.decode().splitlines())
        self.klartext, numbered = case.language == "heidenhain", case.numbered
        self.path = [k for k, line in enumerate(self.lines) if LETTER.search(line) and "ncfix" not in line.lower()]
        self.put_in = [k for k, line in enumerate(self.lines) if line not in known and CALLS_HOLE.search(line)]
        self.touched = [k for k in self.path if self.lines[k] not in known]
        self.ends = [k for k in self.touched if numbered and not self._added(k + 1)] if numbered else []
        self.heads = [k for k in self.ends if not self._added(k)]

    def _added(self, at: int) -> bool:
        if at >= len(self.lines) or at not in self.path:
            return False
        if self.klartext:
            return self.lines[at].split()[0] == self.lines[at - 1].split()[0]
        return not re.match(r"N\d", self.lines[at])

    def text(self) -> bytes:
        """The program with the fault."""
        return ("\n".join(self.lines) + "\n").encode()

    def values(self, upto: int) -> dict[str, float]:
        """The last word of each axis before a line."""
        found: dict[str, float] = {}
        for line in self.lines[:upto]:
            if "ncfix" not in line.lower():
                found.update({m[1]: float(m[3]) for m in LETTER.finditer(line)})
        return found


def digit(draft: Draft) -> bool:
    """Another digit in the number of an axis at the end of a block."""
    if not draft.ends:
        return False
    at = draft.rng.choice(draft.ends)
    words = list(LETTER.finditer(draft.lines[at]))
    word = draft.rng.choice(words)
    text = word[3]
    where = draft.rng.choice([k for k, c in enumerate(text) if c.isdigit()])
    new = draft.rng.choice([c for c in "0123456789" if c != text[where]])
    other = text[:where] + new + text[where + 1 :]
    change = abs(float(other) - float(text))
    rotary = word[1] in "AC"
    if change < (0.001 if rotary else STEP / 2):
        return False
    draft.lines[at] = draft.lines[at][: word.start(3)] + other + draft.lines[at][word.end(3) :]
    return True


def lost_word(draft: Draft) -> bool:
    """A word of an axis that moves is gone."""
    at = draft.rng.choice(draft.touched)
    word = draft.rng.choice(list(LETTER.finditer(draft.lines[at])))
    if abs(draft.values(at).get(word[1], 1e9) - float(word[3])) < 0.02:
        return False
    draft.lines[at] = (draft.lines[at][: word.start()].rstrip() + draft.lines[at][word.end() :]).strip()
    return bool(draft.lines[at])


def doubled_word(draft: Draft) -> bool:
    """A word twice."""
    at = draft.rng.choice(draft.touched)
    word = draft.rng.choice(list(LETTER.finditer(draft.lines[at])))
    draft.lines[at] = f"{draft.lines[at][: word.end()]} {word[0]}{draft.lines[at][word.end() :]}"
    return True


def dropped_line(draft: Draft) -> bool:
    """A line of the original is gone."""
    spare = [k for k, line in enumerate(draft.lines) if line.strip() and "ncfix" not in line.lower()]
    at = draft.rng.choice(draft.heads if draft.heads and draft.rng.random() < 0.7 else spare)
    if at not in draft.heads and (at in draft.path or at in draft.put_in):
        return False
    del draft.lines[at]
    return True


def wrong_sign(draft: Draft) -> bool:
    """The sign of a coordinate."""
    at = draft.rng.choice(draft.touched)
    word = draft.rng.choice(list(LETTER.finditer(draft.lines[at])))
    value = float(word[3])
    if abs(value) < 0.02:
        return False
    plain = word[3].lstrip("+-")
    text = (
        ("+" if word[3].startswith("-") and "+" in "".join(draft.lines) else "") + plain if value < 0 else f"-{plain}"
    )
    draft.lines[at] = draft.lines[at][: word.start(3)] + text + draft.lines[at][word.end(3) :]
    return True


def swapped_axes(draft: Draft) -> bool:
    """The numbers of two axes exchanged."""
    at = draft.rng.choice(draft.touched)
    words = list(LETTER.finditer(draft.lines[at]))
    if len(words) < 2:
        return False
    one, two = sorted(draft.rng.sample(words, 2), key=lambda word: word.start())
    if abs(float(one[3]) - float(two[3])) < 0.02:
        return False
    line = draft.lines[at]
    draft.lines[at] = line[: one.start(3)] + two[3] + line[one.end(3) : two.start(3)] + one[3] + line[two.end(3) :]
    return True


def stale_stamp(draft: Draft) -> bool:
    """The stamp of another machine."""
    at = next(k for k, line in enumerate(draft.lines) if "ncfix" in line.lower())
    found = re.search(r"(?i)machine ([0-9a-f]{12})", draft.lines[at])
    assert found is not None
    other = "".join(draft.rng.choice("0123456789abcdef") for _ in range(12))
    draft.lines[at] = draft.lines[at][: found.start(1)] + other + draft.lines[at][found.end(1) :]
    return True


def wrong_cycle(draft: Draft) -> bool:
    """Another digit in a number of a drilling cycle, or of what goes round a hole."""
    spots = [
        (at, number)
        for at, line in enumerate(draft.lines)
        if (where := CYCLE_NUMBERS.search(line)) is not None
        for number in DIGITS.finditer(line, where.start())
    ]
    if not spots:
        return False
    at, found = draft.rng.choice(spots)
    text, line = found[0], draft.lines[at]
    where = draft.rng.choice([k for k, c in enumerate(text) if c.isdigit()])
    other = text[:where] + draft.rng.choice([c for c in "0123456789" if c != text[where]]) + text[where + 1 :]
    if abs(float(other) - float(text)) < 1.5 * STEP:  # where a cycle starts follows its hole to a digit
        return False
    draft.lines[at] = line[: found.start()] + other + line[found.end() :]
    return True


def unsplit(draft: Draft) -> bool:
    """The pieces of a straight motion at feed made one again: its way leaves the tolerance."""
    many = [k for k in draft.ends if draft._added(k) and draft._added(k - 1)]
    if not many:
        return False
    last = draft.rng.choice(many)
    first = last
    while draft._added(first):
        first -= 1
    block = "".join(draft.lines[first : last + 1])
    if re.search(r"G0\b|G[23]\b|[IJ]", block):
        return False
    words = {match[1]: match[3] for k in range(first, last + 1) for match in LETTER.finditer(draft.lines[k])}
    head = LETTER.sub(lambda match: match[1] + match[2] + words.pop(match[1]), draft.lines[first])
    extra = " ".join(f"{axis}{value}" for axis, value in words.items())
    draft.lines[first : last + 1] = [f"{head} {extra}".strip()]
    return True


KINDS: tuple[Callable[[Draft], bool], ...] = (
    digit, lost_word, doubled_word, dropped_line, wrong_sign, swapped_axes, stale_stamp, wrong_cycle, unsplit,
)  # fmt: skip


def planted(case: Case, kind: Callable[[Draft], bool], rng: random.Random) -> bytes | None:
    """The correction with a fault of this kind; None if it has no place for one."""
    for _ in range(40):
        draft = Draft(case, rng)
        if not draft.touched:
            return None
        if kind(draft) and draft.text() != case.corrected:
            return draft.text()
    return None


def judged(case: Case, corrected: bytes) -> BlockProof:
    """What the second reader says."""
    return prove(case.original, corrected, case.machine, GIVEN, case.language)


@dataclass(slots=True)
class Score:
    """Figures of a run, and what was wrong: descriptions with the texts."""

    good: int = 0
    alarms: int = 0
    planted: Counter[str] = field(default_factory=Counter)
    found: Counter[str] = field(default_factory=Counter)
    motions: int = 0
    proved: int = 0
    wrong: list[tuple[str, Case, bytes, BlockProof]] = field(default_factory=list)


def run(programs: int, faults: int, seed: int = 1) -> Score:
    """Judge so many good programs, and so many faults in them, of all kinds in turn."""
    score, rng = Score(), random.Random(seed)
    each = -(-faults // programs)
    kinds = 0
    for case in cases(programs, seed):
        found = judged(case, case.corrected)
        score.good += 1
        score.motions += found.motions
        score.proved += found.proved_motions
        if found.faults:
            score.alarms += 1
            score.wrong.append(("alarm", case, case.corrected, found))
            continue
        for _ in range(each):
            if sum(score.planted.values()) >= faults:
                break
            for _ in range(len(KINDS)):
                kind = KINDS[kinds % len(KINDS)]
                kinds += 1
                text = planted(case, kind, rng)
                if text is not None:
                    break
            else:
                continue
            name = kind.__name__
            score.planted[name] += 1
            verdict = judged(case, text)
            if verdict.faults:
                score.found[name] += 1
            else:
                score.wrong.append((f"missed {name}", case, text, verdict))
    return score


def main() -> int:
    """Print the figures; exit code 1 if a good program is called faulty or more than 2 in 1,000 faults are missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--programs", type=int, default=1000)
    parser.add_argument("--faults", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--show", type=int, default=3, help="of what was wrong")
    asked = parser.parse_args()
    score = run(asked.programs, asked.faults, asked.seed)
    for text, case, corrected, verdict in score.wrong[: asked.show]:
        print(text, case.language, verdict.faults[:3], dict(verdict.reasons))
        before = case.corrected.decode().splitlines()
        for number, line in enumerate(corrected.decode().splitlines(), 1):
            mark = "" if line in before else "   <<<"
            if mark or any(fault.line == number for fault in verdict.faults):
                print("    ", number, line, mark)
    print(f"{score.good} good programs, {score.proved} of {score.motions} motions proved, {score.alarms} false alarms")
    print(f"{sum(score.planted.values())} faults, {sum(score.found.values())} found")
    for name, count in sorted(score.planted.items()):
        print(f"  {name.replace('_', ' '):13} {score.found[name]} of {count}")
    missed = sum(score.planted.values()) - sum(score.found.values())
    return int(score.alarms > 0 or missed > 0.002 * sum(score.planted.values()))


if __name__ == "__main__":
    sys.exit(main())
