"""Compositions as Klartext programs."""

from __future__ import annotations

import random
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from metamorphic.composing import SECOND, Author, Frame, Vector, scaled, shifted, turned
from metamorphic.harness import SETUP
from metamorphic.iso_modes import LENGTHS


class KlartextAuthor(Author):
    """Blocks in words: L, C, CC, cycles and labels."""

    def begin(self) -> None:
        self.tool, self.length = 1, LENGTHS[1]
        self.shift, self.rotation, self.mirror, self.scale = Frame(), Frame(), Frame(), Frame()
        self.plane, self.rate, self.anew = False, "", set[str]()
        self.lines = ["BEGIN PGM R MM", "TOOL CALL 1 Z"]

    def finish(self) -> str:
        return "\n".join([*self.lines, "M30", *self.behind, "END PGM R MM", ""])

    # -- words --------------------------------------------------------------------------------------------------------

    def word(self, letter: str, value: float, form: str = "+.6f") -> str:
        """A word, sometimes computed."""
        if self.often(0.1):
            name = f"Q{10 + 'XYZABC'.index(letter[-1])}"
            self.put(f"FN 1: {name} = {value - 3.0:+.6f} + +3" if self.often(0.5) else f"{name} = {value:+.6f}")
            return f"{letter}{self.style.choice(['+', ''])}{name}"
        return f"{letter}{value:+.6f}"

    def words(self, target: Vector, letters: str = "XYZABC") -> list[str]:
        """The words that lead to a place, each absolute or an increment."""
        owed = bool(self.unsaid)
        here, there = self.place(self.q), self.place(target)
        found = []
        for letter, value in self.values(target).items():
            n = self.letters.index(letter)
            if letter not in letters:
                continue
            step = n < 3 and not owed and letter not in self.anew and self.often(0.3)
            found.append(self.word("I" + letter, there[n] - here[n]) if step else self.word(letter, value))
            self.anew.discard(letter)
        return found

    def go(self, target: Vector, rapid: bool = False) -> None:
        """A straight motion."""
        rate = "FMAX" if rapid else "F500"
        polar = self.often(0.15) and not self.unsaid and not self.exact
        there = self.place(target)
        if polar:
            pole = [round(self.style.uniform(-9, 9), 1) for _ in range(2)]
            across = there[:2] - pole
            if np.hypot(*across) > 1.0:
                self.put(f"CC X{pole[0]:+} Y{pole[1]:+}")
                rest = self.words(target, "ZABC")
                angle = np.degrees(np.arctan2(across[1], across[0]))
                self.anew -= set("XY")
                self.move(["LP", f"PR{np.hypot(*across):+.8f}", f"PA{angle:+.9f}", *rest], target, rate)
                return
        names = set(self.letters[3:])
        turns = (target[3:] != self.q[3:]).any() or self.unsaid & names
        vector = self.pointed(target) if self.tcp and turns and self.often(0.4) else None
        if vector is not None:
            words = self.words(target, "XYZ")
            self.unsaid -= names
            directions = ("T{}{:+.9f}".format(*each) for each in zip("XYZ", vector, strict=True))
            self.move(["LN", *words, *directions], target, rate)
        else:
            self.move(["L", *self.words(target)], target, rate)

    def travel(self, target: Vector, *, rapid: bool) -> None:
        self.go(target, rapid)

    def move(self, words: list[str], target: Vector, rate: str) -> None:
        """A motion block; F stays in force."""
        if rate != "FMAX":
            words, self.rate = [*words, *([rate] if rate != self.rate or not self.often(0.5) else [])], rate
        else:
            words = [*words, rate]
        self.q = target
        self.put(" ".join(words), moves=True)

    # -- events -------------------------------------------------------------------------------------------------------

    def line(self, chance: random.Random) -> None:
        self.go(self.somewhere(chance, turns=self.rotary))

    def rapid(self, chance: random.Random) -> None:
        self.go(self.somewhere(chance, turns=self.rotary), rapid=True)

    def arc(self, chance: random.Random) -> None:
        """A rapid to where it begins, and an arc or a helix."""
        self.go(self.somewhere(chance), rapid=True)
        target, centre, sweep, climb = self.bow(chance)
        if self.exact:  # a helix is written by its angle, which is rounded
            target[2], climb = self.q[2], 0.0
        self.round(target, centre, sweep, climb)

    def round(self, target: Vector, centre: Vector, sweep: float, climb: float = 0.0, tangent: bool = False) -> None:
        """An arc; `tangent`: it goes on in the direction of the motion before it."""
        right = (sweep > 0) == (np.linalg.det(self.frame.turn[:2, :2]) > 0)
        sense, here, there = "DR+" if right else "DR-", self.place(self.q), self.place(target)
        middle = self.place(np.concatenate([centre, self.q[3:]]))
        choice = self.style.randrange(4) if self.wild else 0
        self.anew -= set("XY")
        if tangent and choice:
            self.move(["CT", self.word("X", there[0]), self.word("Y", there[1])], target, "F500")
        elif climb or (choice == 1 and not self.exact):
            turn = np.degrees(abs(sweep)) * (1 if right else -1)
            self.put(f"CC X{middle[0]:+.6f} Y{middle[1]:+.6f}")
            height = [self.word("Z", there[2])] if climb else []
            if climb and self.often(0.3) and "Z" not in self.anew:
                height = [self.word("IZ", there[2] - here[2])]
            self.move(["CP", f"IPA{turn:+.8f}", *height, sense], target, "F500")
        elif choice == 2:
            radius = np.hypot(*(here - middle)[:2]) * (1 if abs(sweep) < np.pi else -1)
            self.move(
                ["CR", self.word("X", there[0]), self.word("Y", there[1]), f"R{radius:+.7f}", sense], target, "F500"
            )
        else:
            step = self.often(0.3)
            pole = (middle - here)[:2] if step else middle[:2]
            i = "I" if step else ""
            self.put(f"CC {i}X{pole[0]:+.6f} {i}Y{pole[1]:+.6f}")
            step = self.often(0.3)
            i, end = ("I", there - here) if step else ("", there)
            self.move(["C", self.word(i + "X", end[0]), self.word(i + "Y", end[1]), sense], target, "F500")

    def tangent(self, chance: random.Random) -> None:
        """A line, and an arc that goes on in its direction."""
        self.go(self.somewhere(chance), rapid=True)
        first, _, centre, sweep = self.legs(chance)
        self.go(first)
        target = first.copy()
        target[:3] = centre + turned("Z", np.degrees(sweep)).turn @ (first[:3] - centre)
        self.round(target.round(6), centre, sweep, tangent=True)

    def corner(self, chance: random.Random) -> None:
        """Two lines with a rounding or a chamfer between them."""
        self.go(self.somewhere(chance), rapid=True)
        first, last, _, _ = self.legs(chance)
        wild, self.wild = self.wild, False
        self.go(first)
        self.put(f"{chance.choice(['RND R', 'CHF '])}{2.0 / self.frame.turn[2, 2]}")
        self.go(last)
        self.wild = wild

    def macro(self, chance: random.Random) -> None:
        """Two lines, sometimes by a subprogram that gets their ends."""
        places = [self.somewhere(chance) for _ in range(2)]
        self.go(self.q, rapid=True)
        name, body = 0, "L XQ21 Y+Q22 ZQ23 FQ24"
        for each in places:
            if not self.wild:
                self.go(each)
                continue
            self.q = each
            if not (self.flat and name):
                name = next(self.names)
                self.behind += [f"LBL {name}", body, "LBL 0"]
                self.moving.add(body)
            for n, value in enumerate((*self.place(each)[:3], 500.0)):
                self.put(f"FN 0: Q{21 + n} = {value:+.6f}" if self.often(0.5) else f"Q{21 + n} = {value:+.6f}")
            self.put(f"CALL LBL {name}")
            self.anew -= set("XYZ")
        self.rate = "" if self.wild else self.rate

    def hole(self, chance: random.Random) -> None:
        """Some holes of one cycle."""
        self.go(self.somewhere(chance), rapid=True)
        depth = round(chance.uniform(5, 20), 2)
        ratio = float(self.frame.turn[2, 2])
        top = self.place(self.q)[2] - 2.0 / ratio
        self.put(
            f"CYCL DEF 200 DRILLING Q200={2 / ratio:+.4f} Q201={-depth / ratio:+.4f} Q206=+250 Q202=+30 Q210=+0"
            f" Q203={top:+.6f} Q204={2 / ratio:+.4f} Q211=+0"
        )
        way = chance.choice(["CALL", "M99"])
        for _ in range(chance.randint(1, 3)):
            where = self.somewhere(chance)
            target = self.q.copy()
            target[:2] = where[:2]
            there = self.place(target)
            words = f"L X{there[0]:+.6f} Y{there[1]:+.6f} FMAX"
            self.anew -= set("XY")
            if way == "M99":
                self.put(words + " M99", moves=True)
            else:
                self.put(words, moves=True)
                self.put("CYCL CALL", moves=True)
            self.q = target
        self.unsaid |= {"Z"}

    def contour(self, chance: random.Random) -> None:
        """Lines with radius compensation, turning to the right of the tool all the time."""
        self.go(self.somewhere(chance), rapid=True)
        centre, radius, side = self.q[:2].copy(), chance.uniform(20, 30), chance.choice(["RL", "RR"])
        angles = np.sort([chance.uniform(0, 2 * np.pi) for _ in range(3)])[:: -1 if side == "RL" else 1]
        if np.linalg.det(self.frame.turn[:2, :2]) < 0:
            side = {"RL": "RR", "RR": "RL"}[side]
        for n, angle in enumerate(angles):
            target = self.q.copy()
            target[:2] = (centre + radius * np.array([np.cos(angle), np.sin(angle)])).round(3)
            self.move(["L", *self.words(target), *([side] if n == 0 else [])], target, "F500")
        target = self.q + np.array([0.0, 0.0, 5.0, 0.0, 0.0])
        self.move(["L", *self.words(target), "R0"], target, "F500")
        self.unsaid = set(self.letters)

    def twice(self, chance: random.Random) -> None:
        """A stretch that is gone through twice, sometimes as a subprogram with repeats."""
        relative = chance.random() < 0.3
        places = [self.somewhere(chance, turns=self.rotary) for _ in range(2)]
        rounds = [places, places]
        if relative:
            self.upright(chance)
            self.go(self.q, rapid=True)
            self.anew -= set("XYZ")
            by = [(0.1 * (place - self.q)).round(3) for place in places]
            rounds = [[self.q + n * sum(by) + by[0], self.q + (n + 1) * sum(by)] for n in range(2)]
        calls = self.style.choice(["", "CALL", "REP"]) if self.wild else ""
        name, outer = next(self.names), self.lines
        if calls:
            self.lines, self.rate = [], ""
        for each in rounds[0] if calls else [*rounds[0], *rounds[1]]:
            if not relative:
                self.unsaid = set(self.letters)
            words, by_steps = self.values(each).items(), self.place(each) - self.place(self.q)
            steps = {letter: by_steps[self.letters.index(letter)] for letter, _ in words}
            forms = (self.word("I" + a, steps[a]) if relative else self.word(a, v) for a, v in words)
            self.move(["L", *forms], each, "F500")
        if calls:
            body, self.lines = self.lines, outer
            if calls == "REP":
                self.lines += [f"LBL {name}", *body, f"CALL LBL {name} REP 1"]
            else:
                self.put(f"CALL LBL {name}\nCALL LBL {name}")
                self.behind += [f"LBL {name}", *body, "LBL 0"]
        self.q = rounds[1][-1]
        self.anew -= set("XYZ")

    def upright(self, chance: random.Random) -> None:
        """No M128, nor a tilted plane."""
        if self.plane:
            self.tilted(chance)
        if self.tcp:
            self.tip(chance)

    def machine_place(self, chance: random.Random) -> None:
        self.put(f"L Z+290 {'R0 ' if self.often(0.5) else ''}FMAX M91", moves=True)
        self.q[2] = 290.0
        self.unsaid |= set(self.letters)

    def other_tool(self, chance: random.Random) -> None:
        self.upright(chance)
        self.tool = 3 - self.tool
        self.length = LENGTHS[self.tool]
        self.put(f"TOOL CALL {self.tool} Z S1000")
        self.unsaid, self.rate = set(self.letters), ""

    def dwell(self, chance: random.Random) -> None:
        self.put("CYCL DEF 9.0 DWELL TIME")
        self.put("CYCL DEF 9.1 DWELL 0.5")

    # -- rewrites -----------------------------------------------------------------------------------------------------

    def compose(self) -> None:
        self.frame = self.shift @ self.mirror @ self.rotation @ self.scale
        self.anew = set("XYZ")

    def datum(self, chance: random.Random) -> None:
        """A datum shift, absolute or on top."""
        if self.turned_or_scaled() or self.plane:
            return
        by = np.array([round(chance.uniform(-20, 20), 2) for _ in range(3)])
        form = chance.choice(["cycle", "more", "function"])
        if form == "function":
            self.put("TRANS DATUM AXIS " + " ".join(f"{a}{v:+}" for a, v in zip("XYZ", by, strict=True)))
        else:
            self.put("CYCL DEF 7.0 DATUM SHIFT")
            i = "I" if form == "more" else ""
            for n in range(3):
                self.put(f"CYCL DEF 7.{n + 1} {i}{'XYZ'[n]}{by[n]:+}")
        self.shift = shifted(*(by + (self.shift.shift if form == "more" else 0.0)))
        self.compose()

    def turned_or_scaled(self) -> bool:
        return any((each.turn - np.eye(3)).any() for each in (self.rotation, self.mirror, self.scale))

    def rotate(self, chance: random.Random) -> None:
        """Cycle 10, off or on."""
        if self.plane or self.tcp or (self.mirror.turn - np.eye(3)).any() or (self.scale.turn - np.eye(3)).any():
            return
        off = (self.rotation.turn - np.eye(3)).any()
        angle = (
            0.0 if off else chance.choice([90.0, 180.0, 90.0 if self.exact else round(chance.uniform(-180, 180), 2)])
        )
        self.put("CYCL DEF 10.0 ROTATION")
        self.put(f"CYCL DEF 10.1 ROT{angle:+}")
        self.rotation = turned("Z", angle)
        self.compose()

    def reflect(self, chance: random.Random) -> None:
        """Cycle 8, off or on."""
        if self.plane or self.tcp or (self.rotation.turn - np.eye(3)).any() or (self.scale.turn - np.eye(3)).any():
            return
        off = (self.mirror.turn - np.eye(3)).any()
        n = chance.randrange(2)
        self.put("CYCL DEF 8.0 MIRROR IMAGE")
        self.put("CYCL DEF 8.1" + ("" if off else " " + "XY"[n]))
        self.mirror = Frame() if off else scaled(*[-1.0 if k == n else 1.0 for k in range(3)])
        self.compose()

    def magnify(self, chance: random.Random) -> None:
        """Cycle 11, off or on."""
        if self.plane or self.tcp:
            return
        off = (self.scale.turn - np.eye(3)).any()
        factor = 1.0 if off else 0.5 if self.exact else chance.choice([0.5, 2.0])
        self.put("CYCL DEF 11.0 SCALING")
        self.put(f"CYCL DEF 11.1 SCL {factor}")
        self.scale = scaled(factor, factor, factor)
        self.compose()

    def presets(self, chance: random.Random) -> None:
        """The other preset."""
        if self.tcp or self.plane or self.turned_or_scaled() or self.shift.shift.any():
            return
        first = self.offset is not SECOND
        self.offset = SECOND if first else SETUP.work_offsets["G54"]
        self.put(f"CYCL DEF 247 DATUM SETTING Q339=+{2 if first else 1}")
        self.unsaid = set(self.letters)

    def tip(self, chance: random.Random) -> None:
        """M128, off or on."""
        if not self.rotary or self.plane or self.turned_or_scaled() or self.offset is SECOND:
            return
        self.tcp = not self.tcp
        names = chance.choice([("M128", "M129"), ("FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS", "FUNCTION RESET TCPM")])
        self.put(names[not self.tcp])
        self.unsaid = set(self.letters)

    def tilted(self, chance: random.Random) -> None:
        """A plane with M128, off or on."""
        if self.plane:
            self.put("PLANE RESET STAY")
            self.plane, self.rotation = False, Frame()
        elif not self.rotary or self.turned_or_scaled() or self.offset is SECOND:
            return
        else:
            if not self.tcp:
                self.tip(chance)
            angles = [round(chance.uniform(-60, 60), 1) for _ in range(3)]
            turn = turned("Z", angles[0]) @ turned("X", angles[1]) @ turned("Z", angles[2])
            words = "PLANE EULER EULPR{:+} EULNU{:+} EULROT{:+} STAY".format(*angles)
            if chance.random() < 0.5:
                turn = turned("Z", angles[2]) @ turned("Y", angles[1]) @ turned("X", angles[0])
                words = "PLANE SPATIAL SPA{:+} SPB{:+} SPC{:+} STAY".format(*angles)
            self.put(words)
            self.plane, self.rotation = True, turn
        self.unsaid = set(self.letters)
        self.compose()

    def may_swivel(self) -> bool:
        if self.turned_or_scaled() or self.offset is SECOND:
            return False
        self.upright(self.style)
        return True

    def swivel(self, plane: Frame, target: Vector) -> None:
        turn = plane.turn
        if self.style.random() < 0.25:
            turn = self.posture(target)
            words = f"AXIAL {self.letters[3]}{target[3]:+} C{target[4]:+} TURN FMAX"
        else:
            words = self.plane_words(turn) + f" TURN FMAX SEQ{'+' if target[3] > 0 else '-'}"
        self.put(f"PLANE {words}", moves=True)
        self.plane, self.tcp, self.rotation = True, True, Frame(turn)
        self.compose()

    def plane_words(self, turn: Vector) -> str:
        """A plane in one of many ways."""
        a, b, c = Rotation.from_matrix(turn).as_euler("ZYX", degrees=True)[::-1]
        first, nutation, last = Rotation.from_matrix(turn).as_euler("ZXZ", degrees=True)
        return self.style.choice([
            f"SPATIAL SPA{a:+.9f} SPB{b:+.9f} SPC{c:+.9f}",
            f"EULER EULPR{first:+.9f} EULNU{nutation:+.9f} EULROT{last:+.9f}",
            "VECTOR BX{:+.9f} BY{:+.9f} BZ{:+.9f} NX{:+.9f} NY{:+.9f} NZ{:+.9f}".format(*turn[:, 0], *turn[:, 2]),
        ])  # fmt: skip

    def unswivel(self) -> None:
        self.put("PLANE RESET STAY")
        self.plane, self.tcp, self.rotation = False, False, Frame()
        self.compose()

    def jump(self, chance: random.Random) -> None:
        name = next(self.names)
        self.put(f"FN 9: IF +1 EQU +1 GOTO LBL {name}")
        self.put(f"L X{chance.randint(-9, 9):+} Z+5 F90")
        self.put(f"LBL {name}")

    def call(self, chance: random.Random) -> None:
        """A subprogram behind the end."""
        name, outer = next(self.names), self.lines
        self.put(f"CALL LBL {name}")
        self.lines = []

        def close() -> None:
            body, self.lines = self.lines, outer
            self.behind += [f"LBL {name}", *body, "LBL 0"]

        self.wrap(chance, close)

    def loop(self, chance: random.Random) -> None:
        """A section that is gone through once."""
        name = next(self.names)
        self.put(f"Q{100 + name} = 0")
        self.put(f"LBL {name}")

        def close() -> None:
            self.put(f"Q{100 + name} = Q{100 + name} + 1")
            self.put(f"FN 12: IF +Q{100 + name} LT +1 GOTO LBL {name}")

        self.wrap(chance, close)

    def skip(self, chance: random.Random) -> None:
        self.put("; here")
        self.put(f"/L X{chance.randint(-9, 9):+} Z+5 F90" if self.setup.block_skip is True else "/M8")

    EVENTS: ClassVar[dict[str, float]] = {
        "line": 6, "rapid": 2, "arc": 3, "hole": 2, "machine_place": 0.5, "other_tool": 0.5, "dwell": 0.3,
        "contour": 0.7, "twice": 0.7, "corner": 0.7, "tangent": 0.7, "macro": 0.7, "swivelled": 2,
    }  # fmt: skip
    REWRITES: ClassVar[dict[str, float]] = {
        "datum": 3, "rotate": 2, "reflect": 1, "magnify": 1, "presets": 1, "tip": 2, "tilted": 2, "jump": 1, "call": 1,
        "loop": 1, "skip": 1,
    }  # fmt: skip
