"""Block numbers of Klartext: all anew, 0, 1, 2, ... Nothing refers to them: jumps go to labels."""

from __future__ import annotations

import re

from ncfix_heidenhain.klartext.shapes import split

NUMBER = re.compile(rb"(?P<skip>[ \t]*/)?[ \t]*(?:\d+(?![\d.,])[ \t]*)?")
"""The block number, block skip before it, and blanks."""


def renumbered(source: bytes) -> bytes:
    """A program with its blocks numbered from 0; the lines that `~` joins are one block, empty lines none."""
    pieces, done, count = [], 0, 0
    for start, stop in split(source).tolist():
        if not source[start:stop].strip():
            continue
        found = NUMBER.match(source, start, stop)
        assert found is not None, "it matches nothing, too"
        pieces += [source[done:start], found["skip"].strip() if found["skip"] else b"", b"%d " % count]
        done, count = found.end(), count + 1
    return b"".join([*pieces, source[done:]])
