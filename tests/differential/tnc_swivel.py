"""A TNC with rotary tables to judge by: all that `tnc` knows, with M128 and in tilted planes.

Positions are those of the tip in the workpiece while it leads (M128, PLANE), else of the machine's axes. Known besides
are words of B and C, FUNCTION TCPM, PLANE in all forms but PROJECTED, with STAY, or with TURN where one way is left,
cycle 19 by spatial angles, and shifts along a tilted plane.
`SwivelMaker` makes programs of these at random, while a control follows them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares

from differential.errors import Machine
from differential.tnc import STEP, Floats, Tnc
from differential.tnc_five import COLUMN, TURNING, Travel, about, spatial
from differential.tnc_programs import RESET, Maker, xy

TURN = re.compile(r"(?<![A-Z0-9])(I?[BC])\s*([+-]?[\d.]+)(?![\w.])")
PARTS = re.compile(r"(?<![A-Z0-9])([BN][XYZ]|SP[ABC]|EUL[PRNUOT]+|P[123][XYZ]|[ABC])\s*([+-]?[\d.]+)")
TURNING_COLUMNS = [COLUMN[letter] for letter in TURNING]


@dataclass(slots=True)
class Swivel(Tnc):
    """The control; `turns` are the positions of B and C, degrees."""

    model: Machine = field(kw_only=True)
    turns: Floats = field(default_factory=lambda: np.zeros(2))
    travels: list[Travel] = field(default_factory=list)
    m128: bool = False
    plane_axes: Floats | None = None
    inner: Floats = field(default_factory=lambda: np.zeros(3))

    # -- frames -------------------------------------------------------------------------------------------------------

    @property
    def by_tip(self) -> bool:
        return self.m128 or self.plane_axes is not None

    @property
    def tilt(self) -> Floats:
        return np.eye(3) if self.plane_axes is None else self.plane_axes

    @property
    def turned(self) -> Floats:
        flat: Floats = Tnc.turned.fget(self)  # type: ignore[attr-defined]
        return self.tilt @ flat

    @property
    def datum(self) -> Floats:
        tool = np.array([0.0, 0.0, 0.0 if self.by_tip else self.length])
        return np.array(self.presets[self.preset]) + self.shift + self.tilt @ self.inner + tool

    def axes_of(self, points: Floats, turns: Floats, *, by_tip: bool) -> Floats:
        """Axis positions (k, 9) of places of the tip, or of the axes."""
        axes = np.zeros((len(points), 9))
        axes[:, TURNING_COLUMNS] = turns
        if not by_tip:
            axes[:, :3] = points
            return axes
        off = points - self.tip(axes)
        axes[:, self.model.linear] += np.linalg.solve(self.model._slopes(axes), off[..., None])[..., 0]
        return axes

    def tip(self, axes: Floats) -> Floats:
        found: Floats = self.model.tip(axes, np.full(len(axes), self.length)) - self.model.tool_point
        return found

    def lead(self, *, m128: bool, plane: Floats | None) -> None:
        """The tip leads from here on, or the axes do: the machine stands still."""
        axes = self.axes_of(self.at[None], self.turns, by_tip=self.by_tip)
        self.m128, self.plane_axes = m128, plane
        self.at = self.tip(axes)[0] if self.by_tip else axes[0, :3]

    # -- blocks -------------------------------------------------------------------------------------------------------

    def block(self, block: str) -> bool:
        if block.startswith(("PLANE", "CYCL DEF 19.1")):
            parts = {name: float(size) for name, size in PARTS.findall(block)}
            if not parts:
                self.shift, self.inner = self.shift + self.tilt @ self.inner, np.zeros(3)
            self.lead(m128=self.m128, plane=self.plane_of(block, parts))
            if "TURN" in block:
                self.turn_axes()
        elif block.startswith("FUNCTION"):
            self.lead(m128="RESET" not in block, plane=self.plane_axes)
        elif block.startswith("TOOL CALL"):
            axes = self.axes_of(self.at[None], self.turns, by_tip=self.by_tip)
            Tnc.block(self, block)
            self.at = self.tip(axes)[0] if self.by_tip else axes[0, :3]
        else:
            return Tnc.block(self, block)
        return False

    def plane_of(self, block: str, parts: dict[str, float]) -> Floats | None:
        if "AXIAL" in block:
            return self.pose(np.array([parts.get(letter, 0.0) for letter in TURNING]))
        found = axes_of_plane(parts)
        return found if "RELATIV" not in block else self.tilt @ found

    def pose(self, turns: Floats) -> Floats:
        """The directions of the machine's axes in the workpiece."""
        axes = np.zeros((1, 9))
        axes[0, TURNING_COLUMNS] = turns
        return np.asarray(self.model.pose(axes, False).turn[0])

    def turn_axes(self) -> None:
        """TURN: the tool stands square to the plane, found by trying; X, Y and Z of the machine stand still."""
        normal, here = self.tilt[:, 2], self.turns
        starts = [np.array([b, c]) for b in (20.0, 50.0, 80.0) for c in (-120.0, -60.0, 0.0, 60.0, 120.0)]
        tries = [
            least_squares(lambda q: self.pose(q)[:, 2] - normal, start, xtol=1e-15, gtol=1e-15) for start in starts
        ]
        ways = [each.x for each in tries if np.abs(each.fun).max() < 1e-9 and 0 <= each.x[0] <= 180]
        ways = [np.array([b, here[1] + (c - here[1] + 180) % 360 - 180]) for b, c in ways]
        was = self.m128, self.plane_axes
        self.lead(m128=False, plane=None)
        self.swing(self.at.copy(), min(ways, key=lambda way: float(np.abs(way - here).sum())), "machine")
        self.lead(m128=was[0], plane=was[1])

    def shifted(self, words: dict[str, float]) -> None:
        if self.plane_axes is None:
            Tnc.shifted(self, words)
            return
        for address, number in words.items():
            axis = "XYZ".index(address[-1])
            self.inner[axis] = number * self.unit + (self.inner[axis] if address[0] == "I" else 0.0)

    def motion(self, block: str) -> bool:
        words = {address: float(number) for address, number in TURN.findall(block)}
        if "M128" in block:
            self.lead(m128=True, plane=self.plane_axes)
        if "M91" in block or (words and not self.m128):
            was = self.m128, self.plane_axes
            self.lead(m128=False, plane=None)
            self.position(block, words)
            self.lead(m128=was[0], plane=was[1])
        elif words:
            end = self.led({k: v for k, v in self.words(block[1:]).items() if k[-1] in "XYZ"}, {})
            self.swing(self.machine(end), self.turned_by(words), "rapid" if "FMAX" in block else "L")
        else:
            Tnc.motion(self, block)
        if "M129" in block:
            self.lead(m128=False, plane=self.plane_axes)
        return False

    def turned_by(self, words: dict[str, float]) -> Floats:
        turns = self.turns.copy()
        for address, number in words.items():
            turns[TURNING.index(address[-1])] *= address[0] == "I"
            turns[TURNING.index(address[-1])] += number
        return turns

    def position(self, block: str, words: dict[str, float]) -> None:
        """Axes, in machine coordinates or turned only."""
        axes = {k: v for k, v in self.words(block[1:]).items() if k[-1] in "XYZ"}
        end = self.at.copy()
        for address, number in axes.items() if "M91" in block else ():
            end["XYZ".index(address)] = number
        if "M91" not in block and axes:
            end = self.machine(self.led(axes, {}))
        plain = "M91" not in block and {"X", "Y", "Z"} <= axes.keys()
        self.swing(end, self.turned_by(words), "rapid" if plain and "FMAX" in block else "L" if plain else "machine")

    def swing(self, end: Floats, turns: Floats, kind: str) -> None:
        count = 2 + int(max(np.linalg.norm(end - self.at) / STEP, 5 * np.abs(turns - self.turns).max()))
        share = np.linspace(0, 1, count)[:, None]
        ways = self.at + share * (end - self.at), self.turns + share * (turns - self.turns)
        axes = self.axes_of(*ways, by_tip=self.by_tip)
        self.travels.append(Travel("path" if kind == "L" else kind, axes, self.length))
        self.at, self.turns, self.heading = end.copy(), turns, None

    def hole(self, over: Floats, *, by_height: bool) -> None:
        Tnc.hole(self, over, by_height=by_height)
        self.note("hole", self.ways[-1].points)

    def go(self, kind: str, points: Floats) -> None:
        self.note("path" if kind in "LC" else kind, points)
        self.at = points[-1].copy()

    def note(self, kind: str, points: Floats) -> None:
        axes = self.axes_of(points, np.tile(self.turns, (len(points), 1)), by_tip=self.by_tip)
        self.travels.append(Travel(kind, axes, self.length))


def axes_of_plane(parts: dict[str, float]) -> Floats | None:
    """The axes of a plane from spatial or Euler angles, from its X axis and normal, or from three points."""
    if "EULPR" in parts:
        return about(2, parts["EULPR"]) @ about(0, parts["EULNU"]) @ about(2, parts["EULROT"])
    if "NX" in parts:
        return from_two(*(np.array([parts[f"{kind}{axis}"] for axis in "XYZ"]) for kind in "BN"))
    if "P1X" in parts:
        first, second, third = (np.array([parts[f"P{k}{axis}"] for axis in "XYZ"]) for k in (1, 2, 3))
        return from_two(second - first, np.cross(second - first, third - first))
    angles = {name[-1]: size for name, size in parts.items()}
    return spatial(angles) if angles else None


def from_two(x: Floats, z: Floats) -> Floats:
    """The axes of a plane whose X lies towards `x`."""
    y = np.cross(z, x)
    return np.column_stack([v / np.linalg.norm(v) for v in (np.cross(y, z), y, z)])


class SwivelMaker(Maker):
    """Makes programs with tilted planes and tip control."""

    control: Swivel

    def program(self, elements: int) -> str:
        """So many parts, upright, by tip control, or in planes, each of a few elements."""
        self.emit(f"BEGIN PGM G {self.unit}", "TOOL CALL 1 Z S1000", "L X+10 Y+5 Z+250 R0 FMAX")
        parts = [self.upright, self.tilted, self.tilted, self.tilted, self.with_tip_control]
        for _ in range(elements):
            self.dice.choice(parts)()
        self.emit("L Z+250 FMAX")
        return "\n".join([*self.lines, f"END PGM G {self.unit}", ""])

    def some(self, count: int) -> None:
        """A few elements of what stands as it is."""
        kinds: list[Callable[[], None]] = [self.straight, self.arc, self.polar, self.tangent, self.other_plane]
        kinds += [self.holes, self.values, self.around]
        for _ in range(count):
            self.dice.choice(kinds)()

    def other_plane(self) -> None:
        x, y, z = self.control.program()
        radius, word = self.dice.uniform(3, 25), self.dice.choice(["DR+", "DR-"])
        choices = [
            [f"CC X{x + radius:+.4f} Z{z:+.4f}", f"C X{x + 2 * radius:+.4f} Z{z:+.4f} {word}"],
            [f"CR Y{y + radius:+.3f} Z{z + radius / 2:+.3f} R{radius:+.3f} {word}"],
        ]
        self.emit(*self.dice.choice(choices), f"CC {xy(self.somewhere())}")

    def around(self) -> None:
        """A rotation or a mirror about the datum, a shift, and a few elements in it."""
        frame = self.dice.choice(
            [
                ["CYCL DEF 10.0 ROTATION", f"CYCL DEF 10.1 ROT{self.number(-100, 100, 2)}"],
                ["CYCL DEF 8.0 MIRROR", f"CYCL DEF 8.1 {self.dice.choice(['X', 'Y', 'X Y'])}"],
                [f"TRANS DATUM AXIS X{self.number(-9, 9, 2)} Z{self.number(-3, 3, 2)}"],
            ]
        )
        self.emit(*frame, f"L {xy(self.somewhere())} Z+3 F700")
        for _ in range(2):
            self.dice.choice([self.straight, self.arc, self.tangent, self.holes])()
        self.emit(*RESET, f"L {xy(self.somewhere())} Z+5 F700")

    def upright(self) -> None:
        self.emit(f"L {xy(self.somewhere())} Z+30 FMAX")
        self.some(2)
        self.emit("L Z+250 FMAX")

    def tilted(self) -> None:
        """A plane to which the tool stands square, said in one of many ways; the control may turn the axes itself."""
        b, c = round(self.dice.uniform(5, 60), 3), round(self.dice.uniform(-80, 80), 3)
        x, y, z = axes = self.control.pose(np.array([b, c]))[:, 2]
        turn, sideways = self.dice.uniform(-180, 180), [self.dice.uniform(-1, 1) for _ in "XYZ"]
        spa, spb = -math.degrees(math.asin(y)), math.degrees(math.atan2(x, z))
        precession = math.degrees(math.atan2(x, -y))
        base, other = np.cross(sideways, axes), np.cross(axes, np.cross(sideways, axes))
        corner = np.array([self.dice.uniform(-50, 50) for _ in "XYZ"])
        points = corner, corner + 40 * base, corner + 30 * other + 7 * base
        forms = [
            [f"PLANE SPATIAL SPA{spa:+.7f} SPB{spb:+.7f} SPC+0"],
            [f"PLANE SPATIAL SPA+0 SPB{spb:+.7f} SPC+0 STAY", f"PLANE RELATIV SPA{spa:+.7f}"],
            [f"PLANE EULER EULPR{precession:+.7f} EULNU{math.degrees(math.acos(z)):+.7f} EULROT{turn:+.3f}"],
            [f"PLANE VECTOR {three('B', base)} {three('N', axes)}"],
            ["PLANE POINTS " + " ".join(three(f"P{k}", point) for k, point in enumerate(points, 1))],
            [f"PLANE AXIAL B{b:+.3f} C{c:+.3f}"],
            [f"CYCL DEF 19.1 A{spa:+.7f} B{spb:+.7f} C+0"],
        ]
        chosen = self.dice.choice(forms)
        self.emit("L Z+400 R0 FMAX M91")
        turns = self.dice.random() < 0.4 and chosen[-1].startswith("PLANE")
        if not turns:
            self.emit(f"L B{b:+.3f} C{c:+.3f} FMAX")
        follows = "" if chosen[-1].startswith("CYCL") else " TURN FMAX SEQ+" if turns else " STAY"
        self.inside([*chosen[:-1], chosen[-1] + follows])

    def inside(self, plane: list[str]) -> None:
        tip = self.dice.random() < 0.3
        self.emit(*(["M128"] if tip else []), *plane, f"L {xy(self.somewhere())} Z+40 FMAX", "L Z+3 F900")
        self.some(3)
        self.emit("L Z+40 FMAX", "PLANE RESET STAY", *(["M129"] if tip else []))
        self.emit("L Z+400 R0 FMAX M91", "L B+0 C+0 FMAX", f"L {xy(self.somewhere())} Z+50 FMAX")

    def with_tip_control(self) -> None:
        b, c = round(self.dice.uniform(5, 60), 3), round(self.dice.uniform(-80, 80), 3)
        self.emit("L Z+400 R0 FMAX M91", f"L B{b:+.3f} C{c:+.3f} FMAX")
        self.emit(self.dice.choice(["M128", "L M128 F1000", "FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS"]))
        self.emit(f"L {xy(self.somewhere())} Z+40 FMAX")
        for _ in range(3):
            turns = f"B{self.number(5, 60)} C{c + self.dice.uniform(-30, 30):+.3f}"
            self.emit(f"L {xy(self.somewhere())} Z{self.number(5, 40)} {turns} F900")
            self.dice.choice([self.straight, self.arc, self.tangent, self.polar])()
        self.emit("L Z+60 FMAX", "M129" if "M128" in str(self.lines[-20:]) else "FUNCTION RESET TCPM")
        self.emit("L Z+400 R0 FMAX M91", "L B+0 C+0 FMAX", f"L {xy(self.somewhere())} Z+50 FMAX")


def three(name: str, vector: Floats) -> str:
    """A vector as three words."""
    return " ".join(f"{name}{axis}{part:+.7f}" for axis, part in zip("XYZ", vector, strict=True))
