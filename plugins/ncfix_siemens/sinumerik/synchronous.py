"""Synchronized actions: what the control may do at any time while the blocks that follow are executed.

Source: Siemens, "SINUMERIK 840D sl, synchronized actions": the actions and what they change.
"""

from __future__ import annotations

import re

_ACTION = r"""
    \$A_\w+(?:\[[^\]]*\])?=\S+
    | \$AC_(?:OVR|VC|MARKER|PARAM|TIMER|FIFO\d*)(?:\[[^\]]*\])?=\S+ | \$AA_(?:OVR|VC)\[\w+\]=\S+
    | [MHS]\d*=?[\d.]+ | (?:SETAL|LOCK|UNLOCK|RESET|CANCEL)\([^()]*\) | RDISABLE
"""
HARMLESS = re.compile(rf"(?:(?:{_ACTION})\s*)+", re.IGNORECASE | re.VERBOSE)
"""Actions that move no axis, change no coordinates and no variable that the program computes with."""

DO = re.compile(r"\bDO\b", re.IGNORECASE)
AROUND_EQUALS = re.compile(r"\s*=\s*")


def is_harmless(text: str) -> bool:
    """Whether a synchronized action may act at any time, and nothing that is followed changes."""
    _, *actions = DO.split(AROUND_EQUALS.sub("=", text.split(";")[0]), maxsplit=1)
    return bool(actions) and HARMLESS.fullmatch(actions[0].strip()) is not None
