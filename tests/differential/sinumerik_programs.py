"""Random SINUMERIK programs for a machine with a cradle: short, and made of whatever there is a manual's page for."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

HEAD = ["G17 G40 G90 G94 G710", "T1 D1 M6", "G54", "G0 X0 Y0 Z40 A0 C0 F1000"]
PLANES = {17: "XYIJZ", 18: "ZXKIY", 19: "YZJKX"}
"""The two axes of a plane, their centre words, and the axis across."""

SWIVEL_MODES = (57, 54, 27, 39, 30, 45, 64 + 57, 128 + 57, 128 + 54)


class Author:
    """Writes one program; coordinates stay where the machine can follow."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.lines = list(HEAD)
        self.subprograms: list[str] = []
        self.plane = 17
        self.transformed = self.swivelled = self.incremental = False

    def program(self) -> str:
        """A program of some length."""
        for _ in range(self.chance.randint(5, 14)):
            self.part()
        return "\n".join([*self.lines, "M30", *self.subprograms]) + "\n"

    def part(self) -> None:
        """A few blocks of one kind."""
        kinds: list[tuple[float, Callable[[], None]]] = [
            (10, self.straight),
            (6, self.arc),
            (2, self.tangential),
            (2, self.polar),
            (2, self.frame),
            (1, self.transformation),
            (1, self.swivel),
            (1, self.angles),
            (1, self.values),
            (1, self.units),
            (1, self.holes),
            (1, self.contour),
            (1, self.tool),
            (1, self.increments),
            (2, self.other_plane),
            (1, self.subprogram),
            (1, self.loop),
            (1, self.machine_position),
        ]
        weights = [weight for weight, _ in kinds]
        self.chance.choices([kind for _, kind in kinds], weights)[0]()

    def number(self, low: float = -35.0, high: float = 35.0) -> str:
        """A number with up to three decimals."""
        return f"{self.chance.uniform(low, high):.{self.chance.randint(0, 3)}f}"

    def anew(self) -> None:
        """A rapid to a known place, in whatever coordinates are in force.

        Rotary axes that it did not name would get no word in what follows, and be left as they are.
        """
        words = [f"{letter}=AC({self.number(5, 45) if letter == 'Z' else self.number()})" for letter in "XYZ"]
        self.lines.append("G0 " + " ".join(words) + ("" if self.swivelled else " A=AC(5) C=AC(10)"))

    # -- motions ------------------------------------------------------------------------------------------------------

    def straight(self) -> None:
        """G0 or G1."""
        words = [self.word(letter) for letter in "XYZ" if self.chance.random() < 0.65] or [self.word("X")]
        self.lines.append(self.chance.choice(("G0 ", "G1 ", "G1 ")) + " ".join(words + self.turn()))

    def word(self, letter: str) -> str:
        """An axis word in one of its forms."""
        value = self.number(5, 45) if letter == "Z" else self.number()
        step = self.number(-8, 8)
        plain = step if self.incremental else value
        forms = [f"{letter}=AC({value})", f"{letter}=IC({step})", f"{letter}{plain}", f"{letter}={plain}"]
        return self.chance.choice(forms)

    def turn(self) -> list[str]:
        """Rotary words, or the direction of the tool."""
        if self.swivelled or self.chance.random() < 0.6:
            return []
        both = [f"A=AC({self.number(-50, 50)})", f"C=AC({self.number(-80, 80)})"]
        vector = [f"{name}={self.chance.uniform(-0.5, 0.5):.4f}" for name in ("A3", "B3")] + ["C3=1"]
        around = [f"C={self.chance.choice(('DC', 'ACP', 'ACN'))}({self.number(0, 359)})"]
        return self.chance.choice([both, vector, around, both[:1]]) if self.transformed else both

    def arc(self) -> None:
        """An arc by its centre, radius, angles or an intermediate point; now and then a helix or a full circle."""
        radius, begin = self.chance.choice((3, 5, 8.5, 12.25)), self.chance.uniform(0, 2 * math.pi)
        angle, code = self.chance.choice((30, 90, 150, 200, 300)), self.chance.choice((2, 3))
        sense = math.radians(angle) * (1 if code == 3 else -1)

        def at(share: float) -> tuple[float, float]:
            place = begin + share * sense
            return radius * (math.cos(place) - math.cos(begin)), radius * (math.sin(place) - math.sin(begin))

        first, second, i, j, across = PLANES[self.plane]
        end = f"{first}=IC({at(1.0)[0]:.4f}) {second}=IC({at(1.0)[1]:.4f})"
        height = f" {across}=IC({self.number(-3, 3)})" if self.chance.random() < 0.3 else ""
        centre = f"{i}{-radius * math.cos(begin):.4f} {j}{-radius * math.sin(begin):.4f}"
        forms = [
            f"G{code} {end}{height} {centre}",
            f"G{code} {end}{height} CR={radius if angle < 180 else -radius}",
            f"G{code} {end}{height} AR={angle}",
            f"G{code}{height} {centre} AR={angle}",
            f"G{code} {centre}",
            f"G{code}{height} {centre} TURN=1",
            f"CIP {end} {i}1=IC({at(0.5)[0]:.4f}) {j}1=IC({at(0.5)[1]:.4f})",
        ]
        self.lines.append(self.chance.choice(forms))

    def tangential(self) -> None:
        """CT, twice perhaps."""
        first, second, _, _, across = PLANES[self.plane]

        def step(low: float, high: float) -> str:
            return f"{first}=IC({self.number(low, 8)}) {second}=IC({self.number(-high, high)})"

        self.lines.append("G1 " + step(3, 6))
        self.lines.append(f"CT {step(2, 8)} {across}=IC({self.chance.choice((0, 2))})")
        self.lines += [step(2, 8)] * self.chance.randint(0, 1)

    def polar(self) -> None:
        """AP and RP about a pole, lines and arcs; now and then only one of them is written."""
        first, second, _, _, across = PLANES[self.plane]
        pole = f"{first}{self.number(-5, 5)} {second}{self.number(-5, 5)}"
        self.lines.append(f"G{self.chance.choice((110, 111, 112))} {pole}")
        self.lines.append(f"G1 AP=AC({self.number(0, 359)}) RP=AC({self.number(5, 25)})")
        radius = self.chance.choice((f" RP=AC({self.number(5, 15)})", "", " RP=IC(1.5)"))
        self.lines.append(f"AP=IC({self.number(-60, 60)}){radius}")
        height = f" {across}=IC({self.number(-3, 3)})" if self.chance.random() < 0.3 else ""
        angles = [self.number(0, 359) for _ in range(self.chance.randint(0, 2))]
        self.lines += [f"G{self.chance.choice((2, 3))} AP=AC({angle}){height}" for angle in angles]
        self.anew()

    def contour(self) -> None:
        """Cutter compensation and roundings: the control's business; after G40 an axis without a word gets none."""
        self.lines += ["G41 G1 X=AC(5) Y=AC(5)", "G1 X=AC(25) RND=1", "G3 X=IC(5) Y=IC(5) CR=5"]
        self.lines.append("G40 G1 X=AC(30) Y=AC(30)")

    def holes(self) -> None:
        """A modal drilling cycle."""
        self.lines.append("MCALL CYCLE81(45,0,2,2)")
        self.lines += [f"G0 X=AC({self.number()}) Y=AC({self.number()})" for _ in range(2)]
        self.lines.append("MCALL")
        self.anew()

    def other_plane(self) -> None:
        """Arcs, polar words and a turn in another plane."""
        self.plane = self.chance.choice((18, 19))
        self.lines.append(f"G{self.plane}")
        if self.chance.random() < 0.4:
            self.lines.append(f"{self.chance.choice(('ROT', 'AROT'))} RPL={self.number(-40, 40)}")
            self.anew()
        for kind in self.chance.choices((self.arc, self.tangential, self.polar), k=2):
            kind()
        self.plane = 17
        self.lines.append("G17")
        self.anew()

    def subprogram(self) -> None:
        """A program with parameters, called once, behind the end of this one."""
        name, main = f"PART_{len(self.subprograms)}", self.lines
        self.lines = [f"%_N_{name}_SPF", f"PROC {name}(REAL WIDE, REAL HIGH)", "G1 X=IC(WIDE) Y=IC(-HIGH/2)"]
        for kind in self.chance.choices((self.straight, self.arc, self.tangential), k=2):
            kind()
        self.subprograms += [*self.lines, "M17"]
        self.lines = [*main, f"{name}({self.number(-6, 6)},{self.number(-6, 6)})"]

    def loop(self) -> None:
        """A loop that is executed once."""
        self.lines += ["R7=0", "WHILE R7<1", "G1 X=IC(R7+2) Y=AC(R7*3)", "R7=R7+1", "ENDWHILE"]

    def machine_position(self) -> None:
        """Up, in machine coordinates."""
        if not self.transformed and not self.swivelled:
            self.lines.append("SUPA G0 Z=AC(240)")
            self.anew()

    # -- what is in force ---------------------------------------------------------------------------------------------

    def frame(self) -> None:
        """A settable or programmable frame."""
        pick, number = self.chance.choice, self.number
        shift = f"X{number(-5, 5)} Y{number(-5, 5)} Z{number(-3, 3)}"
        angles = " ".join(
            f"{letter}{number(-25, 25)}" for letter in self.chance.sample("XYZ", self.chance.randint(1, 3))
        )
        factor = pick(("0.8", "1.1"))
        forms = [
            pick(("TRANS ", "ATRANS ")) + shift,
            pick(("ROT ", "AROT ")) + angles,
            f"{pick(('ROT', 'AROT'))} RPL={number(-60, 60)}",
            pick(("MIRROR ", "AMIRROR ")) + pick(("X0", "Y0", "X0 Y0")),
            f"{pick(('SCALE', 'ASCALE'))} X{factor} Y{factor} Z{factor}",
            pick(("G54", "G55", "G505")),
            "TRANS",
        ]
        self.lines.append(pick(forms))
        self.anew()

    def transformation(self) -> None:
        """TRAORI on or off."""
        if self.swivelled:
            return
        self.transformed = not self.transformed
        self.lines += ["TRANS", "TRAORI" if self.transformed else "TRAFOOF"]
        self.lines += ["ORIAXES"] * (self.transformed and self.chance.random() < 0.7)
        self.anew()

    def angles(self) -> None:
        """The direction of the tool by angles."""
        if not self.transformed:
            return
        words = " ".join(f"{name}={self.number(-35, 35)}" for name in ("A2", "B2", "C2"))
        self.lines += [self.chance.choice(("ORIEULER", "ORIRPY")), f"G1 X=AC({self.number()}) {words}"]

    def swivel(self) -> None:
        """A tilted plane, or out of it."""
        if self.transformed:
            return
        self.lines.append("TRANS")
        if self.swivelled:
            self.lines.append("CYCLE800()")
        else:
            shift, angles = ([self.number(-9, 9) for _ in "XYZ"], [self.number(-25, 25) for _ in "ABC"])
            places = ",".join([*shift, *angles, "0", "0", self.number(-2, 2)])
            mode, way = self.chance.choice(SWIVEL_MODES), self.chance.choice((-1, 1))
            self.lines.append(f'CYCLE800(0,"T",200000,{mode},{places},{way})')
        self.swivelled = not self.swivelled
        self.anew()

    def values(self) -> None:
        """Variables, expressions, a branch and a jump over nothing."""
        self.lines += [f"R2={self.number(2, 6)}", "G1 X=AC(R2*SIN(30)+3) Y=AC(-R2)"]
        self.lines += ["IF R2>4", "G1 X=IC(R2/2)", "ELSE", "G1 Y=IC(-R2)", "ENDIF"]

    def units(self) -> None:
        """Inches for a while, or diameters."""
        inches = ["G700", f"G1 X=AC({self.chance.uniform(-1, 1):.4f})", "G2 X=IC(0.2) Y=IC(0.2) I0.2 J0", "G710"]
        diameters = ["DIAMON", f"G1 X=AC({self.number()}) Y=AC({self.number()})", "G3 X=IC(4) Y=IC(2) I0 J2", "DIAMOF"]
        self.lines += self.chance.choice((inches, diameters))

    def tool(self) -> None:
        """Another tool."""
        self.lines.append(f"T{self.chance.choice((1, 2))} D1 M6")
        self.anew()

    def increments(self) -> None:
        """G91 or G90."""
        self.incremental = not self.incremental
        self.lines.append("G91" if self.incremental else "G90")


def patterned(seed: int) -> str:
    """A program with rows and circles of holes, in frames and planes of all kinds."""
    author = Author(seed)
    number, chance = author.number, author.chance
    for _ in range(4):
        author.incremental = False
        author.lines += [
            "G90",
            chance.choice(("TRANS", f"ROT RPL={number(-60, 60)}", "MIRROR X0", "SCALE X0.8 Y0.8 Z0.8")),
        ]
        author.lines += ["G0 X=AC(3) Y=AC(-4) Z=AC(40)", "MCALL CYCLE81(35,5,2,-4)"]
        for _ in range(chance.randint(1, 3)):
            count = chance.randint(1, 5)
            row = f"HOLES1({number(-9, 9)},{number(-9, 9)},{number(-180, 180)},{number(0, 5)},{number(2, 6)},{count})"
            step = chance.choice(("0", number(10, 60), number(-60, -10)))
            circle = f"HOLES2({number(-9, 9)},{number(-9, 9)},{number(4, 20)},{number(-180, 180)},{step},{count})"
            author.lines.append(chance.choice((row, circle)))
        author.lines += ["X=AC(5) Y=AC(6)", "MCALL", "G1 X=AC(8) Y=AC(-2)"]
    return "\n".join([*author.lines, "G0 Z60", "M30"]) + "\n"


def looped(seed: int) -> str:
    """A program with two loops, in which frames, ends and values change from turn to turn."""
    author = Author(seed)
    kinds = (author.straight, author.straight, author.arc, author.tangential, author.polar, author.values)

    def body() -> list[str]:
        author.lines = []
        for _ in range(author.chance.randint(2, 4)):
            author.chance.choice(kinds)()
        return author.lines

    first = ["FOR R9=1 TO 3", "TRANS X=R9*4 Y=-R9", "G0 X=AC(R9*2) Y=AC(3) Z=AC(20+R9)", *body(), "ENDFOR", "TRANS"]
    second = ["FOR R8=1 TO 2", "G1 X=AC(10*R8) Y=AC(5-R8*2) Z=AC(20)", *body(), "ENDFOR", "G0 Z60", "M30"]
    return "\n".join([*HEAD, *first, "G0 X=AC(1) Y=AC(2) Z=AC(30)", *second]) + "\n"
