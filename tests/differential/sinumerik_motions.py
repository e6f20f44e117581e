"""Where the axes of a machine stand, and the ways on which a control of SINUMERIK takes them, for judging.

`base` is X Y Z with the settable frame and all others worked in: what the axes have without transformation and tool,
what the tip has in the workpiece (in the sense of the machine at A0 C0) with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from differential.errors import LETTERS, Machine
from differential.sinumerik_frames import PLANES, Floats, Frame, about, rotated, through

LINE_SAMPLES, ARC_SAMPLES = 25, 721


@dataclass(frozen=True, slots=True)
class Path:
    """One motion: axis positions (n, 9) at even steps, mm and degrees.

    sort    "cut", "rapid", or "fixed" for machine coordinates
    length  of the tool in the spindle, mm, whether the control counts it or not
    """

    mark: tuple[int, int]
    line: int
    sort: str
    q: Floats
    length: float


@dataclass(slots=True)
class Standing:
    """A machine and its control, and how a program has left them.

    offsets  settable frames by number (54, 55, ...), X Y Z
    tools    lengths by number
    """

    machine: Machine
    offsets: dict[int, tuple[float, float, float]]
    tools: dict[int, float]
    base: Floats
    turned: dict[str, float]
    settable: Frame = field(default_factory=Frame)
    swivel: Frame = field(default_factory=Frame)
    program: Frame = field(default_factory=Frame)
    modes: dict[str, Any] = field(default_factory=dict)
    values: dict[str, Any] = field(default_factory=dict)
    length: float = 0.0
    gauge: float = 0.0
    tangent: Floats | None = None
    paths: list[Path] = field(default_factory=list)
    mark: tuple[int, int] = (-1, 0)
    line: int = 0

    def __post_init__(self) -> None:
        self.modes = {"g": 0, "plane": 17, "inc": False, "unit": 1.0, "tcp": False, "pole": np.zeros(2), "diameter": 1}
        self.modes |= {"polar": [0.0, 0.0], "drill": None, "transformed": False, "ori": "", "angles": ""}

    # -- where it stands -----------------------------------------------------------------------------------------------

    @property
    def frame(self) -> Frame:
        """The whole chain."""
        return self.settable @ self.swivel @ self.program

    def rotary(self) -> Floats:
        """(1, 9) axis positions with the rotary axes where they stand and the others at zero."""
        q = np.zeros((1, 9))
        for letter, degrees in self.turned.items():
            q[0, LETTERS.index(letter)] = degrees
        return q

    def axes(self, base: Floats, rotary: Floats) -> Floats:
        """(n, 9) axis positions for points (n, 3) of the base and rotary positions (n, 9)."""
        q = np.broadcast_to(rotary, (len(base), 9)).copy()
        if not self.modes["tcp"]:
            q[:, :3] = base + np.array([0.0, 0.0, self.length])
            return q
        flat = np.zeros_like(q)
        flat[:, :3] = base
        wanted = self.machine.tip(flat)
        q[:, :3] = 0.0
        miss = wanted - self.machine.tip(q, self.length)
        slopes = np.stack([self.machine.tip(q + np.eye(9)[k]) - self.machine.tip(q) for k in range(3)], axis=-1)
        q[:, :3] = np.linalg.solve(slopes, miss[..., None])[..., 0]
        return q

    def base_of(self, q: Floats) -> Floats:
        """The point of the base at which axis positions (9,) stand."""
        if not self.modes["tcp"]:
            return np.asarray(q[:3] - np.array([0.0, 0.0, self.length]))
        zero = np.zeros((1, 9))
        slopes = np.stack([(self.machine.tip(np.eye(9)[[k]]) - self.machine.tip(zero))[0] for k in range(3)], axis=-1)
        return np.linalg.solve(slopes, self.machine.tip(q[None], self.length)[0] - self.machine.tip(zero)[0])

    @property
    def real_length(self) -> float:
        """Of the tool, also where a transformation leads the spindle reference, since no length is in force."""
        return (self.length or self.gauge) if self.modes["tcp"] else self.gauge

    def pointing(self, a: float, c: float) -> Floats:
        """The direction from the tip to the spindle in the workpiece."""
        q = np.zeros((1, 9))
        q[0, 3], q[0, 5] = a, c
        return np.asarray(self.machine.pose(q, actual=False).turn[0] @ self.machine.tool_direction)

    def ways(self, direction: Floats) -> list[dict[str, float]]:
        """Positions of A and C with which the tool points along a unit vector, nearest to where they stand first."""
        tilt = math.degrees(math.acos(min(1.0, max(-1.0, float(direction[2])))))
        found = []
        for a in (tilt, -tilt):
            c = self.turned["C"]
            if tilt > 1e-7:
                at = self.pointing(a, 0.0)
                c = math.degrees(math.atan2(direction[1], direction[0]) - math.atan2(at[1], at[0]))
                sign = np.sign(np.cross(self.pointing(a, 0.0), self.pointing(a, 1.0))[2])
                c = self.turned["C"] + (sign * c - self.turned["C"] + 180.0) % 360.0 - 180.0
            if np.linalg.norm(self.pointing(a, c) - direction) > 1e-9:
                raise NotImplementedError("this machine points its tool otherwise")
            found.append({"A": a, "C": c})
        return sorted(found, key=lambda way: sum(abs(way[name] - self.turned[name]) for name in way))

    # -- motions ------------------------------------------------------------------------------------------------------

    def move(self, words: dict[str, Any], fixed: bool) -> None:
        """A motion, whose end and way come from the words."""
        turned = self.turn_words(words)
        if fixed and self.modes["tcp"] and not self.modes["transformed"]:
            q, length = self.axes(self.base[None], turned[:1])[0], np.array([0.0, 0.0, self.length])
            for index, letter in enumerate("XYZ"):
                if letter in words:
                    q[index] = length[index] + self.one(words[letter], q[index] - length[index], self.modes["unit"])
            q[3:] = turned[-1, 3:]
            self.base = self.base_of(q)
            self.sweep(np.repeat(self.base[None], LINE_SAMPLES, axis=0), turned, "fixed")
            return
        if fixed:
            for index, letter in enumerate("XYZ"):
                if letter in words:
                    self.base[index] = self.one(words[letter], self.base[index], self.modes["unit"])
            points = np.repeat(self.base[None], LINE_SAMPLES, axis=0)
            self.sweep(points, turned, "fixed")
            return
        frame, unit = self.frame, self.modes["unit"]
        start = frame.back(self.base)
        end = start.copy()
        for index, letter in enumerate("XYZ"):
            if letter in words:
                scale = unit / (self.modes["diameter"] if index == 0 else 1)
                end[index] = self.one(words[letter], start[index], scale)
        if "AP" in words or "RP" in words:
            self.polar(words, end)
        local = self.way(words, start, end)
        self.base = frame.of(local[-1])
        self.sweep(frame.of(local), turned, "rapid" if self.modes["g"] == 0 else "cut")

    def one(self, word: Any, here: float, scale: float) -> float:
        """A word's target."""
        form, value = word if isinstance(word, tuple) else ("", word)
        incremental = form == "IC" or (not form and self.modes["inc"])
        return here + value * scale if incremental else value * scale

    def polar(self, words: dict[str, Any], end: Floats) -> None:
        """AP and RP."""
        first, second, _ = PLANES[self.modes["plane"]]
        last = self.modes["polar"]
        for place, (name, scale) in enumerate((("AP", 1.0), ("RP", self.modes["unit"]))):
            if name in words:
                last[place] = self.one(words[name], last[place], scale)
        angle = math.radians(last[0])
        end[first] = self.modes["pole"][0] + last[1] * math.cos(angle)
        end[second] = self.modes["pole"][1] + last[1] * math.sin(angle)

    def turn_words(self, words: dict[str, Any]) -> Floats:
        """(n, 9) rotary positions along the motion."""
        before, after = dict(self.turned), dict(self.turned)
        direction = None
        if {"A3", "B3", "C3"} & set(words):
            direction = np.array([words.get(name, 0.0) for name in ("A3", "B3", "C3")])
        if {"A2", "B2", "C2"} & set(words):
            a, b, c = (words.get(name, 0.0) for name in ("A2", "B2", "C2"))
            turn = about(2, a) @ about(0, b) if self.modes["angles"] == "ORIEULER" else None
            turn = about(2, c) @ about(1, b) @ about(0, a) if self.modes["angles"] == "ORIRPY" else turn
            direction = turn[:, 2]
        if direction is not None:
            frame = self.frame.turn @ direction
            after = self.ways(frame / np.linalg.norm(frame))[0]
        for letter in "ABC":
            if letter in words:
                after[letter] = turned_to(words[letter], before[letter], self.modes["inc"])
        forms = {letter: word[0] for letter, word in words.items() if letter in "ABC" and isinstance(word, tuple)}
        self.turned = {k: v % 360.0 if forms.get(k) in ("DC", "ACP", "ACN") else v for k, v in after.items()}
        share = np.linspace(0.0, 1.0, LINE_SAMPLES)[:, None]
        q = np.zeros((LINE_SAMPLES, 9))
        for letter, degrees in after.items():
            q[:, LETTERS.index(letter)] = before[letter] + share[:, 0] * (degrees - before[letter])
        return q

    def way(self, words: dict[str, Any], start: Floats, end: Floats) -> Floats:
        """(n, 3) points of the program along the motion."""
        g = self.modes["g"]
        if g in (0, 1):
            start = np.where(np.isnan(start), end, start)
            self.tangent = end - start
            return start + np.linspace(0.0, 1.0, LINE_SAMPLES)[:, None] * (end - start)
        if g == "CIP":
            via = start.copy()
            for index, name in enumerate(("I1", "J1", "K1")):
                if name in words:
                    via[index] = self.one(words[name], start[index], self.modes["unit"])
            return self.round(*through(start, via, end), start, end)
        if g == "CT":
            return self.tangential(start, end, words.get("TURN", 0))
        across = PLANES[self.modes["plane"]][2]
        normal = np.eye(3)[across] * (-1.0 if g == 2 else 1.0)
        centre = self.centre(words, start, end, normal)
        if "AR" in words and "CR" not in words and {"I", "J", "K"} & set(words):
            height = end[across]
            end[:] = centre + rotated(normal, math.radians(words["AR"])) @ (start - centre)
            end[across] = height
        arm, last = start - centre, end - centre
        arm[across] = last[across] = 0.0
        sweep = math.atan2(normal @ np.cross(arm, last), arm @ last) % (2 * math.pi)
        sweep = sweep if sweep > 1e-9 else 2 * math.pi
        return self.round(centre, normal, sweep + 2 * math.pi * words.get("TURN", 0), start, end)

    def centre(self, words: dict[str, Any], start: Floats, end: Floats, normal: Floats) -> Floats:
        """The centre of an arc in the plane."""
        unit, (first, second, across) = self.modes["unit"], PLANES[self.modes["plane"]]
        if {"AP", "RP"} & set(words):
            centre = start.copy()
            centre[[first, second]] = self.modes["pole"]
            return centre
        if {"I", "J", "K"} & set(words):
            centre = start.copy()
            for index, name in enumerate("IJK"):
                if name in words and index != across:
                    word = words[name]
                    centre[index] = unit * word[1] if isinstance(word, tuple) else start[index] + unit * word
            return centre
        chord = end - start
        chord[across] = 0.0
        half = np.linalg.norm(chord) / 2
        if "CR" in words:
            radius = unit * words["CR"]
        else:
            radius = half / math.sin(math.radians(words["AR"]) / 2) * (1 if words["AR"] <= 180 else -1)
        rise = math.sqrt(max(radius**2 - half**2, 0.0)) * math.copysign(1.0, radius)
        return start + chord / 2 + np.cross(normal, chord / (2 * half)) * rise

    def tangential(self, start: Floats, end: Floats, turns: float) -> Floats:
        """CT: the arc that leaves the start along the tangent and goes to the end, both seen in the plane."""
        assert self.tangent is not None
        flat = 1.0 - np.eye(3)[PLANES[self.modes["plane"]][2]]
        along, chord = self.tangent * flat / np.linalg.norm(self.tangent * flat), (end - start) * flat
        normal = np.cross(along, chord)
        if np.linalg.norm(normal) < 1e-9 * np.linalg.norm(chord):
            self.tangent = end - start
            return start + np.linspace(0.0, 1.0, LINE_SAMPLES)[:, None] * (end - start)
        normal /= np.linalg.norm(normal)
        towards = np.cross(normal, along)
        radius = chord @ chord / (2 * (towards @ chord))
        sweep = 2 * math.atan2(towards @ chord, along @ chord) + 2 * math.pi * turns
        return self.round(start + radius * towards, normal, sweep, start, end)

    def round(self, centre: Floats, normal: Floats, sweep: float, start: Floats, end: Floats) -> Floats:
        """Points along an arc or helix; where the radii differ a little it goes evenly from one to the other."""
        share = np.linspace(0.0, 1.0, ARC_SAMPLES)
        arm = start - centre
        rise = normal * (arm @ normal)
        points = [centre + rotated(normal, sweep * s) @ (arm - rise) + rise for s in share]
        miss = end - points[-1]
        found = np.array(points) + share[:, None] * miss
        beside = np.cross(normal, arm - rise)
        self.tangent = rotated(normal, sweep) @ (beside * sweep) + normal * (miss @ normal)
        return found

    def sweep(self, points: Floats, turned: Floats, sort: str) -> None:
        """Note a motion through points (n, 3) of the base."""
        bends = bool(np.ptp(turned, axis=0).any()) and len(points) < ARC_SAMPLES and not self.modes["tcp"]
        if bends:
            points = points[0] + np.linspace(0.0, 1.0, ARC_SAMPLES)[:, None] * (points[-1] - points[0])
        share = np.linspace(0.0, LINE_SAMPLES - 1.0, len(points))
        rotary = np.stack([np.interp(share, np.arange(LINE_SAMPLES), column) for column in turned.T], axis=-1)
        self.paths.append(Path(self.mark, self.line, sort, self.axes(points, rotary), self.real_length))


def turned_to(word: Any, here: float, incremental: bool) -> float:
    """Where a rotary word leads, degrees."""
    form, value = word if isinstance(word, tuple) else ("IC" if incremental else "AC", word)
    if form in ("AC", "IC"):
        return here * (form == "IC") + value
    step = (value - here) % 360.0
    if form == "ACP" or step == 0.0:
        return here + step
    return here + step - 360.0 if form == "ACN" or step > 180.0 else here + step
