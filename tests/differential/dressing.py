"""A Klartext program written otherwise: block numbers, commas, signs, case, blanks, remarks, block skip, line ends."""

from __future__ import annotations

import random
import re

OTHERS = re.compile(r"\s*(BEGIN|END|TOOL|CYCL|Q\d|FN|LBL|CALL|PLANE|TRANS|FUNCTION)")
"""Blocks that are left as they are but for commas."""

REMARKS = (" ; X+5 Y9", " ;NOTE ~ish L X+1", " ; (a) M30")
BETWEEN = ("; comment X+1", "* - structure Y+5", "")
NUMBERING = ("none", "plain", "tens", "odd")


def dressed(text: str, seed: int) -> str:
    """The program in another manner, which means the same."""
    dice = random.Random(7 * seed + 1)
    comma, unsigned, wide, remarks, lower, skips = (dice.random() < share for share in (0.4, 0.4, 0.4, 0.5, 0.3, 0.2))
    numbering, end = dice.choice(NUMBERING), dice.choice(("\n", "\n", "\r\n"))
    lines: list[str] = []
    number, follows = 0, False
    for line in text.splitlines():
        continues, follows = follows, line.rstrip().endswith("~")
        plain = not continues and not OTHERS.match(line)
        if comma:
            line = re.sub(r"([XYZTLR=] ?[+-]?\d+)\.(?=\d)", r"\1,", line)
        if unsigned and plain:
            line = re.sub(r"(?<=[XYZABCRAI])\+(?=\d)", "", line)
        if wide and plain:
            line = re.sub(r" (?=[A-Z])", lambda _: " " * dice.randint(1, 3), line)
        if remarks and plain and dice.random() < 0.3:
            line += dice.choice(REMARKS)
        if lower and plain and ";" not in line:
            line = line.lower()
        if not continues and numbering != "none":
            number += {"plain": 1, "tens": 10}.get(numbering, dice.randint(0, 3))
            line = f"{'/' if skips and plain and dice.random() < 0.1 else ''}{number} {line}"
        lines.append(line)
        if remarks and not follows and dice.random() < 0.1:
            lines.append(dice.choice(BETWEEN))
    return end.join(lines) + end
