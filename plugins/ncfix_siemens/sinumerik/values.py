"""What a block says, and what stays in force: values of the interpreter, which know no control."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from ncfix.control.coordinates import LETTERS, Vector
from ncfix.control.frames import ZEROS
from ncfix.control.moves import Arc, MotionKind, Passing, UnknownAxes
from ncfix_siemens.sinumerik.vocabulary import ABSOLUTE

DEEP, FIRST_DEPTH = "cycle83", (5, 6)
"""The cycle that drills in steps, and where the depth of the first one stands: a height (FDEP), a way down (FDPR)."""

DP, DPR = 3, 4


@dataclass(slots=True)
class BlockWordValues:
    """The words of a block while it is executed.

    block    the block in its program
    values   address -> number, in program units; None where it is known only at run time
    forms    address -> how the word is meant (`ac`, `ic`, `dc`, ...), where it says so
    axes     bit mask of the axis words
    texts    address -> text, as in T="DRILL"
    refusal  why a motion of the block is refused, if it is
    whole    the motion must not be split
    """

    block: int
    values: dict[str, float | None]
    forms: dict[str, str]
    axes: int
    texts: dict[str, str] = field(default_factory=dict)
    refusal: str = ""
    whole: bool = False

    def refuse(self, reason: str, rotary: Sequence[int]) -> None:
        """Refuse the motion of the block; where these rotary axes go is not known."""
        self.refusal = reason
        for index in rotary:
            self.values[LETTERS[index]] = None
            self.forms[LETTERS[index]] = ABSOLUTE

    def get(self, address: str, default: float = 0.0) -> float:
        """The number of a word; the default where it is not there, or not known."""
        value = self.values.get(address)
        return default if value is None else value

    def runtime(self, *addresses: str) -> bool:
        """Whether one of these words is there and known only at run time."""
        return any(address in self.values and self.values[address] is None for address in addresses)


@dataclass(slots=True)
class End:
    """Where a motion ends: the command, which axes are not known there, and which coordinates.

    in_machine  as in `Motion`
    """

    target: Vector
    unknown: UnknownAxes
    lost: UnknownAxes
    in_machine: Vector | None = None


class ProgrammedMotion(NamedTuple):
    """One motion of a block, as its words say it: what `Sinumerik.go` makes a `Motion` of.

    code        the motion code, in tenths
    refusal, passing, arc  as in `Motion`
    placed     as there; None: the axes of its words, but for increments, and none where the motion is passed
    by_machine  the words are machine coordinates
    """

    kind: MotionKind
    words: BlockWordValues
    end: End
    code: int
    refusal: str = ""
    passing: Passing | None = None
    arc: Arc | None = None
    placed: int | None = None
    by_machine: bool = False


@dataclass(frozen=True, slots=True)
class Drilling:
    """A drilling cycle as it was called.

    name    lower case
    clear   height at which it ends, in program units (RTP); None if known only at run time
    depth   of the hole, in program units
    fault   why its holes are refused; empty if they are not
    values  of its arguments
    sure    all arguments that are written are known
    external  the file in which it is called; empty: the program itself
    """

    name: str
    clear: float | None
    depth: float | None
    fault: str
    values: tuple[float | str | None, ...]
    sure: bool
    external: str

    @property
    def depths(self) -> list[int]:
        """The places of the arguments that say how deep the hole, or the first step to it, is."""
        places = [DP, DPR, *(FIRST_DEPTH if self.name == DEEP else ())]
        given = [place for place in places if place < len(self.values) and self.values[place] is not None]
        return [place for place in given if place not in (DPR, FIRST_DEPTH[1]) or self.values[place] != 0.0]


@dataclass(slots=True)
class Modes:
    """What is in force besides the modal state that all controls have.

    added        what of the shift of the programmable frame is the additive part (ATRANS, G59), mm and rad; None where
                 nobody can say
    fine         G59 has set that part
    diameter     "", "DIAMON" or "DIAM90"
    said         the program or the setup has said whether X is a diameter
    pole         of polar coordinates in the frame of the program, mm; None until one is programmed
    carried      TRAORI or TRAFOOF, if one came after the settable frame and no motion has come since
    in_plane     the plane has not changed since the start: a pole that nobody has set is the zero point
    polar        the last AP and RP
    transformed  TRAORI is on
    swivelled    CYCLE800 has tilted the plane
    modal_cycle  what MCALL calls after each block with a motion
    orientation  ORIAXES, ORIVECT or another way in which the tool turns, lower case
    orientation_in_machine  ORIMKS
    rounds       RNDM rounds all corners
    angles       ORIEULER, ORIRPY or ORIRPY2, lower case: what A2 B2 C2 are
    """

    added: Sequence[float] | None = ZEROS
    fine: bool = False
    diameter: str = ""
    said: bool = False
    pole: tuple[float, float] | None = None
    carried: str = ""
    in_plane: bool = True
    polar: tuple[float | None, float | None] = (None, None)
    transformed: bool = False
    swivelled: bool = False
    modal_cycle: Drilling | None = None
    orientation: str = ""
    orientation_in_machine: bool = False
    rounds: bool = False
    angles: str = ""


@dataclass(slots=True)
class Named:
    """Tools that are called by name: numbers that stand for them here, beyond those that a magazine has."""

    numbers: dict[str, int] = field(default_factory=dict)

    def number(self, name: str) -> int:
        """The number of a name."""
        return self.numbers.setdefault(name, 1_000_000 + len(self.numbers))

    def name(self, number: int) -> str:
        """How people call a tool."""
        return next((name for name, known in self.numbers.items() if known == number), str(number))
