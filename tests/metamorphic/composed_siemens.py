"""Compositions as programs of SINUMERIK."""

from __future__ import annotations

import random
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from metamorphic.composed_iso import IsoAuthor
from metamorphic.composing import Frame, Vector, number, scaled, shifted, turned
from metamorphic.iso_modes import LENGTHS


class SiemensAuthor(IsoAuthor):
    """As ISO code, with frames in any order and words that each have their own form."""

    comment = "; here"

    def begin(self) -> None:
        super().begin()
        self.anew, self.length, self.rate = set[str](), LENGTHS[1], 1.0
        self.lines = ["G710 G17 G40 G90 G94 S1000", "T1 D1 M6", "G54"]

    def finish(self) -> str:
        head = ["%_N_PART_MPF"] if self.behind else []
        return "\n".join([*head, *self.lines, "M30", *self.behind]) + "\n"

    # -- words --------------------------------------------------------------------------------------------------------

    def word(self, letter: str, value: float) -> str:
        text = number(value, 6)
        if self.often(0.1):
            return f"{letter}={number(value - 3.0, 6)}+3"
        if self.often(0.1):
            name = f"R{10 + 'XYZABC'.index(letter)}"
            self.put(f"{name}={text}")
            return f"{letter}={name}"
        return f"{letter}={text}" if self.often(0.1) else letter + text

    def motion(self, code: str, words: list[str]) -> None:
        feed = self.feed()
        if code == "0" or (feed == self.fed and self.rates != "G93" and self.often(0.7)):
            feed = ""
        else:
            self.fed = feed
        if self.often(0.3):
            self.style.shuffle(words)
        parts = [*([] if code == self.code and self.often(0.6) else [code if code.isalpha() else f"G{code}"]), *words]
        self.code = code
        self.put(self.prefix + " ".join([*parts, *([feed] if feed else [])]), moves=True)
        self.prefix = ""

    def go(self, code: str, target: Vector, extra: list[str] | None = None) -> None:
        steps = self.steps and bool(self.unsaid | self.anew)
        if steps:
            self.absolute()
        here, there = self.place(self.q), self.place(target)
        words, owed = [], self.unsaid | self.anew
        polar = extra is None and not self.steps and not self.diameter and not self.exact and self.often(0.1)
        if code in ("0", "1"):
            self.way = float(np.linalg.norm((target - self.q)[:3]))
        values = self.values(target)
        self.anew = self.anew - set(values)
        self.pointing = self.tcp and self.often(0.3)
        vector = self.directed(target, values)
        for letter, value in values.items():
            n = self.letters.index(letter)
            if letter == "X" and self.diameter:
                value *= 2.0
            if self.repeated or owed:
                words.append(self.word(letter, value))
            elif letter == "C" and min(here[n], there[n]) > 0 and self.often(0.2):
                form = self.style.choice(["DC", "ACP" if there[n] > here[n] else "ACN"])
                words.append(f"C={form}({number(there[n], 6)})")
            elif n < 3 and self.often(0.1) and not (letter == "X" and self.diameter):
                scale = self.unit if n < 3 else 1.0
                other = there[n] if self.steps else there[n] - here[n]
                words.append(f"{letter}={'AC' if self.steps else 'IC'}({number(other / scale, 6)})")
            else:
                words.append(self.word(letter, value))
        if polar and not owed:
            pole = [round(self.style.uniform(-9, 9), 1) for _ in range(2)]
            across = there[:2] / self.unit - pole
            if np.hypot(*across) > 1.0:
                self.alone(f"G111 X{pole[0]} Y{pole[1]}")
                angle = np.degrees(np.arctan2(across[1], across[0]))
                words = [each for each in words if each[0] not in "XY"]
                words += [f"AP={number(angle, 9)}", f"RP={number(np.hypot(*across), 8)}"]
        self.q = target
        self.motion(code, [*words, *vector, *(extra or [])])
        if steps:
            self.increments(self.style)

    def directed(self, target: Vector, values: dict[str, float]) -> list[str]:
        vector = super().directed(target, values)
        return [f"{'ABC'['IJK'.index(word[0])]}3={word[1:]}" for word in vector]

    # -- events -------------------------------------------------------------------------------------------------------

    def square_up(self) -> None:
        if np.abs(self.frame.turn[:, 2] * self.frame.turn[2]).sum() != 1.0 or self.frame.turn[0, 1]:
            self.alone("ROT")
            self.frame, self.anew = Frame(), set("XYZ")

    def circle(
        self, right: bool, middle: Vector, target: Vector, sweep: float, plane: list[int], tangent: bool
    ) -> tuple[str, list[str]]:
        choice = self.style.randrange(5) if self.wild else 0
        code = "3" if right else "2"
        if tangent and choice:
            return "CT", []
        if choice == 1:
            return code, [f"CR={number(np.linalg.norm(middle[plane]) * (1 if abs(sweep) < np.pi else -1), 7)}"]
        here, there = self.place(self.q)[:3] / self.unit, self.place(target)[:3] / self.unit
        centre = here + middle
        if choice == 2 and not self.diameter:
            return code, [f"{'IJK'[n]}=AC({number(centre[n], 6)})" for n in plane]
        (across,) = {0, 1, 2} - set(plane)
        if choice == 3 and abs(there[across] - here[across]) < 1e-9 and not self.steps and not self.diameter:
            half = turned("XYZ"[across], np.degrees(abs(sweep) / 2 * (1 if right else -1))).turn
            point = centre - half @ middle
            point[across] = here[across]
            return "CIP", [f"{'IJK'[n]}1={number(point[n], 7)}" for n in range(3)]
        if choice == 4:
            return code, [f"AR={number(np.degrees(abs(sweep)), 8)}"]
        return code, [f"{'IJK'[n]}{number(middle[n], 6)}" for n in plane]

    def rounded(self, chance: random.Random, size: str) -> list[str]:
        return [f"{chance.choice(['RND', 'CHF', 'CHR'])}={size}"]

    def defined(self, name: int) -> None:
        line = "G1 X=WA Y=WB Z=WC F=WF"
        self.behind += [f"%_N_SUB{name}_SPF", f"PROC SUB{name}(REAL WA, REAL WB, REAL WC, REAL WF)", line, "M17"]
        self.moving.add(line)

    def given(self, name: int, values: list[str]) -> str:
        return f"SUB{name}({','.join(values)})"

    def hole(self, chance: random.Random) -> None:
        """Some holes of one cycle, called by MCALL."""
        self.go("0", self.somewhere(chance))
        self.minutes()
        if self.steps:
            self.steps = False
            self.alone("G90")
        depth, level = self.q.copy(), self.q.copy()
        depth[2] -= chance.uniform(5, 20)
        level[2] -= 2.0
        heights = [number(self.place(each)[2] / self.unit, 6) for each in (self.q, level, depth)]
        gap = number(1.0 / self.unit, 6)
        self.alone(f"MCALL CYCLE81({heights[0]},{heights[1]},{gap},{heights[2]})")
        for _ in range(chance.randint(1, 3)):
            where = self.somewhere(chance)
            self.q[:2] = where[:2]
            there = self.place(self.q)[:2] / self.unit
            if self.diameter:
                there = there * (2.0, 1.0)
            self.put(f"X{number(there[0], 6)} Y{number(there[1], 6)}", moves=True)
        self.alone("MCALL")
        self.moving |= {line for line in self.lines if "CYCLE81" in line}
        self.code, self.fed = "", ""
        self.unsaid |= {"Z"}

    def machine_place(self, chance: random.Random) -> None:
        self.absolute()
        if self.tcp:
            self.tip(chance)
        if self.diameter:
            self.diameters(chance)
        self.alone(f"{chance.choice(['SUPA', 'G53', 'G153'])} G0 Z{number(290.0 / self.unit, 6)} D0", moves=True)
        self.alone("D1")
        self.length = LENGTHS[self.tool]
        self.code, self.q[2] = "0", 290.0
        self.unsaid |= set(self.letters)

    def reference(self, chance: random.Random) -> None:
        self.alone("G74 Z1=0", moves=True)
        self.q[2], self.code = 290.0, ""
        self.unsaid |= set(self.letters)
        self.rapid(chance)

    def other_tool(self, chance: random.Random) -> None:
        self.upright()
        self.tool = 3 - self.tool
        self.length = LENGTHS[self.tool]
        self.alone(f"T{self.tool} D1 M6")
        self.unsaid, self.code = set(self.letters), ""

    def put_twice(self, name: int, body: list[str]) -> None:
        if self.style.random() < 0.5:
            self.put(f"SUB{name} P2")
            self.behind += self.subprogram(name, body)
        else:
            self.lines += [f"LAB{name}:", *body, f"END{name}:", f"REPEAT LAB{name} END{name} P=1"]

    def subprogram(self, name: int, body: list[str]) -> list[str]:
        return [f"%_N_SUB{name}_SPF", *body, "M17"]

    def dwell(self, chance: random.Random) -> None:
        self.alone("G4 F0.5")

    # -- rewrites -----------------------------------------------------------------------------------------------------

    def units(self, chance: random.Random) -> None:
        self.unit = 25.4 if self.unit == 1.0 else 1.0
        whole = chance.random() < 0.7
        self.rate, self.metric = self.unit if whole else 1.0, self.metric or not whole
        codes = ("G710", "G700") if whole else ("G71", "G70")
        self.mode(codes[self.unit != 1.0])
        self.fed = ""

    def frames(self, chance: random.Random) -> None:
        """A programmed frame, in place of the one in force or on top of it."""
        kind, more = chance.choice(["TRANS", "ROT", "MIRROR", "SCALE", "off"]), chance.random() < 0.5
        if self.diameter:
            self.diameters(chance)
        if kind == "off":
            self.alone(chance.choice(["TRANS", "ROT"]))
            self.frame = Frame()
        else:
            if kind == "TRANS":
                by = [round(chance.uniform(-20, 20), 2) for _ in range(3)]
                words, new = [*map("{}{}".format, "XYZ", (number(v / self.unit, 6) for v in by))], shifted(*by)
            elif kind == "ROT" and self.rotary and chance.random() < 0.5:
                by = [round(chance.uniform(-50, 50), 1) for _ in range(3)]
                words = [*map("{}{}".format, "XYZ", map(str, by))]
                new = turned("Z", by[2]) @ turned("Y", by[1]) @ turned("X", by[0])
            elif kind == "ROT":
                angle = chance.choice([90.0, 180.0, 90.0 if self.exact else round(chance.uniform(-180, 180), 2)])
                words, new = [f"RPL={angle}"], turned("Z", angle)
            elif kind == "MIRROR":
                n = chance.randrange(2)
                words, new = ["XY"[n] + "0"], scaled(*[-1.0 if k == n else 1.0 for k in range(3)])
            else:
                factor = 0.5 if self.exact else chance.choice([0.5, 2.0])
                words, new = [f"{letter}{factor}" for letter in "XYZ"], scaled(factor, factor, factor)
            self.alone(("A" if more else "") + kind + " " + " ".join(words))
            self.frame = self.frame @ new if more else new
        self.anew = set("XYZ")

    def offsets(self, chance: random.Random) -> None:
        if self.tcp:
            return
        self.offset, self.kept, self.second = self.kept, self.offset, not self.second
        self.mode("G55" if self.second else "G54")
        self.unsaid = set(self.letters)

    def lengths(self, chance: random.Random) -> None:
        if self.tcp:
            return
        self.length = 0.0 if self.length else LENGTHS[self.tool]
        self.mode("D0" if not self.length else "D1")
        self.unsaid |= set("Z")
        self.anew = set("XYZ")

    def tip(self, chance: random.Random) -> None:
        """TRAORI, with frames said anew."""
        if not self.rotary or (not self.tcp and self.second) or not self.length:
            return
        self.tcp = not self.tcp
        self.alone("TRANS")
        self.frame = Frame()
        self.alone("TRAORI" if self.tcp else "TRAFOOF")
        self.alone("G54")
        self.unsaid, self.anew = set(self.letters), set("XYZ")

    def may_swivel(self) -> bool:
        if self.second:
            return False
        self.absolute()
        self.upright()
        self.alone("TRANS")
        self.frame, self.anew = Frame(), set("XYZ")
        if not self.length:
            self.lengths(self.style)
        return True

    def swivel(self, plane: Frame, target: Vector) -> None:
        angles = Rotation.from_matrix(plane.turn).as_euler("XYZ", degrees=True)
        words = ",".join(number(each, 9) for each in (*(plane.shift / self.unit), *angles))
        self.alone(f'CYCLE800(0,"T",200000,57,{words},0,0,0,{1 if target[3] > 0 else -1})', moves=True)
        self.tcp, self.frame = True, plane

    def unswivel(self) -> None:
        self.absolute()
        self.alone("CYCLE800()")
        self.tcp, self.frame = False, Frame()

    def diameters(self, chance: random.Random) -> None:
        """X as a diameter, off or on."""
        if self.rotary or (self.frame.turn - np.eye(3)).any() or self.frame.shift.any():
            return
        self.diameter = not self.diameter
        self.alone("DIAMON" if self.diameter else "DIAMOF")

    def jump(self, chance: random.Random) -> None:
        name = f"MARK{next(self.names)}"
        self.alone(f"GOTOF {name}" if chance.random() < 0.5 else f"IF R99<>0.5 GOTOF {name}")
        if self.lines[-1].startswith("IF"):
            self.lines.insert(-1, "R99=2")
        self.put(f"G1 X{chance.randint(-9, 9)} Z5 F90")
        self.put(f"{name}:")

    def loop(self, chance: random.Random) -> None:
        name = next(self.names)
        head, tail = chance.choice([
            (f"FOR R{50 + name}=1 TO 1", "ENDFOR"), ("IF 1==1", "ENDIF"), ("REPEAT", "UNTIL 1==1"),
        ])  # fmt: skip
        self.alone(head)
        self.wrap(chance, lambda: self.alone(tail))

    def call(self, chance: random.Random) -> None:
        name, outer, save = f"SUB{next(self.names)}", self.lines, chance.random() < 0.4 and not self.tcp
        if save and self.diameter:
            self.diameters(chance)
        if save:
            self.minutes()
        self.alone(name)
        self.lines = [f"%_N_{name}_SPF", f"PROC {name}" + (" SAVE" if save else "")]
        kept = self.frame, self.offset, self.kept, self.second, self.steps, self.unit, self.rate

        def close() -> None:
            if save:
                self.upright()
                self.minutes()
            if save and self.diameter:
                self.diameters(chance)
            if save and (self.offset is not kept[1]):
                self.unsaid = set(self.letters)
            if save:
                self.frame, self.offset, self.kept, self.second, self.steps, self.unit, self.rate = kept
                self.anew, self.code, self.fed = set("XYZ"), "", ""
            if self.prefix:
                self.put(self.prefix.strip())
                self.prefix = ""
            body, self.lines = self.lines, outer
            self.behind += [*body, "M17"]

        self.wrap(chance, close)

    REWRITES: ClassVar[dict[str, float]] = {
        "increments": 3, "units": 2, "feeds": 1, "frames": 6, "offsets": 2, "lengths": 2, "tip": 2, "diameters": 1,
        "jump": 1, "loop": 1, "call": 1, "skip": 1,
    }  # fmt: skip
