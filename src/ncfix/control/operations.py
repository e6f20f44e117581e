"""Codes and drilling cycles that a dialect adds to those of its family, described as data.

They are passed to `Dialect.derive`; the interpreter of the family executes them, so that modes, frames, unknown
positions and path words are treated as for any other code. A code is a sequence of operations:

    codes={
        "G100": [SetTool("T"), Rapid()],                       # change the tool, then go to the words in rapid
        "G110": [SetTool("T"), Lose(ALL_AXES, "the tool change (G110)")],  # ... and stay where tools are changed
        "G168": [like("G68.2", I="A", J="B", K="C", P=0)],     # a tilted plane by other addresses
        "G120": [Suspend("scaling of the fixture (G120)")],    # a mode that is not followed ...
        "G121": [Resume("scaling of the fixture (G120)")],     # ... and its end
        "G136": [MakeUp("the arc tangent to the motion before it (G136)")],  # this block is refused, others are not
        "M6": [SetTool("T"), SetLength()],                     # the length of the tool acts from its change on
        "M180": [],                                            # moves nothing, and changes no coordinates
    },
    cycles={"G177": CycleTable(needs="Q", returns="level")}
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Set
from typing import TYPE_CHECKING, ClassVar, Protocol

from ncfix.control.coordinates import INDEX, LETTERS, X, Y, Z, mask_of
from ncfix.control.moves import Motion, MotionEnd, MotionKind
from ncfix.text.dialect import NO_WORDS, is_letters
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.control.control import ProgramControl

ALL_AXES = LETTERS
"""For `Lose`: all axes of the machine."""
MOTION = re.compile(r"G0*[0-3]|G7[346]|G8[1-9]")
"""Codes whose words position axes and are rewritten."""
LOST = "the position of the axis {{}} after {} is not known"
NOT_FOLLOWED = "{} is in force, which ncfix does not support"
AFTER = "the position of the axis {{}} after {} is not known"
AFTER_MADE = "the position of the axis {} after motions that the control generates is not known"


Destination = Callable[[], MotionEnd]
"""Returns the end position that the axis words of a block define."""


class BlockValues(Protocol):
    """The words of the block being executed, see `Operation.carry_out`."""

    @property
    def values(self) -> Mapping[str, float]:
        """Address -> value, in program units."""

    @property
    def unknown(self) -> Set[str]:
        """Addresses whose value is known only at run time."""

    @property
    def axes(self) -> int:
        """The axes that have a word, as a bit mask of their letters."""


@frozen
class Operation(ABC):
    """One action of a code, executed before the motion of its block."""

    takes: ClassVar[bool] = False
    """Whether it uses the axis words of its block, so that they cause no other motion."""
    alone: ClassVar[bool] = False
    """Whether it must be the only operation of its code."""

    @abstractmethod
    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """Execute the operation."""


Given = str | float | tuple[str, float]
"""Source of a word of the family's code: another address, a number, or (address, number used without such a word)."""
GIVEN = "a letter for a letter, a number, or both: (letter, number if the block has no such word)"


def source(given: Given) -> tuple[str | None, float | None]:
    """The address that supplies a word of the family's code, and the number used without it; None: none."""
    if isinstance(given, tuple):
        return given if len(given) == 2 else ("", None)
    return (given, None) if isinstance(given, str) else (None, given)


@frozen
class Like(Operation):
    """Acts like a code of the family. See `like`.

    words  address in the family's code -> own address that supplies the word, or a fixed number, or both: the number is
           used in blocks without that word
    """

    alone: ClassVar[bool] = True

    code: str
    words: tuple[tuple[str, Given], ...] = ()

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[GM]\d{1,4}(\.\d)?", self.code):
            raise ValueError(f"like({self.code!r}): not a code of a family: write a capital G or M and its number")
        for known, own in self.words:
            address, default = source(own)
            letters = (known,) if address is None else (known, address)
            fixed = isinstance(default, int | float) or (default is None and address is not None)
            if not fixed or any(not is_letters(each) or len(each) != 1 for each in letters):
                raise ValueError(f"like({self.code!r}): {known}={own!r} is not allowed: {GIVEN}")
        places = {*LETTERS, *"IJKR"}
        if MOTION.fullmatch(self.code) and any(places & {known, source(own)[0]} for known, own in self.words):
            raise ValueError(
                f"like({self.code!r}): the position words of a motion cannot be renamed, since ncfix corrects them"
            )

    @property
    def given(self) -> dict[str, tuple[str | None, float | None]]:
        """Sources of the words of the family's code, by address: see `source`."""
        return {known: source(own) for known, own in self.words}

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """Do nothing: blocks are read with the family's code in its place."""

    def __str__(self) -> str:
        told = []
        for known, (address, default) in self.given.items():
            without = "" if default is None else f"{known}{default:g}"
            told.append(f"{address} as {known}" + (f" (else {without})" if without else "") if address else without)
        return f"as {self.code}" + "".join(f", {each}" for each in told)


def like(code: str, **words: Given) -> Like:
    """Act like the family's `code`.

    `I="A"`: its I is the word A. `P=0`: its P is 0. `X=("I", 0)`: its X is the word I, or 0 in a block without I.
    Other words stay.
    """
    return Like(code, tuple(sorted(words.items())))


@frozen
class SetTool(Operation):
    """The tool named by a word is put into the spindle, as with M6.

    The axes are taken to stay where they are: their positions remain known, and motions after it are corrected. But no
    word is added for an axis until the program names that axis again. If the code leaves the axes at the tool change
    position, add `Lose`.

    address  of the tool word, not an axis letter; in a block without it, the tool selected last is used
    """

    address: str = "T"

    def __post_init__(self) -> None:
        if not is_letters(self.address, LETTERS + NO_WORDS) or len(self.address) != 1:
            raise ValueError(f"{self.address!r} cannot be the address of a tool: one letter that is not an axis letter")

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        if self.address in block.values:
            control.tools.select(round(block.values[self.address]), unsure=self.address in block.unknown)
        control.tools.change()
        control.places.lose(mask_of(control.axis_indices))

    def __str__(self) -> str:
        return f"the tool {self.address} is changed into the spindle"


@frozen
class Lose(Operation):
    """Axes move to unknown positions: feed motions are refused until each of these axes is at a known place.

    It is known again after an absolute word, a word in machine coordinates, or a reference point.

    axes   letters, linear and rotary; those that the machine lacks are ignored. `ALL_AXES` for all
    after  the cause, for messages: "the tool change (G100)"
    """

    axes: str
    after: str

    def __post_init__(self) -> None:
        if not is_letters(self.axes) or not {*self.axes} <= INDEX.keys():
            raise ValueError(f"{self.axes!r} are not axes: use letters of {LETTERS}, or ALL_AXES")

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        lost = control.lose_in_machine([INDEX[letter] for letter in self.axes], LOST.format(self.after))
        control.places.lose(lost)

    def __str__(self) -> str:
        axes = "the axes" if self.axes == ALL_AXES else f"the axes {' '.join(self.axes)}"
        return f"the position of {axes} after {self.after} is not known"


@frozen
class Rapid(Operation):
    """The axes move in rapid to the words of the block, whatever motion code is in force."""

    takes: ClassVar[bool] = True

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        if block.axes:
            end = destination()
            with control.in_one_piece():
                control.make(Motion(MotionKind.RAPID, block.axes, end, 0))

    def __str__(self) -> str:
        return "the axes move to the position of the block in rapid"


def make_up(control: ProgramControl, block: BlockValues, what: str, turned: Collection[int] = ()) -> None:
    """Add a motion that the control generates itself: it is refused, and its end position is unknown.

    This concerns X Y Z, the axes of the block, and `turned` (letter indices).
    """
    led = (X, Y, Z, *turned)
    gone = {index for index in control.axis_indices if block.axes >> index & 1 or index in led}
    unknown = control.unknown | dict.fromkeys(sorted(gone), AFTER_MADE)
    control.make(Motion(MotionKind.FEED, block.axes, MotionEnd(control.position[:], unknown), 0, refusal=what))


@frozen
class MakeUp(Operation):
    """The control generates the motion of this block, such as a pocket: it is refused, other motions are not.

    The positions of X, Y, Z and of the axes of the block are unknown afterwards, as with `Lose`.

    what  the generated motion, for messages: "the arc tangent to the motion before it (G8)"
    """

    takes: ClassVar[bool] = True

    what: str

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        make_up(control, block, self.what)

    def __str__(self) -> str:
        return f"the control generates the motion, which is refused: {self.what}"


@frozen
class SetLength(Operation):
    """The tool length is in force from here on, as with G43; many controls have no code for it.

    Tool lengths come from the setup. Together with `SetTool`, it stands after it.

    address  of the word with the tool's number; without that word, or with "", the tool in the spindle is meant
    """

    address: str = ""

    def __post_init__(self) -> None:
        if self.address and (not is_letters(self.address, LETTERS + NO_WORDS) or len(self.address) != 1):
            raise ValueError(
                f"{self.address!r} cannot be the address of a tool length: one letter that is not an axis letter"
            )

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        if self.address in block.unknown:
            control.refuse_rest("a tool length is known only at run time")
        control.take_length(round(block.values.get(self.address, control.tools.spindle)))

    def __str__(self) -> str:
        whose = f"of tool {self.address}" if self.address else "of the tool in the spindle"
        return f"the length {whose} acts"


@frozen
class Suspend(Operation):
    """Begin a mode that ncfix does not follow: motions are refused until `Resume` of the same mode."""

    mode: str

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        control.suspend(self.mode, NOT_FOLLOWED.format(self.mode))

    def __str__(self) -> str:
        return f"motions are refused from here: {self.mode}"


@frozen
class Resume(Operation):
    """End a suspended mode; the axis positions are unknown afterwards."""

    mode: str

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        if control.resume(self.mode):
            control.lose(control.axis_indices, AFTER.format(self.mode))

    def __str__(self) -> str:
        return f"the end of {self.mode}"


@frozen
class Refuse(Operation):
    """Refuse every motion from here on; `why` is reported for each."""

    why: str

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        control.refuse_rest(self.why)

    def __str__(self) -> str:
        return f"motions are refused from here on: {self.why}"
