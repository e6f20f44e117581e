"""Lines that are no Klartext, or Klartext that the grammar does not know: what may be in them.

The control stops at a line that is none. One that it does understand, and this program does not, may have moved the
axes, changed the frame or decided where the program goes on; the words in it tell which.
"""

from __future__ import annotations

import re

from ncfix.control.expressions import Fault
from ncfix_heidenhain.klartext.control import KlartextControl

UNREADABLE = "NCF236"
NOT_KLARTEXT = "this line is not understood; if it is no Klartext, the control stops at it"
NOT_FOLLOWED = "the line {} changes coordinates in a way that is not followed"
DECIDES = "where the program goes on is decided by a line that is not understood"
HINT = "correct the line, or name the dialect with --dialect"

NUMBER = r"\A\s*/?\s*\d*\s*"
FLOW = re.compile(NUMBER + r"(LBL|CALL|FN\s*(9|1[0-2])\s*:|IF\b|.*\bGOTO\b)", re.IGNORECASE | re.DOTALL)
PARAMETER = re.compile(r"\bQ[LRS]?\d+", re.IGNORECASE)
ASSIGNED = re.compile(NUMBER + r"(?:FN\s*\d+\s*:\s*)?Q[LRS]?\d+\s*=", re.IGNORECASE)
FRAME = re.compile(
    NUMBER
    + r"(PLANE|TRANS|CYCL\s*DEF|TOOL|FUNCTION|PRESET|POLARKIN|PATTERN|SEL)|\bM\s*(12[6-9]|130|11[45]|14[45]|89)\b",
    re.IGNORECASE,
)


def unread_line(control: KlartextControl, text: str) -> None:
    """A line that could not be read is reached; raises `Fault` if the program may go on elsewhere."""
    if FLOW.match(text):
        raise Fault(UNREADABLE, DECIDES, "correct the line")
    for name in PARAMETER.findall(text):
        control.scope.parameters.assign(name.upper(), 0.0, runtime=True)
    if ASSIGNED.match(text):
        return
    control.warn(UNREADABLE, NOT_KLARTEXT, HINT)
    if FRAME.search(text):
        control.refusal = control.refusal or NOT_FOLLOWED.format(control.place().line)
    control.refuse_here(NOT_KLARTEXT)
