"""What is known of the ends of motions once they have been corrected: the errors there, before and after."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.plan.arrays import Array, Index, Mask, greatest, picked
from ncfix.compensate.plan.intent import lacking
from ncfix.compensate.written import Written
from ncfix.control.moves import Kind

TURNED = 1e-12
"""rad; a rotary axis that is so close to its number in the program stands there."""


@dataclass(frozen=True, slots=True)
class Known:
    """Ends of motions, found by bringing the tip there on the exact model.

    before  (n,) mm: how far off the tip is without correction; NaN where that is not known
    end     (n, n_axes) commands at which it is where it should be, to 1 nm
    beside  (n, n_axes) mm: how far axes that get no word are at most from where they should be on the way there; 0 for
            all others. None: there are none
    """

    before: Array
    end: Array
    beside: Array | None = None

    def at(self, written: Written, piece: Index) -> tuple[Mask, Array, Array]:
        """Which of these pieces (k,) end where errors are known, and these: before and after (k,) mm.

        After a correction what is off is what the numbers that were written differ from those that were meant, as the
        linear axes take the tip. The errors change on that way by less than a thousandth of it.
        """
        intent, pieces = written.intent, written.pieces
        move = pieces.move[piece]
        machine, ways = intent.machine, intent.machine.linear_ways
        before = self.before[move]
        if ways is None:
            return np.zeros(len(piece), dtype=bool), before, before
        off = picked(pieces.end, piece) - picked(self.end, move)
        turned = greatest(np.abs(off[:, machine.rotary]))
        straight = (intent.moves.kind[move] != Kind.ARC) & (turned <= TURNED)
        here = np.isfinite(before) & (pieces.fraction[piece] == 1) & straight
        here[lacking(intent, move)] = False
        shift = off[:, intent.columns] @ ways.T
        return here, before, np.sqrt(np.einsum("ij,ij->i", shift, shift))
