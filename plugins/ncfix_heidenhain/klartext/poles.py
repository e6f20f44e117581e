"""The pole that is in force at a block, as the text shows it, and whether blocks after it rely on it: what has to come
back after an arc that is written about a pole of its own.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from functools import lru_cache

NUMBER = r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)"
LINE = re.compile(
    rf"(?im)^[ \t]*/?[ \t]*\d*[ \t]*(?:"
    rf"CC[ \t]+(?P<words>[XYZ]{NUMBER}[ \t]*[XYZ]{NUMBER})[ \t]*(?:;.*)?\r?$"
    rf"|(?:CC(?![A-Z])|LBL|[^;\r\n]*(?:CALL|M99|M98|M89)))".encode("latin-1")
)
"""A pole in plain numbers, or what may set another one or be reached from elsewhere."""


NUMBERED = r"(?i)\n[ \t]*/?[ \t]*\d*[ \t]*(?=[CLADFIE])(?!L[ \t])"
"""The beginning of a line, behind the end of the one before; most lines are told apart from those that matter here."""

SETS = re.compile(rb"(?i)CC[ \t]*(?:[;~\r\n]|\Z|I?[XYZ][^;\r\nXYZ]*I?[XYZ])|END[ \t]+PGM")
EVENT = re.compile(
    (
        NUMBERED + r"(?P<what>CC?(?![A-Z])|LP|CP|CTP|(?:APPR|DEP)[ \t]+P|CALL|FN|IF|LBL[ \t]*0(?!\d)|END[ \t]+PGM)"
    ).encode()
)
"""What sets a pole, relies on one, or may lead elsewhere; other labels are passed through."""

CALCULATION = re.compile(rb"(?i)FN[ \t]*(?!9|1[0-2])\d")
LOOK = 80
"""Bytes of a line that tell what it is."""


def in_lines(source: bytes) -> bytes:
    """A text with a line feed for every carriage return, which may stand alone: every byte is where it was."""
    return source.replace(b"\r", b"\n")


def is_relied_on(source: bytes, after: int) -> bool:
    """Whether what follows a byte of the program may rely on the pole that is in force there."""
    places, relying = _events(source)
    index = bisect_left(places, after)
    return index < len(places) and relying[index]


def relies_at_once(source: bytes) -> bool:
    """Whether a text relies on a pole before it sets one."""
    _, relying = _events(source)
    return bool(relying) and relying[0]


@lru_cache(maxsize=4)
def _events(source: bytes) -> tuple[list[int], list[bool]]:
    """Where a pole is set or something may rely on one, and which of the two it is."""
    places, relying = [], []
    text = b"\n" + in_lines(source)
    for found in EVENT.finditer(text):
        line = text[found.start("what") : found.start("what") + LOOK]
        if CALCULATION.match(line) is None:
            places.append(found.start())
            relying.append(SETS.match(line) is None)
    return places, relying


def pole_in_force(source: bytes, at: int) -> str | None:
    """The words of the last CC before a byte of the program: empty if there is none, None if the text does not tell."""
    places, words = _poles(source)
    index = bisect_left(places, at) - 1
    return words[index] if index >= 0 else ""


@lru_cache(maxsize=4)
def _poles(source: bytes) -> tuple[list[int], list[str | None]]:
    found = [(match.start(), match["words"]) for match in LINE.finditer(in_lines(source))]
    return [place for place, _ in found], [None if words is None else words.decode("latin-1") for _, words in found]
