"""Klartext programs at random, with everything that `tnc` knows; each is made while a `Tnc` follows it.

python -m differential.test_tnc FIRST LAST    (with `tests` on the path) judges as many as wanted
"""

from __future__ import annotations

import cmath
import math
import random
from collections.abc import Callable

from differential.tnc import Tnc, blocks_of

FAR = 120.0
"""mm; elements that would end farther out are straight."""

RESET = ["CYCL DEF 10.0 R", "CYCL DEF 10.1 ROT+0", "CYCL DEF 8.0 M", "CYCL DEF 8.1", "CYCL DEF 11.0 S"]
RESET += ["CYCL DEF 11.1 SCL 1", "TRANS DATUM RESET"]
SUBPROGRAMS = {
    '"P1"': ["L IX+3 IY+1", "L IY+2.5 F300"],
    "77": ["CC X+5 Y+5", "LP PR+20 PA+10", "CP IPA+60 DR+", "LP IPA+15"],
}
SECTIONS = [
    ["L IX+3.2 IY-2.1", "L IZ-0.5"],
    ["CC IX+5 IY+0", "C IX+10 IY+0 DR+", "L IY+2"],
    ["Q9 = Q9 + 7.5", "L X+Q9 Y+3"],
    ["CYCL DEF 10.0 R", "CYCL DEF 10.1 IROT+20", "L X+20 Y+3", "CR X+25 Y+8 R+5 DR-"],
]


class Maker:
    """Makes one program; `control` stands where the program so far has led."""

    def __init__(self, seed: int, control: Tnc, unit: str = "MM") -> None:
        self.unit = unit
        self.dice = random.Random(seed)
        self.control = control
        self.lines: list[str] = []
        self.called: set[str] = set()
        self.label = 10

    def program(self, elements: int) -> str:
        """A program of so many elements."""
        self.emit(f"BEGIN PGM G {self.unit}", "TOOL CALL 1 Z S1000", "L X+10 Y+5 Z+20 FMAX", "L Z-1 F500")
        kinds: list[Callable[[], None]] = [self.straight, self.arc, self.polar, self.tangent, self.elsewhere]
        kinds += [self.frame, self.holes, self.flow, self.values]
        for _ in range(elements):
            self.dice.choice(kinds)()
        self.emit("L Z+60 FMAX M30")
        for name in sorted(self.called):
            self.lines += [f"LBL {name}", *SUBPROGRAMS[name], "LBL 0"]
        return "\n".join([*self.lines, f"END PGM G {self.unit}", ""])

    def emit(self, *lines: str) -> None:
        """Blocks that are executed where they stand."""
        for line in lines:
            self.lines.append(line)
            self.feed(line)

    def feed(self, *lines: str) -> None:
        """Follow blocks."""
        for line in lines:
            for _, block in blocks_of(line):
                self.control.block(block)

    def at(self) -> complex:
        """Where the tool stands in the working plane."""
        x, y, _ = self.control.program()
        return complex(x, y)

    def number(self, least: float, most: float, digits: int = 3) -> str:
        return f"{self.dice.uniform(least, most):+.{digits}f}"

    def somewhere(self) -> complex:
        return complex(round(self.dice.uniform(-90, 90), 3), round(self.dice.uniform(-90, 90), 3))

    # -- elements -----------------------------------------------------------------------------------------------------

    def straight(self) -> None:
        to, by = self.somewhere(), (self.somewhere() - self.at()) / 3
        self.emit(
            self.dice.choice(
                [
                    f"L {xy(to)} Z{self.number(-5, 5)} F{self.dice.randint(100, 900)}",
                    f"X {to.real:.3f} Y{to.imag:.1f} R0 F500 M8",
                    f"L Y{to.imag:+.3f}",
                    f"L {xy(to)} FMAX",
                    f"L Z{self.number(-5, 50)} R0 F MAX",
                    f"L {xy(by, 'I')}",
                    f"L IX{by.real:+.3f} Z{self.number(-5, 5)}",
                ]
            )
        )

    def arc(self) -> None:
        at, sense = self.at(), self.dice.choice([1, -1])
        angle, word = round(self.dice.uniform(20, 340), 3), "DR+" if sense > 0 else "DR-"
        pole = rounded(at + cmath.rect(self.dice.uniform(3, 25), self.dice.uniform(-3, 3)))
        end = pole + (at - pole) * cmath.exp(1j * sense * math.radians(angle))
        if max(abs(end.real), abs(end.imag)) > FAR:
            self.straight()
            return
        radius = (abs(end - at) / 2 * self.dice.uniform(1.01, 2) + 0.02) * self.dice.choice([1, -1])
        turns = sense * self.dice.choice([1, 2, 3]) * angle
        choices = [
            [f"CC {xy(pole)}", f"C {xy(end, digits=4)} {word}"],
            [f"CC {xy(pole - at, 'I')}", f"C {xy(end - at, 'I', 4)} {word}"],
            [f"CC {xy(pole)}", f"C {xy(2 * pole - at, digits=4)} {word}"],
            [f"CC {xy(pole)}", f"C {xy(at, digits=6)} {word}"],
            [f"CC {xy(pole)}", f"C {word}"],
            [f"CR {xy(end)} R{radius:+.3f} {word}"],
            [f"CC {xy(pole)}", f"CP IPA{sense * angle:+.3f} {word}"],
            [f"CC {xy(pole)}", f"CP PA{angle:+.3f} {word}"],
            [f"CC {xy(pole)}", f"CP IPA{turns:+.3f} IZ{self.number(-5, 5)} {word}"],
        ]
        self.emit(*self.dice.choice(choices))

    def polar(self) -> None:
        pole, angle = rounded(self.at() + cmath.rect(self.dice.uniform(3, 25), self.dice.uniform(-3, 3))), 30.0
        radius, angle = self.number(5, 25), self.dice.uniform(0, 360)
        choices = [
            [f"CC {xy(pole)}", f"LP PR{radius} PA{angle:+.3f}", "LP IPR+3.5", f"LP PA{angle / 2:+.2f} FMAX"],
            [f"CC {xy(pole)}", f"LP PR{radius} IPA+20 Z{self.number(-5, 5)}", "LP IPA-33.5"],
            ["CC", f"LP PR{radius} PA{angle:+.3f}", "LP IPA+30"],
            [f"CC {xy(pole)}", f"CC X{pole.real + 2:+.3f}", f"LP PR{radius} PA{angle:+.3f}"],
        ]
        self.emit(*self.dice.choice(choices))

    def tangent(self) -> None:
        to = self.somewhere()
        way = to - self.at()
        self.emit(f"L {xy(to)}")
        if abs(way) > 5:
            turn = self.dice.choice([-1, 1]) * self.dice.uniform(10, 70)
            self.emit(f"CT {xy(to + 15 * way / abs(way) * cmath.exp(1j * math.radians(turn)))}")

    def elsewhere(self) -> None:
        x, y, z = self.control.program()
        radius, word = self.dice.uniform(3, 25), self.dice.choice(["DR+", "DR-"])
        choices = [
            [f"CC X{x + radius:+.4f} Z{z:+.4f}", f"C X{x + 2 * radius:+.4f} Z{z:+.4f} {word}"],
            [f"CR Y{y + radius:+.3f} Z{z + radius / 2:+.3f} R{radius:+.3f} {word}"],
            [f"L Z{self.number(250, 300)} R0 FMAX M91", f"L {xy(self.somewhere())} FMAX", "L Z+5 FMAX"],
            [self.dice.choice(["TOOL CALL 2 Z S500", "TOOL CALL 1 Z DL+0.25 DR-0.1"]), f"L {xy(self.somewhere())} Z+9"],
        ]
        self.emit(*self.dice.choice(choices))

    def frame(self) -> None:
        choices = [
            ["CYCL DEF 7.0 DATUM", f"CYCL DEF 7.1 X{self.number(-9, 9, 2)}", f"CYCL DEF 7.2 IY{self.number(-9, 9)}"],
            [f"TRANS DATUM AXIS X{self.number(-9, 9, 2)} Z{self.number(-3, 3, 2)}"],
            ["CYCL DEF 10.0 ROTATION", f"CYCL DEF 10.1 ROT{self.number(-100, 100, 2)}"],
            ["CYCL DEF 8.0 MIRROR", f"CYCL DEF 8.1 {self.dice.choice(['X', 'Y', 'X Y'])}"],
            ["CYCL DEF 11.0 SCALING", f"CYCL DEF 11.1 SCL {self.dice.uniform(0.7, 1.2):.3f}"],
            ["CYCL DEF 247 DATUM SETTING ~\n Q339=+1 ;NUMBER"],
        ]
        self.emit(*RESET, *self.dice.choice(choices), f"L {xy(self.somewhere())} Z+3 F700")

    def holes(self) -> None:
        to = self.somewhere()
        cycle = [
            f"CYCL DEF 200 DRILLING ~\n Q200=+2 ;CLEAR ~\n Q201={-self.dice.randint(3, 15)} ~\n"
            f" Q203={self.number(-2, 2)} ~\n Q204=+{self.dice.choice([0, 20])}"
        ]
        old = ["CYCL DEF 1.0 PECKING", "CYCL DEF 1.1 SET UP 2", "CYCL DEF 1.2 DEPTH -8"]
        ways = [
            [f"L {xy(to)} FMAX M99", f"L IX{self.number(-5, 5)} FMAX M99"],
            [f"L {xy(to)} FMAX M89", f"L Y{to.imag - 4:+.3f} FMAX", f"L X{to.real + 3:+.3f} FMAX M99"],
            [f"CC {xy(to)}", "LP PR+15 PA+30 FMAX M99", "LP IPA+60 FMAX M99"],
            [f"L {xy(to)} FMAX", "CYCL CALL M3"],
        ]
        if self.dice.random() < 0.3:
            self.emit(*cycle, f"CYCL CALL POS {xy(to)} Z+3 FMAX", "L Z+30 FMAX")
        else:
            self.emit(*self.dice.choice([cycle, old]), *self.dice.choice(ways), "L Z+30 FMAX")

    def flow(self) -> None:
        if self.dice.random() < 0.5:
            name = self.dice.choice(sorted(SUBPROGRAMS))
            self.called.add(name)
            self.lines.append(f"CALL LBL {name}")
            self.feed(*SUBPROGRAMS[name])
            return
        count, body = self.dice.randint(1, 3), self.dice.choice(SECTIONS)
        self.label += 1
        self.emit(*RESET, "Q9 = -20")
        self.lines += [f"LBL {self.label}", *body, f"CALL LBL {self.label} REP {count}/{count}"]
        self.feed(*body * (count + 1))
        self.emit(*RESET)

    def values(self) -> None:
        to = self.somewhere()
        choices = [
            [f"Q1 = {to.real / 2:.3f} * 2", f"FN 1: Q2 = {to.imag - 3:+.3f} + +3", "L X+Q1 Y+Q2"],
            ["FN 0: Q3 = +2.5", "L IX-Q3 IY+Q3"],
            ["Q4 = 12 * COS ( 30 )", "LBL 9", "L X-Q4 Z+1 F MAX", "FN 9: IF +Q4 EQU +0 GOTO LBL 9"],
        ]
        chosen = self.dice.choice(choices)
        self.label += 1
        for line in chosen:
            text = line.replace("LBL 9", f"LBL {self.label}")
            self.lines.append(text)
            if not text.startswith(("LBL", "FN 9")):
                self.feed(text)


def xy(point: complex, mark: str = "", digits: int = 3) -> str:
    """A point as two words."""
    return f"{mark}X{point.real:+.{digits}f} {mark}Y{point.imag:+.{digits}f}"


def rounded(point: complex) -> complex:
    return complex(round(point.real, 3), round(point.imag, 3))
