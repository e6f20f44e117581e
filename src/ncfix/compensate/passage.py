"""What there is to know of a part that another process has followed, for those that need not follow it themselves."""

from __future__ import annotations

from dataclasses import dataclass

from ncfix.control.parts import Remains


@dataclass(frozen=True, slots=True)
class Passage:
    """A part that left little behind: only its last block has still to be read and followed.

    size     bytes of the part
    begin    where its last block begins
    lines    that end before that, and `blocks` that stand there
    led      the tip was under control (TCP) somewhere in it
    remains  what the control was like there
    """

    size: int
    begin: int
    lines: int
    blocks: int
    led: bool
    remains: Remains
