"""A small TNC of its own, to judge by: Klartext in, the way of the machine's axes out.

It shares nothing with the product: text is taken apart by regular expressions, formulas are handed to Python, frames
are 3x3 matrices. What it does not know is an error. Known are the path functions, increments, poles, Q parameters, FN 0
to 4 and 9 to 12, labels, calls and repeats, the cycles 7, 8, 10, 11 and 247, TRANS DATUM, drilling cycles of the 200s
and cycle 1 with M99, M89, CYCL CALL and CYCL CALL POS, M91, TOOL CALL with DL, MM and INCH.
"""

from __future__ import annotations

import cmath
import math
import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

NUMBER = r"[+-]?\s*(?:\d+\.?\d*|\.\d+)"
WORD = re.compile(rf"(?<![A-Z0-9])(I?(?:PA|PR|[XYZ])|DL|F|R)\s*([+-]?\s*Q[LR]?\d+|{NUMBER})(?![\w.])")
STEP, SAGITTA = 1.0, 1e-4
"""mm between points of a straight way, and by which the chords of an arc may miss it."""

PLANES = {frozenset("XY"): "XY", frozenset("YZ"): "YZ", frozenset("ZX"): "ZX"}


class UnknownError(Exception):
    """The judge does not know this."""


@dataclass(frozen=True, slots=True)
class Way:
    """One motion: points in machine axes (k, 3) mm, and the length of the tool; a hole is its bottom."""

    kind: str
    points: Floats
    line: int
    length: float


@dataclass(slots=True)
class Tnc:
    """The control; `lengths` of tools and `presets` by row, row 0 is active at first."""

    lengths: dict[int, float]
    presets: dict[int, tuple[float, float, float]]
    at: Floats
    ways: list[Way] = field(default_factory=list)
    q: dict[str, float] = field(default_factory=dict)
    unit: float = 1.0
    length: float = 0.0
    preset: int = 0
    shift: Floats = field(default_factory=lambda: np.zeros(3))
    mirror: str = ""
    turn: float = 0.0
    scale: float = 1.0
    pole: dict[str, float] = field(default_factory=dict)
    plane: str = "XY"
    heading: Floats | None = None
    cycle: int = 0
    old: dict[str, float] = field(default_factory=dict)
    modal: bool = False
    line: int = 0

    # -- frames -------------------------------------------------------------------------------------------------------

    @property
    def turned(self) -> Floats:
        """What acts on program coordinates before the shift."""
        c, s = math.cos(math.radians(self.turn)), math.sin(math.radians(self.turn))
        flip = np.diag([-1.0 if letter in self.mirror else 1.0 for letter in "XYZ"])
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ flip * (self.scale * self.unit)

    @property
    def datum(self) -> Floats:
        return np.array(self.presets[self.preset]) + self.shift + np.array([0, 0, self.length])

    def program(self) -> Floats:
        """Where the tool stands, in program coordinates."""
        return np.linalg.solve(self.turned, self.at - self.datum)

    def machine(self, point: Floats) -> Floats:
        return self.turned @ point + self.datum

    # -- blocks -------------------------------------------------------------------------------------------------------

    def run(self, text: str) -> list[Way]:
        """Follow a program."""
        blocks = list(blocks_of(text))
        labels = {m[1]: n for n, (_, b) in reversed(list(enumerate(blocks))) if (m := re.match(r"LBL\s+(\S+)", b))}
        left: dict[int, int] = {}
        calls: list[int] = []
        at = 0
        while at < len(blocks):
            self.line, block = blocks[at]
            at += 1
            if m := re.match(r"CALL\s+LBL\s+(\S+?)(?:\s+REP\s*(\d+)(?:/\d+)?)?\s*$", block):
                if m[2] is None:
                    calls.append(at)
                    at = labels[m[1]]
                elif left.setdefault(at, int(m[2])) > 0:
                    left[at] -= 1
                    at = labels[m[1]]
                else:
                    del left[at]
            elif re.match(r"LBL\s+0\s*$", block):
                at = calls.pop() if calls else at
            elif m := re.match(r"FN\s*(\d+)\s*:\s*IF\s+(\S+)\s+(EQU|NE|GT|LT)\s+(\S+)\s+GOTO\s+LBL\s+(\S+)", block):
                a, b = self.value(m[2]), self.value(m[4])
                if {"EQU": abs(a - b) < 1e-9, "NE": abs(a - b) >= 1e-9, "GT": a > b, "LT": a < b}[m[3]]:
                    at = labels[m[5]]
            elif re.match(r"END\s+PGM", block) or self.block(block):
                break
        return self.ways

    def block(self, block: str) -> bool:
        """One block that is no jump; True if the program ends."""
        if m := re.match(r"BEGIN\s+PGM.*\b(MM|INCH)\s*$", block):
            self.unit = 1.0 if m[1] == "MM" else 25.4
        elif re.match(r"(LBL|BLK|\*|PATTERN)", block) or not block:
            pass
        elif m := re.match(r"(?:FN\s*[0-4]\s*:\s*)?(Q[LR]?\d+)\s*=(.*)$", block):
            self.q[m[1]] = self.formula(m[2])
        elif block.startswith("TOOL CALL"):
            number = re.match(r"TOOL CALL\s+(\d+)", block)
            self.length = self.lengths[int(number[1])] if number else self.length
            self.length += self.words(block).get("DL", 0.0) * self.unit
        elif block.startswith("CYCL DEF"):
            self.define(block)
        elif block.startswith("TRANS DATUM"):
            self.shifted(dict.fromkeys("XYZ", 0.0) if "RESET" in block else self.words(block))
        else:
            return self.motion(block)
        return False

    def value(self, text: str) -> float:
        text = re.sub(r"\s", "", text)
        if m := re.fullmatch(r"([+-]?)(Q[LR]?\d+)", text):
            return self.q[m[2]] * (-1 if m[1] == "-" else 1)
        return float(text)

    def formula(self, text: str) -> float:
        text = re.sub(r"Q[LR]?\d+", lambda m: f"({self.q[m[0]]!r})", text).replace("DIV", "/").replace("^", "**")
        for name in ("SIN", "COS"):
            text = re.sub(
                rf"{name}\s*(\([^()]*(?:\([^()]*\)[^()]*)*\)|[\d.]+)", rf"math.{name.lower()}(math.radians(\1))", text
            )
        return float(eval(text, {"math": math}))  # formulas of our own programs

    def words(self, block: str) -> dict[str, float]:
        found = {}
        for address, text in WORD.findall(block):
            if address in found:
                raise UnknownError(f"{address} twice: {block}")
            found[address] = self.value(text)
        return found

    def define(self, block: str) -> None:
        m = re.match(r"CYCL\s+DEF\s+(\d+)(?:\.(\d))?", block)
        if m is None:
            raise UnknownError(block)
        number, part = int(m[1]), m[2]
        for name, text in re.findall(rf"(Q\d+)\s*=\s*([+-]?Q\d+|{NUMBER})", block):
            self.q[name] = self.value(text)
        words = self.words(block[m.end() :])
        if number == 7:
            self.shifted(words)
        elif number == 8 and part == "1":
            self.mirror = "".join(sorted(set(block[m.end() :]) & set("XYZ")))
        elif number == 10 and part == "1":
            (turn,) = re.findall(rf"(I?)ROT\s*({NUMBER})", block)
            self.turn = float(turn[1]) + (self.turn if turn[0] else 0.0)
        elif number == 11 and part == "1":
            self.scale = float(re.findall(rf"SCL\s*({NUMBER})", block)[0])
        elif number == 247:
            self.preset = int(self.q["Q339"])
        elif number == 1:
            self.cycle = 1
            self.old |= {name: abs(float(size)) for name, size in re.findall(rf"(SET UP|DEPTH)\s*({NUMBER})", block)}
        elif number in (200, 201, 203):
            self.cycle = number
        elif number not in (7, 8, 10, 11, 9, 32):
            raise UnknownError(block)

    def shifted(self, words: dict[str, float]) -> None:
        for address, number in words.items():
            axis = "XYZ".index(address[-1])
            self.shift[axis] = number * self.unit + (self.shift[axis] if address[0] == "I" else 0.0)

    # -- motions ------------------------------------------------------------------------------------------------------

    def motion(self, block: str) -> bool:
        m = re.match(r"(LP|L|CC|CP|CR|CTP|CT|C|RND|CHF|CYCL CALL POS|CYCL CALL|APPR LCT|DEP LCT)(?=\s|$)", block)
        name = m[1] if m else ""
        if re.match(r"(APPR|DEP|LN)\b", block) and not name:
            raise UnknownError(block)
        words = self.words(block[len(name) :]) if name not in ("RND", "CHF") else {}
        codes = {int(code) for code in re.findall(r"(?<![A-Z])M(\d+)", block)}
        axes = {k: v for k, v in words.items() if k[-1] in "XYZ" and k not in ("F", "R")}
        polar = {k: v for k, v in words.items() if k.endswith(("PA", "PR"))}
        if name == "CC":
            self.set_pole(axes)
        elif 91 in codes and axes:
            end = np.array([axes.get(c, p / self.unit) * self.unit for c, p in zip("XYZ", self.at, strict=True)])
            self.go("machine", np.array([self.at, end]))
            self.heading = None
        elif name.startswith("CYCL CALL") or 99 in codes or ((self.modal or 89 in codes) and (axes or polar)):
            self.modal = (self.modal or 89 in codes) and 99 not in codes
            self.hole(self.led(axes, polar), by_height="POS" in name)
        elif axes or polar or name == "C":
            sense = -1 if "DR-" in block else 1 if "DR+" in block else 0
            self.path(name, self.led(axes, polar), words, sense, fast=bool(re.search(r"F\s*MAX", block)))
        return bool(codes & {2, 30})

    def led(self, axes: dict[str, float], polar: dict[str, float]) -> Floats:
        """Where words lead, in program coordinates."""
        end = self.program()
        for address, number in axes.items():
            axis = "XYZ".index(address[-1])
            end[axis] = number + (end[axis] if address[0] == "I" else 0.0)
        if polar:
            first, second = ("XYZ".index(letter) for letter in self.plane)
            here = self.program()
            pole = complex(*(self.pole[letter] for letter in self.plane))
            spoke = complex(here[first], here[second]) - pole
            radius = polar.get("PR", abs(spoke) + polar.get("IPR", 0.0))
            angle = (
                math.radians(polar["PA"]) if "PA" in polar else cmath.phase(spoke) + math.radians(polar.get("IPA", 0))
            )
            end[first], end[second] = (pole + cmath.rect(radius, angle)).real, (pole + cmath.rect(radius, angle)).imag
        return end

    def set_pole(self, axes: dict[str, float]) -> None:
        end = self.led(axes, {})
        named = {address[-1] for address in axes} or set(self.plane)
        if len(named) == 2:
            self.plane = PLANES[frozenset(named)]
        self.pole = {**self.pole, **{letter: float(end["XYZ".index(letter)]) for letter in named}}

    def path(self, name: str, end: Floats, words: dict[str, float], sense: int, *, fast: bool) -> None:
        start = self.program()
        if name in ("", "L", "LP", "APPR LCT", "DEP LCT"):
            points = np.array([start, end])
            way = self.machine(end) - self.at
            self.heading = way / np.linalg.norm(way) if np.linalg.norm(way) > 0 else self.heading
            points = np.array([self.machine(p) for p in points])
            self.go("rapid" if fast else "L", dense(points))
            return
        letters = self.plane if name in ("C", "CP", "CTP") else plane_of(words)
        first, second = ("XYZ".index(letter) for letter in letters)
        a, b = complex(start[first], start[second]), complex(end[first], end[second])
        if name in ("C", "CP"):
            centre = complex(*(self.pole[letter] for letter in letters))
        elif name == "CR":
            centre = by_radius(a, b, words["R"], sense)
        else:
            if self.heading is None:
                raise UnknownError("CT without a direction")
            ahead = np.linalg.solve(self.turned, self.heading)
            left = 1j * complex(ahead[first], ahead[second])
            left /= abs(left)
            radius = abs(b - a) ** 2 / (2 * ((b - a) * left.conjugate()).real)
            centre, sense = a + radius * left, 1 if radius > 0 else -1
        sweep = cmath.phase((b - centre) / (a - centre)) * sense % (2 * math.pi)
        sweep = (2 * math.pi if sweep < 1e-6 or sweep > 2 * math.pi - 1e-6 else sweep) * sense
        if name == "CP" and "IPA" in words:
            sweep = math.radians(words["IPA"])
        shares = np.linspace(0, 1, max(8, int(abs(sweep) * math.sqrt(abs(a - centre) * self.unit / (8 * SAGITTA))) + 2))
        spokes = (a - centre) * np.exp(1j * sweep * shares)
        spokes *= 1 + shares * (abs(b - centre) / abs(a - centre) - 1)
        points = start + shares[:, None] * (end - start)
        points[:, first], points[:, second] = (centre + spokes).real, (centre + spokes).imag
        turn = self.turned
        last = 1j * spokes[-1] * np.sign(sweep)
        local = np.zeros(3)
        local[first], local[second] = last.real, last.imag
        self.heading = turn @ local / np.linalg.norm(turn @ local)
        self.go("C", points @ turn.T + self.datum)

    def hole(self, over: Floats, *, by_height: bool) -> None:
        """A hole: the bottom, then where the control stands after it."""
        bottom, clear = over.copy(), over.copy()
        if self.cycle == 1:
            bottom[2] = over[2] - self.old["SET UP"] - self.old["DEPTH"]
        elif self.cycle:
            surface = self.q["Q203"] + (over[2] if by_height else 0.0)
            bottom[2] = surface + self.q["Q201"]
            clear[2] = surface + max(self.q["Q200"], self.q["Q204"])
        else:
            raise UnknownError("no cycle")
        self.ways.append(Way("hole", self.machine(bottom)[None], self.line, self.length))
        self.at, self.heading = self.machine(clear), None

    def go(self, kind: str, points: Floats) -> None:
        self.ways.append(Way(kind, points, self.line, self.length))
        self.at = points[-1].copy()


def blocks_of(text: str) -> list[tuple[int, str]]:
    """Line numbers and blocks: joined, without numbers and remarks, points for commas, capitals."""
    found: list[tuple[int, str]] = []
    joined = ""
    for number, line in enumerate(text.splitlines(), 1):
        code = line.split(";")[0].rstrip()
        follows = line.rstrip().endswith("~")
        joined += " " + code.rstrip("~")
        if follows:
            continue
        block = re.sub(r"\s+", " ", joined.upper().replace(",", ".")).strip()
        block = re.sub(r"^/?\s*(\d+(?=\s+[A-Z*]|$)\s*)?", "", block)
        found.append((number, block))
        joined = ""
    return found


def plane_of(words: dict[str, float]) -> str:
    """The plane of an arc without a pole."""
    return PLANES.get(frozenset(address[-1] for address in words if address[-1] in "XYZ"), "XY")


def by_radius(a: complex, b: complex, radius: float, sense: int) -> complex:
    """The centre from which the arc is short (radius > 0) or long."""
    height = math.sqrt(max(radius**2 - abs(b - a) ** 2 / 4, 0.0))
    for side in (1j, -1j):
        centre = (a + b) / 2 + side * height * (b - a) / abs(b - a)
        if ((cmath.phase((b - centre) / (a - centre)) * sense % (2 * math.pi)) <= math.pi + 1e-12) == (radius > 0):
            return centre
    raise UnknownError("no centre")


def dense(points: Floats) -> Floats:
    """A straight way as points."""
    shares = np.linspace(0, 1, max(2, int(np.linalg.norm(points[1] - points[0]) / STEP) + 1))
    return points[0] + shares[:, None] * (points[1] - points[0])
