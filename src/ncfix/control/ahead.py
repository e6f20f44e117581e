"""Looking ahead: what the blocks of numbers say and where they lead, found out for many stretches at once."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ncfix.control.control import Control
from ncfix.control.stage import LONGEST, Mask, Stage, Text, feed_unit, stage_of

FEWEST = 256
"""Blocks that are offered at least: few enough to be gone through in no time."""


@dataclass(slots=True)
class Ahead:
    """The blocks that were looked at together, of which one stretch after the other is taken.

    What stands between stretches (arcs, dwells, expressions) counts as if it did nothing; what it has really done is
    put right where the next stretch begins, up to the next word of an axis, the next F, the next motion code.
    Increments count from where the axes stand: of these each stretch is looked at by itself.

    begin  the first of these blocks; a jump may lead before it, or to it again from elsewhere
    stage  what they say, and where they lead
    frame  what their numbers counted from
    done   the blocks before it may have been taken: their rows must not change any more, nor where this one starts,
           which is where they end; a jump may come back to it from elsewhere
    reach  so many blocks are looked at next time
    most   so many blocks are offered to be taken next time
    """

    begin: int = 0
    stage: Stage | None = None
    frame: object = None
    done: int = 0
    reach: int = field(default=LONGEST)
    most: int = field(default=LONGEST)

    def stretch(self, control: Control, unit: Text, block: int, stop: int) -> Stage:
        """The blocks from one on; the control stands before it. `done` is to be set to what has been taken of them."""
        frame = control.modal.incremental, feed_unit(control), *control.offset, *control.scale
        begin, stage = self.begin, self.stage
        known = stage is not None and frame == self.frame and not control.modal.incremental
        if stage is None or not known or not max(begin, self.done) < block < stop <= begin + len(stage.mask):
            begin, stage = block, self._looked(control, unit, block, stop)
            self.begin, self.stage, self.frame = begin, stage, frame
        found = stage.rows(block - begin, stop - begin)
        if block > begin:
            put_right(found, control)
        return found

    def note(self, taken: int, offered: int) -> None:
        """So many of the blocks offered can be taken: where others are in the way again and again, fewer are offered.

        What is offered is gone through to find what is in the way.
        """
        self.most = min(2 * self.most, LONGEST) if taken == offered else max(2 * taken, FEWEST)

    def _looked(self, control: Control, unit: Text, block: int, stop: int) -> Stage:
        """Look at blocks, at twice as many as the last look was good for, but for those to `stop` at least."""
        if control.modal.incremental:
            return stage_of(control, unit, block, stop)
        if self.stage is not None:
            self.reach = min(max(stop - block, 2 * (self.done - self.begin)), LONGEST)
        return stage_of(control, unit, block, min(max(stop, block + self.reach), len(unit.program)))


def put_right(stage: Stage, control: Control) -> None:
    """Let blocks go on from where the control stands."""
    here = np.array(control.position)
    for letter in np.flatnonzero(here.view(np.int64) != stage.path[0].view(np.int64)).tolist():
        stage.path[: rows_before((stage.mask >> letter & 1) != 0) + 1, letter] = here[letter]
    stage.feed[: rows_before(stage.fed)] = control.modal.feed
    stage.motion[: rows_before(stage.coded)] = control.modal.motion


def rows_before(given: Mask) -> int:
    """How many rows (n,) come before the first one that is given."""
    first = int(given.argmax())
    return first if given[first] else len(given)
