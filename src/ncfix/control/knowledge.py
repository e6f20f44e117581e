"""What a program uses and cannot know: asked of the setup; what is not there is collected, once each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ncfix.control.setup import Setup
from ncfix.diagnostics import Message, Place

WORK_OFFSET = "NCF201"
TOOL_LENGTH = "NCF202"
START_POSITION = "NCF203"
REFERENCE_POINT = "NCF204"
ASSUMED = "NCF205"
PROBED = "results of probing"
"""What `Knowledge.assumed` calls them where they count as nominal; all else in it was taken as zero."""


@dataclass(slots=True)
class Knowledge:
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
