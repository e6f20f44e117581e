"""A small interpreter of Fanuc programs, for judging: written from the manual, slow, sharing nothing with the product.

It follows the tool as the control of one machine would and gives its path as axis positions. Each line of a program may
end with a mark, `(#7)`: what is executed after it belongs to it, lines that a correction puts in included. What is not
known here raises `KeyError` or `NotImplementedError`: nothing is judged by half.

Source: Fanuc 30i operator's manual (machining centre).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from differential.errors import LETTERS
from differential.fanuc_frames import SETTING
from differential.sinumerik_frames import PLANES, Floats, Frame
from differential.sinumerik_motions import Path, Standing

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
WORD = re.compile(rf"([A-Z])({NUMBER}|#\d+|\[[^\]]*(?:\[[^\]]*\][^\]]*)*\]|-#\d+)")
HOLES = (73, 76, 81, 82, 83, 84, 85, 86, 88, 89)


@dataclass(slots=True)
class Control(Standing):
    """Executes programs of one file; macros are `O` numbers in it."""

    codes: dict[str, Any] = field(default_factory=dict)
    shift: Floats = field(default_factory=lambda: np.zeros(3))
    local: Floats = field(default_factory=lambda: np.zeros(3))
    mirrors: dict[int, float] = field(default_factory=dict)
    scaled: tuple[Floats, float] | None = None
    levels: dict[str, float] = field(default_factory=dict)
    points: dict[int, dict[str, float]] = field(default_factory=dict)
    extended: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    scopes: list[dict[int, float]] = field(default_factory=lambda: [{}])
    common: dict[int, float] = field(default_factory=dict)

    # -- a program ----------------------------------------------------------------------------------------------------

    def run(self, text: str) -> list[Path]:
        """Follow a program to its end."""
        self.codes = {"g": 0, "system": 54, "retract": 98, "vectors": False, "polar": None, "place": None}
        self.codes["tool"] = 1
        self.settable = self.system(54)
        lines = text.splitlines()
        heads = {int(found[1]): n for n, line in enumerate(lines) if (found := re.match(r"O(\d+)", line))}
        calls: list[int] = []
        at = 0
        while at < len(lines):
            line = lines[at]
            self.line, at = at + 1, at + 1
            if mark := re.search(r"\(#(\d+)\)", line):
                self.mark = int(mark[1]), self.mark[1] + 1
            body = re.sub(r"\([^)]*\)", "", line).replace(" ", "").upper()
            body = re.sub(r"^(?:O\d+|N\d+)", "", body)
            if not body or body == "%":
                continue
            if found := re.fullmatch(r"#(\d+)=(.+)", body):
                self.assign(int(found[1]), self.value(found[2]))
            elif found := re.fullmatch(r"WHILE(\[.+\])DO(\d)", body):
                if not self.value(re.sub(r"LT", "<", found[1])):
                    at = next(n for n in range(at, len(lines)) if f"END{found[2]}" in lines[n]) + 1
            elif found := re.fullmatch(r"END(\d)", body):
                at = max(n for n in range(at) if f"DO{found[1]}" in lines[n].replace(" ", ""))
            elif body.startswith("G65"):
                words = dict(WORD.findall(body[3:]))
                arguments = {"ABCIJKDEFHMQRSTUVWXYZ".index(k): self.value(v) for k, v in words.items() if k != "P"}
                numbers = (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 13, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26)
                self.scopes.append({numbers[place]: value for place, value in arguments.items()})
                calls.append(at)
                at = heads[int(words["P"])]
            elif body == "M99":
                at = calls.pop()
                self.scopes.pop()
            elif body in ("M30", "M2"):
                break
            else:
                self.block(body)
        return self.paths

    def assign(self, number: int, value: float) -> None:
        """Give a variable its value."""
        (self.scopes[-1] if number < 34 else self.common)[number] = value

    def value(self, text: str) -> float:
        """The value of an expression."""
        text = re.sub(r"#(\d+)", lambda m: f"({self.common.get(int(m[1]), self.scopes[-1].get(int(m[1])))!r})", text)
        return float(eval(text.replace("[", "(").replace("]", ")"), {"__builtins__": {}}))

    # -- a block ------------------------------------------------------------------------------------------------------

    def block(self, body: str) -> None:
        """One block."""
        codes, words = [], {}
        for letter, text in WORD.findall(body):
            if letter == "G":
                codes.append(float(text))
            elif letter == "T":
                self.codes["tool"] = int(text)
            elif letter not in "MSFN":
                words[letter] = self.value(text)
        taken = self.settings(codes, words)
        if self.codes["vectors"] and {"I", "J", "K"} & words.keys():
            vector = self.frame.turn @ np.array([words.pop(letter, 0.0) for letter in "IJK"])
            words |= self.ways(vector / np.linalg.norm(vector))[0]
        moving = {*LETTERS} & words.keys() or (self.codes["g"] in (2, 3) and {"I", "J", "K"} & words.keys())
        if taken or not moving:
            return
        if self.codes["g"] in HOLES:
            self.hole(words)
        else:
            self.travel(words, 53.0 in codes)

    def settings(self, codes: list[float], words: dict[str, float]) -> bool:
        """Codes; True if they took the words of the block."""
        taken = False
        for code in codes:
            if code <= 3 or code in HOLES:
                self.begin(int(code))
            elif code == 80:
                self.codes["g"] = 0
            elif code in PLANES:
                self.modes["plane"] = int(code)
            elif code in (90, 91):
                self.modes["inc"] = code == 91
            elif code in (20, 21):
                self.modes["unit"] = 25.4 if code == 20 else 1.0
            elif code in (98, 99):
                self.codes["retract"] = code
            elif code in (54, 55, 56, 57, 58, 59, 54.1):
                self.codes["system"] = int(code) if code != 54.1 else -int(words["P"])
                self.settable = self.system(self.codes["system"])
            elif code in (43, 49, 43.4, 43.5):
                self.offset(code, words)
            elif code in (15, 16):
                self.codes["polar"] = [0.0, 0.0] if code == 16 else None
            elif code in SETTING:
                SETTING[code](self, words)
                taken = True
            elif code not in (53, 40, 93, 94, 4, 61, 64, 17):
                raise NotImplementedError(f"G{code}")
            else:
                taken |= code == 4
        return taken

    def begin(self, code: int) -> None:
        """A motion code; the first of a series of holes has its own initial level."""
        if code in HOLES and self.codes["g"] not in HOLES:
            self.levels = {"initial": float(self.here()[PLANES[self.modes["plane"]][2]])}
        self.codes["g"] = self.modes["g"] = code

    def offset(self, code: float, words: dict[str, float]) -> None:
        """Tool length offsets; the axes stand still."""
        length = 0.0 if code == 49 else self.tools[int(words["H"])]

        def change() -> None:
            self.length = length

        self.gauge = self.tools[int(words["H"]) if "H" in words else self.codes["tool"]]
        self.stand(change, tcp=code in (43.4, 43.5) or self.modes.get("tilted", False))
        self.codes["tip"], self.codes["vectors"] = code in (43.4, 43.5), code == 43.5

    def stand(self, change: Any, tcp: bool) -> None:
        """Change something while the axes stand still."""
        q = self.axes(self.base[None], self.rotary())[0]
        change()
        self.modes["tcp"] = tcp
        self.base = self.base_of(q)

    # -- coordinates --------------------------------------------------------------------------------------------------

    def system(self, number: int) -> Frame:
        """A work offset."""
        return Frame(np.eye(3), np.array(self.offsets[number] if number > 0 else self.extended[-number]))

    @property
    def frame(self) -> Frame:
        """The whole chain, without mirrors and scale."""
        return self.settable @ Frame(np.eye(3), self.shift + self.local) @ self.swivel @ self.program

    def inner(self, point: Floats) -> Floats:
        """What the frame is given for a point of the program: scaled, mirrored."""
        found = point.copy()
        if self.scaled is not None:
            centre, factor = self.scaled
            found = centre + factor * (found - centre)
        for index, place in self.mirrors.items():
            found[index] = 2 * place - found[index]
        return found

    def here(self) -> Floats:
        """Where the control stands, in the numbers of the program, mm."""
        found = self.frame.back(self.base)
        for index, place in self.mirrors.items():
            found[index] = 2 * place - found[index]
        if self.scaled is not None:
            centre, factor = self.scaled
            found = centre + (found - centre) / factor
        return found

    def target(self, words: dict[str, float]) -> Floats:
        """Where the words of a block lead, in the numbers of the program, mm."""
        unit, end = self.modes["unit"], self.here()
        if self.codes["polar"] is not None and {"X", "Y"} & words.keys():
            last = self.codes["polar"]
            last[:] = [words.get("X", last[0]), words.get("Y", last[1])]
            turn = math.radians(last[1])
            words = words | {"X": last[0] * math.cos(turn), "Y": last[0] * math.sin(turn)}
        for index, letter in enumerate("XYZ"):
            if letter in words:
                end[index] = words[letter] * unit + (end[index] if self.modes["inc"] else 0.0)
        return end

    # -- motions ------------------------------------------------------------------------------------------------------

    def travel(self, words: dict[str, float], fixed: bool) -> None:
        """A motion."""
        turned = self.turn_words({k: v for k, v in words.items() if k in "ABC"})
        if fixed:
            q = self.axes(self.base[None], self.rotary())[0]
            for index, letter in enumerate("XYZ"):
                q[index] = words.get(letter, q[index] / self.modes["unit"]) * self.modes["unit"]
            self.base = self.base_of(q)
            self.paths.append(Path(self.mark, self.line, "fixed", q[None].copy(), self.gauge))
            return
        start, end = self.here(), self.target(words)
        points = np.stack([self.inner(point) for point in self.points_of(words, start, end)])
        self.base = self.frame.of(points[-1])
        self.sweep(self.frame.of(points), turned, "rapid" if self.codes["g"] == 0 else "cut")

    def points_of(self, words: dict[str, float], start: Floats, end: Floats) -> Floats:
        """(n, 3) points of the program along a motion."""
        if self.codes["g"] in (0, 1):
            start = np.where(np.isnan(start), end, start)
            return start + np.linspace(0.0, 1.0, 25)[:, None] * (end - start)
        first, second, across = PLANES[self.modes["plane"]]
        normal = np.eye(3)[across] * (-1.0 if self.codes["g"] == 2 else 1.0)
        unit, centre = self.modes["unit"], start.copy()
        if "R" in words:
            chord = end - start
            chord[across] = 0.0
            half, radius = np.linalg.norm(chord) / 2, unit * words["R"]
            rise = math.sqrt(max(radius**2 - half**2, 0.0)) * math.copysign(1.0, radius)
            centre = start + chord / 2 + np.cross(normal, chord / (2 * half)) * rise
        else:
            for index in (first, second):
                centre[index] += unit * words.get("IJK"[index], 0.0)
        arm, last = start - centre, end - centre
        arm[across] = last[across] = 0.0
        sweep = math.atan2(normal @ np.cross(arm, last), arm @ last) % (2 * math.pi)
        return self.round(centre, normal, sweep if sweep > 1e-9 else 2 * math.pi, start, end)

    def hole(self, words: dict[str, float]) -> None:
        """A hole: only its bottom is noted."""
        across, unit = PLANES[self.modes["plane"]][2], self.modes["unit"]
        self.turn_words({k: v for k, v in words.items() if k in "ABC"})
        letter, incremental = "XYZ"[across], self.modes["inc"]
        if "R" in words:
            self.levels["r"] = unit * words["R"] + (self.levels["initial"] if incremental else 0.0)
        if letter in words:
            self.levels["depth"] = unit * words[letter] + (self.levels["r"] if incremental else 0.0)
        count = int(words.get("K", 1))
        for _ in range(count):
            point = self.target({k: v for k, v in words.items() if k != letter})
            point[across] = self.levels["depth"]
            self.base = self.frame.of(self.inner(point))
            q = self.axes(self.base[None], self.rotary())
            self.paths.append(Path(self.mark, self.line, "hole", q, self.real_length))
            up = self.levels["r"] if self.codes["retract"] == 99 else max(self.levels["initial"], self.levels["r"])
            point[across] = up
            self.base = self.frame.of(self.inner(point))


def marked(text: str) -> str:
    """The program with a mark at the end of every line."""
    return "".join(f"{line} (#{n})\n" if line != "%" else "%\n" for n, line in enumerate(text.splitlines()))
