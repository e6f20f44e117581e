"""A small interpreter of SINUMERIK programs, for judging: written from the manual, slow, and sharing nothing with the
product. It follows the tool as the control of one machine would and gives its path as axis positions.

Each line of a program may end with a mark, `;#7`: what is executed after it belongs to it, lines that a correction puts
in included. So original and corrected program are compared mark by mark. What is not known here raises `KeyError` or
`NotImplementedError`: nothing is judged by half.

Source: Siemens, "SINUMERIK 840D sl, NC programming" (fundamentals, job planning); CYCLE800: "SINUMERIK Operate".
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np

from differential.errors import LETTERS, Machine
from differential.sinumerik_frames import PLANES, Floats, Frame, about, projected
from differential.sinumerik_milling import NAMES as MILLING
from differential.sinumerik_milling import milling
from differential.sinumerik_motions import Path, Standing
from differential.sinumerik_walk import Walk

WORD = re.compile(
    r"(?P<name>[A-Z_$][A-Z_]+|[A-Z]\d(?==)|[A-Z])(?:=(?P<value>(?:[^\s()]|\((?:[^()]|\([^()]*\))*\))+)"
    r"|(?P<number>[-+]?\d*\.?\d*)|(?P<list>\([^;]*\)))"
)


DRILLING = {f"CYCLE{number}" for number in (*range(81, 90), 840)}


class Control(Standing):
    """Executes programs."""

    __slots__ = ()

    # -- a program ----------------------------------------------------------------------------------------------------

    def run(self, text: str) -> list[Path]:
        """Follow a program to its end."""
        Walk(self, text).run()
        return self.paths

    def assign(self, name: str, value: float) -> None:
        """Give a variable its value."""
        self.values[name] = float(value)

    def value(self, text: str) -> Any:
        """The value of an expression, angles in degrees."""
        names = dict(self.values) | {
            "SIN": lambda a: math.sin(math.radians(a)),
            "COS": lambda a: math.cos(math.radians(a)),
            "SQRT": math.sqrt,
            "POT": lambda a: a * a,
            "ABS": abs,
        }
        names |= {name: (lambda v, name=name: (name, v)) for name in ("AC", "IC", "DC", "ACP", "ACN")}
        return eval(text.strip().replace("<>", "!="), {"__builtins__": {}}, names)

    # -- a block ------------------------------------------------------------------------------------------------------

    def block(self, body: str) -> None:
        """One block."""
        if found := re.fullmatch(r"(MCALL\s*)?((?:CYCLE|HOLES|POCKET|SLOT)\d+|LONGHOLE)?\s*(\(.*\))?", body):
            self.cycle(found[1], found[2], found[3])
            return
        codes, words, names = [], {}, []
        for item in WORD.finditer(body):
            name, value, number = item["name"], item["value"], item["number"]
            if name in ("G", "M") and number:
                codes.append((name, int(float(number))))
            elif value is not None:
                words[name] = self.value(value)
            elif number and len(name) == 1:
                words[name] = float(number)
            else:
                names.append(name)
        plain = {name: value[1] if isinstance(value, tuple) else value for name, value in words.items()}
        if self.settings(codes, names, plain):
            return
        self.tool(plain, names, codes)
        if any(g in (4, 74, 75) for name, g in codes if name == "G"):
            raise NotImplementedError(body)
        moving = {*LETTERS, "AP", "RP", "A3", "B3", "C3", "A2", "B2", "C2"}
        if moving & set(words) or (self.modes["g"] in (2, 3) and {"I", "J", "K"} & set(words)):
            self.move(words, "SUPA" in names or ("G", 153) in codes or ("G", 53) in codes)
            if self.modes["drill"]:
                self.drill(*self.modes["drill"])

    def settings(self, codes: list[tuple[str, int]], names: list[str], words: dict[str, float]) -> bool:
        """Codes and names; True if they took the words of the block."""
        for name, code in codes:
            if name == "M":
                continue
            if code <= 3:
                self.modes["g"] = code
            elif code in PLANES:
                if code != self.modes["plane"]:
                    self.modes["pole"] = np.full(2, np.nan)
                self.modes["plane"] = code
            elif code in (90, 91):
                self.modes["inc"] = code == 91
            elif code in (70, 71, 700, 710):
                self.modes["unit"] = 25.4 if code in (70, 700) else 1.0
            elif code in self.offsets or code == 500:
                self.settable = Frame(np.eye(3), np.array(self.offsets.get(code, (0.0, 0.0, 0.0))))
            elif code in (110, 111, 112):
                self.pole(code, words)
                return True
            elif code not in (93, 94, 64, 40, 41, 42, 60, 9, 53, 153):
                raise NotImplementedError(f"G{code}")
        for name in names:
            if name in FRAMES or name[1:] in FRAMES:
                kind = name if name in FRAMES else name[1:]
                before = self.program if name != kind else Frame()
                self.program = before @ FRAMES[kind](self, words)
                return True
            self.word(name)
        return False

    def word(self, name: str) -> None:
        """A name with no value."""
        if name in ("CIP", "CT"):
            self.modes["g"] = name
        elif name in ("TRAORI", "TRAFOOF"):
            self.transform(name == "TRAORI")
        elif name in ("ORIEULER", "ORIRPY"):
            self.modes["angles"] = name
        elif name.startswith("ORI"):
            self.modes["ori"] = name
        elif name in ("DIAMON", "DIAMOF"):
            self.modes["diameter"] = 2 if name == "DIAMON" else 1
        elif name not in ("SUPA", "N", "M", "S", "F"):
            raise NotImplementedError(name)

    def tool(self, words: dict[str, float], names: list[str], codes: list[tuple[str, int]]) -> None:
        """T with M6 takes the tool with its edge D1 in; D0 takes its length away. The axes stand still."""
        if "T" in words:
            self.modes["tool"] = int(words["T"])
        if ("M", 6) not in codes and "D" not in words:
            return
        if ("M", 6) in codes:
            self.gauge = self.tools[self.modes["tool"]]
        new = self.gauge if words.get("D", 1.0) else 0.0
        q = self.axes(self.base[None], self.rotary())[0]
        self.length = new
        self.base = self.base_of(q)

    def cycle(self, modal: str | None, name: str | None, arguments: str | None) -> None:
        """MCALL, drilling cycles and CYCLE800."""
        if name is None:
            self.modes["drill"] = None
            return
        values = [self.value(part) if part.strip() else None for part in (arguments or "()")[1:-1].split(",")]
        if name == "CYCLE800":
            self.tilt([value or 0.0 for value in values])
        elif name in DRILLING:
            depth = values[3] if values[3] is not None else values[1] - values[4]
            if modal:
                self.modes["drill"] = values[0], depth
            else:
                self.drill(values[0], depth)
        elif name in ("HOLES1", "HOLES2"):
            self.holes(name, values)
        elif name in MILLING:
            call = milling(name, values)
            if modal:
                self.modes["drill"] = call.clear, call.bottom
            else:
                first, second, _ = PLANES[self.modes["plane"]]
                places = zip((first, second), call.place, strict=True)
                self.move({"XYZ"[index]: ("AC", value) for index, value in places}, False)
                self.drill(call.clear, call.bottom)
        else:
            raise NotImplementedError(name)

    def holes(self, name: str, values: list[float]) -> None:
        """A row, from its nearer end, or a circle, whose holes are turned about its centre one after the other."""
        one, two, angle, *rest = (np.array(value) for value in values)
        first, second, _ = PLANES[self.modes["plane"]]
        if name == "HOLES1":
            (off, step, count), along = rest, about(2, angle)[:2, 0]
            places = [np.array([one, two]) + along * (off + n * step) for n in range(int(count))]
            here = self.frame.back(self.base)[[first, second]] / self.modes["unit"]
            nearer = np.linalg.norm(here - places[-1]) < np.linalg.norm(here - places[0])
            places = places[::-1] if nearer else places
        else:
            radius, (start, step, count) = angle, rest
            turn = about(2, step if step else 360.0 / count)[:2, :2]
            arm, places = radius * about(2, start)[:2, 0], []
            for _ in range(int(count)):
                places.append(np.array([one, two]) + arm)
                arm = turn @ arm
        for place in places:
            self.move({"XYZ"[index]: value for index, value in zip((first, second), place, strict=True)}, False)
            self.drill(*self.modes["drill"])

    def drill(self, clear: float, depth: float) -> None:
        """Down and up."""
        self.to_height(depth)
        self.paths.append(
            Path(self.mark, self.line, "hole", self.axes(self.base[None], self.rotary()), self.real_length)
        )
        self.to_height(clear)

    def to_height(self, height: float) -> None:
        """Along the tool only."""
        frame = self.frame
        p = frame.back(self.base)
        p[PLANES[self.modes["plane"]][2]] = height * self.modes["unit"]
        self.base = frame.of(p)

    def along(self, bodies: list[tuple[int, str]], values: list[float]) -> None:
        """CYCLE72: where the lines of its contour end is a point at its bottom, unless the corner there is cut off.

        Codes are what they were behind it.
        """
        modes = dict(self.modes)
        clear, reference, _, deep = values[:4]
        bottom = reference - deep if len(values) > 16 and values[21] % 10 == 1 else deep
        for self.line, body in bodies:
            self.block(body.split(";")[0].strip())
            if "RND" in body or "CHF" in body:
                self.to_height(bottom)
            else:
                self.drill(bottom, bottom)
        self.to_height(clear)
        self.modes = modes

    # -- frames -------------------------------------------------------------------------------------------------------

    def pole(self, code: int, words: dict[str, float]) -> None:
        """G110 from where the axes stand, G111 in the frame, G112 from the last pole."""
        first, second, _ = PLANES[self.modes["plane"]]
        here = self.frame.back(self.base)
        origin = {110: here[[first, second]], 111: np.zeros(2), 112: self.modes["pole"]}[code]
        step = [words.get("XYZ"[index], 0.0) * self.modes["unit"] for index in (first, second)]
        self.modes["pole"] = origin + np.array(step)

    def tilt(self, values: list[float]) -> None:
        """CYCLE800: the rotary axes turn until the tool stands square to the plane."""
        if len(values) < 10:
            self.stand(lambda: setattr(self, "swivel", Frame()), tcp=False)
            return
        mode, table = int(values[3]), int(values[2])
        before, angles, after = np.array(values[4:7]), values[7:10], np.array([*values[10:13], 0.0, 0.0, 0.0][:3])
        if mode >> 6 == 0:
            turn = np.eye(3)
            for place, angle in enumerate(angles):
                turn = turn @ about((mode >> 2 * place & 3) - 1, angle)
        elif mode >> 6 == 1:
            turn = about(2, angles[0]) @ about(1, angles[1])
        else:
            turn = projected(mode & 63, angles)
        frame = Frame(turn, before + turn @ after)
        self.swivel = self.swivel @ frame if table % 10 == 1 else frame
        normal = (self.settable @ self.swivel).turn[:, 2]
        wanted = values[13] if len(values) > 13 else -1.0
        ways = self.ways(normal)
        way = max(ways, key=lambda each: wanted * each["A"]) if len(ways) > 1 else ways[0]
        if abs(normal[2]) > 1 - 1e-12:
            way = dict(self.turned)
        self.modes["tcp"], self.turned = True, way
        self.base = np.full(3, np.nan)

    def transform(self, on: bool) -> None:
        """TRAORI and TRAFOOF: the axes stand still."""
        self.stand(lambda: None, tcp=on)
        self.modes["transformed"] = on

    def stand(self, change: Callable[[], None], tcp: bool) -> None:
        """Change something while the axes stand still."""
        q = self.axes(self.base[None], self.rotary())[0]
        change()
        self.modes["tcp"] = tcp
        self.base = self.base_of(q)


def translation(control: Control, words: dict[str, float]) -> Frame:
    """TRANS."""
    return Frame(np.eye(3), np.array([words.get(letter, 0.0) for letter in "XYZ"]) * control.modes["unit"])


def rotation(control: Control, words: dict[str, float]) -> Frame:
    """ROT: RPY angles, about Z first, or one angle in the plane."""
    if "RPL" in words:
        return Frame(about(PLANES[control.modes["plane"]][2], words["RPL"]))
    x, y, z = (words.get(letter, 0.0) for letter in "XYZ")
    return Frame(about(2, z) @ about(1, y) @ about(0, x))


def mirroring(control: Control, words: dict[str, float]) -> Frame:
    """MIRROR."""
    return Frame(np.diag([-1.0 if letter in words else 1.0 for letter in "XYZ"]))


def scaling(control: Control, words: dict[str, float]) -> Frame:
    """SCALE."""
    return Frame(np.diag([words.get(letter, 1.0) for letter in "XYZ"]))


FRAMES: dict[str, Callable[[Control, dict[str, float]], Frame]] = {
    "TRANS": translation,
    "ROT": rotation,
    "MIRROR": mirroring,
    "SCALE": scaling,
}


def marked(text: str) -> str:
    """The program with a mark at the end of every line."""
    return "".join(f"{line} ;#{n}\n" for n, line in enumerate(text.splitlines()))


def tips(machine: Machine, paths: list[Path], actual: bool) -> list[Floats]:
    """The tip (n, 3) along each path, in the workpiece: of the perfect machine, or really."""
    if not paths:
        return []
    q = np.concatenate([path.q for path in paths])
    length = np.concatenate([np.full(len(path.q), path.length) for path in paths])
    found = machine.actual_tip(q, length) if actual else machine.tip(q, length)
    return np.split(found, np.cumsum([len(path.q) for path in paths])[:-1])


def control_of(machine: Machine, start: dict[str, float], **given: Any) -> Control:
    """A control whose axes stand at `start`, mm and degrees."""
    base = np.array([start[letter] for letter in "XYZ"])
    return Control(machine, base=base, turned={"A": start["A"], "C": start["C"]}, **given)
