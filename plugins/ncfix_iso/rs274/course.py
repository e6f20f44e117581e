"""Where execution stands: what the walk through a program asks of any flow control of this family."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from ncfix.control.faults import Fault
from ncfix_iso.rs274.plans import FlowLine, RS274Unit


class Course(Protocol):
    """Where execution stands, and where flow-control lines take it.

    unit, block    what is executed next
    skipping       the label that execution waits for; None while it does not skip
    """

    unit: RS274Unit
    block: int
    skipping: str | None

    @property
    def calls(self) -> Sequence[object]:
        """Calls that have not returned."""

    def under_way(self) -> tuple[object, ...]:
        """The calls that have not returned, and how often each is still to be made."""

    def arrive(self) -> bool:
        """See `Interpreter`."""

    def follow(self, flow: FlowLine) -> None:
        """Do what a flow-control line says; `block` is already that of the next line."""

    def unfinished(self) -> Fault | None:
        """What is wrong if the text ends here."""

    def call_by_code(self, label: str, times: int) -> None:
        """M98."""

    def finish(self) -> None:
        """Return from a subprogram, or run it again if M98 asked for it several times."""
