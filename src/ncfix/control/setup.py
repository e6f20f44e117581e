"""What a program uses and cannot know: work offsets, tool lengths, start position. They are read from the setup file or
from options; what a program asks for and is not there is collected, once each.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, NamedTuple

from ncfix.control.coordinates import LETTERS
from ncfix.diagnostics import Message, Place, UsageError
from ncfix.values import frozen, mutable

if TYPE_CHECKING:
    from ncfix.control.moves import Kinematics
    from ncfix.text.tree import Program

MOST_BLOCKS = 1_000_000
"""Blocks that are executed beyond those of a program's own text before it counts as endless: under half a minute."""


class Increments(NamedTuple):
    """The least increments of a control's input: mm, inch, degree."""

    mm: float
    inch: float
    degree: float


POINTLESS = {
    "IS-A": Increments(0.01, 0.001, 0.01),
    "IS-B": Increments(0.001, 0.0001, 0.001),
    "IS-C": Increments(0.0001, 0.00001, 0.0001),
}
"""Increment systems of controls that count them in numbers without a decimal point (Fanuc and its like)."""

CALCULATOR = "calculator"
"""A number means the same with and without a decimal point."""


@frozen
class Tool:
    """A tool as the control's table has it, mm.

    aside  offsets of the table along other axes of the machine, `X1.5`, which a length offset adds, too: the length of
           such a tool is not known
    """

    length: float | None = None
    radius: float | None = None
    aside: str = ""


@frozen
class Setup:
    """What is on the machine when the program starts. Angles here are in degrees, as on the control.

    work_offsets      "G54" -> values for the axes in the order X Y Z A B C, or by axis letter
    tools             tool number -> `Tool`; tool 0 is what is in the spindle when the program starts
    named_tools       tools that are called by name, in upper case; a further cutting edge has its D number after it
    initial           axis letter -> start position, machine axes, mm or degree
    references        "G28" | "G30", and "M92", from which M92 counts -> axis letter -> machine position
    variables         "#100", "#<name>", "R1" or "NAME" -> value
    inputs            what the errors of the machine depend on besides its axes: "temp_spindle" -> 24.5
    workpiece_offset  origin of the workpiece frame in the base frame with all axes at zero, mm
    tcp               X Y Z are tool-tip coordinates from the start of the program
    assume_zero       what is not given is zero (named in warnings and in the stamp), else it is an error
    no_point          what numbers without a decimal point mean to controls that tell: "calculator" (X50 is 50 mm), or
                      an increment system: "IS-B" (X50 is 0.050 mm); empty: not given, and asked for where it matters
    most_blocks       blocks that may be executed beyond those of the text; with more the program counts as endless
    passed_codes      G codes of the machine's builder that move nothing and change no coordinates, in tenths (G5.3: 53)
    subprograms       folders in which subprograms are looked for that are not beside the program
    probed            where probing ends, if its results count as nominal: axis letter -> position in the program's
                      coordinates, mm or degree; axes that are not in it: the end of the motion. None: at run time only
    block_skip        how the switches of block delete stand: all on (blocks with `/` are skipped), all off, or those
                      that are on, by number; None: not said. Whoever follows a program once takes them as off then
    """

    work_offsets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    tools: Mapping[int, Tool] = field(default_factory=dict)
    initial: Mapping[str, float] = field(default_factory=dict)
    references: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    variables: Mapping[str, float] = field(default_factory=dict)
    inputs: Mapping[str, float] = field(default_factory=dict)
    workpiece_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tcp: bool = False
    assume_zero: bool = False
    block_skip: bool | frozenset[int] | None = None
    most_blocks: int = MOST_BLOCKS
    no_point: str = ""
    passed_codes: frozenset[int] = frozenset()
    named_tools: Mapping[str, Tool] = field(default_factory=dict)
    subprograms: tuple[str, ...] = ()
    probed: Mapping[str, float] | None = None

    def tool_called(self, name: str) -> Tool | None:
        """The tool of a name; digits are a number where no tool has that name (`T="5"`)."""
        return self.named_tools.get(name.upper()) or (self.tools.get(int(name)) if name.isdecimal() else None)


def check_offsets(setup: Setup, axes: Collection[str], typed: Collection[str] = ()) -> None:
    """Refuse work offsets whose numbers seem to be in the order of the machine's axes. Raises `UsageError` NCF384.

    The order is X Y Z A B C on any machine. Where an axis that the machine lacks has a number that is not zero, and one
    of its axes further on has none, the number was meant for that one. Numbers of other axes are not used, but of
    offsets that were typed for this machine: 1,5,2,5,3,5 may be three numbers with decimal commas.
    """
    for system, values in setup.work_offsets.items():
        for letter, value in values.items():
            behind = LETTERS[LETTERS.index(letter) + 1 :]
            meant = system in typed or any(axis in axes and axis not in values for axis in behind)
            if value and letter not in axes and meant:
                text = f"work offset {system}: {letter} is {value:g}, and the machine has no axis {letter}"
                hint = f"numbers are {' '.join(LETTERS)} on any machine, with decimal points; or name the axes: "
                hint += f"--offset {system}=Z60" if system in typed else f"{system} = {{ Z = 60 }}"
                raise UsageError.of("NCF384", text, hint=hint)


WORK_OFFSET = "NCF201"
TOOL_LENGTH = "NCF202"
START_POSITION = "NCF203"
REFERENCE_POINT = "NCF204"
ASSUMED = "NCF205"
PROBED = "results of probing"
"""What `SetupLookup.assumed` calls them where they count as nominal; all else in it was taken as zero."""


@mutable
class SetupLookup:
    """The setup, and the book of what was asked of it in vain.

    place    where in the program we are, for messages
    missing  what was not given, by name
    assumed  what was taken as zero because the setup says so, by name; and `PROBED`
    """

    setup: Setup
    place: Callable[[], Place]
    missing: dict[str, Message] = field(default_factory=dict)
    assumed: dict[str, Message] = field(default_factory=dict)

    def lack(self, code: str, what: str, verb: str, option: str) -> None:
        """Note that something is used and not given; from here on it counts as zero.

        `what` names it ("work offset G54"), `verb` says how it comes in ("is used"), `option` how to give it.
        """
        if self.setup.assume_zero:
            text = f"{what} is not given and is taken as zero"
            self.assumed.setdefault(what, Message(ASSUMED, text, self.place(), option))
            return
        hint = f"{option} or --assume-zero"
        self.missing.setdefault(what, Message(code, f"{what} {verb} and not given", self.place(), hint))

    def work_offset(self, system: str) -> None:
        """A work offset is used and not given."""
        self.lack(WORK_OFFSET, f"work offset {system}", "is used", f"--offset {system}=x,y,z")

    def tool_length(self, number: int) -> float:
        """The length of a tool for a length offset, mm; zero if it is lacking."""
        length = self.known_tool_length(number)
        if length is not None:
            return length
        what = f"length of tool {number}" if number else "length of the tool that is in the spindle at the start"
        if number in self.setup.tools and self.setup.tools[number].aside:
            what += f", which the tool table has at {self.setup.tools[number].aside} as well,"
        self.lack(TOOL_LENGTH, what, "is used", f"--tool {number}=LENGTH")
        return 0.0

    def known_tool_length(self, number: int) -> float | None:
        """The length of a tool, mm, if it is given."""
        tool = self.setup.tools.get(number)
        return None if tool is None else tool.length

    def known_tool_radius(self, number: int) -> float | None:
        """The radius of a tool, mm, if it is given."""
        tool = self.setup.tools.get(number)
        return None if tool is None else tool.radius

    def start_position(self, letter: str) -> None:
        """The start position of an axis matters and is not given."""
        self.lack(START_POSITION, f"start position of {letter}", "matters", f"--initial {letter}=...")

    def probing(self) -> None:
        """The program goes on with what probing has found, which counts as nominal."""
        text = "probing counts as ending where the setup says; what is computed from its results stays as it is"
        self.assumed.setdefault(PROBED, Message(ASSUMED, text, self.place(), "without --probed this is refused"))

    def reference_point(self, code: str) -> None:
        """The position of a reference point is used as a number and not given."""
        option = f"references.{code} in the setup file"
        self.lack(REFERENCE_POINT, f"reference point {code}", "is used", option)


Resolve = Callable[[str], bytes | None]
"""Gives the text of a subprogram file by its name; None if there is none."""


@frozen
class Run:
    """What a program is followed with; see `trace`, which has the same arguments."""

    setup: Setup
    axes: tuple[str, ...]
    rotary: frozenset[str]
    resolve: Resolve | None = None
    kinematics: Kinematics | None = None

    def budget(self, program: Program) -> int:
        """Blocks that may be executed before a program, or a part of one, counts as endless."""
        return self.setup.most_blocks + len(program.blocks)
