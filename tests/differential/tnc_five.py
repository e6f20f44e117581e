"""A five-axis TNC to judge by: straight motions with rotary axes, with M128, and in tilted planes.

It shares nothing with the product; how axes and tip belong together it asks the second model of the machine. Known are
L with increments and M91, LN with TX TY TZ, M128, M129, FUNCTION TCPM and RESET TCPM, PLANE SPATIAL STAY and RESET,
cycle 19 with spatial angles, cycles 7 and 10, TRANS DATUM, and TOOL CALL. `program` makes programs of these at random.
"""

from __future__ import annotations

import math
import random
import re
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares

from differential.errors import Machine
from differential.tnc import Floats, blocks_of

COLUMN = {"X": 0, "Y": 1, "Z": 2, "B": 4, "C": 5}
TURNING = "BC"
WORD = re.compile(r"(?<![A-Z0-9])(I?[XYZBC])\s*([+-]?[\d.]+)(?![\w.])")
VECTOR = re.compile(r"T[XYZ]([+-][\d.]+)")
ANGLES = re.compile(r"(?:SP)?([ABC])([+-][\d.]+)")
SAMPLES, OF_TURNS = 60, 500


@dataclass(frozen=True, slots=True)
class Travel:
    """One motion: axis positions (k, 9) mm and degrees, as the columns of `errors.Machine`, and the tool's length."""

    kind: str
    axes: Floats
    length: float


def about(axis: int, degrees: float) -> Floats:
    """A right-handed rotation about X, Y or Z (0, 1, 2)."""
    turn = math.radians(degrees)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    found = np.eye(3)
    found[first, first] = found[second, second] = math.cos(turn)
    found[first, second], found[second, first] = -math.sin(turn), math.sin(turn)
    return found


def spatial(angles: dict[str, float]) -> Floats:
    """The plane of spatial angles: about X, then Y, then Z of the workpiece."""
    a, b, c = (angles.get(letter, 0.0) for letter in "ABC")
    return about(2, c) @ about(1, b) @ about(0, a)


@dataclass(slots=True)
class FiveAxisTnc:
    """The control; `at` are the positions of its axes."""

    machine: Machine
    preset: Floats
    lengths: dict[int, float]
    at: Floats
    travels: list[Travel] = field(default_factory=list)
    m128: bool = False
    plane: Floats | None = None
    shift: Floats = field(default_factory=lambda: np.zeros(3))
    inner: Floats = field(default_factory=lambda: np.zeros(3))
    turn: float = 0.0
    length: float = 0.0

    def run(self, text: str) -> list[Travel]:
        """Follow a program."""
        for _, block in blocks_of(text):
            if block and not block.startswith(("BEGIN", "END")):
                self.block(block)
        return self.travels

    def block(self, block: str) -> None:
        words = {address: float(number) for address, number in WORD.findall(block)}
        if found := re.match(r"TOOL CALL (\d+)", block):
            self.length = self.lengths[int(found[1])]
        elif block.startswith("TRANS DATUM RESET"):
            self.shift, self.inner = np.zeros(3), np.zeros(3)
        elif block.startswith(("CYCL DEF 7.", "TRANS DATUM AXIS")):
            datum = self.shift if self.plane is None else self.inner
            for letter, number in words.items():
                datum["XYZ".index(letter)] = number
        elif found := re.match(r"CYCL DEF 10.1 ROT([+-]?[\d.]+)", block):
            self.turn = float(found[1])
        elif block.startswith(("PLANE", "CYCL DEF 19.1")):
            angles = {letter: float(number) for letter, number in ANGLES.findall(block.split(" ", 2)[2])}
            self.plane = spatial(angles) if angles and "RESET" not in block else None
            self.inner = self.inner if angles else np.zeros(3)
        elif not block.startswith("CYCL DEF"):
            self.motion(block, words)

    def motion(self, block: str, words: dict[str, float]) -> None:
        self.m128 = (self.m128 or "M128" in block or "FUNCTION TCPM" in block) and "RESET TCPM" not in block
        if "M91" in block:
            for letter, number in words.items():
                self.at[COLUMN[letter]] = number
            self.travels.append(Travel("machine", self.at[None].copy(), self.length))
        elif words:
            if "TX" in block:
                words |= self.turned_to(np.array([float(part) for part in VECTOR.findall(block)]))
            rapid = "rapid" if {"X", "Y", "Z"} <= words.keys() else "positioning"
            self.go(words, rapid if re.search(r"F ?MAX", block) else "path")
        self.m128 &= "M129" not in block

    def turned_to(self, vector: Floats) -> dict[str, float]:
        """The rotary words that point the tool along a vector of the program, from where they stand, by trying."""
        rotation, _ = self.frame()
        wanted = rotation @ vector / np.linalg.norm(vector)
        turning = [COLUMN[letter] for letter in TURNING]

        def off(turns: Floats) -> Floats:
            axes = np.zeros((1, 9))
            axes[0, turning] = turns
            return np.asarray(self.machine.pose(axes, False).turn[0] @ self.machine.tool_direction - wanted)

        here = self.at[turning]
        starts = [
            here,
            *(here * [1, 0] + [0, c] for c in (-150, -90, -30, 30, 90, 150)),
            [20, 0],
            [20, 120],
            [20, -120],
        ]
        found = [least_squares(off, start, xtol=1e-15, ftol=1e-15, gtol=1e-15) for start in starts]
        ways = [each.x for each in found if np.abs(each.fun).max() < 1e-9]
        ways = [np.array([b, here[1] + (c - here[1] + 180) % 360 - 180]) for b, c in ways if 0 <= b <= 180]
        best = min(ways, key=lambda way: float(np.abs(way - here).sum()))
        return dict(zip(TURNING, best.tolist(), strict=True))

    # -- geometry -----------------------------------------------------------------------------------------------------

    def frame(self) -> tuple[Floats, Floats]:
        """What acts on program coordinates, and the datum."""
        plane = np.eye(3) if self.plane is None else self.plane
        return plane @ about(2, self.turn), self.preset + self.shift + plane @ self.inner

    def tip(self, axes: Floats) -> Floats:
        """Tip coordinates (k, 3) of axis positions."""
        found: Floats = self.machine.tip(axes, np.full(len(axes), self.length)) - self.machine.tool_point
        return found

    def axes_of(self, tips: Floats, turns: Floats) -> Floats:
        """Axis positions (k, 9) with which the tip is there and the rotary axes stand so."""
        axes = np.zeros((len(tips), 9))
        axes[:, [COLUMN[letter] for letter in TURNING]] = turns
        slopes = self.machine._slopes(axes)
        axes[:, self.machine.linear] += np.linalg.solve(slopes, (tips - self.tip(axes))[..., None])[..., 0]
        return axes

    def go(self, words: dict[str, float], kind: str) -> None:
        by_tip = self.m128 or self.plane is not None
        turning = [COLUMN[letter] for letter in TURNING]
        rotation, datum = self.frame()
        here = self.tip(self.at[None])[0] if by_tip else self.at[:3] - [0, 0, self.length]
        end, turns = rotation.T @ (here - datum), self.at[turning].copy()
        for address, number in words.items():
            place, index = (turns, TURNING) if address[-1] in TURNING else (end, "XYZ")
            place[index.index(address[-1])] *= address[0] == "I"
            place[index.index(address[-1])] += number
        target = rotation @ end + datum
        moved = bool((turns != self.at[turning]).any())
        share = np.linspace(0, 1, OF_TURNS if moved else SAMPLES)[:, None]
        way = self.at[turning] + share * (turns - self.at[turning])
        if by_tip:
            axes = self.axes_of(here + share * (target - here), way)
        else:
            stop = self.at.copy()
            stop[:3], stop[turning] = target + np.array([0.0, 0.0, self.length]), turns
            axes = self.at + share * (stop - self.at)
        self.travels.append(Travel(kind, axes, self.length))
        self.at = axes[-1].copy()


# -- programs at random -----------------------------------------------------------------------------------------------


class Dice(random.Random):
    """Chance; `least` is the smallest angle that the program writes for its table, degrees."""

    least = -90.0


def program(seed: int, machine: Machine, parts: int = 4) -> str:
    """A program of so many parts, each of which begins and ends with upright axes or says where it is."""
    dice = Dice(seed)
    dice.least = 0.0 if seed % 2 else -90.0
    kinds = [plain, with_tip_control, in_plane, in_plane_with_tip_control, in_plane_of_cycle_19, shifted, turned]
    kinds += [by_directions]
    lines = ["BEGIN PGM F MM", "TOOL CALL 1 Z", "L Z+250 R0 FMAX", "L X+0 Y+0 FMAX"]
    for _ in range(parts):
        lines += dice.choice(kinds)(dice, machine)
    return "\n".join([*lines, "L Z+250 FMAX", "END PGM F MM", ""])


def number(dice: Dice, least: float, most: float) -> str:
    return f"{dice.uniform(least, most):+.3f}"


def place(dice: Dice) -> str:
    return f"X{number(dice, -40, 40)} Y{number(dice, -40, 40)} Z{number(dice, 20, 60)}"


def plain(dice: Dice, machine: Machine) -> list[str]:
    return [
        f"L {place(dice)} B{number(dice, 0, 60)} C{number(dice, dice.least, 90)} FMAX",
        f"L X{number(dice, -40, 40)} F700",
        "L IB+3.5 IC-12.25 F300",
        f"L {place(dice)} C{number(dice, dice.least, 90)} F900",
    ]


def with_tip_control(dice: Dice, machine: Machine) -> list[str]:
    tcpm = ("FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS", "FUNCTION RESET TCPM")
    on, off = dice.choice([("L M128 F1000", "M129"), tcpm])
    rotation = [f"CYCL DEF 10.1 ROT{number(dice, -60, 60)}"] if dice.random() < 0.4 else []
    return [
        on,
        *rotation,
        f"L {place(dice)} B{number(dice, 0, 50)} C{number(dice, dice.least, 90)} F900",
        f"L X{number(dice, -40, 40)} F700",
        f"L B{number(dice, 0, 50)} F400",
        "L IX+4 IB-2.5 IC+7.5",
        "CYCL DEF 10.1 ROT+0",
        off,
        "L Z+250 FMAX",
    ]


def by_directions(dice: Dice, machine: Machine) -> list[str]:
    """Directions of the tool instead of angles: they may lead the table where no word of the program does."""
    lines = ["M128", f"L {place(dice)} B{number(dice, 15, 40)} C{number(dice, 0, 20)} F900"]
    axes = np.zeros((1, 9))
    for c in (dice.uniform(-40, 0), dice.uniform(-70, -40)):
        axes[0, COLUMN["B"]], axes[0, COLUMN["C"]] = dice.uniform(15, 40), c
        x, y, z = machine.pose(axes, False).turn[0] @ machine.tool_direction
        lines.append(f"LN {place(dice)} NX+0 NY+0 NZ+1 TX{x:+.7f} TY{y:+.7f} TZ{z:+.7f} F600")
    return [*lines, f"L {place(dice)} B{number(dice, 15, 40)} C{number(dice, 5, 25)} F500", "M129", "L Z+250 FMAX"]


def shifted(dice: Dice, machine: Machine) -> list[str]:
    shift = f"TRANS DATUM AXIS X{number(dice, -5, 5)} Z{number(dice, -5, 5)}"
    return ["TOOL CALL 2 Z", shift, f"L {place(dice)} F800", "TRANS DATUM RESET", f"L {place(dice)}", "TOOL CALL 1 Z"]


def turned(dice: Dice, machine: Machine) -> list[str]:
    rotation = f"CYCL DEF 10.1 ROT{number(dice, -60, 60)}"
    return [rotation, f"L {place(dice)} FMAX", f"L X{number(dice, -40, 40)} F500", "L IX+3 IY-2", "CYCL DEF 10.1 ROT+0"]


def in_plane(dice: Dice, machine: Machine, *, tip: bool = False, cycle: bool = False) -> list[str]:
    """The rotary axes are turned, and the plane is the one to which the tool is square then."""
    b, c = round(dice.uniform(10, 60), 3), round(dice.uniform(max(dice.least, -80), 80), 3)
    axes = np.zeros((1, 9))
    axes[0, COLUMN["B"]], axes[0, COLUMN["C"]] = b, c
    x, y, z = machine.pose(axes, False).turn[0] @ machine.tool_direction
    tilt = -math.degrees(math.asin(y)), math.degrees(math.atan2(x, z))
    plane = "PLANE SPATIAL SPA{:+.6f} SPB{:+.6f} SPC+0 STAY" if not cycle else "CYCL DEF 19.1 A{:+.6f} B{:+.6f} C+0"
    inside = [f"CYCL DEF 7.1 X{number(dice, -5, 5)}", f"CYCL DEF 7.2 Z{number(dice, -5, 5)}"]
    inside += [f"CYCL DEF 10.1 ROT{number(dice, -60, 60)}"] if dice.random() < 0.4 else []
    return [
        "L Z+400 R0 FMAX M91",
        f"L B{b:+.3f} C{c:+.3f} FMAX",
        *(["M128"] if tip else []),
        plane.format(*tilt),
        *(inside if dice.random() < 0.6 else []),
        f"L X{number(dice, -30, 30)} Y{number(dice, -30, 30)} Z{number(dice, 40, 60)} FMAX",
        f"L Z{number(dice, -5, 5)} F300",
        f"L X{number(dice, -30, 30)}",
        "L IX+5 IY-3",
        "L Z+60 FMAX",
        *([f"L B{min(b + 2, 60):+.3f} X{number(dice, -30, 30)} F500"] if tip else []),
        "CYCL DEF 10.1 ROT+0",
        "TRANS DATUM RESET",
        "CYCL DEF 19.1" if cycle else "PLANE RESET STAY",
        *(["M129"] if tip else []),
        "L Z+400 R0 FMAX M91",
        "L B+0 C+0 FMAX",
        f"L {place(dice)} FMAX",
    ]


def in_plane_with_tip_control(dice: Dice, machine: Machine) -> list[str]:
    return in_plane(dice, machine, tip=True)


def in_plane_of_cycle_19(dice: Dice, machine: Machine) -> list[str]:
    return in_plane(dice, machine, cycle=True)
