"""A family of controls, as the functions in which they differ: how corrected motions are written."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

from ncfix.control.interpreter import FollowedLanguage
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.arrays import Ints, Mask
    from ncfix.control.moves import Moves
    from ncfix.text.spelling import Spelling
    from ncfix.text.tree import Program
    from ncfix.writer.pieces import Pieces
    from ncfix.writer.target import Rendered, Target


class Writer(Protocol):
    """Writes one motion into one block."""

    def write(self) -> Rendered:
        """What is written; called once."""


@frozen(kw_only=True)
class WrittenLanguage(FollowedLanguage):
    """One family of controls: how its programs are read, followed, and written. That is what a dialect names.

    writer    (program, block, layout, target, spelling) -> what writes the motion of a block: `BlockWriter`, or a
              class of its kind with what no other control has
    arc_pieces  `writer` can write an arc as several (`Target.arcs`)
    one_by_one  (program, moves, pieces, first piece of each motion) -> (n,) motions that `writer` has to write one by
              one for what else there is about them; None: none
    held_angle  (text of the program, rotary axis, angle as programmed, corrected, one digit) -> the angle that the
              control may be told, degrees; None: any
    """

    writer: Callable[[Program, int, Any, Target, Spelling], Writer]
    arc_pieces: bool = False
    one_by_one: Callable[[Program, Moves, Pieces, Ints], Mask] | None = None
    held_angle: Callable[[bytes, str, float, float, float], float] | None = None
