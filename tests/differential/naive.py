"""A very small program fixer, right for plain programs and wrong on demand: the judge is tried on it.

It knows N, G0-G3 in the XY plane with I J, G90, G91, G94, F and X Y Z, one block a line, all in mm.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from differential.errors import Machine

LINE_WORDS = re.compile(r"\s*[XYZ]\s*[-+]?[0-9.]+")
ARC_WORDS = re.compile(r"\s*(?:[XYZIJ]|(?<![0-9])G[23](?![0-9]))\s*[-+]?[0-9.]*")
WORD = re.compile(r"([A-Z])\s*([-+]?\d*\.?\d+)")


@dataclass(frozen=True, slots=True)
class Flaws:
    """What the fixer gets wrong."""

    sign: float = 1.0
    scale: float = 1.0
    ignores_g91: bool = False
    drops: int = -1
    repeats: int = -1
    moves_arc_ends_only: bool = False
    pieces: int = 1
    decimals: int = 3
    skips_axis: str = ""
    changes_feed: bool = False
    leaves: int = -1
    piece_off: float = 0.0
    swaps: int = -1


class Naive:
    """Rewrites a program for a machine."""

    def __init__(self, machine: Machine, flaws: Flaws) -> None:
        self.machine, self.flaws = machine, flaws
        self.at = np.zeros(9)
        self.written = np.zeros(3)
        self.motion, self.incremental = "0", False

    def fix(self, source: str) -> str:
        """The corrected program."""
        blocks = [self.block(n, line) for n, line in enumerate(source.splitlines())]
        if self.flaws.swaps >= 0:
            n = self.flaws.swaps
            blocks[n], blocks[n + 1] = blocks[n + 1], blocks[n]
        return "\n".join(line for block in blocks for line in block) + "\n"

    def block(self, n: int, line: str) -> list[str]:
        words = dict(WORD.findall(re.sub(r"\(.*?\)", "", line)))
        self.motion = next((v for a, v in WORD.findall(line) if a == "G" and v in "0123"), self.motion)
        self.incremental = ("G91" in line) or (self.incremental and "G90" not in line)
        if not words.keys() & set("XYZ"):
            return [line]
        start = self.at.copy()
        for i, axis in enumerate("XYZ"):
            if axis in words:
                self.at[i] = float(words[axis]) + (start[i] if self.incremental else 0.0)
        if n == self.flaws.drops:
            return []
        if n == self.flaws.leaves or (self.incremental and self.flaws.ignores_g91):
            self.written = self.at[:3].copy()
            return [line]
        arc = self.motion in "23" and not self.flaws.moves_arc_ends_only
        targets = self.chords(start, words) if arc else self.pieces(start)
        head = (ARC_WORDS if arc else LINE_WORDS).sub("", line)
        again = f"F{words['F']}" if "F" in words else ""
        motion = " G1" if arc else ""
        lines = [(again if i else head) + motion + self.words(target) for i, target in enumerate(targets)]
        lines = [re.sub("F100", "F101", text) if self.flaws.changes_feed else text for text in lines]
        return lines * (2 if n == self.flaws.repeats else 1)

    def pieces(self, start: np.ndarray) -> list[np.ndarray]:
        parts = [start + (self.at - start) * k / self.flaws.pieces for k in range(1, self.flaws.pieces + 1)]
        if len(parts) > 1:
            parts[0][1] += self.flaws.piece_off
        return parts

    def chords(self, start: np.ndarray, words: dict[str, str]) -> list[np.ndarray]:
        centre = start[:2] + np.array([float(words.get("I", 0)), float(words.get("J", 0))])
        first, last = start[:2] - centre, self.at[:2] - centre
        angle = np.arctan2(first[0] * last[1] - first[1] * last[0], first @ last) % (2 * np.pi)
        angle = (angle or 2 * np.pi) if self.motion == "3" else -(-angle % (2 * np.pi) or 2 * np.pi)
        count = int(np.ceil(abs(angle) / np.arccos(1 - 8e-4 / np.hypot(*first)) / 2)) + 1
        out = []
        for u in np.arange(1, count + 1) / count:
            point = start + u * (self.at - start)
            c, s = np.cos(u * angle), np.sin(u * angle)
            point[:2] = centre + np.array([c * first[0] - s * first[1], s * first[0] + c * first[1]])
            out.append(point)
        return out

    def words(self, target: np.ndarray) -> str:
        command = self.machine.corrected(target[None])[0]
        goal = target[:3] + self.flaws.sign * self.flaws.scale * (command - target)[:3]
        base = self.written if self.incremental else np.zeros(3)
        values = np.round(goal - base, self.flaws.decimals)
        self.written = base + values
        axes = [axis for axis in "XYZ" if axis != self.flaws.skips_axis]
        return "".join(f" {axis}{values['XYZ'.index(axis)]:.{self.flaws.decimals}f}" for axis in axes)
