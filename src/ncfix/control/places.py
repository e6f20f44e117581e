"""Which axes the program itself has brought to where they stand, in the coordinates that are in force.

A correction may want a word for an axis that its block does not name. Such a word says where the axis stands already,
but for some um, and that must be the program's own knowledge: if it rests on what tables or people say of the start,
of work offsets or of tool lengths, and they are wrong, the word makes the axis move there, perhaps into the part.
So an axis is adrift until an absolute word of the program brings it to its place, and again after whatever takes it
elsewhere or makes another table count: machine coordinates, reference points, probing, a change of tool, of its
length offset, or of the work offset.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, field

from ncfix.control.setup import Setup


@dataclass(slots=True)
class Places:
    """The book of it; axes are bits of a mask, by letter.

    adrift   axes that the program has not brought to where they stand
    anchors  for each letter what its numbers count from, besides what the program states in numbers itself
    rotation how X Y Z of the program are turned: its rows, for comparison only
    begun    there has been a motion
    """

    adrift: int
    anchors: Sequence[Hashable] = field(default_factory=list)
    rotation: Sequence[Hashable] = ()
    begun: bool = False

    @classmethod
    def at_start(cls, setup: Setup, axes: Iterable[str], letters: str) -> Places:
        """At the start only those axes stand somewhere known that the setup gives, if it assumes nothing."""
        given = () if setup.assume_zero else setup.initial
        return cls(sum(1 << letters.index(axis) for axis in axes if axis not in given))

    def watch(self, anchors: Sequence[Hashable], rotation: Sequence[Hashable]) -> None:
        """What numbers count from now; an axis for which that has changed since the first motion is adrift.

        Of axes that the program turns (G68, ROT) each is made of all: they are adrift together.
        """
        if self.begun:
            self.adrift |= changed(self.anchors, anchors)
            turned = changed(self.rotation, rotation)
            self.adrift |= turned if self.adrift & turned else 0
        self.anchors, self.rotation = anchors, rotation

    def lose(self, axes: int) -> None:
        """Something else than a word of the program has moved these axes, or may have."""
        self.adrift |= axes

    def shift(self, axes: int) -> None:
        """What the numbers of these axes count from is put anew, perhaps to other values than it really had.

        Before the first motion nothing has been brought anywhere.
        """
        if self.begun:
            self.adrift |= axes

    def settle(self, axes: int) -> None:
        """The program says where these axes stand."""
        self.adrift &= ~axes


def changed(before: Sequence[Hashable], now: Sequence[Hashable]) -> int:
    """The places at which two sequences differ, as a bit mask."""
    return mask_of(index for index, (a, b) in enumerate(zip(before, now, strict=True)) if a != b)


def mask_of(indices: Iterable[int]) -> int:
    """Letter indices as a bit mask."""
    return sum(1 << index for index in indices)
