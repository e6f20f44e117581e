"""Compositions as programs of the RS274 and Fanuc families: what the path is made of."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from metamorphic.composing import FEED, PLANES, Vector, number, turned
from metamorphic.iso_modes import MACRO, IsoModes


class IsoAuthor(IsoModes):
    """Motions, holes, contours and calls."""

    # -- words --------------------------------------------------------------------------------------------------------

    def directed(self, target: Vector, values: dict[str, float]) -> list[str]:
        """The words of rotary axes, or of the direction to which they turn the tool, taken out of a motion's."""
        names = self.letters[3:]
        pointed = self.pointed(target) if self.pointing and set(names) & set(values) else None
        for name in names if pointed is not None else ():
            values.pop(name, None)
        return [] if pointed is None else [f"{a}{number(v, 9)}" for a, v in zip("IJK", pointed, strict=True)]

    def go(self, code: str, target: Vector, extra: list[str] | None = None) -> None:
        """A motion to a place; increments begin where the program has said where the axes stand."""
        turns = (target[3:] != self.q[3:]).any() or self.unsaid & set(self.letters[3:])
        if self.pointing and turns and self.pointed(target) is None:
            self.absolute()
            self.tip(self.style)
        if code in ("0", "1"):
            self.way = float(np.linalg.norm((target - self.q)[:3]))
        steps = self.steps and bool(self.unsaid)
        if steps:
            self.absolute()
        there, values = self.place(target), self.values(target)
        across = there[:2] / self.unit
        polar = (
            not extra and not self.steps and not self.exact and {"X", "Y"} <= set(values) and np.hypot(*across) > 1.0
        )
        polar = polar and self.flat and self.dialect in (*MACRO, "linuxcnc") and code in ("0", "1") and self.often(0.15)
        if polar:
            values |= {"X": float(np.hypot(*across)), "Y": float(np.degrees(np.arctan2(across[1], across[0])))}
        halved = (
            not (extra or polar or self.exact or self.tcp or self.pointing)
            and self.plain_frame()
            and code in ("0", "1")
        )
        halved = halved and self.flat and self.dialect in MACRO and not self.steps and self.often(0.1)
        if halved:
            values |= {letter: value / 2.0 for letter, value in values.items() if letter in "XYZ"}
        vector = self.directed(target, values)
        words = [*(self.word(letter, value) for letter, value in values.items()), *vector]
        if polar and self.dialect == "linuxcnc":
            words = [{"X": "@", "Y": "^"}.get(word[0], word[0]) + word[1:] for word in words]
            polar = False
        if polar or halved:
            self.alone("G16" if polar else "G51 X0. Y0. Z0. P2.")
        self.q = target
        self.motion(code, [*words, *(extra or [])])
        if polar or halved:
            self.alone("G15" if polar else "G50")
        if steps:
            self.increments(self.style)

    # -- events -------------------------------------------------------------------------------------------------------

    def line(self, chance: random.Random) -> None:
        self.go("1", self.somewhere(chance, turns=self.rotary))

    def rapid(self, chance: random.Random) -> None:
        self.go("0", self.somewhere(chance, turns=self.rotary))

    def arc(self, chance: random.Random) -> None:
        """A rapid to where it begins, and an arc or a helix in one of the planes."""
        begin, across = self.somewhere(chance), chance.choice("ZZZYX")
        begin[2] = min(begin[2], 260.0)
        self.go("0", begin)
        if across != "Z":
            self.square_up()
            self.mode({"Y": "G18", "X": "G19"}[across])
        self.round(*self.bow(chance, across)[:3], across)
        if across != "Z":
            self.mode("G17")

    def square_up(self) -> None:
        """No turned frame."""
        if (self.rotation.turn - np.eye(3)).any():
            self.absolute()
            self.rotate(self.style)

    def round(self, target: Vector, centre: Vector, sweep: float, across: str = "Z", tangent: bool = False) -> None:
        """An arc; `tangent`: it goes on in the direction of the motion before it."""
        plane = PLANES[across]
        right = (sweep > 0) == (np.linalg.det(self.frame.turn[np.ix_(plane, plane)]) > 0)
        middle = np.linalg.solve(self.frame.turn, centre - self.q[:3]) / self.unit
        self.way = float(np.linalg.norm((centre - self.q[:3])[plane]) * abs(sweep))
        code, words = self.circle(right, middle, target, sweep, plane, tangent)
        absolute = self.dialect == "linuxcnc" and self.often(0.2)
        if absolute:
            self.alone("G90.1")
            centre = middle + self.place(self.q)[:3] / self.unit
            words = [f"{'IJK'[n]}{number(centre[n], 6)}" for n in plane]
        self.go(code, target, words)
        if absolute:
            self.alone("G91.1")

    def circle(
        self, right: bool, middle: Vector, target: Vector, sweep: float, plane: list[int], tangent: bool
    ) -> tuple[str, list[str]]:
        """Code and words of an arc; `middle` (3,): from where it starts to its centre."""
        words = [f"{'IJK'[n]}{number(middle[n], 6)}" for n in plane]
        if self.often(0.3):
            words = [f"R{number(np.linalg.norm(middle[plane]) * (1 if abs(sweep) < np.pi else -1), 7)}"]
        return "3" if right else "2", words

    def corner(self, chance: random.Random) -> None:
        """Two lines with a rounding or a chamfer between them."""
        self.go("0", self.somewhere(chance))
        first, last, _, _ = self.legs(chance)
        size, wild = number(2.0 / self.unit / abs(self.frame.turn[2, 2]), 6), self.wild
        self.wild = False
        self.go("1", first, self.rounded(chance, size))
        self.go("1", last)
        self.wild = wild

    def rounded(self, chance: random.Random, size: str) -> list[str]:
        """The word of a corner."""
        return [f",{chance.choice('RC')}{size}"] if self.dialect in MACRO else []

    def tangent(self, chance: random.Random) -> None:
        """A line, and an arc that goes on in its direction."""
        self.go("0", self.somewhere(chance))
        first, _, centre, sweep = self.legs(chance)
        self.go("1", first)
        target = first.copy()
        target[:3] = centre + turned("Z", np.degrees(sweep)).turn @ (first[:3] - centre)
        self.round(target.round(6), centre, sweep, tangent=True)

    def hole(self, chance: random.Random) -> None:
        """Some holes of one cycle."""
        self.go("0", self.somewhere(chance))
        self.minutes()
        if self.steps:
            self.steps = False
            self.alone("G90")
        home, depth = self.q.copy(), self.q.copy()
        back = chance.choice(["G98", "G99"]) if self.dialect != "iso" else "G98"
        depth[2] -= chance.uniform(5, 20)
        level = self.q.copy()
        level[2] -= 2.0
        code, more = chance.choice(self.CYCLES if self.dialect != "siemens" else self.CYCLES[:1])
        for n in range(chance.randint(1, 3)):
            where = self.somewhere(chance)
            depth[:2] = level[:2] = home[:2] = where[:2]
            there, top = self.place(depth)[:3] / self.unit, self.place(level)[2] / self.unit
            words = [self.word("XYZ"[k], there[k]) for k in range(2)]
            if n == 0 or not self.often(0.7):
                words += [self.word("Z", there[2]), self.word("R", top)]
            if more == "P":
                words.append("P0.5" if self.dialect == "linuxcnc" else "P500")
            elif more == "Q":
                words.append(f"Q{number(2.0 / self.unit, 6)}")
            self.motion(code, [*([back] if n == 0 else []), *words])
        if chance.random() < 0.3:
            step = np.array([chance.uniform(-6, 6), chance.uniform(-6, 6)]).round(2)
            self.row(code, [(depth[:2] + k * step).round(6) for k in (1, 2)], depth)
            level[:2] = home[:2] = depth[:2]
        self.q = home if back == "G98" else level.copy()
        self.alone("G80")
        self.code, self.fed = "", ""
        self.unsaid |= {"Z"}

    def row(self, code: str, holes: Sequence[Vector], depth: Vector) -> None:
        """Holes at equal steps from where one was drilled, down to a depth; sometimes repeats of one block in G91."""
        before = self.place(depth)
        for where in holes:
            depth[:2] = where
            if not (self.wild and self.flat and self.dialect in MACRO):
                self.motion(
                    code,
                    [
                        f"{letter}{number(v, 6)}"
                        for letter, v in zip("XY", self.place(depth)[:2] / self.unit, strict=True)
                    ],
                )
        if self.wild and self.flat and self.dialect in MACRO:
            step = (self.place(depth) - before)[:2] / len(holes) / self.unit
            repeats = f"{'L' if self.dialect == 'haas' else 'K'}{len(holes)}"
            self.alone("G91")
            self.motion(code, [f"X{number(step[0], 7)}", f"Y{number(step[1], 7)}", repeats])
            self.alone("G90")

    def pecked(self, chance: random.Random) -> None:
        """Down and up again at some places; sometimes by a macro that is called behind every motion."""
        self.minutes()
        self.absolute()
        places, down = [self.somewhere(chance) for _ in range(2)], round(chance.uniform(2, 5), 2)
        called = self.wild and self.flat and self.dialect in MACRO
        if called:
            name, rate = next(self.names), number(FEED / self.rate, 6)
            lines = ["G91", "G1 Z-[#26] F#9", "Z#26", "G90"]
            self.alone(f"G66 P{7000 + name} Z{number(down / self.unit, 6)} F{rate}")
            self.behind += self.subprogram(name, lines)
        for place in places:
            self.go("1", place)
            below = place - np.array([0.0, 0.0, down, 0.0, 0.0])
            for each in () if called else (below, place):
                self.go("1", each)
            if called:
                self.code, self.fed = "", ""
        if called:
            self.alone("G67")

    CYCLES = (("81", ""), ("82", "P"), ("83", "Q"), ("73", "Q"), ("85", ""), ("89", "P"))
    """Codes of cycles, and what they need besides."""

    def contour(self, chance: random.Random) -> None:
        """Lines with cutter radius compensation, turning to the right of the tool all the time."""
        self.go("0", self.somewhere(chance))
        centre, radius, side = self.q[:2].copy(), chance.uniform(20, 30), chance.choice(["G41", "G42"])
        angles = np.sort([chance.uniform(0, 2 * np.pi) for _ in range(3)])[:: -1 if side == "G41" else 1]
        if np.linalg.det(self.frame.turn[:2, :2]) < 0:
            side = {"G41": "G42", "G42": "G41"}[side]
        for n, angle in enumerate(angles):
            target = self.q.copy()
            target[:2] = (centre + radius * np.array([np.cos(angle), np.sin(angle)])).round(3)
            if n == 0:
                self.alone(f"{side} D{self.tool}" if self.dialect != "siemens" else side)
            self.go("1", target)
        self.alone("G40")
        self.go("1", self.q + np.array([0.0, 0.0, 5.0, 0.0, 0.0]))
        self.unsaid = set(self.letters)

    def twice(self, chance: random.Random) -> None:
        """A stretch, or steps, gone through twice, sometimes as a subprogram with repeats."""
        steps, relative = self.steps, chance.random() < 0.3
        places = [self.somewhere(chance, turns=self.rotary) for _ in range(2)]
        self.minutes()
        self.absolute()
        rounds = [places, places]
        if relative:
            self.upright()
            self.go("0", self.q)
            by = [(0.1 * (place - self.q)).round(3) for place in places]
            rounds = [[self.q + n * sum(by) + by[0], self.q + (n + 1) * sum(by)] for n in range(2)]
        calls = self.often(0.7) and self.dialect != "iso"
        if calls:
            if relative:
                self.increments(self.style)
            self.flush()
            self.repeated = relative
            outer, loops = self.lines, self.loops
            self.lines, self.loops, self.code, self.fed = [], [], "", ""
        for each in rounds[0] if calls else [*rounds[0], *rounds[1]]:
            if not relative:
                self.unsaid = set(self.letters)
            self.go("1", each)
        if calls:
            body, self.lines, self.loops = self.lines, outer, loops
            self.put_twice(next(self.names), body)
            self.repeated = False
        self.q = rounds[1][-1]
        if steps != self.steps:
            self.increments(self.style)

    def upright(self) -> None:
        """No control of the tip, nor a tilted plane."""
        if self.tcp:
            self.absolute()
            (self.tilted if self.plane else self.tip)(self.style)

    def put_twice(self, name: int, body: list[str]) -> None:
        """A stretch that is gone through twice."""
        if self.dialect == "linuxcnc":
            call = f"o{7000 + name} call\no{7000 + name} call"
        else:
            call = self.style.choice([f"M98 P{7000 + name} L2", f"M98 P2{7000 + name}"])
        self.put(call)
        self.behind += self.subprogram(name, body)

    def macro(self, chance: random.Random) -> None:
        """Two lines, sometimes by macros that get their ends."""
        places = [self.somewhere(chance) for _ in range(2)]
        self.go("0", self.q)
        if not self.wild or self.steps or self.dialect == "iso":
            for each in places:
                self.go("1", each)
            return
        self.minutes()
        name = 0
        for self.q in places:
            ends = self.place(self.q)[:3] / self.unit * ((2.0 if self.diameter else 1.0), 1.0, 1.0)
            if not (self.flat and name):
                name = next(self.names)
                self.defined(name)
            self.alone(self.given(name, [number(each, 6) for each in (*ends, FEED / self.rate)]))
        self.code, self.fed = "", ""

    def defined(self, name: int) -> None:
        """A macro that makes a line."""
        x, y, z, rate = (1, 2, 3, 4) if self.dialect == "linuxcnc" else (24, 25, 26, 9)
        line = f"G1 X#{x} Y#{y} Z#{z} F#{rate}"
        self.behind += self.subprogram(name, [line])
        self.moving.add(line)

    def given(self, name: int, values: list[str]) -> str:
        """Its call."""
        if self.dialect == "linuxcnc":
            return f"o{7000 + name} call " + " ".join(f"[{value}]" for value in values)
        return f"G65 P{7000 + name} " + " ".join(map("{}{}".format, "XYZF", values))

    def subprogram(self, name: int, body: list[str]) -> list[str]:
        if self.dialect == "linuxcnc":
            return [f"o{7000 + name} sub", *body, f"o{7000 + name} endsub"]
        return [f"O{7000 + name}", *body, "M99"]

    def machine_place(self, chance: random.Random) -> None:
        """A retraction in machine coordinates."""
        self.absolute()
        self.alone(f"G53 G0 Z{number(290.0 / self.unit, 6)}", moves=True)
        self.code, self.q[2] = "0", 290.0
        self.unsaid |= set(self.letters)

    def reference(self, chance: random.Random) -> None:
        """A retraction to the reference point, which ends a tool length of Haas."""
        if self.dialect == "haas":
            self.upright()
        if self.often(0.5) or self.steps:
            self.alone("G91 G28 Z0." if not self.steps or self.often(0.5) else "G28 Z0.", moves=True)
            self.mode("G90")
            self.steps = False
        else:
            self.alone("G91 G28 Z0.", moves=True)
            self.alone("G90")
        self.q[2], self.code = 290.0, ""
        if self.dialect == "haas":
            self.length = 0.0
        self.unsaid |= set(self.letters)

    def other_tool(self, chance: random.Random) -> None:
        """The other tool, with no length in force."""
        self.absolute()
        self.upright()
        self.tool = 3 - self.tool
        self.length = 0.0
        self.alone("G49")
        self.alone(f"T{self.tool} M6")
        self.unsaid, self.code = set(self.letters), ""

    def dwell(self, chance: random.Random) -> None:
        self.alone(f"G4 P{0.5 if self.dialect == 'linuxcnc' else 500}")
        self.code = "" if self.dialect == "iso" else self.code

    EVENTS: ClassVar[dict[str, float]] = {
        "line": 6, "rapid": 2, "arc": 3, "hole": 2, "machine_place": 0.5, "reference": 0.5, "other_tool": 0.5,
        "dwell": 0.3, "contour": 0.7, "twice": 0.7, "corner": 0.7, "tangent": 0.7, "macro": 0.7, "swivelled": 2,
        "pecked": 0.7,
    }  # fmt: skip
