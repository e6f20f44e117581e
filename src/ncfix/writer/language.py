"""A language with its writer: the functions that put corrected motions into the words of a family of controls."""

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
        """Write the motion; called once."""


@frozen(kw_only=True)
class WrittenLanguage(FollowedLanguage):
    """How programs of one family of controls are read, followed and written; a dialect names such an object.

    writer    (program, block, layout, target, spelling) -> the writer of a block's motion: `BlockWriter`, or a subclass
              with what only this language has
    arc_pieces  whether `writer` can write an arc as several arcs (`Target.arcs`)
    one_by_one  (program, moves, pieces, first piece of each motion) -> (n,) motions that cannot be written in bulk for
              reasons of the language; None: none
    held_angle  (program text, rotary axis, angle as programmed, corrected, one digit) -> the angle, degrees, that may
              be commanded instead of the corrected one; None: any angle
    """

    writer: Callable[[Program, int, Any, Target, Spelling], Writer]
    arc_pieces: bool = False
    one_by_one: Callable[[Program, Moves, Pieces, Ints], Mask] | None = None
    held_angle: Callable[[bytes, str, float, float, float], float] | None = None
