"""How the RS274 and Fanuc families say it: words, modes and frames of compositions."""

from __future__ import annotations

import random
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from metamorphic.composing import (
    FEED,
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
EXTENDED = 7
"""P of an additional work offset."""


class IsoModes(Author):
    """Blocks of G codes, and what is in force; what a dialect has not is left out."""

    comment = "(here)"

    def begin(self) -> None:
        self.tool, self.fed, self.prefix, self.plane = 1, "", "", False
        self.rates, self.way, self.pointing, self.repeated = "G94", 0.0, False, False
        self.loops: list[int] = []
        self.second, self.kept, self.extended, self.stated, self.led = False, SECOND, False, False, False
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
            asked = "IF[2GT1]THEN " if self.dialect in MACRO and self.often(0.3) else ""
            self.put(f"{asked}{name}={text}")
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
        words += self.vacant(words)
        head = self.computed(code)
        parts = [*([] if code == self.code and self.often(0.6) else [head]), *words, *([feed] if feed else [])]
        if self.often(0.1):
            self.style.shuffle(parts)
        self.code = code
        self.put(self.prefix + (" " if not self.often(0.1) else "").join(parts), moves=True)
        self.prefix = ""

    def vacant(self, words: list[str]) -> list[str]:
        """A word that counts as not written, because its variable has no value."""
        left = [letter for letter in "XYZ" if not any(letter in word for word in words)]
        return [f"{left[0]}#0"] if self.dialect in MACRO and left and self.often(0.1) else []

    def computed(self, code: str) -> str:
        """A motion code, sometimes from a variable."""
        if self.dialect == "iso" or not self.often(0.05):
            return f"G{code}"
        self.put(f"#110={code}")
        return "G#110"

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
            if self.second and self.extended:
                self.alone(f"G10 L20 P{EXTENDED} {words}")
            elif self.dialect in MACRO and self.often(0.3):
                first = 5241 if self.second else 5221
                for n in range(3):
                    self.put(f"#{first + n}={number(shown[n] / self.unit, 6)}")
            else:
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
            self.state_local()
            self.compose()

    def state_local(self) -> None:
        """G52 as it is in force; some controls have one for each work offset."""
        self.stated = True
        x, y, z = self.local.shift / self.unit
        self.alone(f"G52 X{number(x, 6)} Y{number(y, 6)} Z{number(z, 6)}")

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
            if self.second and self.kept_as_given() and self.dialect in MACRO:
                self.extended = self.often(0.5)
                self.set_extended()
            extended = f"G{154 if self.dialect == 'haas' else 54.1} P{EXTENDED}"
            if self.second and self.extended and self.dialect != "haas" and self.often(0.3):
                self.alone(f"G54 P{EXTENDED}")
            else:
                self.mode((extended if self.extended else "G55") if self.second else "G54")
            self.unsaid = set(self.letters)
            if self.stated and self.dialect in ("iso", "mitsubishi"):
                self.state_local()

    def set_extended(self) -> None:
        """The other work offset as an additional one, some axes after the others."""
        words = [f"{a}{number(self.offset[a] / (self.unit if a in 'XYZ' else 1.0), 6)}" for a in self.letters]
        for part in (words[:2], words[2:]) if self.extended else ():
            self.alone(f"G10 L20 P{EXTENDED} {' '.join(part)}")

    def kept_as_given(self) -> bool:
        """Whether the other work offset is that of the setup."""
        return self.offset is SECOND

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
        if self.dialect not in MACRO or self.steps or self.tcp:
            return
        if (self.rotation.turn - np.eye(3)).any():
            return
        haas = self.dialect == "haas"
        if (self.mirror.turn - np.eye(3)).any():
            self.mirror = Frame()
            self.alone("G100 X0. Y0." if haas else "G50.1 X0. Y0.")
        else:
            n, at = chance.randrange(2), 0.0 if haas else round(chance.uniform(-10, 10), 2)
            factors, by = [1.0, 1.0, 1.0], [0.0, 0.0, 0.0]
            factors[n], by[n] = -1.0, 2 * at
            self.mirror = shifted(*by) @ scaled(*factors)
            self.alone(f"{'G101' if haas else 'G51.1'} {'XY'[n]}{number(at / self.unit, 6)}")
        self.compose()

    def lengths(self, chance: random.Random) -> None:
        """A length offset, on or off."""
        if self.tcp or self.steps:
            return
        on = not self.length
        self.length = LENGTHS[self.tool] if on else 0.0
        if on and self.dialect in MACRO and self.often(0.3):
            self.mode(f"G43 H{self.measured()}")
        elif not on and self.dialect in MACRO and self.often(0.3):
            self.mode("H0")
        else:
            self.mode(f"G43 H{self.tool}" if on else "G49")
        self.unsaid |= set("Z")

    def measured(self) -> int:
        """A register into which the program puts the length of the tool."""
        register, length = 10 + self.tool, number(self.length / self.unit, 6)
        if self.steps or self.often(0.5):
            self.alone(f"#{11000 + register}={length}")
        else:
            self.alone(f"G10 L10 P{register} R{length}")
        return register

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
        if self.dialect not in MACRO or not self.plain_frame() or self.second:
            return False
        self.absolute()
        self.upright()
        if not self.length:
            self.lengths(self.style)
        return True

    def swivel(self, plane: Frame, target: Vector) -> None:
        if self.dialect == "haas":
            plane = Frame(self.posture(target))
            self.travel(target, rapid=True)
            self.alone("G254")
        else:
            self.swivel_plane(plane, target)
        self.plane, self.tcp, self.rotation = True, True, plane
        self.compose()

    def swivel_plane(self, plane: Frame, target: Vector) -> None:
        """G68.2, and the turn to it."""
        angles = Rotation.from_matrix(plane.turn).as_euler("ZXZ", degrees=True)
        words = zip("XYZIJK", [*(plane.shift / self.unit), *angles], strict=True)
        self.alone("G68.2 " + " ".join(f"{letter}{number(value, 9)}" for letter, value in words))
        if self.often(0.5):
            angles = target[3:] - [self.offset[letter] for letter in self.letters[3:]]
            turns = zip(self.letters[3:], angles, strict=True)
            self.alone("G0 " + " ".join(f"{letter}{number(value, 6)}" for letter, value in turns), moves=True)
            self.code = "0"
        else:
            self.alone("G53.1", moves=True)

    def unswivel(self) -> None:
        self.absolute()
        self.tilted(self.style)

    def travel(self, target: Vector, *, rapid: bool) -> None:
        self.go("0" if rapid else "1", target)

    def tilted(self, chance: random.Random) -> None:
        """A tilted plane, on or off."""
        if self.steps or not self.rotary:
            return
        if self.plane:
            self.plane = self.tcp = False
            self.rotation = Frame()
            self.mode("G255" if self.dialect == "haas" else "G69")
            if self.led:
                self.alone(f"G43 H{self.tool}")
            self.led = False
        elif self.dialect not in ("fanuc", "mitsubishi") or self.tcp or not self.plain_frame() or self.second:
            return
        else:
            if not self.length:
                self.lengths(chance)
            self.plane = self.tcp = self.led = True
            origin = [round(chance.uniform(-10, 10), 2) for _ in range(3)]
            angles = [round(chance.uniform(-60, 60), 1) for _ in range(3)]
            turn = turned("Z", angles[0]) @ turned("X", angles[1]) @ turned("Z", angles[2])
            self.rotation = shifted(*origin) @ turn
            words = zip("XYZIJK", [*(each / self.unit for each in origin), *angles], strict=True)
            self.alone("G68.2 " + " ".join(f"{letter}{number(value, 6)}" for letter, value in words))
            self.alone(f"G43.4 H{self.tool}")
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
        local = self.dialect == "haas" and self.often(0.5)
        code = "M97 P" if local else chance.choice(["M98 P", "G65 P"])
        self.alone(f"o{7000 + name} call" if self.dialect == "linuxcnc" else f"{code}{7000 + name}")
        self.lines, self.loops = [], []

        def close() -> None:
            self.alone("(end)")
            body, self.lines, self.loops = self.lines, outer, loops
            if local:  # in the same program, which another O would end
                self.behind = [f"N{7000 + name}", *body, "M99", *self.behind]
            else:
                self.behind += self.subprogram(name, body)

        self.wrap(chance, close)

    def quiet(self, chance: random.Random) -> None:
        """Codes that move nothing and change no coordinates."""
        if self.dialect in (*MACRO, "iso"):
            ahead = ["G8 P1", "G5.1 Q1", "G5 P10000", "G5 P0", "G5.1 Q2 X0 Y0 Z0"]
            self.alone(chance.choice([*ahead, "M8", "G23", "G11"]))
        if self.dialect in MACRO and chance.random() < 0.5:
            self.alone(chance.choice(["G10 L12 P5 R4.", "#3006=1(LOOK)", "#140=#0", "M97", "DPRNT[X#140[42]]"]))

    def skip(self, chance: random.Random) -> None:
        """A block with a slash."""
        if self.setup.block_skip is True:
            self.alone(self.comment)
            self.put(f"/G1 X{chance.randint(-9, 9)}. Z5. F90.")
        else:
            self.alone(self.comment)
            self.put("/M8")

    REWRITES: ClassVar[dict[str, float]] = {
        "increments": 3, "units": 2, "feeds": 1, "zero": 2, "preset": 1, "offsets": 1, "rotate": 2, "reflect": 1,
        "lengths": 2, "tip": 2, "tilted": 2, "jump": 1, "loop": 1, "call": 1, "skip": 1, "table": 1,
        "quiet": 1,
    }  # fmt: skip
