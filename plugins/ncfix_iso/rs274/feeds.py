"""Feed and speed: F in its three modes, S.

Source: LinuxCNC documentation, "G93, G94, G95", "F".
"""

from __future__ import annotations

import math

from ncfix.control.expressions import Fault
from ncfix.control.moves import FeedMode
from ncfix_iso.rs274.control import Block, RS274Control

NO_FEED = "NCF225"


def feed_mode(control: RS274Control, block: Block, code: int) -> None:
    """G93, G94, G95. In LinuxCNC a feed per minute or revolution has to be given anew after its code."""
    mode = code // 10
    if mode != control.modal.feed_mode or (control.rules.strict and mode != FeedMode.INVERSE_TIME):
        control.modal.feed = math.nan
        control.modal.feed_given = False
    control.modal.feed_mode = mode


def feed(control: RS274Control, block: Block, code: int) -> None:
    """F."""
    unit = 1.0 if control.modal.feed_mode == FeedMode.INVERSE_TIME else control.modal.unit
    control.modal.feed = math.nan if "F" in block.runtime else unit * block.values["F"]
    control.modal.feed_given = control.modal.feed != 0.0


def speed(control: RS274Control, block: Block, code: int) -> None:
    """S."""
    control.modal.speed = block.values["S"]


def check_feed(control: RS274Control, block: Block) -> None:
    """Raise `Fault` where LinuxCNC refuses a motion for want of a feed."""
    if not control.needs_feed:
        return
    if control.modal.feed_mode == FeedMode.INVERSE_TIME:
        if "F" not in block.values:
            raise Fault(NO_FEED, "in inverse time mode (G93) every motion at feed needs its own F")
    elif not control.modal.feed_given:
        raise Fault(NO_FEED, "a motion at feed, and no feed (F) is set")
    elif control.modal.feed_mode == FeedMode.PER_REVOLUTION and control.modal.speed == 0.0:
        raise Fault(NO_FEED, "a feed per revolution (G95), and no spindle speed (S) is set")
