"""Klartext path functions made into RS274, line for line, so that LinuxCNC's interpreter can say what they mean.

It shares nothing with the product: lines are taken apart by regular expressions, and the geometry is worked out anew.
Every position is written absolutely, centres from the start of the arc, nine decimals. Only what a contour needs is
known: L, LP, C, CR, CP, CT, CC, increments, FMAX, MM and INCH; anything else is an error.
"""

from __future__ import annotations

import cmath
import math
import re

import numpy as np

WORD = re.compile(r"(I?(?:PA|PR|[XYZBC])|F|R)\s*([+-]?[\d.,]+)(?=\s|$)")
PLANES = {"XY": (17, "IJ"), "YZ": (19, "JK"), "ZX": (18, "KI")}


def value(text: str) -> float:
    return float(text.replace(",", "."))


class Translator:
    """A tool that stands somewhere, a pole, a direction."""

    def __init__(self) -> None:
        self.at = dict.fromkeys("XYZBC", 0.0)
        self.pole = {"X": 0.0, "Y": 0.0}
        self.plane = "XY"
        self.heading: complex | None = None
        self.unit = "G21"

    def program(self, text: str) -> str:
        """A whole program."""
        return "\n".join(map(self.line, text.splitlines())) + "\n"

    def line(self, line: str) -> str:
        """One line."""
        line = re.sub(r"^\s*\d+(?=\s+[A-Z;])", "", line.split(";")[0]).strip()
        if not line:
            return ""
        if line.startswith("BEGIN PGM"):
            self.unit = "G20" if line.endswith("INCH") else "G21"
            return f"{self.unit} G90 G94 G54"
        if line.startswith("END PGM"):
            return "M2"
        name = line.split()[0]
        words = {address: value(number) for address, number in WORD.findall(line[len(name) :])}
        if name == "CC":
            self.set_pole(words)
            return "(pole)"
        return self.motion(name, words, line)

    def set_pole(self, words: dict[str, float]) -> None:
        named = {}
        for address, number in words.items():
            letter = address[-1]
            named[letter] = number + (self.at[letter] if address[0] == "I" else 0.0)
        if len(named) == 2:
            self.plane = next(plane for plane in PLANES if set(plane) == set(named))
        self.pole = {letter: named.get(letter, self.pole.get(letter, 0.0)) for letter in self.plane}

    def motion(self, name: str, words: dict[str, float], line: str) -> str:
        start = dict(self.at)
        for address, number in words.items():
            if address[-1] in self.at and len(address) <= 2 and address not in ("PA", "PR"):
                self.at[address[-1]] = number + (start[address[-1]] if address[0] == "I" and len(address) == 2 else 0.0)
        feed = f" F{words['F']:.6f}" if "F" in words else ""
        if name in ("LP", "CP"):
            self.polar(words, start)
        if name in ("L", "LP"):
            self.head(start)
            return f"{'G0' if 'FMAX' in line else 'G1'} {self.words()}{feed}"
        clockwise = "DR-" in line
        plane = self.plane if name in ("C", "CP") else self.plane_of(words)
        begin, end = self.flat(start, plane), self.flat(self.at, plane)
        if name in ("C", "CP"):
            centre = self.flat(self.pole, plane)
        elif name == "CR":
            centre = self.by_radius(begin, end, words["R"], clockwise)
        else:
            assert name == "CT", line
            centre, clockwise = self.tangential(begin, end)
        code, letters = PLANES[plane]
        turns = ""
        if "IPA" in words and abs(words["IPA"]) > 360:
            turns = f" P{math.ceil(abs(words['IPA']) / 360 - 1e-9)}"
        self.heading = (end - centre) * (-1j if clockwise else 1j) if plane == "XY" else None
        offset = centre - begin
        arc = f"{letters[0]}{offset.real:.9f} {letters[1]}{offset.imag:.9f}{turns}"
        return f"G{code} {'G2' if clockwise else 'G3'} {self.words()} {arc}{feed}"

    def words(self) -> str:
        return " ".join(f"{letter}{number:.9f}" for letter, number in self.at.items() if letter in "XYZ")

    def head(self, start: dict[str, float]) -> None:
        way = self.flat(self.at, "XY") - self.flat(start, "XY")
        if abs(way) > 0:
            self.heading = way

    def plane_of(self, words: dict[str, float]) -> str:
        named = {address[-1] for address in words if address[-1] in "XYZ"}
        return next((plane for plane in PLANES if set(plane) == named), "XY")

    @staticmethod
    def flat(position: dict[str, float], plane: str) -> complex:
        return complex(position[plane[0]], position[plane[1]])

    def polar(self, words: dict[str, float], start: dict[str, float]) -> None:
        spoke = self.flat(start, self.plane) - self.flat(self.pole, self.plane)
        radius, angle = abs(spoke), cmath.phase(spoke)
        radius = words.get("PR", radius) + words.get("IPR", 0.0)
        angle = math.radians(words["PA"]) if "PA" in words else angle + math.radians(words.get("IPA", 0.0))
        end = self.flat(self.pole, self.plane) + cmath.rect(radius, angle)
        self.at[self.plane[0]], self.at[self.plane[1]] = end.real, end.imag

    @staticmethod
    def by_radius(begin: complex, end: complex, radius: float, clockwise: bool) -> complex:
        """Of the two centres the one from which the shorter way (R > 0) has the right sense."""
        chord = end - begin
        height = math.sqrt(max(radius**2 - abs(chord) ** 2 / 4, 0.0))
        for side in (1j, -1j):
            centre = (begin + end) / 2 + side * height * chord / abs(chord)
            turn = cmath.phase((end - centre) / (begin - centre))
            way = -turn if clockwise else turn
            if (way % (2 * math.pi) <= math.pi + 1e-12) == (radius > 0):
                return centre
        raise AssertionError("one of the two centres fits")

    def tangential(self, begin: complex, end: complex) -> tuple[complex, bool]:
        assert self.heading is not None
        left = 1j * self.heading / abs(self.heading)
        chord = end - begin
        radius = abs(chord) ** 2 / (2 * (chord * left.conjugate()).real)
        return begin + radius * left, radius < 0


# -- programs at random -----------------------------------------------------------------------------------------------


def contour(seed: int, blocks: int = 24, comma: bool = False) -> str:
    """A program of all path functions, its numbers with three decimals."""
    dice = np.random.default_rng(seed)
    maker = Translator()
    lines = ["BEGIN PGM G MM", "L X+10 Y+5 Z+20 FMAX", "L Z-1 F500"]
    for line in lines:
        maker.line(line)
    for _ in range(blocks):
        for line in element(dice, maker):
            maker.line(line)
            lines.append(line)
    text = "\n".join([*lines, "L Z+50 FMAX", "END PGM G MM"]) + "\n"
    return text.replace(".", ",") if comma else text


def element(dice: np.random.Generator, maker: Translator) -> list[str]:
    """One contour element, with the pole it needs; it stays within 100 mm of the datum."""
    x, y, z = (maker.at[letter] for letter in "XYZ")
    to = dice.uniform(-90, 90, 2).round(3)
    choice = dice.choice(["l", "il", "fmax", "c", "cr", "cp", "helix", "lp", "ct", "zx", "circle"])
    sense = str(dice.choice(["DR+", "DR-"]))
    sign = 1 if sense == "DR+" else -1
    angle = round(float(dice.uniform(20, 340)), 3)
    radius = round(float(dice.uniform(5, 20)), 3)
    middle = complex(x, y) + cmath.rect(radius, float(dice.uniform(-3, 3)))
    middle = complex(round(middle.real, 3), round(middle.imag, 3))
    pole = f"CC X{middle.real:+.3f} Y{middle.imag:+.3f}"
    spoke = complex(x, y) - middle
    end = middle + spoke * cmath.exp(1j * sign * math.radians(angle))
    match choice:
        case "l":
            return [f"L X{to[0]:+.3f} Y{to[1]:+.3f} Z{dice.uniform(-5, 5):+.3f}"]
        case "il":
            return [f"L IX{(to[0] - x) / 3:+.3f} Y{to[1]:+.3f} F{dice.integers(100, 900)}"]
        case "fmax":
            return [f"L X{to[0]:+.3f} FMAX"]
        case "c":
            return [pole, f"C X{end.real:+.3f} Y{end.imag:+.3f} {sense}"]
        case "cr":
            size = abs(end - complex(x, y)) / 2 * 1.2 + 0.5
            return [f"CR X{end.real:+.3f} Y{end.imag:+.3f} R{size * (1 if angle < 180 else -1):+.3f} {sense}"]
        case "cp":
            return [pole, f"CP IPA{sign * angle:+.3f} {sense}"]
        case "helix":
            return [pole, f"CP IPA{sign * 2 * angle:+.3f} IZ{dice.uniform(-3, 3):+.3f} {sense}"]
        case "lp":
            return [pole, f"LP PR+{radius:.3f} PA{angle:+.3f}", f"LP IPA{angle / 5:+.3f}"]
        case "ct":
            return [f"L X{to[0]:+.3f} Y{to[1]:+.3f}", *tangent(dice, complex(*to) - complex(x, y), complex(*to))]
        case "zx":
            down = [f"CC X{x + radius:+.3f} Z{z:+.3f}", f"C X{2 * (x + radius) - x:+.3f} Z{z:+.3f} {sense}"]
            return down if abs(x) < 50 and round(x, 3) == x and round(z, 3) == z else []
    return [pole, f"C X{x:+.3f} Y{y:+.3f} {sense}"] if round(x, 3) == x and round(y, 3) == y else []


def tangent(dice: np.random.Generator, way: complex, at: complex) -> list[str]:
    """A CT that leaves the direction by less than 150 degrees; none after a line that is too short."""
    if abs(way) < 5:
        return []
    turn = float(dice.choice([-1, 1])) * float(dice.uniform(10, 70))
    end = at + 15 * way / abs(way) * cmath.exp(1j * math.radians(turn))
    return [f"CT X{end.real:+.3f} Y{end.imag:+.3f}"]
