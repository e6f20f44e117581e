"""Data that a program uses but cannot contain: work offsets, tool lengths, start position.

They come from the setup file or from options. Missing data that a program asks for are collected, each once.
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
"""Default limit on executed blocks beyond those of the text; it is reached in under half a minute."""


class Increments(NamedTuple):
    """Least input increments of a control: mm, inch, degree."""

    mm: float
    inch: float
    degree: float


POINTLESS = {
    "IS-A": Increments(0.01, 0.001, 0.01),
    "IS-B": Increments(0.001, 0.0001, 0.001),
    "IS-C": Increments(0.0001, 0.00001, 0.0001),
}
"""Increment systems of controls that read numbers without a decimal point in least increments (Fanuc and similar)."""

CALCULATOR = "calculator"
"""Value of `Setup.no_point`: numbers mean the same with and without a decimal point."""


@frozen
class Tool:
    """A tool as in the control's tool table, mm.

    aside  further offsets of the table along other machine axes, `X1.5`, which a length offset adds, too; the length of
           such a tool counts as not known
    """

    length: float | None = None
    radius: float | None = None
    aside: str = ""


@frozen
class Setup:
    """The state of the machine when the program starts. Angles are in degrees, as on the control.

    work_offsets      "G54" -> values of the axes in the order X Y Z A B C, or by axis letter
    tools             tool number -> `Tool`; tool 0 is the tool in the spindle when the program starts
    named_tools       tools called by name, in upper case; a further cutting edge has its D number appended
    initial           axis letter -> start position, machine axes, mm or degree
    references        "G28" | "G30", and "M92" (origin of M92) -> axis letter -> machine position
    variables         "#100", "#<name>", "R1" or "NAME" -> value
    inputs            what the machine's errors depend on besides its axes: "temp_spindle" -> 24.5
    workpiece_offset  origin of the workpiece frame in the base frame with all axes at zero, mm
    tcp               X Y Z are tool-tip coordinates from the start of the program
    assume_zero       missing data are taken as zero (named in warnings and in the stamp) instead of being an error
    no_point          meaning of numbers without a decimal point on controls where it can be set: "calculator" (X50 is
                      50 mm), or an increment system: "IS-B" (X50 is 0.050 mm); empty: not given, and asked for if it
                      matters
    most_blocks       blocks that may be executed beyond those of the text; with more the program counts as endless
    passed_codes      G codes of the machine's builder that move nothing and change no coordinates, in tenths (G5.3: 53)
    subprograms       folders searched for subprograms that are not beside the program
    probed            where probing ends, if its results count as nominal: axis letter -> position in program
                      coordinates, mm or degree; for axes not listed, the end of the motion. None: results are known
                      only at run time
    block_skip        position of the block delete switches: all on (blocks with `/` are skipped), all off, or the
                      numbers of those that are on; None: not given. A program that is followed once is then followed
                      with all off
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
        """The tool with this name; if none has it and the name is digits, the tool with that number (`T="5"`)."""
        return self.named_tools.get(name.upper()) or (self.tools.get(int(name)) if name.isdecimal() else None)


def check_offsets(setup: Setup, axes: Collection[str], typed: Collection[str] = ()) -> None:
    """Refuse work offsets whose numbers seem to be in the order of the machine's axes. Raises `UsageError` NCF384.

    The order is X Y Z A B C on every machine. A nonzero number for an axis that the machine lacks is refused if a later
    axis of the machine has no number: it was probably meant for that axis. Otherwise it is ignored, except in an offset
    typed for this machine: 1,5,2,5,3,5 may be three numbers with decimal commas.
    """
    for system, values in setup.work_offsets.items():
        for letter, value in values.items():
            behind = LETTERS[LETTERS.index(letter) + 1 :]
            meant = system in typed or any(axis in axes and axis not in values for axis in behind)
            if value and letter not in axes and meant:
                text = f"work offset {system}: {letter} is {value:g}, but the machine has no axis {letter}"
                hint = (
                    f"a list of numbers is {' '.join(LETTERS)} on any machine, with decimal points; or name the axes: "
                )
                hint += f"--offset {system}=Z60" if system in typed else f"{system} = {{ Z = 60 }}"
                raise UsageError.of("NCF384", text, hint=hint)


WORK_OFFSET = "NCF201"
TOOL_LENGTH = "NCF202"
START_POSITION = "NCF203"
REFERENCE_POINT = "NCF204"
ASSUMED = "NCF205"
PROBED = "results of probing"
"""Name in `SetupLookup.assumed` of probing results that count as nominal; other entries were taken as zero."""


@mutable
class SetupLookup:
    """Access to the setup, and a record of data that were asked for and not given.

    place    current place in the program, for messages
    missing  errors for missing data, by name
    assumed  data taken as zero because the setup says so, by name; and `PROBED`
    """

    setup: Setup
    place: Callable[[], Place]
    missing: dict[str, Message] = field(default_factory=dict)
    assumed: dict[str, Message] = field(default_factory=dict)

    def lack(self, code: str, what: str, verb: str, option: str) -> None:
        """Record that something is used and not given; from here on it counts as zero.

        `what` names it ("work offset G54"), `verb` says how it is involved ("is used"), `option` how to give it.
        """
        if self.setup.assume_zero:
            text = f"{what} is not given; ncfix uses zero"
            self.assumed.setdefault(what, Message(ASSUMED, text, self.place(), option))
            return
        hint = f"{option} or --assume-zero"
        self.missing.setdefault(what, Message(code, f"{what} {verb} but not given", self.place(), hint))

    def work_offset(self, system: str) -> None:
        """Record that a work offset is used and not given."""
        self.lack(WORK_OFFSET, f"work offset {system}", "is used", f"--offset {system}=x,y,z")

    def tool_length(self, number: int) -> float:
        """The length of a tool for a length offset, mm; zero, with a record, if it is missing."""
        length = self.known_tool_length(number)
        if length is not None:
            return length
        what = f"length of tool {number}" if number else "length of the tool that is in the spindle at the start"
        if number in self.setup.tools and self.setup.tools[number].aside:
            what += f", which the tool table has at {self.setup.tools[number].aside} as well,"
        self.lack(TOOL_LENGTH, what, "is used", f"--tool {number}=LENGTH")
        return 0.0

    def known_tool_length(self, number: int) -> float | None:
        """The length of a tool, mm; None if it is not given."""
        tool = self.setup.tools.get(number)
        return None if tool is None else tool.length

    def known_tool_radius(self, number: int) -> float | None:
        """The radius of a tool, mm; None if it is not given."""
        tool = self.setup.tools.get(number)
        return None if tool is None else tool.radius

    def start_position(self, letter: str) -> None:
        """Record that the start position of an axis matters and is not given."""
        self.lack(START_POSITION, f"start position of {letter}", "matters", f"--initial {letter}=...")

    def probing(self) -> None:
        """Record that the program uses results of probing, which count as nominal."""
        text = (
            "ncfix uses the positions of the setup as the results of probing; words that are calculated from them "
            "stay unchanged"
        )
        self.assumed.setdefault(PROBED, Message(ASSUMED, text, self.place(), "without --probed this is refused"))

    def reference_point(self, code: str) -> None:
        """Record that the position of a reference point is used as a number and not given."""
        option = f"references.{code} in the setup file"
        self.lack(REFERENCE_POINT, f"reference point {code}", "is used", option)


Resolve = Callable[[str], bytes | None]
"""Returns the text of a subprogram file by its name; None if there is none."""


@frozen
class Run:
    """Everything needed to follow a program; the arguments of `trace`."""

    setup: Setup
    axes: tuple[str, ...]
    rotary: frozenset[str]
    resolve: Resolve | None = None
    kinematics: Kinematics | None = None

    def budget(self, program: Program) -> int:
        """Number of blocks that may be executed before a program, or a part of one, counts as endless."""
        return self.setup.most_blocks + len(program.blocks)
