"""Compositions as programs of the RS274 and Fanuc families."""

from __future__ import annotations

import random
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from metamorphic.composing import (
    FEED,
    PLANES,
    SECOND,
    SHORT,
    SPEED,
    Author,
    Frame,
    Vector,
    number,
    scaled,
    shifted,
    turned,
)
from metamorphic.harness import LENGTH

MACRO = ("fanuc", "haas", "mitsubishi")
LENGTHS = {1: LENGTH, 2: SHORT}


class IsoAuthor(Author):
    """Blocks of G codes; what a dialect has not is left out."""

    comment = "(here)"

    def begin(self) -> None:
        self.tool, self.fed, self.prefix, self.plane = 1, "", "", False
        self.rates, self.way, self.pointing, self.repeated = "G94", 0.0, False, False
        self.loops: list[int] = []
        self.second, self.kept = False, SECOND
        self.shift, self.local, self.rotation, self.mirror = Frame(), Frame(), Frame(), Frame()
        self.lines += ["%", "O1"] if self.dialect in MACRO else []
        self.lines += ["G21 G17 G40 G49 G80 G90 G94 S1000", "G54"]

    def finish(self) -> str:
        if self.dialect == "linuxcnc":
            return "\n".join([*self.behind, *self.lines, "M30"]) + "\n"
        return "\n".join([*self.lines, "M30", *self.behind, "%"]) + "\n"

    # -- words --------------------------------------------------------------------------------------------------------

    def mode(self, codes: str) -> None:
        """Codes on a line of their own, or in front of the next motion."""
        self.alone(codes)
        if self.often(0.3):
            self.prefix = self.lines.pop() + " "

    def alone(self, line: str, moves: bool = False) -> None:
        """A line that is no plain motion."""
        self.flush()
        self.put(line, moves)

    def flush(self) -> None:
        """The codes that wait for a motion."""
        if self.prefix:
            self.put(self.prefix.strip())
        self.prefix = ""

    def word(self, letter: str, value: float) -> str:
        """A word, sometimes computed."""
        text = number(value, 6)
        if self.dialect != "iso" and self.often(0.1):
            return f"{letter}[{number(value - 3.0, 6)}+3.]"
        if self.dialect != "iso" and self.often(0.1):
            name = f"#{100 + 'XYZABCR'.index(letter)}"
            self.put(f"{name}={text}")
            return letter + name
        return letter + text

    def motion(self, code: str, words: list[str]) -> None:
        """A motion block."""
        feed = self.feed()
        if code == "0" or (feed == self.fed and self.rates != "G93" and self.often(0.7)):
            feed = ""
        else:
            self.fed = feed
        if self.often(0.3):
            self.style.shuffle(words)
        parts = [*([] if code == self.code and self.often(0.6) else [f"G{code}"]), *words, *([feed] if feed else [])]
        if self.often(0.1):
            self.style.shuffle(parts)
        self.code = code
        self.put(self.prefix + (" " if not self.often(0.1) else "").join(parts), moves=True)
        self.prefix = ""

    rate = 1.0

    def feed(self) -> str:
        """F of 500 mm/min, as a rate of the way that is before the tool, or per revolution."""
        if self.rates == "G93":
            return f"F{number(FEED / (self.way or FEED), 8)}"
        return f"F{number(FEED / self.rate / (SPEED if self.rates == 'G95' else 1.0), 7)}"

    def minutes(self) -> None:
        """G94, if that is not in force."""
        if self.rates != "G94":
            self.feeds(self.style)

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
        vector = self.directed(target, values)
        words = [*(self.word(letter, value) for letter, value in values.items()), *vector]
        if polar and self.dialect == "linuxcnc":
            words = [{"X": "@", "Y": "^"}.get(word[0], word[0]) + word[1:] for word in words]
            polar = False
        if polar:
            self.alone("G16")
        self.q = target
        self.motion(code, [*words, *(extra or [])])
        if polar:
            self.alone("G15")
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
        for n in range(chance.randint(1, 3)):
            where = self.somewhere(chance)
            depth[:2] = level[:2] = home[:2] = where[:2]
            there, top = self.place(depth)[:3] / self.unit, self.place(level)[2] / self.unit
            words = [self.word("XYZ"[k], there[k]) for k in range(2)]
            if n == 0 or not self.often(0.7):
                words += [self.word("Z", there[2]), self.word("R", top)]
            self.motion("81", [*([back] if n == 0 else []), *words])
        self.q = home if back == "G98" else level.copy()
        self.alone("G80")
        self.code, self.fed = "", ""
        self.unsaid |= {"Z"}

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

    # -- rewrites -----------------------------------------------------------------------------------------------------

    def absolute(self) -> None:
        """G90, if that is not in force."""
        if self.steps:
            self.steps = False
            self.mode("G90")

    def increments(self, chance: random.Random) -> None:
        if self.steps:
            self.absolute()
        else:
            self.mode("G91")
            self.steps = True

    def feeds(self, chance: random.Random) -> None:
        """F by the time that a motion takes, or per revolution, or per minute again."""
        if not self.rotary:
            self.rates = "G94" if self.rates != "G94" else chance.choice(["G93", "G95"])
            self.mode(self.rates)
            self.fed = ""

    diameter = False

    def units(self, chance: random.Random) -> None:
        self.unit = self.rate = 25.4 if self.unit == 1.0 else 1.0
        (self.alone if self.dialect in ("iso", "linuxcnc") else self.mode)("G21" if self.unit == 1.0 else "G20")
        self.fed = ""

    def table(self, chance: random.Random) -> None:
        """G10: the work offset in force becomes another one."""
        if self.plain_frame() and not self.steps and not self.tcp and self.dialect != "haas":
            self.offset = dict(self.offset) | {a: round(self.offset[a] + chance.uniform(-5, 5), 2) for a in "XYZ"}
            by_place = self.dialect == "linuxcnc" and not self.unsaid and chance.random() < 0.5
            shown = self.place(self.q) if by_place else [self.offset[a] for a in "XYZ"]
            words = " ".join(f"{a}{number(v / self.unit, 6)}" for a, v in zip("XYZ", shown, strict=False))
            self.alone(f"G10 L{20 if by_place else 2} P{2 if self.second else 1} {words}")
            self.unsaid = set(self.letters)

    def compose(self) -> None:
        """The frame that its parts make."""
        self.frame = self.shift @ self.local @ self.rotation @ self.mirror
        if self.dialect == "linuxcnc":
            self.frame = self.rotation @ self.shift @ self.local

    def plain_frame(self) -> bool:
        """Neither turned nor mirrored."""
        return not (self.rotation.turn - np.eye(3)).any() and not (self.mirror.turn - np.eye(3)).any()

    def zero(self, chance: random.Random) -> None:
        """G52."""
        if self.plain_frame() and not self.steps and not self.plane:
            self.local = shifted(*(round(chance.uniform(-20, 20), 2) for _ in range(3)))
            if self.dialect == "linuxcnc":
                self.shift = Frame()
                self.unsaid |= set("XYZ")
            x, y, z = self.local.shift / self.unit
            self.alone(f"G52 X{number(x, 6)} Y{number(y, 6)} Z{number(z, 6)}")
            self.compose()

    def preset(self, chance: random.Random) -> None:
        """G92 where the tool stands."""
        if self.plain_frame() and not self.steps and not self.unsaid and not self.plane:
            said = np.array([round(chance.uniform(-20, 20), 2) for _ in range(3)])
            here = self.place(self.q)[:3]
            self.shift, self.local = shifted(*(self.frame.shift + here - said)), Frame()
            x, y, z = said / self.unit
            self.alone(f"G92 X{number(x, 6)} Y{number(y, 6)} Z{number(z, 6)}")
            self.compose()

    def offsets(self, chance: random.Random) -> None:
        """The other work offset."""
        if self.plain_frame() and not self.steps and not self.tcp:
            self.offset, self.kept, self.second = self.kept, self.offset, not self.second
            self.mode("G55" if self.second else "G54")
            self.unsaid = set(self.letters)

    def rotate(self, chance: random.Random) -> None:
        """G68, off or on."""
        if self.dialect == "iso" or self.steps or self.tcp:
            return
        off = (self.rotation.turn - np.eye(3)).any()
        if self.dialect == "linuxcnc":
            if (self.shift @ self.local).shift.any():
                return
            askew = 90.0 if self.exact else round(chance.uniform(-180, 180), 2)
            angle = 0.0 if off else chance.choice([90.0, 180.0, askew])
            self.rotation = turned("Z", angle)
            self.alone(f"G10 L2 P{2 if self.second else 1} R{angle}")
        elif off:
            self.rotation = Frame()
            self.mode("G69")
        else:
            centre = np.array([*(round(chance.uniform(-10, 10), 2) for _ in range(2)), 0.0])
            if (self.mirror.turn - np.eye(3)).any():
                return
            angle = chance.choice([90.0, -90.0, 180.0, 90.0 if self.exact else round(chance.uniform(-180, 180), 2)])
            self.rotation = turned("Z", angle, centre)
            x, y, _ = centre / self.unit
            self.alone(f"G68 X{number(x, 6)} Y{number(y, 6)} R{number(angle, 3)}")
        self.unsaid |= set("XY")
        self.compose()

    def reflect(self, chance: random.Random) -> None:
        """A mirror image, off or on."""
        if self.dialect not in ("fanuc", "mitsubishi") or self.steps or self.tcp:
            return
        if (self.rotation.turn - np.eye(3)).any():
            return
        if (self.mirror.turn - np.eye(3)).any():
            self.mirror = Frame()
            self.alone("G50.1 X0. Y0.")
        else:
            n, at = chance.randrange(2), round(chance.uniform(-10, 10), 2)
            factors, by = [1.0, 1.0, 1.0], [0.0, 0.0, 0.0]
            factors[n], by[n] = -1.0, 2 * at
            self.mirror = shifted(*by) @ scaled(*factors)
            self.alone(f"G51.1 {'XY'[n]}{number(at / self.unit, 6)}")
        self.compose()

    def lengths(self, chance: random.Random) -> None:
        """A length offset, on or off."""
        if self.tcp or self.steps:
            return
        self.length = 0.0 if self.length else LENGTHS[self.tool]
        self.mode("G49" if not self.length else f"G43 H{self.tool}")
        self.unsaid |= set("Z")

    def tip(self, chance: random.Random) -> None:
        """Tool-centre-point control, on or off."""
        if self.dialect not in MACRO or self.steps or not self.plain_frame() or self.plane or not self.rotary:
            return
        if not self.tcp and self.second:
            return
        self.tcp, code = not self.tcp, "G49"
        self.length = LENGTHS[self.tool] if self.tcp else 0.0
        if self.tcp:
            code = "G234" if self.dialect == "haas" else chance.choice(["G43.4", "G43.5"])
        self.pointing = code == "G43.5"
        self.alone(f"{code} H{self.tool}" if self.tcp else code)
        self.unsaid = set(self.letters)

    def may_swivel(self) -> bool:
        if self.dialect not in ("fanuc", "mitsubishi") or not self.plain_frame() or self.second:
            return False
        self.absolute()
        self.upright()
        if not self.length:
            self.lengths(self.style)
        return True

    def swivel(self, plane: Frame, target: Vector) -> None:
        angles = Rotation.from_matrix(plane.turn).as_euler("ZXZ", degrees=True)
        words = zip("XYZIJK", [*(plane.shift / self.unit), *angles], strict=True)
        self.alone("G68.2 " + " ".join(f"{letter}{number(value, 9)}" for letter, value in words))
        self.alone("G53.1", moves=True)
        self.plane, self.tcp, self.rotation = True, True, plane
        self.compose()

    def unswivel(self) -> None:
        self.absolute()
        self.tilted(self.style)

    def travel(self, target: Vector, *, rapid: bool) -> None:
        self.go("0" if rapid else "1", target)

    def tilted(self, chance: random.Random) -> None:
        """A tilted plane, on or off."""
        if self.dialect not in ("fanuc", "mitsubishi") or self.steps or not self.rotary:
            return
        if self.plane:
            self.plane = self.tcp = False
            self.rotation = Frame()
            self.mode("G69")
        elif self.tcp or not self.plain_frame() or self.second:
            return
        else:
            if not self.length:
                self.lengths(chance)
            self.plane = self.tcp = True
            origin = [round(chance.uniform(-10, 10), 2) for _ in range(3)]
            angles = [round(chance.uniform(-60, 60), 1) for _ in range(3)]
            turn = turned("Z", angles[0]) @ turned("X", angles[1]) @ turned("Z", angles[2])
            self.rotation = shifted(*origin) @ turn
            words = zip("XYZIJK", [*(each / self.unit for each in origin), *angles], strict=True)
            self.alone("G68.2 " + " ".join(f"{letter}{number(value, 6)}" for letter, value in words))
        self.unsaid = set(self.letters)
        self.compose()

    def jump(self, chance: random.Random) -> None:
        """Blocks that the program never goes through."""
        name = 9000 + next(self.names)
        if self.dialect in MACRO:
            self.alone(f"GOTO{name}")
            self.put(f"G1 X{chance.randint(-9, 9)}. Z5. F90.")
            self.put(f"N{name}")
        elif self.dialect == "linuxcnc":
            self.alone(f"o{name} if [1 EQ 0]")
            self.put(f"G1 X{chance.randint(-9, 9)} Z5 F90")
            self.put(f"o{name} endif")

    def loop(self, chance: random.Random) -> None:
        """A loop that is gone through once."""
        name = next(self.names)
        if self.dialect in MACRO and len(self.open) < 3:
            self.alone(f"#{130 + name}=0")
            level = 1 + sum(1 for _ in self.loops)
            self.loops.append(level)
            self.put(f"WHILE[#{130 + name}LT1]DO{level}")

            def close() -> None:
                self.loops.pop()
                self.alone(f"#{130 + name}=#{130 + name}+1")
                self.put(f"END{level}")

            self.wrap(chance, close)
        elif self.dialect == "linuxcnc":
            self.alone(f"#<l{name}>=0")
            self.put(f"o{9000 + name} while [#<l{name}> LT 1]")

            def end() -> None:
                self.alone(f"#<l{name}>=[#<l{name}>+1]")
                self.put(f"o{9000 + name} endwhile")

            self.wrap(chance, end)

    def call(self, chance: random.Random) -> None:
        """A subprogram that is called once."""
        name, outer, loops = next(self.names), self.lines, self.loops
        if self.dialect == "iso":
            return
        self.alone(
            f"o{7000 + name} call"
            if self.dialect == "linuxcnc"
            else f"{chance.choice(['M98 P', 'G65 P'])}{7000 + name}"
        )
        self.lines, self.loops = [], []

        def close() -> None:
            self.alone("(end)")
            body, self.lines, self.loops = self.lines, outer, loops
            self.behind += self.subprogram(name, body)

        self.wrap(chance, close)

    def skip(self, chance: random.Random) -> None:
        """A block with a slash."""
        if self.setup.block_skip is True:
            self.alone(self.comment)
            self.put(f"/G1 X{chance.randint(-9, 9)}. Z5. F90.")
        else:
            self.alone(self.comment)
            self.put("/M8")

    EVENTS: ClassVar[dict[str, float]] = {
        "line": 6, "rapid": 2, "arc": 3, "hole": 2, "machine_place": 0.5, "reference": 0.5, "other_tool": 0.5,
        "dwell": 0.3, "contour": 0.7, "twice": 0.7, "corner": 0.7, "tangent": 0.7, "macro": 0.7, "swivelled": 2,
    }  # fmt: skip
    REWRITES: ClassVar[dict[str, float]] = {
        "increments": 3, "units": 2, "feeds": 1, "zero": 2, "preset": 1, "offsets": 1, "rotate": 2, "reflect": 1,
        "lengths": 2, "tip": 2, "tilted": 2, "jump": 1, "loop": 1, "call": 1, "skip": 1, "table": 1,
    }  # fmt: skip
