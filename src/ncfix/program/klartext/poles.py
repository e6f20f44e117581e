"""The pole that is in force at a block, as the text shows it: what has to come back after an arc that CR, CT or another
function without a pole described, and that is written about a pole of its own.
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


def pole_in_force(source: bytes, at: int) -> str | None:
    """The words of the last CC before a byte of the program: empty if there is none, None if the text does not tell."""
    places, words = _poles(source)
    index = bisect_left(places, at) - 1
    return words[index] if index >= 0 else ""


@lru_cache(maxsize=4)
def _poles(source: bytes) -> tuple[list[int], list[str | None]]:
    found = [(match.start(), match["words"]) for match in LINE.finditer(source)]
    return [place for place, _ in found], [None if words is None else words.decode("latin-1") for _, words in found]
