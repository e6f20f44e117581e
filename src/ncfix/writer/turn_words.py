"""The F of turns of rotary axes alone: the time that they take is stated in their block, and taken back after it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.control.turns import number, way
from ncfix.text.tree import Literal
from ncfix.writer.block_words import WordWriter

FloatArray = NDArray[np.float64]
INVERSE_TIME, PER_MINUTE = "93", "94"


class TurnWriter(WordWriter):
    """Writes the feeds of one block whose rotary axes turn alone."""

    def _time_of_turn(self, begin: FloatArray, end: FloatArray) -> None:
        """State the time of a turn in its own block."""
        if not self.target.turn_by_feed:
            self._feed_mode(INVERSE_TIME)
        elif self.target.back_to_inverse_time:
            self._feed_mode(PER_MINUTE)
        feed, text = self.layout.feed, self._turn_feed(0, begin, end)
        if feed is None:
            self._add("F", text)
        else:
            self.out.edits.append((*self.program.span(self.block, feed.value_span), text))

    def _feed_mode(self, number: str) -> None:
        code = self.layout.feed_mode
        if code is not None:
            self.out.edits.append((*self.program.span(self.block, code.value_span), number))
            return
        at = self.program.position(self.block, self.layout.code_at)
        self.out.edits.append((at, at, self._cased("G") + number + self.layout.blank))

    def _turn_feed(self, piece: int, begin: FloatArray, end: FloatArray) -> str:
        """The number after F with which a piece of a turn takes its share of the time."""
        minutes = self.target.turn_minutes * float(self.target.shares[piece])
        reach = way(self.target.letters, begin, end, self.target.diameter) if self.target.turn_by_feed else 1.0
        return number(reach / minutes) if reach > 0 else self._feed_in_force()

    def _feed_in_force(self) -> str:
        feed = self.layout.feed
        if feed is not None and isinstance(feed.value, Literal):
            return self.program.slice(self.block, feed.value_span)
        return f"{self.target.feed:.6f}".rstrip("0")

    def _feed_as_before(self) -> None:
        """Back to the feed that was in force, for the blocks that follow; in inverse time each has its own."""
        words = [] if self.target.turn_by_feed else [self._cased("G") + PER_MINUTE]
        words.append(self._cased("F") + self._feed_in_force())
        if self.target.back_to_inverse_time:
            words = [self._cased("G") + INVERSE_TIME]
        prefix = self.program.slice(self.block, self.layout.prefix) if self.layout.prefix else ""
        self.out.lines.append(prefix + self.layout.blank.join(words))
