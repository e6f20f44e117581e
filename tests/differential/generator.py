"""Random programs that a control accepts: every mode switched at random, with motions that stay in a small volume."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field

INCH = 25.4


@dataclass(slots=True)
class Generator:
    """Writes one program; positions are kept in mm of the current coordinate system, as the control would."""

    rng: random.Random
    rotary: str = ""
    at: dict[str, float] = field(default_factory=lambda: dict.fromkeys("XYZABC", 0.0))
    incremental: bool = False
    arc_absolute: bool = False
    inch: bool = False
    plane: str = "G17"
    inverse: bool = False
    motion: str = ""
    lines: list[str] = field(default_factory=list)

    def program(self, blocks: int) -> str:
        """A program of so many random blocks, from a known start to M2."""
        self.lines = ["G21 G90 G17 G40 G49 G80 G94 G54 G91.1"]
        self.block("G0", dict(zip("XYZ", (self.place(), self.place(), self.place()), strict=True)))
        self.lines.append("F500")
        for _ in range(blocks):
            self.rng.choices(self.choices(), self.weights())[0]()
        return "\n".join([*self.lines, "M2"]) + "\n"

    def choices(self) -> list:
        return [self.straight, self.arc, self.switch, self.offset, self.other, self.machine, self.cycle]

    def weights(self) -> list[int]:
        return [50, 22, 12, 6, 6, 2, 2]

    # -- numbers ------------------------------------------------------------------------------------------------------

    def place(self) -> float:
        return round(self.rng.uniform(-80, 80), self.rng.choice((0, 1, 3)))

    def number(self, mm: float, linear: bool = True) -> str:
        """A length as this program would write it."""
        digits = self.rng.choice((3, 4, 5)) if linear and self.inch else self.rng.choice((3, 3, 4))
        value = mm / INCH if linear and self.inch else mm
        text = f"{value:.{digits + (linear and self.inch)}f}"
        return self.rng.choice((text, text.rstrip("0"), text.rstrip("0").rstrip("."))) or "0"

    def word(self, axis: str, target: float) -> str:
        """An axis word to a target; what was written decides where the axis is afterwards."""
        unit = INCH if self.inch and axis in "XYZ" else 1.0
        wanted = target - self.at[axis] if self.incremental else target
        text = self.number(wanted, axis in "XYZ")
        written = float(text) * unit
        self.at[axis] = self.at[axis] + written if self.incremental else written
        return axis + text

    # -- blocks -------------------------------------------------------------------------------------------------------

    def block(self, motion: str, targets: dict[str, float], more: str = "") -> None:
        words = [self.word(axis, value) for axis, value in targets.items()]
        head = "" if motion == self.motion and self.rng.random() < 0.6 else motion
        self.motion = motion
        feed = f" F{self.rng.choice((200, 350.5, 600))}" if self.rng.random() < 0.2 else ""
        if self.inverse:
            feed = f" F{self.rng.choice((2, 5.5, 12))}" if motion != "G0" else ""
        comment = self.rng.choice(("", "", "", " (X1 to Y2)", " ; G1 Z99"))
        self.lines.append(f"{head} {' '.join(words)}{more}{feed}{comment}".strip())

    def straight(self) -> None:
        axes = self.rng.sample("XYZ" + self.rotary, self.rng.randint(1, 3 + len(self.rotary)))
        self.block(self.rng.choice(("G0", "G1", "G1")), {axis: self.place() for axis in axes})

    def arc(self) -> None:
        """An arc from here round a centre nearby, sometimes a helix or a full circle."""
        one, two, up = {"G17": "XYZ", "G18": "ZXY", "G19": "YZX"}[self.plane]
        radius, start = self.rng.uniform(2, 40), self.rng.uniform(0, 2 * math.pi)
        centre = {one: self.at[one] - radius * math.cos(start), two: self.at[two] - radius * math.sin(start)}
        unit = INCH if self.inch else 1.0
        letters = {"X": "I", "Y": "J", "Z": "K"}
        words = []
        for axis in (one, two):
            base = 0.0 if self.arc_absolute else self.at[axis]
            text = f"{(centre[axis] - base) / unit:.5f}"
            centre[axis] = float(text) * unit + base
            words.append(letters[axis] + text)
        radius = math.hypot(self.at[one] - centre[one], self.at[two] - centre[two])
        angle = self.rng.uniform(0, 2 * math.pi)
        targets = {one: centre[one] + radius * math.cos(angle), two: centre[two] + radius * math.sin(angle)}
        if self.rng.random() < 0.2:
            targets = {}
        if self.rng.random() < 0.25:
            targets[up] = self.at[up] + self.rng.uniform(-9, 9)
        self.exact_block(self.rng.choice(("G2", "G3")), targets, " " + " ".join(words))

    def exact_block(self, motion: str, targets: dict[str, float], more: str) -> None:
        """Arc ends with enough digits to close."""
        words = []
        for axis, target in targets.items():
            unit = INCH if self.inch else 1.0
            text = f"{(target - self.at[axis] if self.incremental else target) / unit:.5f}"
            self.at[axis] = (self.at[axis] if self.incremental else 0.0) + float(text) * unit
            words.append(axis + text)
        self.motion = motion
        feed = f" F{self.rng.choice((2, 5.5, 12))}" if self.inverse else ""
        self.lines.append(f"{motion} {' '.join(words)}{more}{feed}")

    def switch(self) -> None:
        match self.rng.randrange(5):
            case 0:
                self.incremental = not self.incremental
                self.lines.append("G91" if self.incremental else "G90")
            case 1:
                self.plane = self.rng.choice(("G17", "G18", "G19"))
                self.lines.append(self.plane)
            case 2:
                self.inch = not self.inch
                self.lines.append("G20" if self.inch else "G21")
            case 3:
                self.arc_absolute = not self.arc_absolute
                self.lines.append("G90.1" if self.arc_absolute else "G91.1")
            case _:
                self.inverse = not self.inverse
                self.lines.append("G93" if self.inverse else "G94 F400")

    def offset(self) -> None:
        """Other coordinates; afterwards every linear axis is moved to, so that it is known again."""
        if self.incremental:
            self.incremental = False
            self.lines.append("G90")
        match self.rng.randrange(4):
            case 0:
                self.lines.append(self.rng.choice(("G54", "G55", "G56")))
            case 1:
                self.lines.append(f"G10 L2 P{self.rng.randint(1, 3)} X{self.number(self.place())} Y{self.number(3.5)}")
            case 2:
                self.lines.append(f"G10 L2 P{self.rng.randint(1, 3)} R{self.rng.choice((0, 0, 15, -40.5))}")
            case _:
                axis = self.rng.choice("XYZ")
                self.lines.append(self.rng.choice((f"G92 {axis}{self.number(self.place())}", "G92.1")))
        self.block("G0", {axis: self.place() for axis in "XYZ"})

    def other(self) -> None:
        """No tool change after an arc: the interpreter, as it is called here, then takes its start for its end.

        Nor one in inches: it then takes millimetres for inches where it stands, which G92 would go by.
        """
        words = ("M3 S500", "M5", "M8", "M9", "G4 P0.1", "(a comment)", "", "G64 P0.01", "G61", "T1 M6")
        word = self.rng.choice(words)
        self.lines.append("M8" if word == "T1 M6" and (self.inch or self.motion in ("G2", "G3")) else word)

    def machine(self) -> None:
        """Machine coordinates or a reference point, and back to where it is known."""
        if self.incremental:
            self.incremental = False
            self.lines.append("G90")
        self.lines.append(self.rng.choice(("G53 G0 Z0", "G53 G0 X5 Y-5", "G28", "G30")))
        self.block("G0", {axis: self.place() for axis in "XYZ"})

    def cycle(self) -> None:
        if self.incremental or self.inverse or self.plane != "G17":
            return
        self.block("G0", {"Z": 30.0})
        words = f"X{self.number(self.place())} Y{self.number(self.place())} Z{self.number(-7.5)} R{self.number(4.0)}"
        kind = self.rng.choice(("G81", "G82 P0.1", f"G83 Q{self.number(3.0)}"))
        self.lines += [f"{self.rng.choice(('G98', 'G99'))} {kind} {words}", f"X{self.number(self.place())}", "G80"]
        self.motion = ""
        self.block("G0", {axis: self.place() for axis in "XYZ"})
