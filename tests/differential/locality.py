"""What may differ in the text: numbers of motion words, and inserted words and blocks. No dialect is known here.

A line without any axis or arc word must come back as it was, in the same order. Everything else that is not a motion
word (comments, N S T M words, parameters, assignments) must be there as often as before; only the sign of block skip
may be repeated, on the pieces of its block.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator

COMMENT = re.compile(rb"\([^)\n]*\)|;[^\n]*")
BRACKETS = rb"\[[^][]*\]"
for _ in range(4):
    BRACKETS = rb"\[(?:[^][]|" + BRACKETS + rb")*\]"
VALUE = rb"(?:[-+]?(?:\d+\.?\d*|\.\d+)|[A-Z]*" + BRACKETS + rb"|[-+]?#+(?:\d+|<[^>]*>|" + BRACKETS + rb"))"
MOTION = re.compile(rb"[XYZABCUVWIJKRPF]" + VALUE + rb"|G0*[0123](?![\d.])")
TOKEN = re.compile(rb"\([^)\n]*\)|;.*|[A-Z][-+]?[0-9.]+|[^ \t]")
NUMBERED = re.compile(rb"[XYZABCUVWIJKR](?:[-+]?[\d.\[#]|[A-Z]+\[)")
STAMP = b"ncfix"


def complaints(original: bytes, fixed: bytes) -> list[str]:
    """What differs that may not differ."""
    before, after = _lines(original), [line for line in _lines(fixed) if STAMP not in line]
    found = [f"line end {end!r}" for end in _foreign_ends(original, fixed)]
    found += _missing(before, after)
    old, new = _tokens(before), _tokens(after)
    found += [f"lost {count} of {token!r}" for token, count in (old - new).items()]
    found += [f"added {count} of {token!r}" for token, count in (new - old).items() if token != b"/"]
    return found


def _lines(source: bytes) -> list[bytes]:
    return re.split(rb"\r\n|\n|\r", source)


def _foreign_ends(original: bytes, fixed: bytes) -> set[bytes]:
    """Line ends that the original does not have."""
    ends = re.compile(rb"\r\n|\n|\r")
    return set(ends.findall(fixed)) - (set(ends.findall(original)) or {b"\n"})


def _missing(before: list[bytes], after: list[bytes]) -> list[str]:
    """Lines without a motion word that do not come back, in order."""
    rest: Iterator[bytes] = iter(after)
    return [f"line {n}: {line!r} is gone" for n, line in enumerate(before, 1) if not _moves(line) and line not in rest]


def _moves(line: bytes) -> bool:
    return NUMBERED.search(_bare(line)) is not None


def _bare(line: bytes) -> bytes:
    return re.sub(rb"[ \t]", b"", COMMENT.sub(b"", line)).upper()


def _tokens(lines: list[bytes]) -> Counter[bytes]:
    """What is no motion word, counted; comments to the byte, words without blanks and in upper case."""
    found: Counter[bytes] = Counter()
    for line in lines:
        found.update(COMMENT.findall(line))
        if not re.search(rb"G(?:92|10|53|28|30)", _bare(line)):
            found.update(TOKEN.findall(MOTION.sub(b"", _bare(line))))
        else:
            found[line] += 1
    return found
