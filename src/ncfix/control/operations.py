"""What codes and drilling cycles do that a dialect adds to those of its family, as data.

`Dialect.derive` takes them; the interpreter of the family carries them out, so that modes, frames, unknown positions
and the account of path words hold for them as for any other code. A code is a few operations, in order:

    codes={
        "G100": [SetTool("T"), Rapid()],                       # change the tool, then go to the words in rapid
        "G110": [SetTool("T"), Lose(ALL_AXES, "the tool change (G110)")],  # ... and stay where tools are changed
        "G168": [like("G68.2", I="A", J="B", K="C", P=0)],     # a tilted plane by other addresses
        "G120": [Suspend("scaling of the fixture (G120)")],    # a mode that is not followed ...
        "G121": [Resume("scaling of the fixture (G120)")],     # ... and its end
        "M180": [],                                            # moves nothing, and changes no coordinates
    },
    cycles={"G177": CycleTable(needs="Q", returns="level")}
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Protocol

from ncfix.control.coordinates import INDEX, LETTERS, mask_of
from ncfix.control.moves import Motion, MotionEnd, MotionKind
from ncfix.text.dialect import NO_WORDS, is_letters

if TYPE_CHECKING:
    from ncfix.control.control import ProgramControl

ALL_AXES = LETTERS
"""For `Lose`: all axes that the machine has."""
MOTION = re.compile(r"G0*[0-3]|G7[346]|G8[1-9]")
"""Codes whose words lead axes, and are rewritten."""
LOST = "where the axis {{}} stands after {} is not known"
NOT_FOLLOWED = "{} is in force, which ncfix does not follow"
AFTER = "where the axis {{}} stands after {} is not followed"


Destination = Callable[[], MotionEnd]
"""Gives the place to which the axis words of a block lead."""


class BlockValues(Protocol):
    """The words of a block that is executed, see `Operation.carry_out`."""

    @property
    def values(self) -> Mapping[str, float]:
        """Address -> value, in program units."""

    @property
    def unknown(self) -> Set[str]:
        """The addresses whose value is known only at run time."""

    @property
    def axes(self) -> int:
        """The axis words, as a bit mask of their letters."""


@dataclass(frozen=True, slots=True)
class Operation(ABC):
    """Something that a code does before the motion of its block."""

    takes: ClassVar[bool] = False
    """It takes the axis words of its block, so that these make no other motion."""
    alone: ClassVar[bool] = False
    """It is all that its code does: no other operation stands beside it."""

    @abstractmethod
    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """Do it."""


@dataclass(frozen=True, slots=True)
class Like(Operation):
    """It does what a code of the family does. See `like`.

    words  the family's address -> the own address whose word it gets, or a fixed number
    """

    alone: ClassVar[bool] = True

    code: str
    words: tuple[tuple[str, str | float], ...] = ()

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[GM]\d{1,4}(\.\d)?", self.code):
            raise ValueError(f"like({self.code!r}): no code of a family: a capital G or M and its number")
        for known, own in self.words:
            letters = (known, own) if isinstance(own, str) else (known,)
            if any(len(each) != 1 or not is_letters(each) for each in letters):
                text = f"like({self.code!r}): {known}={own!r} cannot be: a letter for a letter, or a number"
                raise ValueError(text)
        places = {*LETTERS, *"IJKR"}
        if MOTION.fullmatch(self.code) and any(places & {known, own} for known, own in self.words):
            raise ValueError(f"like({self.code!r}): the words of a motion's place are corrected, and stay as they are")

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """The family's code stands in its place wherever blocks are read: there is nothing left to do."""

    def __str__(self) -> str:
        given = (f"{own} as {known}" if isinstance(own, str) else f"{known}{own:g}" for known, own in self.words)
        return f"as {self.code}" + "".join(f", {each}" for each in given)


def like(code: str, **words: str | float) -> Like:
    """Do what the family's `code` does. `I="A"`: its I is the word A; `P=0`: its P is 0; other words stay."""
    return Like(code, tuple(sorted(words.items())))


@dataclass(frozen=True, slots=True)
class SetTool(Operation):
    """The tool that a word names comes into the spindle, as with M6.

    It does not mean that the axes go anywhere: their positions stay known, and motions after it are corrected from
    there. It only means that no word is added for an axis until the program names that axis again. Where the code
    leaves the axes at the place where tools are changed, `Lose` stands beside it.

    address  of the word, no axis letter; without that word it is the tool that was selected last
    """

    address: str = "T"

    def __post_init__(self) -> None:
        if not is_letters(self.address, LETTERS + NO_WORDS) or len(self.address) != 1:
            raise ValueError(f"{self.address!r} cannot be the address of a tool: one letter, of no axis")

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        if self.address in block.values:
            control.tools.select(round(block.values[self.address]), unsure=self.address in block.unknown)
        control.tools.change()
        control.places.lose(mask_of(control.machine))

    def __str__(self) -> str:
        return f"the tool {self.address} comes into the spindle"


@dataclass(frozen=True, slots=True)
class Lose(Operation):
    """Axes go where the program does not say: motions at feed are refused until each is brought to a known place.

    That is one that the program names in absolute or in machine coordinates, or a reference point.

    axes   letters, linear and rotary; those that the machine lacks do not count. `ALL_AXES` for all
    after  after what, for messages: "the tool change (G100)"
    """

    axes: str
    after: str

    def __post_init__(self) -> None:
        if not is_letters(self.axes) or not {*self.axes} <= INDEX.keys():
            raise ValueError(f"{self.axes!r} are no axes: letters of {LETTERS}, or ALL_AXES")

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        lost = control.lose_in_machine([INDEX[letter] for letter in self.axes], LOST.format(self.after))
        control.places.lose(lost)

    def __str__(self) -> str:
        axes = "the axes" if self.axes == ALL_AXES else f"the axes {' '.join(self.axes)}"
        return f"where {axes} stand after {self.after} is not known"


@dataclass(frozen=True, slots=True)
class Rapid(Operation):
    """The axes go to the words of the block in rapid, whatever motion code is in force."""

    takes: ClassVar[bool] = True

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        if block.axes:
            end = destination()
            with control.in_one_piece():
                control.make(Motion(MotionKind.RAPID, block.axes, end, 0))

    def __str__(self) -> str:
        return "the axes go to the words of the block in rapid"


@dataclass(frozen=True, slots=True)
class Suspend(Operation):
    """A mode begins that ncfix does not follow: motions are refused until `Resume` of the same mode."""

    mode: str

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        control.suspend(self.mode, NOT_FOLLOWED.format(self.mode))

    def __str__(self) -> str:
        return f"motions are refused from here: {self.mode}"


@dataclass(frozen=True, slots=True)
class Resume(Operation):
    """The mode ends; where it has led the axes is not known."""

    mode: str

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        if control.resume(self.mode):
            control.lose(control.machine, AFTER.format(self.mode))

    def __str__(self) -> str:
        return f"the end of {self.mode}"


@dataclass(frozen=True, slots=True)
class Refuse(Operation):
    """Every motion from here on is refused, those before it are not; `why` is told for each."""

    why: str

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        control.refuse_rest(self.why)

    def __str__(self) -> str:
        return f"motions are refused from here on: {self.why}"
